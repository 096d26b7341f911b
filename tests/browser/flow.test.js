// A person's way through the page, with the real program behind it.

import assert from "node:assert/strict";
import { mkdirSync, readdirSync, readFileSync, rmdirSync, truncateSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { browser, flight, observation, scratch, Server, truth, Window } from "./harness.js";

/** @import {Browser} from "playwright-core" */
/** @import {State} from "../../vice-annotate/page/types.js" */

const BROKEN = 13;
const BY_HAND = 20;
const CORRECTED = 10;

const dataset = flight(3);
const labels = join(scratch(), "my.json");
const exact = truth(dataset);
/** @type {Browser} */
let chromium;
/** @type {Server} */
let server;
/** @type {Window} */
let first;

before(async () => {
  const images = join(dataset, "mav0", "cam0", "data");
  truncateSync(join(images, readdirSync(images).sort()[BROKEN]), 400);
  chromium = await browser();
  server = await Server.start(dataset, labels);
});

after(async () => {
  await chromium?.close();
  await server?.end();
});

/** Points of the flight that stay in sight and are not hidden. */
const SEEN = ["4", "5"];

test("opens with the first frame, and fits 1280 x 720", async () => {
  first = await Window.open(chromium, server);
  assert.match(await first.page.title(), /VICE annotate/);
  await first.saved();
  const overflow = await first.page.evaluate(() => ({
    across: document.documentElement.scrollWidth > innerWidth,
    down: document.documentElement.scrollHeight > innerHeight,
  }));
  assert.deepEqual(overflow, { across: false, down: false });
  for (const name of ["Play", "New", "Respawn", "Delete here", "Fit", "Undo", "Help"]) {
    assert.ok(await first.page.getByRole("button", { name, exact: true }).isVisible(), name);
  }
});

test("everything that can be worked has a name and can be reached by keyboard", async () => {
  const nameless = await first.page.evaluate(() =>
    [...document.querySelectorAll("button, input, select, summary, canvas[tabindex]")]
      .filter((each) => each instanceof HTMLElement && each.checkVisibility())
      .filter((each) => {
        const labels = each instanceof HTMLInputElement || each instanceof HTMLSelectElement ? [...(each.labels ?? [])] : [];
        const name = each.getAttribute("aria-label") ?? (labels.map((label) => label.textContent).join("") || each.textContent);
        return !name?.trim() || (each instanceof HTMLElement && each.tabIndex < 0);
      })
      .map((each) => each.outerHTML));
  assert.deepEqual(nameless, []);
  const reached = new Set();
  for (let step = 0; step < 60; step += 1) {
    await first.press("Tab");
    reached.add(await first.page.evaluate(() => document.activeElement?.id || document.activeElement?.getAttribute("data-action")));
  }
  for (const id of ["marks", "timeline", "retrack", "suggest", "brightness", "play", "speed", "frame", "zoom-fit"]) {
    assert.ok(reached.has(id), `${id} is reached: ${[...reached].join(" ")}`);
  }
  await first.page.focus("#marks");
});

test("four points are placed: by clicks, by the keyboard alone, and from a suggestion", async () => {
  const { page } = first;
  const state = await server.state();
  const stamp = state.frames[0].stamp_ns;
  const [a, b] = SEEN.map((name) => exact.get(name)?.get(stamp));
  assert.ok(a && b, "the flight has two points that stay in sight");
  for (const at of [a, b]) {
    const { x, y } = await first.place(at, state);
    await first.press("a");
    await page.mouse.click(x, y);
    await first.saved();
  }
  await page.mouse.move(5, 5);
  await first.press("a", "c");
  for (let step = 0; step < 8; step += 1) await first.press("Shift+ArrowLeft", "ArrowDown", "ArrowDown");
  await first.press("Enter");
  await first.saved();
  await first.press("a", "s");
  await page.getByRole("button", { name: /^Use all/ }).waitFor();
  await first.screenshot("1-suggestions");
  const suggestion = (await (await server.request("/api/suggestions?frame=0&count=4")).json()).suggestions[0];
  const { x, y } = await first.place(suggestion, state);
  await page.mouse.click(x, y);
  await first.press("Escape");
  const placed = await server.until("four points are there", ({ points }) => points.length === 4);
  const clicked = observation(placed, "1", 0);
  assert.ok(clicked && Math.hypot(clicked.u - a.u, clicked.v - a.v) < 0.6, "a click lands on the pixel under it");
  assert.equal(clicked.source, "manual");
  assert.equal(clicked.keyframe, true);
  const taken = observation(placed, "4", 0);
  assert.ok(taken && Math.hypot(taken.u - suggestion.u, taken.v - suggestion.v) < 1e-6, "a suggestion is taken as it is");
});

test("they are tracked forwards through all frames", async () => {
  await first.press("Shift+B");
  const tracked = await server.until("the tracker is done", ({ points, jobs }) =>
    jobs.every((job) => job.state !== "running") && ["1", "2"].every((name) => (points.find((each) => each.name === name)?.observations.length ?? 0) > 20));
  await first.page.waitForFunction(() => document.getElementById("job")?.hidden);
  const start = observation(tracked, "2", 0);
  const later = observation(tracked, "2", BY_HAND);
  assert.ok(start && later);
  assert.equal(later.source, "auto");
  const stamps = exact.get(SEEN[1]);
  const from = stamps?.get(start.stamp_ns);
  const to = stamps?.get(later.stamp_ns);
  assert.ok(from && to);
  const off = Math.hypot(later.u - start.u - (to.u - from.u), later.v - start.v - (to.v - from.v));
  assert.ok(off < 2, `point 2 is ${off} px from where it went`);
  await first.goTo(CORRECTED);
  await first.screenshot("2-tracked");
});

test("a correction tracks again what follows, up to the next observation by hand", async () => {
  await first.press("2");
  await first.goTo(BY_HAND);
  const tracked = await server.state();
  await first.press("Shift+ArrowDown");
  const held = await server.until("frame 20 is by hand, and followed", (state) =>
    observation(state, "2", BY_HAND)?.source === "manual" && state.jobs.every((job) => job.state !== "running") &&
    observation(state, "2", BY_HAND + 1)?.v !== observation(tracked, "2", BY_HAND + 1)?.v);
  await first.goTo(CORRECTED);
  await first.press("Shift+ArrowRight", "Shift+ArrowRight", "ArrowRight");
  const corrected = await server.until("frame 10 is corrected and followed", (state) => {
    const here = observation(state, "2", CORRECTED);
    const next = observation(state, "2", CORRECTED + 1);
    const before = observation(held, "2", CORRECTED + 1);
    return here?.source === "manual" && state.jobs.every((job) => job.state !== "running") && next !== undefined && before !== undefined && next.u !== before.u;
  });
  const here = observation(corrected, "2", CORRECTED);
  const was = observation(held, "2", CORRECTED);
  assert.ok(here && was && Math.abs(here.u - was.u - 2.1) < 0.051, "two steps of 1 px and one of 0.1 px");
  const next = observation(corrected, "2", CORRECTED + 1);
  const old = observation(held, "2", CORRECTED + 1);
  assert.ok(next && old && Math.abs(next.u - old.u - 2.1) < 1, "the next frame follows the correction");
  assert.deepEqual(observation(corrected, "2", BY_HAND), observation(held, "2", BY_HAND), "what is by hand stays");
  assert.deepEqual(observation(corrected, "2", BY_HAND + 1), observation(held, "2", BY_HAND + 1));
});

test("marks, delete here and delete after, undo and redo", async () => {
  const { page } = first;
  await first.press("3");
  await first.goTo(0);
  await first.press("o");
  await server.until("occluded", (state) => observation(state, "3", 0)?.occluded === true);
  await first.press("u");
  await server.until("uncertain", (state) => observation(state, "3", 0)?.uncertain === true);
  await first.press("1");
  await first.goTo(5);
  const before = await server.state();
  await first.press("Shift+D");
  await server.until("the lane ends at frame 5", ({ points }) => points[0].observations.at(-1)?.frame === 5);
  await first.press("d");
  const after = await server.until("frame 5 is gone", (state) => observation(state, "1", 5) === undefined);
  await first.press("Control+z", "Control+z");
  const undone = await server.until("both are undone", ({ points }) => JSON.stringify(points) === JSON.stringify(before.points));
  assert.equal(undone.can_redo, true);
  await page.getByRole("button", { name: "Redo" }).click();
  await page.getByRole("button", { name: "Redo" }).click();
  await server.until("both are done again", ({ points }) => JSON.stringify(points) === JSON.stringify(after.points));
  await first.press("Control+z", "Control+z");
  await server.until("both are undone again", ({ points }) => JSON.stringify(points) === JSON.stringify(before.points));
});

test("a doubtful frame is found", async () => {
  await first.goTo(BY_HAND);
  await first.press("1");
  await first.press("u");
  await server.until("frame 20 is uncertain", (state) => observation(state, "1", BY_HAND)?.uncertain === true);
  await first.goTo(BY_HAND - 2);
  await first.press("n");
  await first.shows(BY_HAND - 1 + 1);
  assert.match(await first.page.locator("#doubtful").innerText(), /\d+ doubtful/);
});

test("a point that left the image is offered a respawn, which begins a segment", async () => {
  const { page } = first;
  const state = await server.state();
  await first.goTo(0);
  await first.press("a");
  const { x, y } = await first.place({ u: 3, v: 300 }, state);
  await page.mouse.click(x, y);
  await server.until("point 5 is there", (now) => observation(now, "5", 0) !== undefined);
  await first.goTo(3);
  await first.told("Point 5 left the image after frame 0");
  await first.screenshot("3-respawn-offer");
  await page.getByRole("button", { name: "Respawn 5" }).click();
  await first.told("New place for point 5");
  await first.press("Enter");
  const respawned = await server.until("point 5 is back", (now) => observation(now, "5", 3) !== undefined);
  assert.equal(observation(respawned, "5", 3)?.keyframe, true);
  await server.until("it is tracked on by itself", (now) => observation(now, "5", 4)?.source === "auto" && now.jobs.every((job) => job.state !== "running"));
  // What was done is told in the frame numbers that the box shows.
  assert.equal(await page.inputValue("#frame"), "3");
  await first.press("Control+z");
  await first.told("Undone: track 5 forwards from frame 3");
  await first.press("Control+z");
  await first.told("Undone: begin 5 in frame 3");
  await server.until("a respawn is one step of undo, and its tracking another", (now) => observation(now, "5", 3) === undefined);
  await first.press("Control+y");
  await server.until("and of redo", (now) => observation(now, "5", 3)?.keyframe === true);
});

test("a frame that cannot be decoded is shown as such, the rest works", async () => {
  await first.goTo(BROKEN);
  await first.page.getByText("This frame cannot be shown.").waitFor();
  await first.screenshot("4-broken-frame");
  await first.press("e");
  await first.shows(BROKEN + 1);
  assert.ok(await first.page.locator("#broken").isHidden());
  // The browser itself reports the refused request.
  first.complaints = first.complaints.filter((line) => !line.includes("422"));
});

test("keys can be changed, and stay changed", async () => {
  const { page } = first;
  await first.press("?");
  const button = page.getByRole("button", { name: /^Change the key of "Next frame"/ });
  await button.click();
  await first.press("q");
  await page.getByText("Q is set.").waitFor();
  await first.screenshot("5-help");
  await first.press("Escape");
  await page.reload();
  await first.shows(0);
  await first.press("q");
  await first.shows(1);
  await first.press("?");
  await page.getByRole("button", { name: "Default keys" }).click();
  await first.press("Escape");
  await first.press("e");
  await first.shows(2);
});

test("zoom goes to the pointer, brightness and inversion change the picture only", async () => {
  const { page } = first;
  const before = await server.state();
  await page.mouse.move(500, 300);
  for (let turn = 0; turn < 5; turn += 1) await page.mouse.wheel(0, -240);
  await page.waitForFunction(() => Number.parseInt(document.getElementById("zoom")?.textContent ?? "") > 400);
  await page.mouse.down();
  await page.mouse.move(450, 260);
  await page.mouse.up();
  await first.press("i");
  // Drawn with the next picture, not at once.
  await page.waitForFunction(() => document.getElementById("image")?.style.filter.includes("invert(1)"));
  await first.screenshot("6-zoomed-inverted");
  await first.press("i", "0");
  assert.equal((await server.state()).revision, before.revision);
});

test("names are shown as text, whatever they hold", async () => {
  const { page } = first;
  const name = "<img src=x>&amp;";
  await first.press("3");
  await page.fill("#name", name);
  await first.press("Enter");
  await server.until("point 3 has its new name", ({ points }) => points.some((each) => each.name === name));
  await page.locator("#points b", { hasText: name }).waitFor();
  assert.equal(await page.locator("img").count(), 0);
  await first.press("Control+z");
  await server.until("it has its old name again", ({ points }) => points.some((each) => each.name === "3"));
});

test("labels go out as files and come in again", async () => {
  const { page } = first;
  const before = await server.state();
  const menu = page.locator("#file-menu summary");
  const folder = scratch();
  for (const [link, ending] of [["Export JSON", "json"], ["Export CSV", "csv"], ["Export CVAT XML", "xml"]]) {
    await menu.click();
    const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name: link, exact: true }).click()]);
    assert.equal(download.suggestedFilename(), `my.${ending}`);
    const file = join(folder, `my.${ending}`);
    await download.saveAs(file);
    await page.setInputFiles("#import", file);
    await first.told("there are points of the same names already: 1, 2, 3, 4, 5");
    await page.locator("#notes").getByRole("button", { name: "Close this note" }).first().click();
    await first.press("1", "Shift+D");
    await server.until("point 1 is cut short", ({ points }) => points[0].observations.length < before.points[0].observations.length);
    await menu.click();
    await page.check("#import-replace");
    await page.setInputFiles("#import", file);
    await first.told(`my.${ending} is imported`);
    // Only JSON says how sure the tracker was; CVAT counts from the corner of a pixel.
    const comparable = (/** @type {State} */ { points }) => ending === "json" ? points : points.map(({ name, observations }) =>
      [name, observations.map(({ frame, u, v, source, keyframe, occluded, uncertain }) => [frame, u.toFixed(9), v.toFixed(9), source, keyframe, occluded, uncertain])]);
    assert.deepEqual(comparable(await server.state()), comparable(before), ending);
    await menu.click();
    await page.uncheck("#import-replace");
    await menu.click();
  }
  await page.setInputFiles("#import", { name: "my.tiff", mimeType: "image/tiff", buffer: Buffer.from("no labels") });
  await first.told("labels come as .json, .csv, .xml (CVAT) or .pkl");
  await page.setInputFiles("#import", { name: "my.pkl", mimeType: "", buffer: Buffer.from("no pickle") });
  await first.told("my.pkl: ");
  // The browser itself reports the refused requests.
  first.complaints = first.complaints.filter((line) => !/409|422/.test(line));
});

test("a labels file that cannot be written is told at once, and that it is written again", async () => {
  const dataset = flight(1);
  const file = join(scratch(), "held.json");
  const own = await Server.start(dataset, file);
  const window = await Window.open(chromium, own);
  // No file can take the place of a folder.
  mkdirSync(file);
  const { x, y } = await window.place({ u: 200, v: 200 }, await own.state());
  await window.page.mouse.click(x, y);
  await window.told("The labels are safe in the journal, but the file is behind");
  await window.screenshot("11-file-behind");
  rmdirSync(file);
  await window.page.locator("#banners").getByText("the file is behind").waitFor({ state: "detached" });
  await window.close();
  await own.end();
  assert.equal(JSON.parse(readFileSync(file, "utf8")).points.length, 1);
});

test("a reload shows the same labels", async () => {
  const before = await server.state();
  await first.page.reload();
  await first.shows(0);
  await first.page.waitForFunction((count) => document.querySelectorAll("#points li").length === count, before.points.length);
  assert.deepEqual((await server.state()).points, before.points);
});

test("a second window follows the first, and its stale write is refused", async () => {
  const second = await Window.open(chromium, server);
  const state = await server.state();
  const { x, y } = await first.place({ u: 200, v: 200 }, state);
  await first.press("a");
  await first.page.mouse.click(x, y);
  await second.told("Changed in another window");
  await second.page.getByRole("button", { name: "Remove point 6" }).waitFor();
  assert.deepEqual(second.complaints, []);
  await second.close();

  const deaf = await Window.open(chromium, server, (page) => page.route("**/api/events*", (route) => route.abort()));
  await first.press("Control+z");
  const settled = await server.until("point 6 is gone", ({ points }) => points.length === 5);
  assert.ok(await deaf.page.getByRole("button", { name: "Remove point 6" }).isVisible(), "it has not heard of it");
  await deaf.press("6");
  await deaf.page.mouse.click(x + 20, y + 20);
  await deaf.told("Not done: the labels had changed elsewhere first");
  await deaf.page.getByRole("button", { name: "Remove point 6" }).waitFor({ state: "detached" });
  await deaf.screenshot("7-stale");
  assert.deepEqual((await server.state()).points, settled.points);
  await deaf.close();

  const refused = await server.request("/api/edits", {
    method: "POST",
    body: JSON.stringify({ revision: settled.revision - 1, edits: [{ op: "delete", point: "1", frame: 0 }] }),
  });
  assert.equal(refused.status, 409);
});

test("a second program on the same file may only look", async () => {
  const other = await Server.start(dataset, labels);
  const window = await Window.open(chromium, other);
  await window.told("Read only");
  const before = await server.state();
  assert.equal((await other.state()).writable, false);
  const { x, y } = await window.place({ u: 250, v: 100 }, before);
  await window.page.mouse.click(x, y);
  await window.press("d");
  for (const name of ["Undo", "New", "Respawn", "Delete here", "Track ▶"]) {
    assert.ok(await window.page.getByRole("button", { name, exact: true }).isDisabled(), name);
  }
  await window.screenshot("8-read-only");
  const refused = await other.request("/api/edits", {
    method: "POST",
    body: JSON.stringify({ revision: (await other.state()).revision, edits: [{ op: "delete", point: "1", frame: 0 }] }),
  });
  assert.equal(refused.status, 403);
  assert.deepEqual((await server.state()).points, before.points);
  await window.close();
  await other.end();
});

test("an address lets one browser in, once, and its token is gone from the address bar", async () => {
  for (const url of [server.origin, server.url, `${server.origin}/open?token=wrong`, `${server.origin}/main.js`, `${server.origin}/api/state`]) {
    assert.equal((await fetch(url)).status, 401, url);
  }
  const other = await Server.start(dataset, join(scratch(), "door.json"), [], false);
  const page = await (await chromium.newContext()).newPage();
  await page.goto(other.url);
  await page.waitForURL(`${other.origin}/`);
  await page.locator("canvas").first().waitFor();
  const cookies = await page.context().cookies();
  assert.ok(cookies.every((c) => c.httpOnly && c.sameSite === "Strict"), JSON.stringify(cookies));
  const second = await (await chromium.newContext()).newPage();
  assert.equal((await second.goto(other.url))?.status(), 401);
  assert.equal(await second.locator("canvas").count(), 0);
  await second.context().close();
  await page.context().close();
  await other.end();
});

test("killed and started again it has every label, and says when it is gone", async () => {
  assert.deepEqual(first.complaints, []);
  await first.goTo(2);
  await first.press("1", "ArrowLeft");
  const before = await server.until("frame 2 is by hand", (state) =>
    observation(state, "1", 2)?.source === "manual" && state.jobs.every((job) => job.state !== "running"));
  await server.end("SIGKILL");
  await first.told("The server");
  await first.screenshot("9-server-gone");
  server = await Server.start(dataset, labels);
  const after = await server.state();
  assert.deepEqual(after.points, before.points);
  await first.goto(server);
  await first.page.waitForFunction((count) => document.querySelectorAll("#points li").length === count, before.points.length);
  await first.screenshot("10-opened-again");
});
