// The labels as the server last said, and questions about them. Everything that changes them comes through here.

/** @import {Change, Dot, Edit, Empty, Job, Observation, Pixel, Point, Projections, State} from "./types.js" */

const DOUBT_BELOW = 0.5;
/** How near the border, as a part of the image's width, a point is taken to have left the image. */
const BORDER = 0.04;

/** @param {string} key of a hope: frame and point @returns {string} the point */
const hopedPoint = (key) => key.slice(key.indexOf(" ") + 1);

export class Labels {
  /** @param {State} state */
  constructor(state) {
    /** @type {State} */
    this.state = state;
    /** @type {Map<string, Map<number, Observation>>} point, then frame */
    this.lanes = new Map();
    /** @type {Map<number, number>} frame to its place among the frames */
    this.places = new Map();
    /** @type {Projections | null} */
    this.projections = null;
    /** @type {Map<number, Dot[]>} by frame */
    this.dots = new Map();
    /** Grows with all that is heard beside changes of the labels. */
    this.heard = 0;
    /** @type {Map<string, Set<number>>} the frames in which tracking lost a point, as far as this page heard of it */
    this.lost = new Map();
    /** @type {Map<string, Set<number>>} the frames that a point was tracked from, as far as this page heard of it */
    this.starts = new Map();
    /** @type {Map<string, [number, number][]>} the frames in which a person says there is nothing to label, by point */
    this.empty = new Map();
    /** @type {Map<string, Pixel>} shown before the server has said yes; by point and frame */
    this.hopes = new Map();
    this.replace(state);
  }

  /** @param {State} state */
  replace(state) {
    this.state = state;
    this.places = new Map(state.frames.map((each, place) => [each.frame, place]));
    this.lanes = new Map();
    for (const point of state.points) this.#index(point);
    for (const job of state.jobs) this.#heardOf(job);
    this.setEmpty(state.empty ?? []);
    this.hopes.clear();
    this.heard += 1;
  }

  /** @param {Point} point */
  #index(point) {
    this.lanes.set(point.name, new Map(point.observations.map((each) => [each.frame, each])));
  }

  /**
   * @param {Change} change
   * @returns {"applied" | "known" | "missed"} `missed`: another change came before it, so the state must be read again
   */
  apply(change) {
    if (change.revision <= this.state.revision) return "known";
    if (change.revision > this.state.revision + 1) return "missed";
    const { state } = this;
    state.revision = change.revision;
    state.can_undo = change.can_undo;
    state.can_redo = change.can_redo;
    state.points = state.points.filter((each) => !change.removed.includes(each.name));
    for (const name of change.removed) this.lanes.delete(name);
    for (const point of change.points) {
      const at = state.points.findIndex((each) => each.name === point.name);
      if (at < 0) state.points.push(point);
      else state.points[at] = point;
      this.#index(point);
    }
    state.points.sort((a, b) => a.name.localeCompare(b.name, "en", { numeric: true }));
    // What is hoped of other points is still on its way.
    const told = new Set([...change.removed, ...change.points.map(({ name }) => name)]);
    for (const key of this.hopes.keys()) if (told.has(hopedPoint(key))) this.hopes.delete(key);
    return "applied";
  }

  /** @param {number} frame of the data set @returns {number} its place among the frames, or that of the nearest */
  placeNear(frame) {
    const { frames } = this.state;
    let nearest = 0;
    for (let place = 1; place < frames.length; place += 1) {
      if (Math.abs(frames[place].frame - frame) < Math.abs(frames[nearest].frame - frame)) nearest = place;
    }
    return nearest;
  }

  /** @param {Projections | null} projections */
  setProjections(projections) {
    this.projections = projections;
    this.dots = new Map();
    for (const dot of projections?.dots ?? []) {
      const there = this.dots.get(dot.frame);
      if (there) there.push(dot);
      else this.dots.set(dot.frame, [dot]);
    }
  }

  /**
   * @param {number} frame
   * @returns {Dot[]}
   */
  dotsAt(frame) {
    return this.dots.get(frame) ?? [];
  }

  /** @param {Job} job */
  applyJob(job) {
    const { jobs } = this.state;
    const at = jobs.findIndex((each) => each.id === job.id);
    if (at >= 0) jobs.splice(at, 1);
    if (job.state === "running") jobs.push(job);
    this.#heardOf(job);
  }

  /** @param {Job} job */
  #heardOf(job) {
    for (const { point, frame, why } of job.ends ?? []) {
      if (why !== "lost") continue;
      const there = this.lost.get(point);
      if (there) there.add(frame);
      else this.lost.set(point, new Set([frame]));
    }
    this.heard += 1;
  }

  /** @param {Empty[]} list */
  setEmpty(list) {
    this.empty = new Map();
    for (const { point, from, to } of list) this.empty.set(point, [...(this.empty.get(point) ?? []), [from, to]]);
    this.heard += 1;
  }

  /**
   * @param {string} name
   * @param {number} frame
   * @returns {boolean} whether a person says that there is nothing to label
   */
  saidEmpty(name, frame) {
    return (this.empty.get(name) ?? []).some(([from, to]) => from <= frame && frame <= to);
  }

  /**
   * @param {string} name
   * @param {number} frame
   */
  trackedFrom(name, frame) {
    this.starts.set(name, (this.starts.get(name) ?? new Set()).add(frame));
    this.heard += 1;
  }

  /**
   * @param {string} name
   * @param {number} frame
   * @returns {boolean} whether a point was tracked from here, or lost right after it
   */
  tried(name, frame) {
    const next = this.state.frames[(this.places.get(frame) ?? 0) + 1]?.frame ?? Infinity;
    const lost = [...(this.lost.get(name) ?? [])].some((each) => each > frame && each <= next);
    return lost || (this.starts.get(name)?.has(frame) ?? false);
  }

  /** @returns {Job[]} */
  get running() {
    return this.state.jobs.filter((each) => each.state === "running");
  }

  get names() {
    return this.state.points.map((each) => each.name);
  }

  /** @param {string} name */
  indexOf(name) {
    return this.state.points.findIndex((each) => each.name === name);
  }

  /**
   * @param {string} name
   * @param {number} frame
   * @returns {Observation | null}
   */
  at(name, frame) {
    return this.lanes.get(name)?.get(frame) ?? null;
  }

  /**
   * Where the point is shown: as hoped, else as the server said.
   * @param {string} name
   * @param {number} frame
   * @returns {Pixel | null}
   */
  pixel(name, frame) {
    return this.hopes.get(`${frame} ${name}`) ?? this.at(name, frame);
  }

  /**
   * @param {string} name
   * @param {number} frame
   * @param {Pixel | null} pixel
   */
  hope(name, frame, pixel) {
    if (pixel) this.hopes.set(`${frame} ${name}`, pixel);
    else this.hopes.delete(`${frame} ${name}`);
  }

  /** @param {Observation} observation */
  doubtful(observation) {
    const { uncertain, confidence } = observation;
    return uncertain || (confidence !== null && confidence < (this.state.doubt_below ?? DOUBT_BELOW));
  }

  /** @returns {string} a name that no point has, nor one that is just being placed: the smallest free number */
  freeName() {
    const hoped = new Set([...this.hopes.keys()].map(hopedPoint));
    let number = 1;
    while (this.lanes.has(String(number)) || hoped.has(String(number))) number += 1;
    return String(number);
  }

  /**
   * The last observation of a point in or before a frame.
   * @param {string} name
   * @param {number} frame
   * @returns {Observation | null}
   */
  lastUpTo(name, frame) {
    let last = null;
    for (const each of this.#observations(name)) {
      if (each.frame > frame) break;
      last = each;
    }
    return last;
  }

  /**
   * @param {string} name
   * @param {number} frame
   * @returns {Observation | null} the next one after a frame that tracking must leave alone: by hand, detected, or the
   *   beginning of a segment
   */
  nextFixed(name, frame) {
    const fixed = (/** @type {Observation} */ each) => each.source === "manual" || each.source === "detected" || each.keyframe;
    return this.#observations(name).find((each) => each.frame > frame && fixed(each)) ?? null;
  }

  /**
   * @param {string} name
   * @param {number} frame
   * @returns {boolean} whether a correction here has automatic observations after it, up to the next fixed one
   */
  followedByAutomatic(name, frame) {
    const until = this.nextFixed(name, frame)?.frame ?? Infinity;
    return this.#observations(name).some((each) => each.frame > frame && each.frame < until);
  }

  /** @param {string} name */
  #observations(name) {
    return this.state.points.find((each) => each.name === name)?.observations ?? [];
  }

  /**
   * Points whose lane ended for good before this frame, near the image's border.
   * @param {number} frame
   * @returns {string[]}
   */
  goneAt(frame) {
    return this.names.filter((name) => {
      const last = this.lastUpTo(name, frame);
      // A target's corners are found again where they are in sight: nobody need place them.
      if (!last || last.source === "detected" || last.frame === frame || last !== this.#observations(name).at(-1)) return false;
      return this.atBorder(last);
    });
  }

  /** @param {Pixel} pixel @returns {boolean} whether a point there is as good as gone from the image */
  atBorder({ u, v }) {
    const { width, height } = this.state;
    const margin = Math.max(8, width * BORDER);
    return u < margin || v < margin || u > width - 1 - margin || v > height - 1 - margin;
  }

  /**
   * @param {string} name
   * @param {number} place among the frames
   * @returns {boolean} whether tracking broke off before this frame, inside the image
   */
  lostAt(name, place) {
    const { frames } = this.state;
    const before = place > 0 ? this.at(name, frames[place - 1].frame) : null;
    if (!before || this.at(name, frames[place].frame) || this.atBorder(before)) return false;
    // Where a person has placed a point it may not have been tracked from yet; a detector follows nothing.
    const { frame } = frames[place];
    const heard = [...(this.lost.get(name) ?? [])].some((each) => each > before.frame && each <= frame);
    if ((before.source !== "auto" || before.confidence === null) && !heard) return false;
    // A gap in a segment is a frame that could not be decoded, or was deleted.
    const next = this.#observations(name).find((each) => each.frame > frames[place].frame);
    return next === undefined || next.keyframe;
  }

  /**
   * What edits would overwrite, as text to compare before a second try.
   * @param {Edit[]} edits
   * @returns {string}
   */
  touchedBy(edits) {
    return JSON.stringify(
      edits.map((edit) => {
        if (edit.op === "place" || edit.op === "mark") return this.at(edit.point, edit.frame);
        return this.#observations(edit.point);
      }),
    );
  }
}
