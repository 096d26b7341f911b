// What needs a person, lane by lane: observations in doubt, and stretches without any. It ends when each lane is full, or said
// to be.

/** @import {Labels} from "./labels.js" */
/** @import {Observation} from "./types.js" */

/**
 * Why a person is needed.
 * - `doubtful`: an observation is uncertain, or the tracker is not sure of it
 * - `lost`: tracking broke off inside the image
 * - `left`: the point left the image
 * - `untracked`: what was placed has not been tracked from yet
 * - `gap`: there is nothing, for another reason
 * - `start`: the lane has not begun yet
 * @typedef {"doubtful" | "lost" | "left" | "untracked" | "gap" | "start"} Kind
 */

/**
 * @typedef {object} Task
 * @property {string} name of the point
 * @property {Kind} kind
 * @property {number} place where a person has to look, among the frames
 * @property {number} first frame of the stretch, by place
 * @property {number} last
 */

export class Tasks {
  /** @param {Labels} labels */
  constructor(labels) {
    this.labels = labels;
    /** @type {Task[]} */
    this.kept = [];
    this.keptFor = "";
  }

  /** @returns {Task[]} in the order of time, then of lanes */
  get list() {
    const { labels } = this;
    const now = `${labels.state.revision} ${labels.heard}`;
    if (now === this.keptFor) return this.kept;
    this.keptFor = now;
    const busy = new Set(labels.running.flatMap(({ kind, points }) => (kind === "track" ? points : [])));
    const rank = new Map(labels.names.map((name, at) => [name, at]));
    this.kept = labels.names
      .flatMap((name) => this.#lane(name).filter(({ kind }) => kind === "doubtful" || !busy.has(name)))
      .sort((one, other) => one.place - other.place || (rank.get(one.name) ?? 0) - (rank.get(other.name) ?? 0));
    return this.kept;
  }

  /** @returns {{doubtful: number, gaps: number}} doubtful frames, and stretches without an observation */
  get count() {
    const { list, labels } = this;
    const frames = new Set();
    for (const { kind, first, last } of list) {
      if (kind === "doubtful") for (let place = first; place <= last; place += 1) frames.add(labels.state.frames[place].frame);
    }
    return { doubtful: frames.size, gaps: list.filter(({ kind }) => kind !== "doubtful").length };
  }

  /**
   * The next one after (before) a place and lane; from the other end where there is none.
   * @param {number} place
   * @param {string} name
   * @param {1 | -1} step
   * @param {(task: Task) => boolean} [wanted]
   * @returns {Task | null}
   */
  next(place, name, step, wanted = () => true) {
    const list = this.list.filter(wanted);
    const lane = this.labels.indexOf(name);
    /** @param {Task} task */
    const ahead = (task) => step * (task.place - place || this.labels.indexOf(task.name) - lane) > 0;
    const inOrder = step > 0 ? list : list.reverse();
    return inOrder.find(ahead) ?? inOrder[0] ?? null;
  }

  /**
   * @param {number} place
   * @param {string} name
   * @returns {Task | null} what is to be done there
   */
  at(place, name) {
    return this.list.find((task) => task.place === place && task.name === name) ?? null;
  }

  /**
   * @param {string} name
   * @returns {Task[]}
   */
  #lane(name) {
    const { labels } = this;
    const { frames } = labels.state;
    /** @param {number} place */
    const stateOf = (place) => {
      const seen = labels.at(name, frames[place].frame);
      if (seen) return labels.doubtful(seen) ? "doubtful" : "fine";
      return labels.saidEmpty(name, frames[place].frame) ? "fine" : "nothing";
    };
    /** @type {Task[]} */
    const tasks = [];
    for (let first = 0; first < frames.length; ) {
      const state = stateOf(first);
      let last = first;
      while (last + 1 < frames.length && stateOf(last + 1) === state) last += 1;
      const task = state === "fine" ? null : state === "doubtful" ? { kind: /** @type {Kind} */ ("doubtful"), place: first } : this.#gap(name, first, last);
      if (task) tasks.push({ name, ...task, first, last });
      first = last + 1;
    }
    return tasks;
  }

  /**
   * @param {string} name
   * @param {number} first
   * @param {number} last
   * @returns {{kind: Kind, place: number} | null} null where nobody need do anything
   */
  #gap(name, first, last) {
    const { labels } = this;
    const { frames } = labels.state;
    const before = first > 0 ? labels.at(name, frames[first - 1].frame) : null;
    const after = last + 1 < frames.length ? labels.at(name, frames[last + 1].frame) : null;
    // A target's corners are found again where they are in sight: nobody need place them.
    if ((before ?? after)?.source === "detected") return null;
    if (!before) return { kind: first === 0 ? "start" : "gap", place: first };
    if (labels.atBorder(before)) return { kind: "left", place: first };
    if (after && !after.keyframe) return { kind: "gap", place: first };
    if (followed(before) || labels.tried(name, before.frame)) return { kind: "lost", place: first };
    return { kind: "untracked", place: first - 1 };
  }
}

/** @param {Observation} observation @returns {boolean} whether the tracker came as far as this, and no further */
function followed({ source, confidence }) {
  return source === "auto" && confidence !== null;
}
