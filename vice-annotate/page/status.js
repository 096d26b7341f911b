// Lines that say how things stand: frame, time, saved or not, jobs, what is under the pointer, offers of a respawn.

/** @import {App} from "./app.js" */
/** @import {Actions} from "./actions.js" */
/** @import {Notices} from "./notices.js" */
/** @import {Player} from "./player.js" */

import { coverage, coverageText } from "./coverage.js";
import { byId, setText } from "./dom.js";
import { underway } from "./jobs.js";

export class Status {
  /**
   * @param {App} app
   * @param {Player} player
   * @param {Actions} actions
   * @param {Notices} notices
   */
  constructor(app, player, actions, notices) {
    this.app = app;
    this.player = player;
    this.actions = actions;
    this.notices = notices;
    /** @type {"open" | "lost" | "closed"} */
    this.connection = "open";
    this.saved = byId("saved", HTMLElement);
    this.frameInput = byId("frame", HTMLInputElement);
  }

  draw() {
    this.#drawHead();
    this.#drawJobs();
    this.#drawFrame();
    this.#offerRespawn();
  }

  #drawHead() {
    const { app } = this;
    const { state } = app.labels;
    setText(byId("dataset", HTMLElement), state.dataset);
    setText(byId("camera", HTMLElement), `${state.camera} · ${state.width} × ${state.height}`);
    setText(byId("labels-file", HTMLElement), state.labels_file);
    byId("labels-file", HTMLElement).title = state.labels_file;
    byId("undo", HTMLButtonElement).disabled = !state.can_undo || !app.writable;
    byId("redo", HTMLButtonElement).disabled = !state.can_redo || !app.writable;
    const busy = app.session.pending > 0 || this.actions.moving !== null;
    const lost = this.connection !== "open";
    setText(this.saved, lost ? "No connection" : !app.writable ? "Read only" : busy ? "Saving…" : "All saved");
    this.saved.classList.toggle("busy", busy || !app.writable);
    this.saved.classList.toggle("wrong", lost);
    if (state.save_problem) {
      this.notices.banner("save", "warning", `The labels are safe in the journal, but the file is behind: ${state.save_problem}`);
    } else this.notices.clear("save");
    if (app.writable) this.notices.clear("read-only");
    else {
      const reason = state.read_only_reason ?? "another window writes to this file";
      this.notices.banner("read-only", "warning", `Read only: ${reason}. The labels are shown as they were when this program started.`);
    }
  }

  #drawJobs() {
    const jobs = this.app.labels.running;
    byId("job", HTMLElement).hidden = jobs.length === 0;
    if (jobs.length === 0) return;
    const total = jobs.reduce((sum, job) => sum + job.total, 0);
    const done = jobs.reduce((sum, job) => sum + job.done, 0);
    byId("job-progress", HTMLProgressElement).value = total > 0 ? done / total : 0;
    setText(byId("job-text", HTMLElement), jobs.map(underway).join(" · "));
  }

  #drawFrame() {
    const { app } = this;
    const { frames, place } = app;
    const { time_s, stamp_ns, frame } = frames[place];
    if (document.activeElement !== this.frameInput) this.frameInput.value = String(frame);
    this.frameInput.min = String(frames[0].frame);
    this.frameInput.max = String(frames[frames.length - 1].frame);
    setText(byId("frames", HTMLElement), `to ${frames[frames.length - 1].frame}`);
    const time = byId("time", HTMLElement);
    setText(time, `${time_s.toFixed(3)} s · ${place + 1} of ${frames.length}`);
    time.title = `${stamp_ns} ns`;
    setText(byId("play", HTMLElement), this.player.playing ? "Pause" : "Play");
    setText(byId("zoom", HTMLElement), `${Math.round(app.viewer.view.scale * 100)} %`);
    this.#drawProgress();
    const { hover } = app;
    setText(byId("readout", HTMLElement), hover ? `${hover.u.toFixed(1)}, ${hover.v.toFixed(1)}` : "");
    const picture = app.images.peek(frame);
    const broken = picture !== null && picture.bitmap === null;
    byId("broken", HTMLElement).hidden = !broken;
    setText(byId("broken-text", HTMLElement), broken ? picture.error : "");
    const { state } = app.labels;
    const other = picture?.bitmap && (picture.bitmap.width !== state.width || picture.bitmap.height !== state.height);
    if (other) this.notices.banner("size", "warning", `This frame is ${picture.bitmap?.width} × ${picture.bitmap?.height}, the camera ${state.width} × ${state.height}.`);
    else this.notices.clear("size");
  }

  /** What is left to do, and how much of the time is labelled. */
  #drawProgress() {
    const { app } = this;
    const { doubtful, gaps } = app.tasks.count;
    const tracking = app.labels.running.some(({ kind }) => kind === "track");
    const line = byId("doubtful", HTMLElement);
    const full = app.labels.names.length === 0 ? "no points yet" : tracking ? "tracking" : "every lane full";
    setText(line, `${gaps === 0 ? full : gaps === 1 ? "1 gap" : `${gaps} gaps`}, ${doubtful === 0 ? "none" : doubtful} doubtful`);
    line.classList.toggle("none", doubtful === 0 && gaps === 0);
    setText(byId("coverage", HTMLElement), app.labels.names.length === 0 ? "" : coverageText(coverage(app.labels)));
  }

  /** A point that left the image is offered a new place, once for each time it left. */
  #offerRespawn() {
    const { app } = this;
    const name = this.#gone();
    // What is to be done with the chosen point here stands in a banner of its own.
    const guided = app.tasks.at(app.place, app.selected) !== null;
    if (name === null || !app.writable || app.respawning || guided || this.player.playing) return this.notices.clear("respawn");
    const last = app.labels.lastUpTo(name, app.frame);
    this.notices.banner("respawn", "info", `Point ${name} left the image after frame ${last?.frame}. Give it a new place here?`, [
      [`Respawn ${name}`, () => {
        app.select(name);
        this.actions.respawn();
      }],
      ["Not now", () => {
        app.declined.add(`${name} ${last?.frame}`);
        app.changed();
      }],
    ]);
  }

  /** @returns {string | null} */
  #gone() {
    const { app } = this;
    const gone = app.labels
      .goneAt(app.frame)
      .filter((name) => !app.labels.saidEmpty(name, app.frame))
      .filter((name) => !app.declined.has(`${name} ${app.labels.lastUpTo(name, app.frame)?.frame}`));
    return gone.includes(app.selected) ? app.selected : (gone[0] ?? null);
  }
}
