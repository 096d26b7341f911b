// Asking for places where points can be followed, and what is to be said of them.

/** @import {App} from "./app.js" */
/** @import {Suggestions} from "./types.js" */

import { getSuggestions, ServerError } from "./api.js";

const SUGGESTIONS = 4;

/**
 * Shows places in the frame that is shown.
 * @param {App} app
 * @param {(kind: "warning" | "error", text: string) => void} tell
 * @param {string | null} name of the point that is to go on there; null for new ones
 */
export async function suggest(app, tell, name) {
  const { frame } = app;
  const until = name === null ? null : (app.labels.nextFixed(name, frame)?.frame ?? null);
  try {
    const { suggestions: list, surface } = await getSuggestions(frame, SUGGESTIONS, until);
    app.suggested = { frame, list, name };
    const said = list.length === 0 ? "There is no good place to suggest in this frame." : caution(app, surface);
    if (said) tell("warning", said);
  } catch (error) {
    if (!(error instanceof ServerError)) throw error;
    tell("error", `No suggestions: ${error.message}`);
  }
  app.changed();
}

/** @param {App} app @param {Suggestions["surface"]} surface @returns {string} */
function caution(app, surface) {
  const { state } = app.labels;
  if (surface === "any" && state.depth_known) return "No depth is known in this frame: a key frame set here is not scored. Try another frame.";
  if (surface === "below-horizon") return "No scan or depth camera tells the floor from walls here: take those that lie on the floor.";
  if (surface === "depth" && state.floor_suggestions) return "No good corner was found on the floor of this frame: these lie elsewhere.";
  return "";
}
