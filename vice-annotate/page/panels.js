// The panels beside the frame: points, the chosen point, distances of the projected dots.

/** @import {App} from "./app.js" */
/** @import {Actions} from "./actions.js" */
/** @import {Observation, Projections, Stream} from "./types.js" */

import { coverage, coverageText } from "./coverage.js";
import { button, byId, make, setText } from "./dom.js";
import { pointColour, streamColour } from "./palette.js";

const SOURCES = { manual: "by hand", auto: "tracked", detected: "detected", interpolated: "interpolated" };

/** @param {Observation} observation @returns {string} */
function sourceText({ source, confidence, seeded }) {
  const sure = confidence === null ? "" : ` ${Math.round(confidence * 100)} % sure`;
  return SOURCES[source] + sure + (seeded ? ", search led by an estimate" : "");
}

export class Panels {
  /**
   * @param {App} app
   * @param {Actions} actions
   */
  constructor(app, actions) {
    this.app = app;
    this.actions = actions;
    this.points = byId("points", HTMLUListElement);
    this.name = byId("name", HTMLInputElement);
    this.chosen = byId("chosen", HTMLElement);
    this.takeAll = byId("take-all", HTMLButtonElement);
    this.dots = byId("dots", HTMLTableSectionElement);
    this.skips = byId("skips", HTMLElement);
    /** What the list of points shows, to build it only on change: a rebuilt button loses the focus. */
    this.listed = "";
    /** The chosen point when it was last brought into sight. */
    this.inSight = "";
    /** @type {Projections | null} what the table shows, and for which frame and point */
    this.tabled = null;
    this.tabledFor = "";
    /** @type {Map<string, {choose: HTMLButtonElement, here: HTMLElement, cover: HTMLElement}>} */
    this.rows = new Map();
    this.name.addEventListener("change", () => actions.rename(app.selected, this.name.value.trim()));
    this.name.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.name.value = app.selected;
      if (event.key === "Enter" || event.key === "Escape") app.viewer.marks.focus();
    });
  }

  draw() {
    this.#drawPoints();
    this.#drawChosen();
    this.#drawDots();
    const { suggestions, respawning, suggestedFor, selected } = this.app;
    this.takeAll.hidden = suggestions.length === 0;
    setText(this.takeAll, respawning || suggestedFor === selected ? `Use S1 for ${selected}` : `Use all ${suggestions.length}`);
  }

  #drawPoints() {
    const { app } = this;
    const { names } = app.labels;
    const shown = app.labels.lanes.has(app.selected) ? names : [...names, app.selected];
    const key = JSON.stringify([shown, names.length, app.writable]);
    if (key !== this.listed) {
      this.listed = key;
      this.rows.clear();
      this.points.replaceChildren(...shown.map((name) => this.#row(name)));
    }
    for (const [name, { choose, here, cover }] of this.rows) {
      const observation = app.labels.at(name, app.frame);
      const doubtful = observation !== null && app.labels.doubtful(observation);
      choose.setAttribute("aria-current", String(name === app.selected));
      here.classList.toggle("doubt", doubtful || app.labels.lostAt(name, app.place));
      setText(here, this.#hereText(name, observation, doubtful));
      setText(cover, app.labels.lanes.has(name) ? coverageText(coverage(app.labels, name)) : "");
    }
    if (this.inSight === app.selected) return;
    this.inSight = app.selected;
    this.rows.get(app.selected)?.choose.scrollIntoView({ block: "nearest" });
  }

  /**
   * @param {string} name
   * @param {Observation | null} observation
   * @param {boolean} doubtful
   */
  #hereText(name, observation, doubtful) {
    if (!this.app.labels.lanes.has(name)) return "to be placed";
    if (!observation) {
      if (this.app.labels.saidEmpty(name, this.app.frame)) return "nothing here";
      return this.app.labels.lostAt(name, this.app.place) ? "lost" : "not here";
    }
    if (doubtful) return "doubtful";
    return observation.occluded ? "occluded" : SOURCES[observation.source];
  }

  /** @param {string} name */
  #row(name) {
    const { app } = this;
    const dot = make("span", { class: "dot" });
    const index = app.labels.indexOf(name);
    dot.style.background = pointColour(index < 0 ? app.labels.names.length : index);
    const here = make("span", { class: "here" });
    const cover = make("span", { class: "cover", title: "how much of the time is labelled" });
    const choose = make("button", { class: "choose" }, [dot, make("b", { text: name }), here, cover]);
    choose.type = "button";
    choose.addEventListener("click", () => app.select(name));
    const row = make("li", {}, [choose]);
    if (index >= 0 && app.writable) {
      row.append(button("×", () => this.actions.removePoint(name), { class: "plain", label: `Remove point ${name}`, title: `Remove point ${name}` }));
    }
    this.rows.set(name, { choose, here, cover });
    return row;
  }

  #drawChosen() {
    const { app } = this;
    const { observation } = app;
    if (document.activeElement !== this.name) this.name.value = app.selected;
    this.name.disabled = !app.writable;
    const pixel = app.pixel;
    const where = pixel ? `${pixel.u.toFixed(1)}, ${pixel.v.toFixed(1)} px` : "";
    setText(this.chosen, observation ? `${where} · ${sourceText(observation)}` : where || this.#absentText());
    for (const [id, on] of /** @type {[string, boolean][]} */ ([
      ["mark-occluded", observation?.occluded ?? false],
      ["mark-uncertain", observation?.uncertain ?? false],
      ["mark-keyframe", observation?.keyframe ?? false],
    ])) {
      const mark = byId(id, HTMLButtonElement);
      mark.setAttribute("aria-pressed", String(on));
      mark.disabled = !observation || !app.writable;
    }
  }

  #absentText() {
    const { app } = this;
    if (app.respawning) return "Respawn: choose its new place.";
    if (!app.labels.lanes.has(app.selected)) return "Click on its place in the frame.";
    if (!app.labels.lostAt(app.selected, app.place)) return "Not labelled in this frame.";
    const gap_s = app.frames[app.place].time_s - app.frames[app.place - 1].time_s;
    return `Lost, ${gap_s.toFixed(2)} s after the frame before. Click on its place to go on.`;
  }

  #drawDots() {
    const { app } = this;
    const { projections } = app.labels;
    byId("dots-section", HTMLElement).hidden = app.labels.state.streams.length === 0;
    if (!projections) return;
    const key = `${app.frame} ${app.selected}`;
    if (projections === this.tabled && key === this.tabledFor) return;
    this.tabled = projections;
    this.tabledFor = key;
    const dots = app.labels.dotsAt(app.frame);
    let onBoard = -1;
    const rows = projections.streams.map((stream, index) => {
      if (stream.kind === "on-board") onBoard += 1;
      const dot = dots.find((each) => each.stream === index && each.point === app.selected);
      const error = dot?.error_px ?? null;
      const name = make("td", { title: `${stream.name} (${stream.kind})` }, [
        this.#mark(stream, onBoard), ` ${stream.name}`,
      ]);
      return make("tr", {}, [
        name,
        make("td", { text: error === null ? "–" : error.toFixed(1) }),
        make("td", { text: rmseText(stream), title: "pooled over all sets of 1, 2 and 3 points: the same where each point has as many frames" }),
      ]);
    });
    this.dots.replaceChildren(...rows);
    const skipped = projections.skips.map(({ reason, count }) => `${count} ${reason}`).join(", ");
    setText(this.skips, skipped ? `Not scored: ${skipped}` : "");
    this.skips.hidden = skipped === "";
  }

  /**
   * @param {Stream} stream
   * @param {number} nth
   */
  #mark({ kind }, nth) {
    const mark = make("span", { text: kind === "reference" ? "■" : "●" });
    mark.style.color = streamColour(kind, nth);
    return mark;
  }
}

/** @param {Stream} stream @returns {string} for 1, 2 and 3 points */
function rmseText({ rmse_px }) {
  if (!rmse_px) return "–";
  return ["1", "2", "3"].filter((each) => each in rmse_px).map((each) => rmse_px[each].toFixed(1)).join(" / ");
}
