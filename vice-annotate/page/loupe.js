// A magnifier in the corner of the viewer, away from what it looks at.

/** @import {App} from "./app.js" */
/** @import {Pixel} from "./types.js" */

import { crossPath } from "./overlay.js";
import { pointColour } from "./palette.js";

const SIZE = 184;
/** Screen pixels of an image pixel; less than the view has would be no help. */
const MAGNIFICATION = 10;

export class Loupe {
  /**
   * @param {HTMLElement} box
   * @param {HTMLCanvasElement} image its pixels get the viewer's brightness, contrast and inversion
   * @param {HTMLCanvasElement} marks
   * @param {HTMLElement} readout
   */
  constructor(box, image, marks, readout) {
    this.box = box;
    this.image = image;
    this.marks = marks;
    this.readout = readout;
  }

  /** @param {App} app */
  draw(app) {
    const at = app.attention;
    const bitmap = app.images.peek(app.frame)?.bitmap ?? null;
    this.box.hidden = !app.switches.loupe || !at || !bitmap;
    if (!at || !bitmap || this.box.hidden) return;
    const ratio = window.devicePixelRatio || 1;
    const pixels = Math.round(SIZE * ratio);
    for (const canvas of [this.image, this.marks]) {
      if (canvas.width !== pixels) canvas.width = canvas.height = pixels;
    }
    const { view } = app.viewer;
    const scale = Math.max(MAGNIFICATION, 2 * view.scale);
    const across = SIZE / scale;
    this.#drawImage(bitmap, at, across, pixels);
    this.#drawMarks(app, at, scale, ratio);
    this.readout.textContent = `${at.u.toFixed(1)}, ${at.v.toFixed(1)}`;
    const { x, y } = view.toScreen(at);
    this.box.classList.toggle("left", x > view.width - SIZE - 60 && y < SIZE + 70);
  }

  /**
   * @param {ImageBitmap} bitmap
   * @param {Pixel} at
   * @param {number} across image pixels in the loupe
   * @param {number} pixels of the loupe's canvas
   */
  #drawImage(bitmap, at, across, pixels) {
    const context = this.image.getContext("2d");
    if (!context) return;
    context.imageSmoothingEnabled = false;
    context.clearRect(0, 0, pixels, pixels);
    context.drawImage(bitmap, at.u + 0.5 - across / 2, at.v + 0.5 - across / 2, across, across, 0, 0, pixels, pixels);
  }

  /**
   * @param {App} app
   * @param {Pixel} at
   * @param {number} scale
   * @param {number} ratio
   */
  #drawMarks(app, at, scale, ratio) {
    const context = this.marks.getContext("2d");
    if (!context) return;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, SIZE, SIZE);
    const half = SIZE / 2;
    app.labels.names.forEach((name, index) => {
      const pixel = app.labels.pixel(name, app.frame);
      if (!pixel) return;
      const x = half + (pixel.u - at.u) * scale;
      const y = half + (pixel.v - at.v) * scale;
      if (x < -20 || y < -20 || x > SIZE + 20 || y > SIZE + 20) return;
      context.strokeStyle = pointColour(index);
      context.lineWidth = 2;
      context.stroke(crossPath(x, y, 4, 14));
    });
    const hair = crossPath(half, half, 7, half);
    context.strokeStyle = "rgba(0, 0, 0, 0.6)";
    context.lineWidth = 2.5;
    context.stroke(hair);
    context.strokeStyle = "rgba(255, 255, 255, 0.85)";
    context.lineWidth = 1;
    context.stroke(hair);
  }
}
