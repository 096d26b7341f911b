// Keys and what they do. The authors' tool had e, space, d, 1 to 6, r and w; here they are next frame, play, delete,
// points, respawn and previous frame. All can be changed; changes stay in this browser.

/** @typedef {{action: string, group: string, text: string, keys: string[]}} Binding */

const STORE = "vice.annotate.keys";

/** @type {[string, [string, string, string[]][]][]} */
const GROUPS = [
  ["Frames", [
    ["next-frame", "Next frame", ["e", "pagedown"]],
    ["previous-frame", "Previous frame", ["w", "pageup"]],
    ["play", "Play or pause", ["space"]],
    ["next-task", "Next thing that needs you", ["n"]],
    ["previous-task", "Previous thing that needs you", ["shift+n"]],
    ["next-gap", "Next gap", ["j"]],
    ["previous-gap", "Previous gap", ["shift+j"]],
    ["first-frame", "First frame", ["home"]],
    ["last-frame", "Last frame", ["end"]],
  ]],
  ["Points", [
    ["place", "Place at pointer or cursor", ["enter"]],
    ["cursor", "Keyboard's cursor", ["c"]],
    ["new-point", "New point", ["a"]],
    ...Array.from({ length: 9 }, (_, index) => /** @type {[string, string, string[]]} */ (
      [`point-${index + 1}`, `Choose point ${index + 1}`, [String(index + 1)]])),
    ["next-point", "Next point", [")", "]"]],
    ["previous-point", "Previous point", ["(", "["]],
    ["suggest", "Suggest points", ["s"]],
    ["use-suggestions", "Use all suggestions; the best one for a respawn", ["shift+s"]],
    ["name", "Name of the point", ["f2"]],
    ["targets", "Find tags or a chessboard", ["g"]],
    ["respawn", "Respawn: new key frame", ["r"]],
  ]],
  ["Move (or move the cursor)", [
    ["left", "0.1 px left", ["arrowleft"]],
    ["right", "0.1 px right", ["arrowright"]],
    ["up", "0.1 px up", ["arrowup"]],
    ["down", "0.1 px down", ["arrowdown"]],
    ["left-far", "1 px left", ["shift+arrowleft"]],
    ["right-far", "1 px right", ["shift+arrowright"]],
    ["up-far", "1 px up", ["shift+arrowup"]],
    ["down-far", "1 px down", ["shift+arrowdown"]],
  ]],
  ["Track", [
    ["track-forward", "Track the point forwards", ["t"]],
    ["track-backward", "Track the point backwards", ["shift+t"]],
    ["track-both", "Track the point both ways", ["b"]],
    ["track-all", "Track all points forwards", ["shift+b"]],
    ["stop", "Stop; put cursor away", ["escape"]],
  ]],
  ["Marks", [
    ["occluded", "Occluded", ["o"]],
    ["uncertain", "Uncertain", ["u"]],
    ["accept", "It is right as it is", ["y"]],
    ["key-frame", "Key frame", ["k"]],
    ["delete", "Delete here", ["d"]],
    ["delete-after", "Delete after here", ["shift+d"]],
    ["delete-range", "Delete a range: once at each end", ["x"]],
    ["nothing-here", "Nothing to label in this gap", ["shift+x"]],
    ["undo", "Undo", ["ctrl+z"]],
    ["redo", "Redo", ["ctrl+shift+z", "ctrl+y"]],
  ]],
  ["View", [
    ["zoom-in", "Zoom in", ["+", "="]],
    ["zoom-out", "Zoom out", ["-"]],
    ["zoom-fit", "Whole image", ["0"]],
    ["follow", "Keep the point in the middle", ["f"]],
    ["loupe", "Loupe", ["l"]],
    ["invert", "Invert the image", ["i"]],
    ["dots", "Projected dots", ["v"]],
    ["help", "This help", ["?"]],
  ]],
];

/**
 * A key press as text, such as `ctrl+shift+z`, `space` or `?`.
 * @param {KeyboardEvent} event
 * @returns {string}
 */
export function nameOf(event) {
  const key = event.key === " " ? "space" : event.key.toLowerCase();
  // Shift is part of a character such as `?`; keyboards differ in where they have it.
  const character = key.length === 1 && key.toUpperCase() === key.toLowerCase();
  let name = "";
  if (event.ctrlKey || event.metaKey) name += "ctrl+";
  if (event.altKey) name += "alt+";
  if (event.shiftKey && !character) name += "shift+";
  return name + key;
}

/** @param {string} key */
export function readable(key) {
  /** @type {Record<string, string>} */
  const symbols = { arrowleft: "←", arrowright: "→", arrowup: "↑", arrowdown: "↓", pageup: "PgUp", pagedown: "PgDn", escape: "Esc" };
  return key
    .split(/\+(?=.)/)
    .map((part) => symbols[part] ?? (part.length === 1 ? part.toUpperCase() : part[0].toUpperCase() + part.slice(1)))
    .join(" + ");
}

export class Keys {
  /** @param {Record<string, string[]>} [served] the server's wishes, above the defaults and below the user's own */
  constructor(served = {}) {
    /** @type {Binding[]} */
    this.defaults = GROUPS.flatMap(([group, rows]) =>
      rows.map(([action, text, keys]) => ({ action, group, text, keys: served[action] ?? keys })),
    );
    /** @type {Record<string, string[]>} */
    this.own = {};
    try {
      const stored = JSON.parse(localStorage.getItem(STORE) ?? "{}");
      for (const { action } of this.defaults) {
        const keys = stored?.[action];
        if (Array.isArray(keys) && keys.every((key) => typeof key === "string")) this.own[action] = keys;
      }
    } catch {
      // A store that cannot be read is as good as none.
    }
  }

  /** @returns {Binding[]} as they hold now */
  get bindings() {
    return this.defaults.map((each) => ({ ...each, keys: this.own[each.action] ?? each.keys }));
  }

  /** @param {string} key @returns {string | null} the action */
  actionOf(key) {
    return this.bindings.find((each) => each.keys.includes(key))?.action ?? null;
  }

  /** @param {string} action @returns {string} its first key, for a tool tip */
  hint(action) {
    const key = this.bindings.find((each) => each.action === action)?.keys[0];
    return key === undefined ? "" : readable(key);
  }

  /**
   * Gives a key to an action; who had it loses it.
   * @param {string} action
   * @param {string} key
   */
  set(action, key) {
    for (const each of this.bindings) {
      if (each.action === action) this.own[action] = [key];
      else if (each.keys.includes(key)) this.own[each.action] = each.keys.filter((other) => other !== key);
    }
    this.#store();
  }

  reset() {
    this.own = {};
    this.#store();
  }

  #store() {
    try {
      localStorage.setItem(STORE, JSON.stringify(this.own));
    } catch {
      // Without a store the change lasts as long as the page.
    }
  }
}
