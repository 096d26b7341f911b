// What the person is doing: frame, chosen point, cursor, suggestions, switches. Parts of the page read it, change it
// through their own doings, and ask for a fresh drawing by `changed`.

/** @import {Observation, Pixel, Suggestion} from "./types.js" */
/** @import {Images} from "./images.js" */
/** @import {Keys} from "./keys.js" */
/** @import {Labels} from "./labels.js" */
/** @import {Session} from "./session.js" */
/** @import {Viewer} from "./viewer.js" */

import { Tasks } from "./tasks.js";

/**
 * @typedef {object} Switches
 * @property {boolean} retrack a correction tracks again what follows
 * @property {boolean} dots projected dots are shown
 * @property {boolean} loupe
 * @property {boolean} follow the chosen point stays in the middle
 * @property {boolean} invert
 * @property {number} brightness percent
 * @property {number} contrast percent
 */

const STORE = "vice.annotate.switches";

/** @returns {Switches} */
function storedSwitches() {
  /** @type {Switches} */
  const switches = { retrack: true, dots: true, loupe: true, follow: false, invert: false, brightness: 100, contrast: 100 };
  try {
    const stored = JSON.parse(localStorage.getItem(STORE) ?? "{}");
    for (const key of /** @type {(keyof Switches)[]} */ (Object.keys(switches))) {
      if (typeof stored?.[key] === typeof switches[key]) Object.assign(switches, { [key]: stored[key] });
    }
  } catch {
    // The defaults will do.
  }
  return switches;
}

export class App {
  /**
   * @param {Labels} labels
   * @param {Images} images
   * @param {Keys} keys
   */
  constructor(labels, images, keys) {
    this.labels = labels;
    this.tasks = new Tasks(labels);
    this.images = images;
    this.keys = keys;
    /** @type {Session} */
    this.session = /** @type {any} */ (null);
    /** @type {Viewer} */
    this.viewer = /** @type {any} */ (null);
    /** Place among the frames of the one that is shown, and of the one that is asked for. */
    this.place = 0;
    this.target = 0;
    /** The point that clicks and keys act on; it may not have been placed yet. */
    this.selected = labels.names[0] ?? "1";
    /** @type {Pixel | null} under the pointer */
    this.hover = null;
    /** @type {Pixel | null} of the keyboard */
    this.cursor = null;
    /** The next placing begins a segment. */
    this.respawning = false;
    /** @type {{frame: number, list: Suggestion[], name: string | null} | null} with the point that is to go on there; null: new ones */
    this.suggested = null;
    /** @type {{name: string, frame: number} | null} one end of a range that is to be deleted */
    this.range = null;
    /** @type {Set<string>} points whose offer of a respawn was declined, with the frame their lane ended at */
    this.declined = new Set();
    this.switches = storedSwitches();
    /** @type {(() => void)[]} */
    this.listeners = [];
    this.drawing = false;
  }

  /** Draws all once, before the next picture goes to the screen. */
  changed() {
    if (this.drawing) return;
    this.drawing = true;
    requestAnimationFrame(() => {
      this.drawing = false;
      for (const each of this.listeners) each();
    });
  }

  storeSwitches() {
    try {
      localStorage.setItem(STORE, JSON.stringify(this.switches));
    } catch {
      // They then last as long as the page.
    }
    this.changed();
  }

  get frames() {
    return this.labels.state.frames;
  }

  get frame() {
    return this.frames[this.place].frame;
  }

  get writable() {
    return this.labels.state.writable;
  }

  /** @returns {Observation | null} of the chosen point in the shown frame */
  get observation() {
    return this.labels.at(this.selected, this.frame);
  }

  /** @returns {Pixel | null} of the chosen point in the shown frame */
  get pixel() {
    return this.labels.pixel(this.selected, this.frame);
  }

  /** The list of suggestions, if it is for the shown frame. */
  get suggestions() {
    return this.suggested?.frame === this.frame ? this.suggested.list : [];
  }

  /** @returns {string | null} the point that the suggestions in the shown frame are for */
  get suggestedFor() {
    return this.suggested?.frame === this.frame ? this.suggested.name : null;
  }

  /** @returns {Pixel | null} what the loupe looks at */
  get attention() {
    return this.hover ?? this.cursor ?? this.pixel;
  }

  /** @param {string} name */
  select(name) {
    if (name !== this.selected) {
      this.respawning = false;
      this.range = null;
      if (this.suggested?.name) this.suggested = null;
    }
    this.selected = name;
    this.changed();
  }
}
