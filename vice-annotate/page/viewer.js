// The frame on its canvas, and what a pointer does there: zoom, pan, place, drag. The image lies on a canvas of its own,
// which the browser brightens and inverts; marks lie on another above it.

/** @import {App} from "./app.js" */
/** @import {Pixel} from "./types.js" */

import { drawOverlay } from "./overlay.js";
import { View } from "./view.js";

/** CSS pixels: how near counts as on a mark, and how far is a drag. */
const REACH = 14;
const DRAG = 4;
/** Part of the pointer's way that a mark goes while Shift is held. */
const SLOWLY = 0.1;
/** From this scale on pixels are shown as squares. */
const CRISP_FROM = 3;

/**
 * @typedef {object} Doings
 * @property {(pixel: Pixel) => void} place
 * @property {(suggestion: number) => void} takeSuggestion
 * @property {(name: string) => void} pick
 * @property {(name: string, pixel: Pixel, done: boolean) => void} drag
 */

/** @typedef {{kind: "point", name: string} | {kind: "suggestion", index: number} | {kind: "image"}} Grip */

export class Viewer {
  /**
   * @param {App} app
   * @param {{box: HTMLElement, image: HTMLCanvasElement, marks: HTMLCanvasElement}} elements
   * @param {Doings} doings
   */
  constructor(app, elements, doings) {
    this.app = app;
    this.box = elements.box;
    this.image = elements.image;
    this.marks = elements.marks;
    this.doings = doings;
    this.view = new View();
    this.view.setImage(app.labels.state.width, app.labels.state.height);
    /** What the image canvas shows, to draw it only on change. */
    this.drawn = "";
    /** @type {ImageBitmap | null} */
    this.drawnBitmap = null;
    /** @type {{grip: Grip, x: number, y: number, startX: number, startY: number, moved: boolean, at: Pixel | null} | null} */
    this.press = null;
    new ResizeObserver(() => this.#resize()).observe(this.box);
    this.#listen();
  }

  #resize() {
    const { clientWidth, clientHeight } = this.box;
    if (clientWidth === 0 || clientHeight === 0) return;
    const ratio = window.devicePixelRatio || 1;
    for (const canvas of [this.image, this.marks]) {
      canvas.width = Math.round(clientWidth * ratio);
      canvas.height = Math.round(clientHeight * ratio);
    }
    this.drawn = "";
    this.view.resize(clientWidth, clientHeight);
    this.app.changed();
  }

  draw() {
    this.#drawImage();
    const context = this.marks.getContext("2d");
    if (!context) return;
    const ratio = this.marks.width / Math.max(1, this.view.width);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.view.width, this.view.height);
    drawOverlay(context, this.app, this.view);
  }

  #drawImage() {
    const { app, view } = this;
    const bitmap = app.images.peek(app.frame)?.bitmap ?? null;
    const now = `${app.frame} ${view.scale} ${view.left} ${view.top}`;
    if (now === this.drawn && bitmap === this.drawnBitmap) return;
    this.drawn = now;
    this.drawnBitmap = bitmap;
    const context = this.image.getContext("2d", { alpha: false });
    if (!context) return;
    const ratio = this.image.width / Math.max(1, view.width);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = "#101316";
    context.fillRect(0, 0, this.image.width, this.image.height);
    this.image.dataset.frame = String(app.frame);
    if (!bitmap) return;
    if (bitmap.width !== view.imageWidth || bitmap.height !== view.imageHeight) view.setImage(bitmap.width, bitmap.height);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.imageSmoothingEnabled = view.scale < CRISP_FROM;
    // Only what is in sight: a 4K image zoomed in is mostly outside.
    const first = view.toImage(0, 0);
    const last = view.toImage(view.width, view.height);
    const u = Math.max(0, Math.floor(first.u));
    const v = Math.max(0, Math.floor(first.v));
    const wide = Math.min(bitmap.width, Math.ceil(last.u + 1)) - u;
    const high = Math.min(bitmap.height, Math.ceil(last.v + 1)) - v;
    if (wide <= 0 || high <= 0) return;
    const corner = view.toScreen({ u: u - 0.5, v: v - 0.5 });
    context.drawImage(bitmap, u, v, wide, high, corner.x, corner.y, wide * view.scale, high * view.scale);
  }

  /**
   * @param {number} x
   * @param {number} y
   * @returns {Grip} what a press there takes hold of; the chosen point first
   */
  #gripAt(x, y) {
    const { app, view } = this;
    /** @param {Pixel} pixel */
    const near = (pixel) => {
      const at = view.toScreen(pixel);
      return Math.hypot(at.x - x, at.y - y) < REACH;
    };
    const names = [app.selected, ...app.labels.names.filter((name) => name !== app.selected)];
    for (const name of names) {
      const pixel = app.labels.pixel(name, app.frame);
      if (pixel && near(pixel)) return { kind: "point", name };
    }
    const index = app.suggestions.findIndex(near);
    return index < 0 ? { kind: "image" } : { kind: "suggestion", index };
  }

  /** @param {MouseEvent} event */
  #place(event) {
    const box = this.marks.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  #listen() {
    const { marks, app, view } = this;
    marks.addEventListener("wheel", (event) => {
      event.preventDefault();
      const { x, y } = this.#place(event);
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 30 : 1;
      const delta = Math.max(-240, Math.min(240, event.deltaY * lines));
      view.zoomAt(Math.exp(-delta * 0.0022), x, y);
      app.changed();
    }, { passive: false });
    marks.addEventListener("contextmenu", (event) => event.preventDefault());
    marks.addEventListener("pointerdown", (event) => {
      marks.setPointerCapture(event.pointerId);
      const { x, y } = this.#place(event);
      const grip = event.button === 0 ? this.#gripAt(x, y) : /** @type {Grip} */ ({ kind: "image" });
      const at = grip.kind === "point" ? app.labels.pixel(grip.name, app.frame) : null;
      this.press = { grip, x, y, startX: x, startY: y, moved: false, at };
    });
    marks.addEventListener("pointermove", (event) => this.#move(event));
    marks.addEventListener("pointerup", (event) => this.#release(event));
    marks.addEventListener("pointercancel", () => {
      this.press = null;
      marks.classList.remove("panning");
    });
    marks.addEventListener("pointerleave", () => {
      app.hover = null;
      app.changed();
    });
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const { app, view, press } = this;
    const { x, y } = this.#place(event);
    const under = view.toImage(x, y);
    app.hover = view.holds(under) ? under : null;
    if (!press) {
      this.marks.classList.toggle("grip", this.#gripAt(x, y).kind !== "image");
      return app.changed();
    }
    const dx = x - press.x;
    const dy = y - press.y;
    if (!press.moved && Math.hypot(x - press.startX, y - press.startY) < DRAG) return;
    press.moved = true;
    press.x = x;
    press.y = y;
    if (press.grip.kind === "point" && press.at && app.writable) {
      const part = (event.shiftKey ? SLOWLY : 1) / view.scale;
      press.at = { u: press.at.u + dx * part, v: press.at.v + dy * part };
      app.hover = press.at;
      this.doings.drag(press.grip.name, press.at, false);
    } else {
      this.marks.classList.add("panning");
      view.pan(dx, dy);
    }
    app.changed();
  }

  /** @param {PointerEvent} event */
  #release(event) {
    const { press, doings } = this;
    this.press = null;
    this.marks.classList.remove("panning");
    if (!press) return;
    const { grip } = press;
    if (press.moved) {
      if (grip.kind === "point" && press.at) doings.drag(grip.name, press.at, true);
    } else if (event.button === 0) {
      const under = this.view.toImage(press.startX, press.startY);
      if (grip.kind === "suggestion") doings.takeSuggestion(grip.index);
      else if (grip.kind === "point" && grip.name !== this.app.selected) doings.pick(grip.name);
      else if (this.view.holds(under)) doings.place(under);
    }
  }
}
