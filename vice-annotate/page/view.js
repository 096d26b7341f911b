// Where an image pixel lies on the screen. A pixel has its centre at integers, so that the image's
// top left corner is (-0.5, -0.5).

/** @import {Pixel} from "./types.js" */

const LARGEST_SCALE = 64;

export class View {
  constructor() {
    /** Screen pixels (CSS) of one image pixel. */
    this.scale = 1;
    /** Screen place of the image's top left corner. */
    this.left = 0;
    this.top = 0;
    this.imageWidth = 1;
    this.imageHeight = 1;
    this.width = 1;
    this.height = 1;
    /** The whole image is shown, and stays so when the window changes its size. */
    this.fitted = true;
  }

  /**
   * @param {number} width of the window on the image, CSS pixels
   * @param {number} height
   */
  resize(width, height) {
    this.width = width;
    this.height = height;
    if (this.fitted) this.fit();
    else this.#keepInSight();
  }

  /**
   * @param {number} width of the image
   * @param {number} height
   */
  setImage(width, height) {
    this.imageWidth = width;
    this.imageHeight = height;
    this.fit();
  }

  get #fittingScale() {
    return Math.min(this.width / this.imageWidth, this.height / this.imageHeight);
  }

  fit() {
    this.scale = this.#fittingScale;
    this.left = (this.width - this.scale * this.imageWidth) / 2;
    this.top = (this.height - this.scale * this.imageHeight) / 2;
    this.fitted = true;
  }

  /**
   * What lies under (x, y) stays there.
   * @param {number} factor
   * @param {number} x CSS pixels
   * @param {number} y
   */
  zoomAt(factor, x, y) {
    const smallest = Math.min(1, this.#fittingScale);
    const scale = Math.min(LARGEST_SCALE, Math.max(smallest, this.scale * factor));
    if (factor < 1 && scale <= this.#fittingScale) return this.fit();
    this.left = x - ((x - this.left) * scale) / this.scale;
    this.top = y - ((y - this.top) * scale) / this.scale;
    this.scale = scale;
    this.fitted = false;
    this.#keepInSight();
  }

  /**
   * @param {number} dx CSS pixels
   * @param {number} dy
   */
  pan(dx, dy) {
    this.left += dx;
    this.top += dy;
    this.fitted = false;
    this.#keepInSight();
  }

  /**
   * Moves the image so that a pixel is well inside the window.
   * @param {Pixel} pixel
   * @param {boolean} always to the middle, even where it is inside already
   */
  reveal(pixel, always = false) {
    const { x, y } = this.toScreen(pixel);
    const margin = Math.min(80, this.width / 4, this.height / 4);
    const inside = x > margin && y > margin && x < this.width - margin && y < this.height - margin;
    if (this.fitted || (inside && !always)) return;
    this.pan(this.width / 2 - x, this.height / 2 - y);
  }

  #keepInSight() {
    const wide = this.scale * this.imageWidth;
    const high = this.scale * this.imageHeight;
    const slackX = Math.min(wide, this.width) * 0.5;
    const slackY = Math.min(high, this.height) * 0.5;
    this.left = Math.min(this.width - slackX, Math.max(slackX - wide, this.left));
    this.top = Math.min(this.height - slackY, Math.max(slackY - high, this.top));
  }

  /**
   * @param {Pixel} pixel
   * @returns {{x: number, y: number}} CSS pixels
   */
  toScreen(pixel) {
    return { x: this.left + (pixel.u + 0.5) * this.scale, y: this.top + (pixel.v + 0.5) * this.scale };
  }

  /**
   * @param {number} x CSS pixels
   * @param {number} y
   * @returns {Pixel}
   */
  toImage(x, y) {
    return { u: (x - this.left) / this.scale - 0.5, v: (y - this.top) / this.scale - 0.5 };
  }

  /**
   * @param {Pixel} pixel
   * @returns {boolean} whether it lies on the image
   */
  holds(pixel) {
    return pixel.u >= -0.5 && pixel.v >= -0.5 && pixel.u <= this.imageWidth - 0.5 && pixel.v <= this.imageHeight - 0.5;
  }
}
