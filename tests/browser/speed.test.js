// How long a step to the next frame takes, from the key to the picture.

import assert from "node:assert/strict";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { browser, film, scratch, Server, Window } from "./harness.js";

/** @import {Browser} from "playwright-core" */

/** Time between two steps of a person who looks at each frame for a moment. */
const LOOK_MS = 250;

/** @type {Browser} */
let chromium;
before(async () => {
  chromium = await browser();
});
after(() => chromium?.close());

for (const { width, height, frames, limitMs } of [
  { width: 752, height: 480, frames: 60, limitMs: 50 },
  { width: 3840, height: 2160, frames: 24, limitMs: 150 },
]) {
  test(`a step takes less than ${limitMs} ms at ${width} x ${height}`, async (context) => {
    const server = await Server.start(film(width, height, frames), join(scratch(), "labels.json"));
    const window = await Window.open(chromium, server);
    const tookMs = await window.page.evaluate(async ([steps, restMs]) => {
      const image = /** @type {HTMLCanvasElement} */ (document.getElementById("image"));
      const drawn = () => new Promise((resolve) => requestAnimationFrame(resolve));
      const times = [];
      for (let frame = 1; frame <= steps; frame += 1) {
        await new Promise((resolve) => setTimeout(resolve, restMs));
        const began = performance.now();
        image.ownerDocument.body.dispatchEvent(new KeyboardEvent("keydown", { key: "e", bubbles: true }));
        while (image.dataset.frame !== String(frame)) await drawn();
        // The one after the drawing begins when the picture has been handed over.
        await drawn();
        times.push(performance.now() - began);
      }
      return times.sort((one, other) => one - other);
    }, [frames - 1, LOOK_MS]);
    const median = tookMs[Math.floor(tookMs.length / 2)];
    const most = tookMs[Math.floor(tookMs.length * 0.9)];
    context.diagnostic(`${width} x ${height}: median ${median.toFixed(1)} ms, 90 % under ${most.toFixed(1)} ms, longest ${tookMs.at(-1)?.toFixed(1)} ms`);
    await window.screenshot(`speed-${width}x${height}`);
    await window.close();
    await server.end();
    assert.ok(most < limitMs, `${most} ms`);
  });
}
