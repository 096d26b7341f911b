// A second person looks again: one sampled observation after the other is placed by who does not see where it was. The server
// tells where that is once the place is on its disk.

/** @import {ReviewState, Pixel, Sample, Summary} from "./types.js" */

import { getReview, postVerdict, ServerError } from "./api.js";
import { byId, setText } from "./dom.js";
import { Images } from "./images.js";
import { Notices } from "./notices.js";
import { crossPath } from "./overlay.js";
import { LABEL_BLUE } from "./palette.js";
import { View } from "./view.js";

const IMAGE_BUDGET_BYTES = 256 * 1024 * 1024;
/** Image pixels around the point that the key frame shows. */
const PATCH = 50;
/** CSS pixels that are no click any more. */
const DRAG = 4;

const notices = new Notices(byId("notes", HTMLElement), byId("banners", HTMLElement));

class Review {
  /** @param {ReviewState} state */
  constructor(state) {
    this.state = state;
    this.images = new Images(IMAGE_BUDGET_BYTES);
    this.view = new View();
    this.view.setImage(state.width, state.height);
    this.at = -1;
    this.busy = false;
    /** @type {{x: number, y: number, moved: boolean} | null} */
    this.press = null;
    this.box = byId("viewer", HTMLElement);
    this.image = byId("image", HTMLCanvasElement);
    this.marks = byId("marks", HTMLCanvasElement);
    this.key = byId("key", HTMLCanvasElement);
  }

  /** @returns {Sample} */
  get sample() {
    return this.state.samples[this.at];
  }

  start() {
    const { state } = this;
    setText(byId("dataset", HTMLElement), state.dataset);
    setText(byId("camera", HTMLElement), `${state.camera} · ${state.width} × ${state.height}`);
    setText(byId("labels-file", HTMLElement), state.labels_file);
    setText(byId("review-file", HTMLElement), `Kept in ${state.review_file}`);
    if (state.outdated > 0) notices.banner("outdated", "warning", `${state.outdated} earlier verdicts are on labels that have changed since: they do not count.`);
    byId("next", HTMLButtonElement).addEventListener("click", () => this.next());
    byId("untold", HTMLButtonElement).addEventListener("click", () => this.say(null));
    document.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      if (event.key === "n") this.next();
      if (event.key === "x") this.say(null);
    });
    this.#listen();
    new ResizeObserver(() => this.#resize()).observe(this.box);
    this.next();
  }

  /** The next one that has not been seen; where all have, that is said. */
  next() {
    const { samples } = this.state;
    const open = samples.findIndex(({ verdict }, at) => !verdict && at > this.at);
    const first = open < 0 ? samples.findIndex(({ verdict }) => !verdict) : open;
    this.at = first >= 0 ? first : Math.max(0, this.at);
    if (first >= 0) this.view.fit();
    this.show();
  }

  async show() {
    const { sample } = this;
    const { frame, keyframe } = sample;
    this.draw();
    await Promise.all([this.images.get(frame), this.images.get(keyframe.frame)]);
    if (this.sample === sample) this.draw();
  }

  /** @param {Pixel | null} pixel */
  async say(pixel) {
    const { sample, at } = this;
    if (this.busy || sample.verdict) return;
    this.busy = true;
    setText(byId("saved", HTMLElement), "Saving…");
    try {
      const { verdict, summary } = await postVerdict(at, pixel);
      sample.verdict = verdict;
      this.state.summary = summary;
    } catch (error) {
      if (!(error instanceof ServerError)) throw error;
      notices.tell("error", error.hint ? `${error.message} — ${error.hint}` : error.message);
    } finally {
      this.busy = false;
      this.draw();
    }
  }

  #listen() {
    const { marks, view } = this;
    /** @param {MouseEvent} event */
    const place = (event) => {
      const box = marks.getBoundingClientRect();
      return { x: event.clientX - box.left, y: event.clientY - box.top };
    };
    marks.addEventListener("wheel", (event) => {
      event.preventDefault();
      const { x, y } = place(event);
      view.zoomAt(Math.exp(-Math.max(-240, Math.min(240, event.deltaY)) * 0.0022), x, y);
      this.draw();
    }, { passive: false });
    marks.addEventListener("pointerdown", (event) => {
      marks.setPointerCapture(event.pointerId);
      this.press = { ...place(event), moved: false };
    });
    marks.addEventListener("pointermove", (event) => {
      const { x, y } = place(event);
      const under = view.toImage(x, y);
      setText(byId("readout", HTMLElement), view.holds(under) ? `${under.u.toFixed(1)}, ${under.v.toFixed(1)}` : "");
      const { press } = this;
      if (!press || (!press.moved && Math.hypot(x - press.x, y - press.y) < DRAG)) return;
      view.pan(x - press.x, y - press.y);
      this.press = { x, y, moved: true };
      this.draw();
    });
    marks.addEventListener("pointerup", () => {
      const { press } = this;
      this.press = null;
      if (!press || press.moved) return;
      const under = view.toImage(press.x, press.y);
      if (view.holds(under)) this.say(under);
    });
  }

  #resize() {
    const { clientWidth, clientHeight } = this.box;
    if (clientWidth === 0 || clientHeight === 0) return;
    const ratio = window.devicePixelRatio || 1;
    for (const canvas of [this.image, this.marks]) {
      canvas.width = Math.round(clientWidth * ratio);
      canvas.height = Math.round(clientHeight * ratio);
    }
    this.view.resize(clientWidth, clientHeight);
    this.draw();
  }

  draw() {
    this.#drawFrame();
    this.#drawMarks();
    this.#drawKey();
    this.#drawText();
  }

  #drawFrame() {
    const { view, image } = this;
    const context = image.getContext("2d", { alpha: false });
    if (!context) return;
    const picture = this.images.peek(this.sample.frame);
    const ratio = image.width / Math.max(1, view.width);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = "#101316";
    context.fillRect(0, 0, image.width, image.height);
    byId("broken", HTMLElement).hidden = !picture || picture.bitmap !== null;
    if (picture && !picture.bitmap) setText(byId("broken-text", HTMLElement), picture.error);
    image.dataset.frame = picture ? String(this.sample.frame) : "";
    if (!picture?.bitmap) return;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.imageSmoothingEnabled = view.scale < 3;
    context.drawImage(picture.bitmap, view.left, view.top, view.scale * picture.bitmap.width, view.scale * picture.bitmap.height);
  }

  #drawMarks() {
    const { view, marks } = this;
    const context = marks.getContext("2d");
    if (!context) return;
    const ratio = marks.width / Math.max(1, view.width);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, view.width, view.height);
    const { verdict } = this.sample;
    if (!verdict) return;
    mark(context, view.toScreen(verdict.stored), LABEL_BLUE);
    if (verdict.reviewed) mark(context, view.toScreen(verdict.reviewed), "#ffffff");
  }

  #drawKey() {
    const { key } = this;
    const { frame, u, v } = this.sample.keyframe;
    const context = key.getContext("2d");
    if (!context) return;
    context.clearRect(0, 0, key.width, key.height);
    const bitmap = this.images.peek(frame)?.bitmap;
    if (!bitmap) return;
    context.imageSmoothingEnabled = false;
    context.drawImage(bitmap, u + 0.5 - PATCH / 2, v + 0.5 - PATCH / 2, PATCH, PATCH, 0, 0, key.width, key.height);
    mark(context, { x: key.width / 2, y: key.height / 2 }, LABEL_BLUE);
  }

  #drawText() {
    const { state, sample } = this;
    const { verdict } = sample;
    const left = state.samples.filter((each) => !each.verdict).length;
    const asked = `Point ${sample.point} in frame ${sample.frame}, ${this.at + 1} of ${state.samples.length}.`;
    const far = verdict?.distance_px ?? null;
    const told = far === null ? "It could not be told." : `${far.toFixed(2)} px from the label (blue).`;
    const done = left === 0 ? " All are reviewed." : "";
    setText(byId("asked", HTMLElement), verdict ? `${asked} ${told}${done}` : `${asked} Click where the point of the key frame is.`);
    byId("untold", HTMLButtonElement).disabled = verdict !== null;
    byId("next", HTMLButtonElement).disabled = left === 0;
    setText(byId("so-far", HTMLElement), summaryText(state.summary));
    setText(byId("saved", HTMLElement), this.busy ? "Saving…" : "All saved");
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {{x: number, y: number}} at
 * @param {string} colour
 */
function mark(context, { x, y }, colour) {
  const path = crossPath(x, y, 3, 13);
  context.strokeStyle = "#000000";
  context.lineWidth = 4;
  context.stroke(path);
  context.strokeStyle = colour;
  context.lineWidth = 2;
  context.stroke(path);
}

/** @param {Summary} summary @returns {string} */
function summaryText({ samples, placed, untold, median_px, p95_px, largest_px }) {
  const parts = [`${placed + untold} of ${samples} reviewed`];
  if (median_px !== null && p95_px !== null && largest_px !== null) {
    parts.push(`median ${median_px.toFixed(2)} px`, `95 % within ${p95_px.toFixed(2)} px`, `largest ${largest_px.toFixed(2)} px`);
  }
  if (untold > 0) parts.push(`${untold} could not be told`);
  return parts.join(", ");
}

getReview().then((state) => {
  document.title = `${state.dataset} · VICE review`;
  new Review(state).start();
}).catch((error) => {
  notices.banner("open", "error", `The review cannot be opened: ${error.message}${error.hint ? ` — ${error.hint}` : ""}`);
  setText(byId("saved", HTMLElement), "Not open");
  if (!(error instanceof ServerError)) throw error;
});
