// How the image looks and what the page does by itself: switches that this browser remembers. And what it says by voice.

/** @import {App} from "./app.js" */

import { byId, setText } from "./dom.js";

/** @param {App} app */
export function joinSwitches(app) {
  const brightness = byId("brightness", HTMLInputElement);
  const contrast = byId("contrast", HTMLInputElement);
  const retrack = byId("retrack", HTMLInputElement);
  const dots = byId("show-dots", HTMLInputElement);
  const { switches } = app;
  brightness.addEventListener("input", () => {
    switches.brightness = brightness.valueAsNumber;
    app.storeSwitches();
  });
  contrast.addEventListener("input", () => {
    switches.contrast = contrast.valueAsNumber;
    app.storeSwitches();
  });
  retrack.addEventListener("change", () => {
    switches.retrack = retrack.checked;
    app.storeSwitches();
  });
  dots.addEventListener("change", () => {
    switches.dots = dots.checked;
    app.storeSwitches();
  });
  byId("reset-image", HTMLButtonElement).addEventListener("click", () => {
    Object.assign(switches, { brightness: 100, contrast: 100, invert: false });
    app.storeSwitches();
  });
  app.listeners.push(() => {
    brightness.value = String(switches.brightness);
    contrast.value = String(switches.contrast);
    retrack.checked = switches.retrack;
    dots.checked = switches.dots;
    const filter = `brightness(${switches.brightness}%) contrast(${switches.contrast}%) invert(${switches.invert ? 1 : 0})`;
    const plain = switches.brightness === 100 && switches.contrast === 100 && !switches.invert;
    for (const id of ["image", "loupe-image"]) byId(id, HTMLCanvasElement).style.filter = plain ? "" : filter;
    byId("invert", HTMLElement).setAttribute("aria-pressed", String(switches.invert));
    byId("loupe-button", HTMLElement).setAttribute("aria-pressed", String(switches.loupe));
    byId("follow", HTMLElement).setAttribute("aria-pressed", String(switches.follow));
  });
}

/** Says by voice where the chosen point or the cursor is, when it rests. @param {App} app */
export function speak(app) {
  const spoken = byId("spoken", HTMLElement);
  let timer = 0;
  app.listeners.push(() => {
    window.clearTimeout(timer);
    timer = window.setTimeout(() => {
      const at = app.cursor ?? app.pixel;
      const what = app.cursor ? "cursor" : `point ${app.selected}`;
      const where = at ? `at ${at.u.toFixed(1)}, ${at.v.toFixed(1)}` : "not labelled here";
      setText(spoken, `Frame ${app.frame}, ${what} ${where}`);
    }, 500);
  });
}
