// Which frame is shown: steps, jumps, play. The image comes first: marks never stand on another frame's image.

/** @import {App} from "./app.js" */

const AHEAD = 8;
const BEHIND = 3;
/** Waiting longer than this is worth a word. */
const SAY_LOADING_MS = 200;
const SLOWEST_MS = 500;

export class Player {
  /**
   * @param {App} app
   * @param {{loading: (frame: number | null) => void, leaving: () => void}} on
   */
  constructor(app, on) {
    this.app = app;
    this.on = on;
    this.playing = false;
    this.speed = 1;
    this.heading = 1;
  }

  /** @param {number} places to go on by, from what was asked for last */
  step(places) {
    this.pause();
    return this.go(this.app.target + places);
  }

  /**
   * @param {number} place among the frames
   * @returns {Promise<void>} when its image is decoded, or found to be broken, and about to be drawn
   */
  async go(place) {
    const { app } = this;
    const target = Math.min(app.frames.length - 1, Math.max(0, place));
    if (target === app.target && target === app.place) return;
    this.on.leaving();
    this.heading = target < app.target ? -1 : 1;
    app.target = target;
    const { frame } = app.frames[target];
    this.#prefetch();
    if (!app.images.peek(frame)) {
      const timer = window.setTimeout(() => app.target === target && this.on.loading(frame), SAY_LOADING_MS);
      await app.images.get(frame);
      window.clearTimeout(timer);
      if (app.target !== target) return;
    }
    this.on.loading(null);
    app.place = target;
    app.cursor = null;
    app.respawning = false;
    if (app.switches.follow && app.pixel) app.viewer.view.reveal(app.pixel, true);
    app.changed();
  }

  /** The frame that is waited for first, then those ahead and a few behind, in the direction of travel. */
  #prefetch() {
    const { frames, target } = this.app;
    const places = [target];
    for (let ahead = 1; ahead <= AHEAD; ahead += 1) {
      places.push(target + ahead * this.heading);
      if (ahead <= BEHIND) places.push(target - ahead * this.heading);
    }
    this.app.images.prefetch(places.filter((each) => each >= 0 && each < frames.length).map((each) => frames[each].frame));
  }

  /** The first frame of all. */
  async begin() {
    const { app } = this;
    this.#prefetch();
    await app.images.get(app.frame);
    app.changed();
  }

  pause() {
    this.playing = false;
    this.app.changed();
  }

  async toggle() {
    if (this.playing) return this.pause();
    const { app } = this;
    this.playing = true;
    app.changed();
    if (app.target === app.frames.length - 1) await this.go(0);
    while (this.playing && app.target < app.frames.length - 1) {
      const began = performance.now();
      const apart = 1000 * (app.frames[app.target + 1].time_s - app.frames[app.target].time_s);
      await this.go(app.target + 1);
      // A gap in the recording is no reason to wait it out.
      const wait = Math.min(apart, SLOWEST_MS) / this.speed - (performance.now() - began);
      await new Promise((resolve) => window.setTimeout(resolve, Math.max(0, wait)));
    }
    this.pause();
  }
}
