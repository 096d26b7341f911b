// Colours that people with any colour vision tell apart (Okabe and Ito). Number and shape say the same again.

const POINTS = ["#e69f00", "#56b4e9", "#f0e442", "#cc79a7", "#009e73", "#d55e00", "#4f9bff", "#ffffff"];

/** The paper's figure: label blue, reference red, on-board green, in hues that stay apart. */
export const LABEL_BLUE = "#3aa0ff";
export const REFERENCE_RED = "#e8501f";
export const ON_BOARD_GREENS = ["#00b383", "#7fd13b", "#00c8c8", "#b5e61d"];

export const DOUBT = "#ffb000";
export const DARK = "rgba(0, 0, 0, 0.75)";

/**
 * @param {number} index place of the point in the list
 * @returns {string}
 */
export function pointColour(index) {
  return POINTS[index % POINTS.length];
}

/**
 * @param {"reference" | "on-board"} kind
 * @param {number} nth which of its kind
 * @returns {string}
 */
export function streamColour(kind, nth) {
  return kind === "reference" ? REFERENCE_RED : ON_BOARD_GREENS[nth % ON_BOARD_GREENS.length];
}
