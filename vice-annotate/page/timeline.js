// All frames from left to right, a lane a point: who made each observation, how sure, marks and gaps.

/** @import {App} from "./app.js" */
/** @import {Observation} from "./types.js" */

import { DOUBT, pointColour } from "./palette.js";

const LANE = 22;
const RULER = 20;
const NAMES = 92;
/** Room for these is there from the start, so that the frame above does not jump with each new point. */
const LEAST_LANES = 4;
const LARGEST_ZOOM = 60;
const STEPS_S = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600];

export class Timeline {
  /**
   * @param {App} app
   * @param {HTMLElement} box scrolls where there are many points
   * @param {HTMLCanvasElement} canvas
   * @param {{go: (place: number) => void, select: (name: string) => void}} doings
   */
  constructor(app, box, canvas, doings) {
    this.app = app;
    this.box = box;
    this.canvas = canvas;
    this.doings = doings;
    /** How many times a frame is wider than when all are in sight, and the first place in sight. */
    this.zoom = 1;
    this.first = 0;
    this.width = 1;
    this.lanes = document.createElement("canvas");
    /** The chosen point when its lane was last brought into sight. */
    this.inSight = "";
    /** What the lanes' canvas shows. */
    this.drawn = "";
    /** @type {unknown} */
    this.drawnLanes = null;
    new ResizeObserver(() => {
      this.width = Math.max(200, box.clientWidth);
      app.changed();
    }).observe(box);
    this.#listen();
  }

  /** @returns {number} CSS pixels of a frame */
  get #frameWidth() {
    return ((this.width - NAMES - 8) / this.app.frames.length) * this.zoom;
  }

  /** @returns {number} how many frames are in sight */
  get #shown() {
    return this.app.frames.length / this.zoom;
  }

  /** @param {number} place */
  #x(place) {
    return NAMES + (place - this.first) * this.#frameWidth;
  }

  /** @param {number} x @returns {number} place */
  #placeAt(x) {
    const place = Math.floor((x - NAMES) / this.#frameWidth + this.first);
    return Math.min(this.app.frames.length - 1, Math.max(0, place));
  }

  #listen() {
    const { canvas, app } = this;
    let scrubbing = false;
    /** @param {PointerEvent} event */
    const at = (event) => {
      const box = canvas.getBoundingClientRect();
      return { x: event.clientX - box.left, y: event.clientY - box.top };
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      const { x, y } = at(event);
      const name = app.labels.names[Math.floor((y - RULER) / LANE)];
      if (name !== undefined && y >= RULER) this.doings.select(name);
      if (x < NAMES) return;
      scrubbing = true;
      canvas.setPointerCapture(event.pointerId);
      this.doings.go(this.#placeAt(x));
    });
    canvas.addEventListener("pointermove", (event) => {
      if (scrubbing) this.doings.go(this.#placeAt(at(event).x));
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => (scrubbing = false));
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.shiftKey && this.box.scrollHeight > this.box.clientHeight) return;
      event.preventDefault();
      const { x } = at(/** @type {any} */ (event));
      const under = (x - NAMES) / this.#frameWidth + this.first;
      if (event.shiftKey) this.first += (event.deltaY + event.deltaX) / this.#frameWidth;
      else {
        this.zoom = Math.min(LARGEST_ZOOM, Math.max(1, this.zoom * Math.exp(-event.deltaY * 0.002)));
        this.first = under - (x - NAMES) / this.#frameWidth;
      }
      this.#keepInSight();
      app.changed();
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const place = { ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10 }[event.key];
      const lane = { ArrowUp: -1, ArrowDown: 1 }[event.key];
      if (place === undefined && lane === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      if (place !== undefined) this.doings.go(app.target + place);
      else if (lane !== undefined) {
        const name = app.labels.names[app.labels.indexOf(app.selected) + lane];
        if (name !== undefined) this.doings.select(name);
      }
    });
  }

  #keepInSight() {
    const shown = this.#shown;
    this.first = Math.min(this.app.frames.length - shown, Math.max(0, this.first));
  }

  draw() {
    const { app, canvas } = this;
    const { names } = app.labels;
    const height = RULER + LANE * Math.max(LEAST_LANES, names.length) + 4;
    const ratio = window.devicePixelRatio || 1;
    if (canvas.width !== Math.round(this.width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(this.width * ratio);
      canvas.height = Math.round(height * ratio);
      canvas.style.width = `${this.width}px`;
      canvas.style.height = `${height}px`;
    }
    this.#followPlayhead();
    this.#followChosen();
    this.#describe();
    const context = canvas.getContext("2d");
    if (!context) return;
    this.#drawLanes(height, ratio);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.drawImage(this.lanes, 0, 0);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.save();
    context.beginPath();
    context.rect(NAMES - 1, 0, this.width - NAMES, height);
    context.clip();
    const x = this.#x(app.place + 0.5);
    context.fillStyle = "#ffffff";
    context.fillRect(x - 0.75, 12, 1.5, height);
    context.beginPath();
    context.moveTo(x - 6, 5);
    context.lineTo(x + 6, 5);
    context.lineTo(x, 15);
    context.fill();
    context.restore();
  }

  /**
   * The lanes on a canvas of their own, drawn when they change and not with each move of the pointer.
   * @param {number} height
   * @param {number} ratio
   */
  #drawLanes(height, ratio) {
    const { app, canvas, lanes } = this;
    const { names } = app.labels;
    const key = [app.labels.state.revision, app.selected, this.first, this.zoom, canvas.width, canvas.height, names.length, app.labels.heard, JSON.stringify(app.range)].join(" ");
    if (key === this.drawn && app.labels.lanes === this.drawnLanes) return;
    this.drawn = key;
    this.drawnLanes = app.labels.lanes;
    lanes.width = canvas.width;
    lanes.height = canvas.height;
    const context = lanes.getContext("2d");
    if (!context) return;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.#drawRuler(context, height);
    names.forEach((name, index) => this.#drawLane(context, name, index));
    if (names.length > 0) return;
    context.fillStyle = "#9aa7b2";
    context.font = "12px system-ui, sans-serif";
    context.fillText("No points yet: click in the frame on what you want to follow, or press Suggest; then Track.", NAMES + 8, RULER + LANE / 2);
  }

  #followPlayhead() {
    const shown = this.#shown;
    const { place } = this.app;
    if (this.zoom > 1 && (place < this.first || place >= this.first + shown)) this.first = place - shown / 2;
    this.#keepInSight();
  }

  /** Scrolls to the lane of a point that was just chosen. */
  #followChosen() {
    const { app, box } = this;
    const index = app.labels.indexOf(app.selected);
    if (this.inSight === app.selected || index < 0) return;
    this.inSight = app.selected;
    const top = RULER + index * LANE;
    // The first lane brings the ruler along.
    if (top - RULER < box.scrollTop) box.scrollTop = index === 0 ? 0 : top;
    else if (top + LANE > box.scrollTop + box.clientHeight) box.scrollTop = top + LANE - box.clientHeight;
  }

  #describe() {
    const { app, canvas } = this;
    const seen = app.labels.names.filter((name) => app.labels.at(name, app.frame));
    const points = seen.length === 0 ? "no point labelled" : `labelled: ${seen.join(", ")}`;
    canvas.setAttribute("aria-valuemin", String(app.frames[0].frame));
    canvas.setAttribute("aria-valuemax", String(app.frames[app.frames.length - 1].frame));
    canvas.setAttribute("aria-valuenow", String(app.frame));
    canvas.setAttribute("aria-valuetext", `frame ${app.frame}, ${app.place + 1} of ${app.frames.length}, ${points}`);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {number} height
   */
  #drawRuler(context, height) {
    const { frames } = this.app;
    const seconds = frames[frames.length - 1].time_s - frames[0].time_s;
    const pixelsASecond = seconds > 0 ? (this.#frameWidth * (frames.length - 1)) / seconds : 0;
    const step = STEPS_S.find((each) => each * pixelsASecond >= 64) ?? 7200;
    context.font = "11px system-ui, sans-serif";
    context.textBaseline = "middle";
    let next = 0;
    let written = 0;
    frames.forEach(({ time_s }, place) => {
      if (time_s + 1e-6 < next) return;
      const x = this.#x(place + 0.5);
      next = (Math.floor(time_s / step + 1e-6) + 1) * step;
      if (x < NAMES || x > this.width - 4) return;
      context.fillStyle = "#2c343b";
      context.fillRect(Math.round(x), RULER - 4, 1, height);
      context.fillStyle = "#9aa7b2";
      const text = `${Number(time_s.toFixed(step < 1 ? 1 : 0))} s`;
      const wide = context.measureText(text).width;
      const left = Math.min(x + 4, this.width - wide - 4);
      // Where frames are missing their times come close to each other.
      if (left < written) return;
      context.fillText(text, left, 9);
      written = left + wide + 8;
    });
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {string} name
   * @param {number} index
   */
  #drawLane(context, name, index) {
    const { app } = this;
    const top = RULER + index * LANE;
    const colour = pointColour(index);
    if (name === app.selected) {
      context.fillStyle = "#252d34";
      context.fillRect(0, top, this.width, LANE);
    }
    context.fillStyle = "#1b2127";
    context.fillRect(NAMES, top + 3, this.width - NAMES - 8, LANE - 6);
    context.fillStyle = colour;
    context.beginPath();
    context.arc(14, top + LANE / 2, 5, 0, 2 * Math.PI);
    context.fill();
    context.fillStyle = "#e6ebef";
    context.font = `${name === app.selected ? 700 : 500} 12px system-ui, sans-serif`;
    context.textBaseline = "middle";
    context.fillText(name, 26, top + LANE / 2 + 1, NAMES - 32);
    context.save();
    context.beginPath();
    context.rect(NAMES, top, this.width - NAMES - 8, LANE);
    context.clip();
    const wide = this.#frameWidth;
    this.#drawEmpty(context, name, top);
    for (const observation of app.labels.lanes.get(name)?.values() ?? []) {
      const place = app.labels.places.get(observation.frame);
      if (place === undefined) continue;
      const x = this.#x(place);
      if (x + wide < NAMES || x > this.width) continue;
      this.#drawObservation(context, observation, x, top, Math.max(1, wide), colour);
      if (place + 1 < app.frames.length && app.labels.lostAt(name, place + 1)) this.#drawLoss(context, x + wide, top, wide);
    }
    context.restore();
  }

  /**
   * Stretches in which there is nothing to label, as a person says; and the first end of a range that is to be deleted.
   * @param {CanvasRenderingContext2D} context
   * @param {string} name
   * @param {number} top
   */
  #drawEmpty(context, name, top) {
    const { app } = this;
    const middle = top + LANE / 2;
    context.strokeStyle = "#7d8a95";
    context.lineWidth = 2;
    context.setLineDash([4, 4]);
    for (const [from, to] of app.labels.empty.get(name) ?? []) {
      context.beginPath();
      context.moveTo(this.#x(app.labels.placeNear(from)) + 1, middle);
      context.lineTo(this.#x(app.labels.placeNear(to) + 1) - 1, middle);
      context.stroke();
    }
    context.setLineDash([]);
    if (app.range?.name !== name) return;
    context.fillStyle = DOUBT;
    context.fillRect(this.#x(app.labels.placeNear(app.range.frame) + 0.5) - 1.5, top + 1, 3, LANE - 2);
  }

  /**
   * A cross where tracking lost the point.
   * @param {CanvasRenderingContext2D} context
   * @param {number} x
   * @param {number} top
   * @param {number} wide
   */
  #drawLoss(context, x, top, wide) {
    const middle = x + Math.max(5, wide / 2);
    context.strokeStyle = DOUBT;
    context.lineWidth = 2;
    context.beginPath();
    for (const slope of [-1, 1]) {
      context.moveTo(middle - 4, top + LANE / 2 - 4 * slope);
      context.lineTo(middle + 4, top + LANE / 2 + 4 * slope);
    }
    context.stroke();
  }

  /**
   * By hand: full height with a white foot. Automatic: as high as the tracker is sure. Detected: full height,
   * interpolated: a thin line.
   * @param {CanvasRenderingContext2D} context
   * @param {Observation} observation
   * @param {number} x
   * @param {number} top
   * @param {number} wide
   * @param {string} colour
   */
  #drawObservation(context, observation, x, top, wide, colour) {
    const { source, confidence, occluded, keyframe } = observation;
    const full = LANE - 6;
    const bottom = top + LANE - 3;
    const high = source === "interpolated" ? 3 : source === "auto" ? Math.max(3, full * (confidence ?? 1)) : full;
    const gap = wide > 3 ? 0.5 : 0;
    context.globalAlpha = occluded ? 0.35 : source === "manual" ? 1 : 0.62;
    context.fillStyle = colour;
    context.fillRect(x + gap, bottom - high, wide - gap, high);
    context.globalAlpha = 1;
    if (source === "manual") {
      context.fillStyle = "#ffffff";
      context.fillRect(x + gap, bottom - 3, Math.max(2, wide - gap), 3);
    }
    if (this.app.labels.doubtful(observation)) {
      context.fillStyle = DOUBT;
      context.fillRect(x, top + 1, Math.max(2, wide), 4);
    }
    if (keyframe) {
      const middle = x + wide / 2;
      context.fillStyle = "#ffffff";
      context.strokeStyle = "#000000";
      context.lineWidth = 1;
      context.beginPath();
      context.moveTo(middle, top + 4);
      context.lineTo(middle + 5, top + LANE / 2);
      context.lineTo(middle, top + LANE - 4);
      context.lineTo(middle - 5, top + LANE / 2);
      context.closePath();
      context.fill();
      context.stroke();
    }
  }
}
