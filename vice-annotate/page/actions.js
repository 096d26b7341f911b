// What can be done to the labels, as the person means it: each is one step of undo on the server.

/** @import {App} from "./app.js" */
/** @import {Direction, Edit, Pixel} from "./types.js" */

import { suggest } from "./suggesting.js";

/** Moves by keys that follow each other faster are one step of undo. */
const TOGETHER_MS = 300;

/** @param {number} value pixels @returns {number} to 0.1, which is as fine as a hand is */
const tenth = (value) => Math.round(value * 10) / 10;

export class Actions {
  /**
   * @param {App} app
   * @param {(kind: "info" | "warning" | "error", text: string) => void} tell
   */
  constructor(app, tell) {
    this.app = app;
    this.tell = tell;
    /** @type {{name: string, frame: number, pixel: Pixel, timer: number} | null} a move by keys not yet sent */
    this.moving = null;
    /** @type {Promise<unknown>} the last placing with the tracking that it begins, or the last tracking asked for */
    this.placing = Promise.resolve();
  }

  /** @returns {Promise<void>} when what was placed is on the disk and its tracking has begun */
  async settled() {
    this.settle();
    await this.placing;
    await this.app.session.written();
  }

  /** @returns {boolean} */
  #mayWrite() {
    if (this.app.writable) return true;
    this.tell("warning", `Read only: ${this.app.labels.state.read_only_reason ?? "another window writes"}`);
    return false;
  }

  /** @param {Pixel} pixel @returns {Pixel} to 0.1 px, inside the image */
  #tidy({ u, v }) {
    const { width, height } = this.app.labels.state;
    return { u: tenth(Math.min(width - 0.5, Math.max(-0.5, u))), v: tenth(Math.min(height - 0.5, Math.max(-0.5, v))) };
  }

  /**
   * Puts the chosen point at a pixel of the shown frame.
   * @param {Pixel} at
   */
  async place(at) {
    if (!this.#mayWrite()) return;
    const { app } = this;
    const begins = app.respawning;
    app.respawning = false;
    app.cursor = null;
    if (begins || app.suggestedFor === app.selected) app.suggested = null;
    await this.#put(app.selected, app.frame, this.#tidy(at), begins);
  }

  /**
   * @param {string} name
   * @param {number} frame
   * @param {Pixel} pixel
   * @param {boolean} begins a segment
   * @returns {Promise<void>}
   */
  #put(name, frame, pixel, begins) {
    const done = this.#putNow(name, frame, pixel, begins);
    this.placing = done.catch(() => undefined);
    return done;
  }

  /**
   * @param {string} name
   * @param {number} frame
   * @param {Pixel} pixel
   * @param {boolean} begins
   */
  async #putNow(name, frame, pixel, begins) {
    const { app } = this;
    app.labels.hope(name, frame, pixel);
    app.changed();
    // What runs on this point works from what has just been corrected.
    await app.session.stop([name]);
    // What fills a gap of a lane goes on from here, whatever it was that ended the lane.
    const fills = app.labels.lanes.has(name) && (begins || !app.labels.at(name, frame));
    const done = await app.session.edit([{ op: begins ? "spawn" : "place", point: name, frame, ...pixel }]);
    app.labels.hope(name, frame, null);
    app.changed();
    if (!done) return;
    if (app.switches.retrack && (fills || app.labels.followedByAutomatic(name, frame))) {
      await app.session.track([name], frame, "forward", app.labels.nextFixed(name, frame)?.frame ?? null);
    }
  }

  /**
   * @param {string} name
   * @param {Pixel} pixel
   * @param {boolean} done let go
   */
  drag(name, pixel, done) {
    const { app } = this;
    app.selected = name;
    app.labels.hope(name, app.frame, pixel);
    if (done && this.#mayWrite()) this.#put(name, app.frame, this.#tidy(pixel), false);
  }

  /**
   * Moves the chosen point, or the cursor where it is out or the point is not here.
   * @param {number} du pixels
   * @param {number} dv
   */
  nudge(du, dv) {
    const { app } = this;
    const from = app.pixel;
    app.hover = null;
    if (app.cursor || !from) {
      const { scale } = app.viewer.view;
      // On the screen a step is alike at any zoom: 2 pixels, or 20.
      const step = Math.max(0.1, 20 / scale);
      const at = this.#cursor();
      app.cursor = this.#tidy({ u: at.u + du * step, v: at.v + dv * step });
      app.viewer.view.reveal(app.cursor);
      return app.changed();
    }
    if (!this.#mayWrite()) return;
    const pixel = this.#tidy({ u: from.u + du, v: from.v + dv });
    app.labels.hope(app.selected, app.frame, pixel);
    if (this.moving && (this.moving.name !== app.selected || this.moving.frame !== app.frame)) this.settle();
    if (this.moving) window.clearTimeout(this.moving.timer);
    const timer = window.setTimeout(() => this.settle(), TOGETHER_MS);
    this.moving = { name: app.selected, frame: app.frame, pixel, timer };
    app.changed();
  }

  /** Sends a move by keys that still waits for more of its kind. */
  settle() {
    const { moving } = this;
    if (!moving) return;
    window.clearTimeout(moving.timer);
    this.moving = null;
    this.#put(moving.name, moving.frame, moving.pixel, false);
  }

  /** @returns {Pixel} where the keyboard's cursor is, or would begin */
  #cursor() {
    const { app } = this;
    if (app.cursor) return app.cursor;
    if (app.pixel) return app.pixel;
    const before = app.labels.lastUpTo(app.selected, app.frame);
    if (before && !app.respawning) return before;
    const { view } = app.viewer;
    return this.#tidy(app.suggestions[0] ?? view.toImage(view.width / 2, view.height / 2));
  }

  toggleCursor() {
    const { app } = this;
    app.hover = null;
    app.cursor = app.cursor ? null : this.#cursor();
    app.changed();
  }

  /** At the pointer, else at the cursor; the first press without either brings the cursor out. */
  placeByKey() {
    const { app } = this;
    const at = app.cursor ?? app.hover;
    if (at) this.place(at);
    else this.toggleCursor();
  }

  newPoint() {
    const name = this.app.labels.freeName();
    this.app.select(name);
    this.tell("info", `Point ${name}: click on its place, or move the cursor with the arrow keys and press Enter.`);
  }

  /** @param {1 | -1} step */
  otherPoint(step) {
    const { names } = this.app.labels;
    if (names.length === 0) return;
    const at = names.indexOf(this.app.selected);
    this.app.select(names[(at + step + names.length) % names.length]);
  }

  async respawn() {
    if (!this.#mayWrite()) return;
    const { app } = this;
    app.respawning = true;
    app.changed();
    await this.suggestFor(app.selected);
    if (!app.respawning) return;
    app.cursor = this.#cursor();
    this.tell("info", `New place for point ${app.selected}: click, take a suggestion (${app.keys.hint("use-suggestions")}), or move the cursor and press Enter.`);
    app.changed();
  }

  suggest() {
    return suggest(this.app, this.tell, null);
  }

  /** @param {string} name suggests where this point may go on */
  suggestFor(name) {
    return suggest(this.app, this.tell, name);
  }

  /** @param {number} index */
  async takeSuggestion(index) {
    const { app } = this;
    const taken = app.suggestions[index];
    if (!taken || !this.#mayWrite()) return;
    const place = { u: taken.u, v: taken.v };
    if (app.respawning || app.suggestedFor === app.selected) {
      app.suggested = null;
      app.respawning = false;
      app.cursor = null;
      return this.#put(app.selected, app.frame, place, true);
    }
    const rest = app.suggestions.filter((_, other) => other !== index);
    app.suggested = rest.length > 0 ? { frame: app.frame, list: rest, name: null } : null;
    // A place of its own is a point of its own; only a respawn goes on with an old one.
    if (app.labels.lanes.has(app.selected)) app.selected = app.labels.freeName();
    await this.#put(app.selected, app.frame, place, false);
  }

  /** The best suggestion for the point that they are for; without such a point all of them as new points, one step of undo. */
  async useSuggestions() {
    const { app } = this;
    const { suggestions, frame } = app;
    if (suggestions.length === 0) return this.tell("info", `Nothing is suggested in this frame: ${app.keys.hint("suggest")} suggests.`);
    if (app.respawning || app.suggestedFor === app.selected) return this.takeSuggestion(0);
    if (!this.#mayWrite()) return;
    const taken = new Set(app.labels.names);
    /** @type {Edit[]} */
    const edits = suggestions.map(({ u, v }) => {
      let number = 1;
      while (taken.has(String(number))) number += 1;
      taken.add(String(number));
      // Nobody has looked at each by itself: it is the tracker's until it is touched.
      return { op: "spawn", point: String(number), frame, u, v, suggested: true };
    });
    app.suggested = null;
    app.cursor = null;
    if (await app.session.edit(edits)) app.select(edits[0].op === "spawn" ? edits[0].point : app.selected);
  }

  /** A person says that the observation here is right as it is. */
  async accept() {
    const { app } = this;
    this.settle();
    const { observation, selected: point, frame } = app;
    if (!observation) return this.tell("info", `Point ${point} is not labelled in this frame.`);
    if (!this.#mayWrite()) return;
    const { u, v } = observation;
    await app.session.edit([{ op: "place", point, frame, u, v }, { op: "mark", point, frame, uncertain: false }]);
  }

  /** There is nothing to label in this gap of the lane; where that was said before it is taken back. */
  async nothingHere() {
    const { app } = this;
    const { labels, selected: point, place, frames } = app;
    if (!labels.lanes.has(point) || app.observation) return this.tell("info", `Point ${point} has a label here: go to a gap of its lane.`);
    if (!this.#mayWrite()) return;
    const nothing = !labels.saidEmpty(point, app.frame);
    let [first, last] = [place, place];
    while (first > 0 && !labels.at(point, frames[first - 1].frame)) first -= 1;
    while (last + 1 < frames.length && !labels.at(point, frames[last + 1].frame)) last += 1;
    const [from, to] = [frames[first].frame, frames[last].frame];
    app.suggested = null;
    app.respawning = false;
    if (!(await app.session.note({ point, from, to }, nothing))) return;
    const again = app.keys.hint("nothing-here");
    this.tell("info", nothing ? `Point ${point} has no place in frames ${from} to ${to}; ${again} takes that back.` : `Frames ${from} to ${to} of point ${point} are to be labelled again.`);
  }

  /** @param {"occluded" | "uncertain" | "keyframe"} mark */
  async toggleMark(mark) {
    const { app } = this;
    this.settle();
    const { observation } = app;
    if (!observation) return this.tell("info", `Point ${app.selected} is not labelled in this frame.`);
    if (!this.#mayWrite()) return;
    await app.session.edit([{ op: "mark", point: app.selected, frame: app.frame, [mark]: !observation[mark] }]);
  }

  /** @param {"delete" | "delete-after"} op */
  async remove(op) {
    const { app } = this;
    this.settle();
    if (!app.labels.lastUpTo(app.selected, op === "delete" ? app.frame : Infinity)) return;
    if (op === "delete" && !app.observation) return this.tell("info", `Point ${app.selected} is not labelled in this frame.`);
    if (!this.#mayWrite()) return;
    await app.session.stop([app.selected]);
    await app.session.edit([{ op, point: app.selected, frame: app.frame }]);
  }

  /** The first press marks one end of a range, the second one deletes from there to here. */
  async deleteRange() {
    const { app } = this;
    this.settle();
    const { selected: point, frame, range } = app;
    if (!app.labels.lanes.has(point)) return this.tell("info", `Point ${point} has no labels.`);
    if (!this.#mayWrite()) return;
    if (range?.name !== point) {
      app.range = { name: point, frame };
      app.changed();
      return this.tell("info", `One end of the range is frame ${frame}: go to the other and press ${app.keys.hint("delete-range")} again. Esc forgets it.`);
    }
    app.range = null;
    await app.session.stop([point]);
    await app.session.edit([{ op: "delete-range", point, frame: Math.min(frame, range.frame), to: Math.max(frame, range.frame) }]);
  }

  /** @param {string} name */
  async removePoint(name) {
    if (!this.#mayWrite()) return;
    const { app } = this;
    await app.session.stop([name]);
    if (await app.session.edit([{ op: "remove-point", point: name }])) {
      this.tell("info", `Point ${name} is removed; undo brings it back.`);
      if (app.selected === name) app.select(app.labels.names[0] ?? "1");
    }
  }

  /**
   * @param {string} name
   * @param {string} to
   */
  async rename(name, to) {
    if (to === name || to === "" || !this.#mayWrite()) return;
    const { app } = this;
    if (app.labels.lanes.has(to)) return this.tell("warning", `There is a point ${to} already.`);
    // A point that is still to be placed has its name from then on.
    if (!app.labels.lanes.has(name)) return app.select(to);
    if ((await app.session.edit([{ op: "rename", point: name, to }])) && app.selected === name) app.select(to);
  }

  /**
   * @param {string[] | null} names of the points, null for all
   * @param {Direction} direction
   */
  track(names, direction) {
    const done = this.#trackNow(names, direction);
    this.placing = done.catch(() => undefined);
    return done;
  }

  /**
   * @param {string[] | null} names
   * @param {Direction} direction
   */
  async #trackNow(names, direction) {
    if (!this.#mayWrite()) return;
    const { app } = this;
    const { frame } = app;
    this.settle();
    // Points that were placed just now are there once they are on the disk.
    await app.session.written();
    const here = (names ?? app.labels.names).filter((name) => app.labels.at(name, frame));
    if (here.length === 0) return this.tell("info", "Nothing to track from: the point is not labelled in this frame.");
    await app.session.stop(here);
    await app.session.track(here, frame, direction, null);
  }

  async stop() {
    const { app } = this;
    app.cursor = null;
    app.respawning = false;
    app.suggested = null;
    app.range = null;
    app.changed();
    if ((await app.session.stop()) > 0) this.tell("info", "Stopped. What tracking found so far stays; a search for targets leaves nothing.");
  }

  /** @param {"undo" | "redo"} which */
  async history(which) {
    if (!this.#mayWrite()) return;
    this.settle();
    const { state } = this.app.labels;
    if (this.app.session.pending === 0 && !(which === "undo" ? state.can_undo : state.can_redo)) {
      return this.tell("info", `There is nothing to ${which}.`);
    }
    await this.app.session.stop();
    const change = await this.app.session.history(which);
    if (change) this.tell("info", `${which === "undo" ? "Undone" : "Done again"}: ${change.label}`);
  }
}
