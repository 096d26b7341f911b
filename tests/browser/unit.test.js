// The page's parts that need no browser.

import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";

/** @import {Observation, State} from "../../vice-annotate/page/types.js" */

Object.assign(globalThis, { location: { search: "" } });
const { View } = await import("../../vice-annotate/page/view.js");
const { Labels } = await import("../../vice-annotate/page/labels.js");
const { coverage, coverageText } = await import("../../vice-annotate/page/coverage.js");
const { Tasks } = await import("../../vice-annotate/page/tasks.js");
const { outcome } = await import("../../vice-annotate/page/jobs.js");
const { Keys, nameOf } = await import("../../vice-annotate/page/keys.js");
const { Images } = await import("../../vice-annotate/page/images.js");

/**
 * @param {number} frame
 * @param {Partial<Observation>} [rest]
 * @returns {Observation}
 */
function seen(frame, rest = {}) {
  return { frame, stamp_ns: `${frame}00`, u: 100, v: 100, source: "auto", keyframe: false, occluded: false, uncertain: false, confidence: 0.9, seeded: false, ...rest };
}

/** @param {Observation[]} observations @returns {State} */
function state(observations) {
  return {
    revision: 7, dataset: "flight", format: "euroc", camera: "cam0", width: 640, height: 480, labels_file: "my.json",
    writable: true, read_only_reason: null, frames: Array.from({ length: 10 }, (_, at) => ({ frame: 2 * at, stamp_ns: `${at}`, time_s: at / 10 })),
    points: [{ name: "1", observations }], can_undo: false, can_redo: false, floor_suggestions: false, streams: [], jobs: [], version: "0",
  };
}

test("an image's corner is half a pixel from the centre of its first pixel", () => {
  const view = new View();
  view.resize(640, 480);
  view.setImage(320, 240);
  assert.deepEqual(view.toScreen({ u: -0.5, v: -0.5 }), { x: 0, y: 0 });
  assert.deepEqual(view.toScreen({ u: 0, v: 0 }), { x: 1, y: 1 });
});

test("what lies under the pointer stays there while zooming, and comes back as the same pixel", () => {
  const view = new View();
  view.resize(900, 500);
  view.setImage(752, 480);
  const before = view.toImage(333, 222);
  view.zoomAt(3.7, 333, 222);
  const after = view.toImage(333, 222);
  assert.ok(Math.hypot(after.u - before.u, after.v - before.v) < 1e-9);
  const { x, y } = view.toScreen({ u: 12.3, v: 45.6 });
  const again = view.toImage(x, y);
  assert.ok(Math.hypot(again.u - 12.3, again.v - 45.6) < 1e-9);
  view.pan(1e6, -1e6);
  assert.ok(view.holds(view.toImage(view.width - 1, 1)), "the image cannot be pushed out of sight");
});

test("a change is applied once and in order", () => {
  const labels = new Labels(state([seen(0)]));
  const change = { revision: 8, points: [{ name: "2", observations: [seen(4)] }], removed: ["1"], can_undo: true, can_redo: false, by: "edit", label: "" };
  assert.equal(labels.apply({ ...change, revision: 9 }), "missed");
  assert.deepEqual(labels.names, ["1"]);
  assert.equal(labels.apply(change), "applied");
  assert.deepEqual(labels.names, ["2"]);
  assert.equal(labels.at("1", 0), null);
  assert.equal(labels.at("2", 4)?.u, 100);
  assert.equal(labels.apply(change), "known");
});

test("a point that is just being placed has its name, whatever happens to others meanwhile", () => {
  const labels = new Labels(state([]));
  labels.replace({ ...state([]), points: [] });
  labels.hope("1", 0, { u: 1, v: 2 });
  assert.equal(labels.freeName(), "2");
  labels.apply({ revision: 8, points: [{ name: "7", observations: [seen(4)] }], removed: [], can_undo: true, can_redo: false, by: "track", label: "" });
  assert.equal(labels.freeName(), "2");
  assert.deepEqual(labels.pixel("1", 0), { u: 1, v: 2 });
  labels.apply({ revision: 9, points: [{ name: "1", observations: [seen(0)] }], removed: [], can_undo: true, can_redo: false, by: "edit", label: "" });
  assert.equal(labels.pixel("1", 0)?.u, 100);
});

/**
 * What is to be done, as place, lane and kind.
 * @param {InstanceType<typeof Labels>} labels
 */
function tasks(labels) {
  return new Tasks(labels).list.map(({ place, name, kind }) => `${place} ${name} ${kind}`);
}

/** A lane from one place to another, the first one a key frame. @param {number} from @param {number} to @param {Partial<Observation>} [last] */
function lane(from, to, last = {}) {
  return Array.from({ length: to - from + 1 }, (_, at) =>
    seen(2 * (from + at), { ...(at === 0 ? { keyframe: true, source: "manual", confidence: null } : {}), ...(from + at === to ? last : {}) }));
}

test("a full lane needs nobody, whatever else there is is named by its kind", () => {
  assert.deepEqual(tasks(new Labels(state(lane(0, 9)))), []);
  assert.deepEqual(tasks(new Labels(state(lane(2, 9)))), ["0 1 start"]);
  assert.deepEqual(tasks(new Labels(state(lane(0, 6)))), ["7 1 lost"]);
  assert.deepEqual(tasks(new Labels(state(lane(0, 6, { u: 637 })))), ["7 1 left"]);
  assert.deepEqual(tasks(new Labels(state([...lane(0, 4), ...lane(7, 9)]))), ["5 1 lost"], "a respawn later on fills no gap before it");
  assert.deepEqual(tasks(new Labels(state(lane(0, 9).filter(({ frame }) => frame !== 8)))), ["4 1 gap"], "a frame was left out");
  assert.deepEqual(tasks(new Labels(state(lane(0, 9, { uncertain: true })))), ["9 1 doubtful"]);
});

test("doubtful frames in a row are one thing to look at, and are all counted", () => {
  const observations = lane(0, 9).map((each, at) => ({ ...each, confidence: at >= 3 && at <= 5 ? 0.3 : each.confidence }));
  const labels = new Labels(state(observations));
  assert.deepEqual(tasks(labels), ["3 1 doubtful"]);
  assert.deepEqual(new Tasks(labels).count, { doubtful: 3, gaps: 0 });
});

test("what was placed and not tracked yet is to be tracked; once it was and came to nothing, it is lost", () => {
  const labels = new Labels(state(lane(4, 4)));
  assert.deepEqual(tasks(labels), ["0 1 start", "4 1 untracked"]);
  labels.trackedFrom("1", 8);
  assert.deepEqual(tasks(labels), ["0 1 start", "5 1 lost"]);
  const suggested = new Labels(state([seen(0, { keyframe: true, confidence: null })]));
  assert.deepEqual(tasks(suggested), ["0 1 untracked"]);
  suggested.applyJob({ id: 1, kind: "track", points: ["1"], done: 1, total: 1, state: "done", ends: [{ point: "1", frame: 1, why: "lost", gap_s: 1 }] });
  assert.deepEqual(tasks(suggested), ["1 1 lost"]);
});

test("a lane that is being tracked, targets, and gaps that are said to be empty need nobody", () => {
  const labels = new Labels(state(lane(0, 6)));
  labels.applyJob({ id: 1, kind: "track", points: ["1"], done: 1, total: 9, state: "running" });
  assert.deepEqual(tasks(labels), []);
  assert.deepEqual(tasks(new Labels(state(lane(2, 6).map((each) => ({ ...each, source: "detected" }))))), []);
  const said = new Labels({ ...state(lane(0, 6)), empty: [{ point: "1", from: 14, to: 18 }, { point: "2", from: 0, to: 4 }] });
  assert.deepEqual(tasks(said), []);
  said.setEmpty([{ point: "1", from: 16, to: 18 }]);
  assert.deepEqual(tasks(said), ["7 1 lost"], "a part of it is still open");
});

test("from one thing to the next in time and then in lanes, and around the end", () => {
  const labels = new Labels(state([]));
  labels.replace({ ...state([]), points: [{ name: "1", observations: lane(0, 4) }, { name: "2", observations: lane(0, 9) }, { name: "3", observations: lane(0, 4) }, { name: "4", observations: lane(3, 9) }] });
  const all = new Tasks(labels);
  const from = (/** @type {[number, string, 1 | -1]} */ ...at) => {
    const task = all.next(...at);
    return task && `${task.place} ${task.name}`;
  };
  assert.equal(from(0, "1", 1), "0 4");
  assert.equal(from(0, "4", 1), "5 1");
  assert.equal(from(5, "1", 1), "5 3");
  assert.equal(from(5, "3", 1), "0 4", "around the end");
  assert.equal(from(5, "1", -1), "0 4");
  assert.equal(from(0, "4", -1), "5 3");
  assert.equal(new Tasks(new Labels(state(lane(0, 9)))).next(3, "1", 1), null);
});

test("coverage is the time that is labelled, of one point and of all", () => {
  const labels = new Labels(state([]));
  labels.replace({ ...state([]), points: [{ name: "1", observations: lane(0, 9) }, { name: "2", observations: lane(2, 4) }] });
  assert.equal(coverageText(coverage(labels, "1")), "1 of 1 s, 100 %");
  assert.equal(coverageText(coverage(labels, "2")), "0.3 of 1 s, 30 %");
  assert.equal(coverageText(coverage(labels)), "1.3 of 2 s, 65 %");
  assert.equal(coverageText({ labelled_s: 29.99, all_s: 30, share: 0.9997 }), "30 of 30 s, 99 %", "full is full");
});

test("what ended a track is told in the data set's own frame numbers", () => {
  const labels = new Labels(state([seen(0)]));
  /** @type {any} */
  const job = { id: 1, kind: "track", points: ["1", "2", "3"], done: 9, total: 9, state: "done", message: "", remarks: "1 frames could not be decoded",
    ends: [{ point: "1", frame: 8, why: "lost", gap_s: 0.95 }, { point: "3", frame: 8, why: "lost", gap_s: 0.95 }, { point: "2", frame: 6, why: "left-image", gap_s: 0.05 }] };
  const { kind, text } = outcome(job, labels, new Keys());
  assert.equal(kind, "info");
  assert.equal(text, "Tracked 1, 2, 3. 1, 3 lost at frame 8, 0.95 s from the image before it. 2 left the image at frame 6. 1 frames could not be decoded. N goes to the next of these frames.");
  assert.match(outcome({ ...job, state: "failed", message: "no disk" }, labels, new Keys()).text, /failed: no disk/);
  assert.equal(outcome({ ...job, state: "stopped" }, labels, new Keys()).text, "");
  assert.equal(outcome({ ...job, kind: "detect", message: "nothing" }, labels, new Keys()).text, "nothing");
});

test("a respawn is offered after a lane that ended at the border, and not after one that ended inside", () => {
  assert.deepEqual(new Labels(state([seen(2, { u: 637 })])).goneAt(6), ["1"]);
  assert.deepEqual(new Labels(state([seen(2, { u: 637 })])).goneAt(2), []);
  assert.deepEqual(new Labels(state([seen(2, { u: 300 })])).goneAt(6), []);
  assert.deepEqual(new Labels(state([seen(2, { u: 637, source: "detected" })])).goneAt(6), []);
  assert.deepEqual(new Labels(state([seen(2, { u: 637 }), seen(8)])).goneAt(6), []);
});

test("a correction tracks again up to the next observation by hand", () => {
  const labels = new Labels(state([seen(0), seen(2), seen(4), seen(6, { source: "manual" }), seen(8)]));
  assert.equal(labels.nextFixed("1", 2)?.frame, 6);
  assert.equal(labels.followedByAutomatic("1", 2), true);
  assert.equal(labels.followedByAutomatic("1", 4), false);
  assert.equal(labels.followedByAutomatic("1", 6), true);
});

test("keys are named alike on all keyboards, and a key given away is lost to its last owner", () => {
  /** @type {any} */
  const press = { key: "Z", ctrlKey: true, shiftKey: true, altKey: false, metaKey: false };
  assert.equal(nameOf(press), "ctrl+shift+z");
  assert.equal(nameOf({ ...press, key: "?", ctrlKey: false }), "?");
  assert.equal(nameOf({ ...press, key: " ", ctrlKey: false, shiftKey: false }), "space");
  assert.equal(nameOf({ ...press, key: "ArrowLeft", ctrlKey: false }), "shift+arrowleft");
  const keys = new Keys({ respawn: ["q"] });
  assert.equal(keys.actionOf("q"), "respawn");
  assert.equal(keys.actionOf("e"), "next-frame");
  keys.set("respawn", "e");
  assert.equal(keys.actionOf("e"), "respawn");
  assert.equal(keys.actionOf("pagedown"), "next-frame");
  keys.reset();
  assert.equal(keys.actionOf("e"), "next-frame");
});

test("no two actions share a default key", () => {
  const all = new Keys().bindings.flatMap(({ keys }) => keys);
  assert.equal(new Set(all).size, all.length);
});

/** @type {number} */
let open;
const real = { fetch: globalThis.fetch };
beforeEach(() => {
  open = 0;
  Object.assign(globalThis, {
    fetch: async (/** @type {string} */ path) => path.endsWith("/13")
      ? new Response(JSON.stringify({ error: "cut short", hint: "copy it again" }), { status: 422 })
      : new Response("bytes"),
    createImageBitmap: async () => {
      open += 1;
      return { width: 10, height: 10, close: () => (open -= 1) };
    },
  });
});
afterEach(() => {
  Object.assign(globalThis, real);
});

test("decoded frames stay within their bytes, the ones used last are kept", async () => {
  const images = new Images(10 * 400);
  for (let frame = 20; frame < 120; frame += 1) {
    await images.get(frame);
    await images.get(20);
  }
  assert.equal(images.bytes, 4000);
  assert.equal(open, 10);
  assert.ok(images.peek(20)?.bitmap);
  assert.ok(images.peek(119)?.bitmap);
  assert.equal(images.peek(60), null);
});

test("a frame that cannot be decoded says why, and is not asked for again", async () => {
  const images = new Images(4000);
  const picture = await images.get(13);
  assert.equal(picture.bitmap, null);
  assert.equal(picture.error, "cut short (copy it again)");
  assert.equal(images.peek(13), picture);
});
