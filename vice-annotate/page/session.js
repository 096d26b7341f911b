// Writes to the server: one after the other, each on the revision that the user saw. A write that came too late is
// refused by the server; then the state is read again and the user is told.

/** @import {Change, Direction, Edit, Empty, Job, Targets} from "./types.js" */
/** @import {Labels} from "./labels.js" */

import { follow, getProjections, getState, postDetect, postEdits, postHistory, postImport, postNote, postTrack, ServerError, stopJob } from "./api.js";

const PROJECTIONS_AFTER_MS = 250;

/**
 * @typedef {object} Listener
 * @property {() => void} changed labels, jobs or projections
 * @property {(kind: "info" | "warning" | "error", text: string) => void} tell
 * @property {(change: Change) => void} elsewhere another window changed the labels
 * @property {(job: Job) => void} finished
 * @property {(state: "open" | "lost" | "closed") => void} connection
 */

export class Session {
  /**
   * @param {Labels} labels
   * @param {Listener} listener
   */
  constructor(labels, listener) {
    this.labels = labels;
    this.listener = listener;
    /** @type {Promise<unknown>} */
    this.last = Promise.resolve();
    /** Writes that are not acknowledged yet. */
    this.pending = 0;
    this.projectionsTimer = 0;
  }

  start() {
    let opened = false;
    follow({
      change: (change) => this.#heard(change),
      job: (job) => {
        this.labels.applyJob(job);
        this.listener.changed();
        if (job.state !== "running") this.listener.finished(job);
      },
      notes: (empty) => {
        this.labels.setEmpty(empty);
        this.listener.changed();
      },
      save: (problem) => {
        this.labels.state.save_problem = problem;
        this.listener.changed();
      },
      closed: () => this.listener.connection("closed"),
      lost: () => this.listener.connection("lost"),
      open: () => {
        this.listener.connection("open");
        if (opened) this.#queue(() => this.reload()).catch(() => undefined);
        opened = true;
      },
    });
    this.#refreshProjections();
  }

  /** @param {Change} change */
  #heard(change) {
    // While a write of our own is under way its answer may be overtaken by its event: they are told apart in turn.
    this.#queue(async () => {
      const known = this.#apply(change);
      if (known === "missed") await this.reload();
      if (known !== "known" && change.by !== "track" && change.by !== "detect") this.listener.elsewhere(change);
    }).catch(() => undefined);
  }

  /** @param {Change} change */
  #apply(change) {
    const result = this.labels.apply(change);
    if (result === "applied") {
      this.listener.changed();
      this.#refreshProjections();
    }
    return result;
  }

  /**
   * @template T
   * @param {() => Promise<T>} work
   * @returns {Promise<T>}
   */
  #queue(work) {
    const run = this.last.then(work);
    this.last = run.catch(() => undefined);
    return run;
  }

  /**
   * @template T
   * @param {() => Promise<T>} work
   * @returns {Promise<T>}
   */
  #write(work) {
    this.pending += 1;
    this.listener.changed();
    return this.#queue(work).finally(() => {
      this.pending -= 1;
      this.listener.changed();
    });
  }

  /** @returns {Promise<unknown>} when all that was asked for so far is done */
  written() {
    return this.last;
  }

  async reload() {
    this.labels.replace(await getState());
    this.listener.changed();
    this.#refreshProjections();
  }

  /**
   * @param {unknown} error
   * @param {string} [about] what was refused, where the user may wonder
   * @returns {Promise<false>}
   */
  async #refused(error, about = "") {
    if (!(error instanceof ServerError)) throw error;
    this.labels.hopes.clear();
    if (error.stale) {
      await this.reload().catch(() => undefined);
      this.listener.tell("warning", "Not done: the labels had changed elsewhere first. They have been read again; look, then repeat.");
    } else {
      this.listener.tell("error", about + (error.hint ? `${error.message} — ${error.hint}` : error.message));
    }
    this.listener.changed();
    return false;
  }

  /**
   * @param {Edit[]} edits one step of undo
   * @returns {Promise<boolean>} whether it is done, and on disk
   */
  edit(edits) {
    const seen = this.labels.touchedBy(edits);
    return this.#write(async () => {
      try {
        await this.#edit(edits, seen);
        return true;
      } catch (error) {
        return this.#refused(error);
      }
    });
  }

  /**
   * @param {Edit[]} edits
   * @param {string} seen what the user saw of what the edits touch
   */
  async #edit(edits, seen) {
    for (let tries = 0; ; tries += 1) {
      try {
        return this.#answered(await postEdits(this.labels.state.revision, edits));
      } catch (error) {
        // A running tracker raises the revision many times a second. What it did elsewhere is no reason to refuse;
        // where it changed what the user saw, it is.
        const stale = error instanceof ServerError && error.stale;
        if (!stale || this.labels.running.length === 0 || tries > 3) throw error;
        this.labels.replace(await getState());
        if (this.labels.touchedBy(edits) !== seen) throw error;
      }
    }
  }

  /** @param {Change} change */
  async #answered(change) {
    if (this.#apply(change) === "missed") await this.reload();
  }

  /**
   * @param {Empty} stretch
   * @param {boolean} nothing whether there is nothing to label
   * @returns {Promise<boolean>}
   */
  note(stretch, nothing) {
    return this.#write(async () => {
      try {
        const { empty } = await postNote({ ...stretch, nothing });
        this.labels.setEmpty(empty);
        return true;
      } catch (error) {
        return this.#refused(error);
      }
    });
  }

  /**
   * @param {"undo" | "redo"} which
   * @returns {Promise<Change | null>}
   */
  history(which) {
    return this.#write(async () => {
      try {
        const change = await postHistory(which, this.labels.state.revision);
        await this.#answered(change);
        return change;
      } catch (error) {
        await this.#refused(error);
        return null;
      }
    });
  }

  /**
   * @param {string[]} points
   * @param {number} frame
   * @param {Direction} direction
   * @param {number | null} until
   * @returns {Promise<boolean>} whether it has begun
   */
  track(points, frame, direction, until) {
    for (const name of points) this.labels.trackedFrom(name, frame);
    return this.#begin(() => postTrack(this.labels.state.revision, { points, frame, direction, until }));
  }

  /**
   * @param {Targets} targets
   * @returns {Promise<boolean>} whether it has begun
   */
  detect(targets) {
    return this.#begin(() => postDetect(this.labels.state.revision, targets));
  }

  /**
   * @param {() => Promise<Job>} ask
   * @returns {Promise<boolean>} whether it has begun
   */
  #begin(ask) {
    return this.#write(async () => {
      try {
        const job = await ask();
        if (job.state === "running") this.labels.applyJob(job);
        this.listener.changed();
        return true;
      } catch (error) {
        return this.#refused(error);
      }
    });
  }

  /** @param {string[]} [points] only the jobs of these */
  async stop(points) {
    const jobs = this.labels.running.filter((job) => !points || job.points.some((name) => points.includes(name)));
    for (const job of jobs) {
      // It may have ended in the meantime: then there is nothing to stop.
      await stopJob(job.id).catch(() => undefined);
    }
    // Its last results may still be on their way: what comes next goes by the state with them.
    if (jobs.length > 0) await this.#queue(() => this.reload()).catch(() => undefined);
    return jobs.length;
  }

  /**
   * @param {string} format
   * @param {{content: string, encoding: "text" | "base64", replace: boolean}} body
   * @param {string} name of the file
   * @returns {Promise<boolean>}
   */
  importLabels(format, body, name) {
    return this.#write(async () => {
      try {
        await this.#answered(await postImport(format, body));
        return true;
      } catch (error) {
        return this.#refused(error, `${name}: `);
      }
    });
  }

  #refreshProjections() {
    if (this.labels.state.streams.length === 0 || this.projectionsTimer) return;
    this.projectionsTimer = window.setTimeout(async () => {
      this.projectionsTimer = 0;
      const revision = this.labels.state.revision;
      try {
        this.labels.setProjections(await getProjections());
        this.listener.changed();
      } catch {
        this.labels.setProjections(null);
      }
      if (revision !== this.labels.state.revision) this.#refreshProjections();
    }, PROJECTIONS_AFTER_MS);
  }
}
