// From nothing to full lanes, led by what the page says; and what a person can say of lanes on the way. Then the blind review.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { distances, labelByHand, share } from "./hands.js";
import { browser, flight, observation, scratch, Server, Window } from "./harness.js";

/** @import {Browser} from "playwright-core" */

const SECONDS = 5;
const FPS = 5;
/** A fifth of a protocol's 30 s: what is allowed for that is 100 acts. */
const MOST_ACTS = 25;

const dataset = flight(SECONDS, 10);
const labels = join(scratch(), "guided.json");
const options = ["--fps", String(FPS), "--depth", "zcam"];
/** @type {Browser} */
let chromium;
/** @type {Server} */
let server;
/** @type {Window} */
let window;

before(async () => {
  chromium = await browser();
  server = await Server.start(dataset, labels, options);
  window = await Window.open(chromium, server);
});

after(async () => {
  await chromium?.close();
  await server?.end();
});

test("what the page offers leads to full lanes, none doubtful", async (context) => {
  await window.press("n");
  await window.told("There are no points yet: S suggests some.");
  const { acts, keys } = await labelByHand(window, MOST_ACTS);
  context.diagnostic(`${acts} acts: ${JSON.stringify(keys)}`);
  await window.screenshot("guide-1-full");
  assert.equal(await window.page.locator("#doubtful").innerText(), "every lane full, none doubtful");
  assert.equal(await window.page.locator("#coverage").innerText(), "20 of 20 s, 100 %");
  const state = await server.state();
  assert.equal(state.points.length, 4);
  assert.ok(share(state) === 1 || (state.empty ?? []).length > 0, "nothing is open that nobody spoke of");
  for (const { observations } of state.points) {
    assert.equal(observations[0].source, "auto", "what was taken as one of many is the tracker's");
    assert.equal(observations[0].keyframe, true);
  }
  const far = distances(dataset, labels);
  const within = far.filter((each) => each <= 1).length / far.length;
  context.diagnostic(`${far.length} observations, ${(100 * within).toFixed(1)} % within 1 px`);
  assert.ok(far.length > 80 && within >= 0.95, `${within}`);
});

test("to say that it is right, to cut a range, and to say that there is nothing", async () => {
  const { page } = window;
  await window.press("1");
  await window.goTo(0);
  await window.press("y");
  await server.until("the suggestion is by hand", (state) => observation(state, "1", 0)?.source === "manual");
  await window.goTo(10);
  await window.press("x");
  await window.told("One end of the range is frame 10");
  await window.goTo(16);
  await window.press("x");
  const cut = await server.until("the range is gone", (state) => observation(state, "1", 10) === undefined && observation(state, "1", 16) === undefined);
  assert.ok(observation(cut, "1", 8) && observation(cut, "1", 18));
  await window.goTo(0);
  await window.press("j");
  await window.shows(10);
  await page.locator("#banners [data-id=task]").getByText("frames 10 to 16").waitFor();
  await window.screenshot("guide-2-gap");
  assert.match(await page.locator("#doubtful").innerText(), /^1 gap, none doubtful$/);
  await window.press("Shift+X");
  await window.told("Point 1 has no place in frames 10 to 16");
  await page.waitForFunction(() => document.getElementById("doubtful")?.textContent === "every lane full, none doubtful");
  await window.screenshot("guide-3-nothing-here");
  await window.press("n");
  await window.told("Done: every lane is full, none doubtful.");
  await page.reload();
  await window.shows(0);
  await page.waitForFunction(() => document.getElementById("doubtful")?.textContent === "every lane full, none doubtful");
  await window.press("1", "j");
  await window.told("There is no gap: every lane is full.");
  await window.goTo(12);
  await window.press("Shift+X");
  await window.told("are to be labelled again");
  await page.waitForFunction(() => document.getElementById("doubtful")?.textContent === "1 gap, none doubtful");
});

test("a point has its name before it is placed, and keeps it", async () => {
  const { page } = window;
  await window.press("a", "F2");
  await page.keyboard.type("door");
  await window.press("Enter");
  const { x, y } = await window.place({ u: 300, v: 220 }, await server.state());
  await page.mouse.click(x, y);
  await server.until("the door is there", ({ points }) => points.some(({ name }) => name === "door"));
  await page.mouse.move(5, 5);
  await page.locator("#banners [data-id=task]").getByText("Point door has not been tracked from here yet").waitFor();
  await window.screenshot("guide-4-untracked");
  await page.getByRole("button", { name: "Remove point door" }).click();
  await server.until("the door is gone", ({ points }) => points.every(({ name }) => name !== "door"));
  assert.deepEqual(window.complaints, []);
  await window.close();
  await server.end();
});

test("a review shows no label before it has been judged, and keeps the distances", async () => {
  const review = await Server.start(dataset, labels, [...options, "--review", "3"]);
  const page = await (await chromium.newContext({ viewport: { width: 1280, height: 720 } })).newPage();
  const blind = new Window(page);
  await review.admit(page);
  await page.goto(review.origin);
  await page.locator("#asked").getByText("1 of 3. Click where the point of the key frame is.").waitFor();
  await page.waitForFunction(() => document.getElementById("image")?.dataset.frame !== "");
  const marked = () => page.evaluate(() => {
    const marks = /** @type {HTMLCanvasElement} */ (document.getElementById("marks"));
    return marks.getContext("2d")?.getImageData(0, 0, marks.width, marks.height).data.some((each) => each !== 0);
  });
  assert.equal(await marked(), false, "nothing is marked");
  await blind.screenshot("guide-5-review");
  const { width, height } = await (await review.request("/api/review")).json();
  const { x, y } = await blind.place({ u: 320, v: 240 }, { width, height });
  await page.mouse.click(x, y);
  await page.locator("#asked").getByText(/\d+\.\d\d px from the label/).waitFor();
  assert.equal(await marked(), true);
  await blind.screenshot("guide-6-judged");
  await page.mouse.click(x + 20, y);
  await blind.press("n", "x");
  await page.locator("#so-far").getByText("2 of 3 reviewed").waitFor();
  await page.locator("#so-far").getByText("1 could not be told").waitFor();
  assert.deepEqual(blind.complaints, []);
  await page.context().close();
  await review.end();
  const { schema, reviews } = JSON.parse(readFileSync(`${labels}.review.json`, "utf8"));
  assert.equal(schema, "vice.review/1");
  const [told] = reviews.filter((/** @type {{distance_px: number | null}} */ { distance_px }) => distance_px !== null);
  const [du, dv] = [0, 1].map((at) => told.reviewed_px[at] - told.stored_px[at]);
  assert.ok(Math.abs(Math.hypot(du, dv) - told.distance_px) < 1e-9);
  assert.ok(Math.hypot(told.reviewed_px[0] - 320, told.reviewed_px[1] - 240) < 0.6, "where the click was");
});
