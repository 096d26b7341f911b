// Labels a flight as a person would who follows what the page offers, and counts the acts: a key each. Waiting for the
// tracker is no act.
//
// `npm run hands` measures it on a rendered flight of 30 s (VICE_BIN names the program; `npm run hands -- SECONDS SEED`). What
// the page says alone decides: where it suggests a place that is taken, what it doubts gets a new place, where it has nothing to
// suggest the gap is said to have nothing to label.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

import { browser, flight, scratch, Server, vice, Window } from "./harness.js";

/** @import {State} from "../../vice-annotate/page/types.js" */

const PAGE_MS = 10_000;
const TRACK_MS = 300_000;

/**
 * @param {Window} window
 * @param {number} most acts
 * @returns {Promise<{acts: number, keys: Record<string, number>}>} when the page says that every lane is full, none doubtful
 */
export async function labelByHand(window, most) {
  const { page } = window;
  /** @type {Record<string, number>} */
  const keys = {};
  let acts = 0;
  const idle = () =>
    page.waitForFunction(() => document.getElementById("job")?.hidden && document.getElementById("saved")?.textContent === "All saved", null, { timeout: TRACK_MS });
  /** @param {string} key */
  const act = async (key) => {
    await idle();
    acts += 1;
    keys[key] = (keys[key] ?? 0) + 1;
    assert.ok(acts <= most, `more than ${most} acts: ${JSON.stringify(keys)}`);
    await window.press(key);
  };
  const suggested = () => page.locator("#take-all").waitFor({ timeout: PAGE_MS }).then(() => true, () => false);
  const done = page.locator("#notes").getByText("Done: every lane is full, none doubtful.");
  const task = page.locator("#banners [data-id=task]");
  const busy = page.locator("#notes").getByText("is under way; nothing else needs you");
  /** @returns {Promise<"found" | "under way">} what the page says to the key */
  const answer = async () => {
    await done.or(task).or(busy).first().waitFor({ timeout: PAGE_MS });
    if (await done.isVisible() || await task.isVisible()) return "found";
    return "under way";
  };
  await act("s");
  assert.ok(await suggested(), "the page suggests points");
  await act("Shift+S");
  await act("Shift+B");
  for (;;) {
    await act("n");
    // Who is told that the tracker still works waits, and asks once more: no act.
    while (await answer() === "under way") {
      await idle();
      await busy.waitFor({ state: "hidden", timeout: PAGE_MS });
      await window.press("n");
    }
    if (await done.isVisible()) return { acts, keys };
    const text = await task.innerText();
    if (text.includes("has not been tracked")) await act("t");
    else {
      if (text.includes("is doubtful")) await act("r");
      await act(await suggested() ? "Shift+S" : "Shift+X");
    }
  }
}

/**
 * How far the observations are from where the true poses have their key frame's point.
 * @param {string} dataset
 * @param {string} labels
 * @returns {number[]} pixels, ascending
 */
export function distances(dataset, labels) {
  const out = join(scratch(), "truth.json");
  const words = ["evaluate", dataset, "--labels", labels, "--estimate", "ground-truth", "--reference", "none", "--depth", "zcam", "--observations", "all", "--json", out];
  const { status, stderr } = vice(words);
  assert.ok(status === 0 || status === 3, stderr);
  /** @type {{pixel: {samples: {error_px: number}[]}[]}} */
  const { pixel } = JSON.parse(readFileSync(out, "utf8"));
  return pixel[0].samples.map(({ error_px }) => error_px).sort((one, other) => one - other);
}

/**
 * @param {State} state
 * @returns {number} share of the labels that there are
 */
export function share({ points, frames }) {
  const chosen = new Set(frames.map(({ frame }) => frame));
  const seen = points.flatMap(({ observations }) => observations.filter(({ frame }) => chosen.has(frame)));
  return seen.length / (frames.length * points.length);
}

/**
 * @param {number} seconds
 * @param {number} seed
 */
async function measure(seconds, seed) {
  const dataset = flight(seconds, 20, seed);
  const labels = join(scratch(), "hands.json");
  const server = await Server.start(dataset, labels, ["--fps", "10", "--depth", "zcam"]);
  const chromium = await browser();
  const window = await Window.open(chromium, server);
  const began = Date.now();
  const { acts, keys } = await labelByHand(window, 400);
  const took_s = (Date.now() - began) / 1000;
  await window.screenshot("hands");
  const state = await server.state();
  await window.close();
  await chromium.close();
  await server.end();
  const far = distances(dataset, labels);
  const within = far.filter((each) => each <= 1).length / far.length;
  console.log(`seed ${seed}, ${seconds} s, ${state.points.length} points, ${state.frames.length} frames: ${acts} acts ${JSON.stringify(keys)}, ` +
    `${took_s.toFixed(0)} s with waiting; ${(100 * share(state)).toFixed(1)} % labelled; ` +
    `${(100 * within).toFixed(1)} % of ${far.length} within 1 px, median ${far[Math.floor(far.length / 2)].toFixed(2)} px`);
}

if (process.argv[1] && import.meta.url === pathToFileURL(process.argv[1]).href) {
  const [seconds = "30", seed = "1"] = process.argv.slice(2);
  await measure(Number(seconds), Number(seed));
  process.exit(0);
}
