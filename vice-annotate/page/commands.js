// The actions that keys and buttons name, and what each does.

/** @import {Actions} from "./actions.js" */
/** @import {App} from "./app.js" */
/** @import {Guide} from "./guide.js" */
/** @import {Help} from "./help.js" */
/** @import {Player} from "./player.js" */
/** @import {Targets} from "./targets.js" */

import { byId } from "./dom.js";
import { nameOf } from "./keys.js";

const ZOOM_STEP = 1.4;
const FAR = 10;
const WRITES = new Set([
  "new-point", "suggest", "targets", "respawn", "track-forward", "track-backward", "track-both", "track-all", "delete", "delete-after",
  "use-suggestions", "accept", "delete-range", "nothing-here",
]);

/**
 * @param {App} app
 * @param {Actions} actions
 * @param {Player} player
 * @param {Help} help
 * @param {Targets} targets
 * @param {Guide} guide
 * @returns {Record<string, () => unknown>}
 */
export function commands(app, actions, player, help, targets, guide) {
  const { view } = app.viewer;
  /** @param {"dots" | "loupe" | "follow" | "invert"} name */
  const toggle = (name) => () => {
    app.switches[name] = !app.switches[name];
    app.storeSwitches();
  };
  /** @param {number} factor */
  const zoom = (factor) => () => {
    const at = app.cursor ?? app.pixel;
    const { x, y } = at ? view.toScreen(at) : { x: view.width / 2, y: view.height / 2 };
    view.zoomAt(factor, x, y);
    if (at) view.reveal(at);
    app.changed();
  };
  /** @type {Record<string, () => unknown>} */
  const table = {
    "next-frame": () => player.step(1),
    "previous-frame": () => player.step(-1),
    "first-frame": () => player.step(-Infinity),
    "last-frame": () => player.step(Infinity),
    play: () => player.toggle(),
    "next-task": () => guide.go(1),
    "previous-task": () => guide.go(-1),
    "next-gap": () => guide.go(1, "gap"),
    "previous-gap": () => guide.go(-1, "gap"),
    place: () => actions.placeByKey(),
    cursor: () => actions.toggleCursor(),
    "new-point": () => actions.newPoint(),
    "next-point": () => actions.otherPoint(1),
    "previous-point": () => actions.otherPoint(-1),
    suggest: () => actions.suggest(),
    "use-suggestions": () => actions.useSuggestions(),
    name: () => {
      const name = byId("name", HTMLInputElement);
      name.focus();
      name.select();
    },
    targets: () => app.writable && targets.show(),
    respawn: () => actions.respawn(),
    "track-forward": () => actions.track([app.selected], "forward"),
    "track-backward": () => actions.track([app.selected], "backward"),
    "track-both": () => actions.track([app.selected], "both"),
    "track-all": () => actions.track(null, "forward"),
    stop: () => actions.stop(),
    occluded: () => actions.toggleMark("occluded"),
    uncertain: () => actions.toggleMark("uncertain"),
    "key-frame": () => actions.toggleMark("keyframe"),
    accept: () => actions.accept(),
    "delete-range": () => actions.deleteRange(),
    "nothing-here": () => actions.nothingHere(),
    delete: () => actions.remove("delete"),
    "delete-after": () => actions.remove("delete-after"),
    undo: () => actions.history("undo"),
    redo: () => actions.history("redo"),
    "zoom-in": zoom(ZOOM_STEP),
    "zoom-out": zoom(1 / ZOOM_STEP),
    "zoom-fit": () => {
      view.fit();
      app.changed();
    },
    follow: toggle("follow"),
    loupe: toggle("loupe"),
    invert: toggle("invert"),
    dots: toggle("dots"),
    help: () => help.toggle(),
  };
  for (const [way, du, dv] of /** @type {[string, number, number][]} */ ([
    ["left", -0.1, 0], ["right", 0.1, 0], ["up", 0, -0.1], ["down", 0, 0.1],
  ])) {
    table[way] = () => actions.nudge(du, dv);
    table[`${way}-far`] = () => actions.nudge(FAR * du, FAR * dv);
  }
  for (let number = 1; number <= 9; number += 1) {
    // The nth of the list where there is one; else the point of that name, to be placed.
    table[`point-${number}`] = () => app.select(app.labels.names[number - 1] ?? app.labels.freeName());
  }
  return table;
}

/**
 * @param {App} app
 * @param {Record<string, () => unknown>} table
 */
export function listenToKeys(app, table) {
  document.addEventListener("keydown", (event) => {
    const { target } = event;
    if (event.defaultPrevented || !(target instanceof HTMLElement) || target.closest("dialog")) return;
    const typing = target instanceof HTMLInputElement && !["checkbox", "range", "file"].includes(target.type);
    const name = nameOf(event);
    if (typing || target instanceof HTMLSelectElement) return;
    if (target instanceof HTMLInputElement && /^(arrow|page|home|end|space)/.test(name)) return;
    if (target.closest("button, summary, a") && ["enter", "space"].includes(name)) return;
    const action = app.keys.actionOf(name);
    if (action === null || !table[action]) return;
    event.preventDefault();
    table[action]();
  });
}

/**
 * @param {App} app
 * @param {Record<string, () => unknown>} table
 */
export function listenToButtons(app, table) {
  for (const each of document.querySelectorAll("[data-action]")) {
    if (!(each instanceof HTMLElement)) continue;
    const action = each.dataset.action ?? "";
    each.addEventListener("click", () => table[action]?.());
  }
  // After a click with the pointer the keys belong to the frame again; who came by keyboard stays where they are.
  document.addEventListener("click", (event) => {
    if (event.detail === 0 || !(event.target instanceof Element)) return;
    if (event.target.closest("button, summary, input[type=checkbox], input[type=range]") && !event.target.closest("dialog, #file-menu")) app.viewer.marks.focus();
  });
}

/** Buttons that would write are dead where nothing may be written. @param {App} app */
export function disableWrites(app) {
  for (const each of document.querySelectorAll("button[data-action]")) {
    if (each instanceof HTMLButtonElement && WRITES.has(each.dataset.action ?? "")) each.disabled = !app.writable;
  }
}

/** @param {App} app */
export function showKeyHints(app) {
  for (const each of document.querySelectorAll("[data-action]")) {
    if (!(each instanceof HTMLElement)) continue;
    const binding = app.keys.bindings.find(({ action }) => action === each.dataset.action);
    if (binding) each.title = binding.keys.length > 0 ? `${binding.text} (${app.keys.hint(binding.action)})` : binding.text;
  }
}
