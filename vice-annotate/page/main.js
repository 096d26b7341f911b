// Opens the state, makes the parts and joins them.

/** @import {Job} from "./types.js" */

import { Actions } from "./actions.js";
import { exportAddress, getState, ServerError } from "./api.js";
import { App } from "./app.js";
import { byId, setText } from "./dom.js";
import { bringIn } from "./exchange.js";
import { Help } from "./help.js";
import { Images } from "./images.js";
import { Keys, nameOf } from "./keys.js";
import { Labels } from "./labels.js";
import { Loupe } from "./loupe.js";
import { Notices } from "./notices.js";
import { Panels } from "./panels.js";
import { Player } from "./player.js";
import { Session } from "./session.js";
import { Status } from "./status.js";
import { Timeline } from "./timeline.js";
import { Viewer } from "./viewer.js";

const IMAGE_BUDGET_BYTES = 512 * 1024 * 1024;
const ZOOM_STEP = 1.4;
const FAR = 10;

const notices = new Notices(byId("notes", HTMLElement), byId("banners", HTMLElement));
/** @type {(kind: "info" | "warning" | "error", text: string) => void} */
const tell = (kind, text) => notices.tell(kind, text);

/** @param {App} app @param {Status} status @returns {import("./session.js").Listener} */
function listener(app, status) {
  return {
    changed: () => app.changed(),
    tell,
    elsewhere: (change) => tell("info", `Changed in another window: ${change.label}`),
    finished: (job) => finished(job),
    connection: (state) => {
      status.connection = state;
      if (state === "open") {
        notices.clear("connection");
        // A frame that could not be fetched meanwhile is asked for again.
        app.images.get(app.frame).then(() => app.changed());
      } else if (state === "lost") notices.banner("connection", "error", "The server does not answer. Every change that was shown as saved is on disk.");
      else notices.banner("connection", "error", "The server has ended. Every change that was shown as saved is on disk; start `vice annotate` again and open its new address.");
      app.changed();
    },
  };
}

/** @param {Job} job */
function finished(job) {
  if (job.state === "failed") tell("error", `Tracking failed: ${job.message ?? "no reason given"}`);
  else if (job.state === "done") tell("info", `Tracked ${job.points.join(", ")}${job.message ? `: ${job.message}` : ""}`);
}

/**
 * @param {App} app
 * @param {Actions} actions
 * @param {Player} player
 * @param {Help} help
 * @returns {Record<string, () => unknown>}
 */
function doings(app, actions, player, help) {
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
    "next-doubtful": () => player.doubtful(1) || tell("info", "No doubtful frame after this one."),
    "previous-doubtful": () => player.doubtful(-1) || tell("info", "No doubtful frame before this one."),
    place: () => actions.placeByKey(),
    cursor: () => actions.toggleCursor(),
    "new-point": () => actions.newPoint(),
    "next-point": () => actions.otherPoint(1),
    "previous-point": () => actions.otherPoint(-1),
    suggest: () => actions.suggest(),
    respawn: () => actions.respawn(),
    "track-forward": () => actions.track([app.selected], "forward"),
    "track-backward": () => actions.track([app.selected], "backward"),
    "track-both": () => actions.track([app.selected], "both"),
    "track-all": () => actions.track(app.labels.names, "forward"),
    stop: () => actions.stop(),
    occluded: () => actions.toggleMark("occluded"),
    uncertain: () => actions.toggleMark("uncertain"),
    "key-frame": () => actions.toggleMark("keyframe"),
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
function listenToKeys(app, table) {
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
function listenToButtons(app, table) {
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

/** @param {App} app */
function showKeyHints(app) {
  for (const each of document.querySelectorAll("[data-action]")) {
    if (!(each instanceof HTMLElement)) continue;
    const binding = app.keys.bindings.find(({ action }) => action === each.dataset.action);
    if (binding) each.title = binding.keys.length > 0 ? `${binding.text} (${app.keys.hint(binding.action)})` : binding.text;
  }
}

/** @param {App} app */
function joinSwitches(app) {
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
function speak(app) {
  const spoken = byId("spoken", HTMLElement);
  let timer = 0;
  app.listeners.push(() => {
    window.clearTimeout(timer);
    timer = window.setTimeout(() => {
      const at = app.cursor ?? app.pixel;
      const what = app.cursor ? "cursor" : `point ${app.selected}`;
      const where = at ? `at ${at.u.toFixed(1)}, ${at.v.toFixed(1)}` : "not labelled here";
      setText(spoken, `Frame ${app.place + 1}, ${what} ${where}`);
    }, 500);
  });
}

async function open() {
  const labels = new Labels(await getState());
  if (labels.state.frames.length === 0) return tell("error", "No frame lies in the chosen range.");
  document.title = `${labels.state.dataset} · VICE annotate`;
  const app = new App(labels, new Images(IMAGE_BUDGET_BYTES), new Keys(labels.state.keys));
  const actions = new Actions(app, tell);
  const loading = byId("loading", HTMLElement);
  const player = new Player(app, {
    loading: (frame) => {
      loading.hidden = frame === null;
      setText(loading, frame === null ? "" : `Loading frame ${frame}…`);
    },
    leaving: () => actions.settle(),
  });
  const viewer = new Viewer(app, { box: byId("viewer", HTMLElement), image: byId("image", HTMLCanvasElement), marks: byId("marks", HTMLCanvasElement) }, {
    place: (pixel) => actions.place(pixel),
    takeSuggestion: (index) => actions.takeSuggestion(index),
    pick: (name) => app.select(name),
    drag: (name, pixel, done) => actions.drag(name, pixel, done),
  });
  app.viewer = viewer;
  const timeline = new Timeline(app, byId("timeline-box", HTMLElement), byId("timeline", HTMLCanvasElement), {
    go: (place) => {
      player.pause();
      player.go(place);
    },
    select: (name) => app.select(name),
  });
  const loupe = new Loupe(byId("loupe", HTMLElement), byId("loupe-image", HTMLCanvasElement), byId("loupe-marks", HTMLCanvasElement), byId("loupe-readout", HTMLElement));
  const panels = new Panels(app, actions);
  const status = new Status(app, player, actions, notices);
  const help = new Help(app.keys, () => showKeyHints(app));
  app.session = new Session(labels, listener(app, status));
  const table = doings(app, actions, player, help);
  listenToKeys(app, table);
  listenToButtons(app, table);
  showKeyHints(app);
  if (labels.state.floor_suggestions) setText(byId("suggest", HTMLElement), "Suggest on the floor");
  joinSwitches(app);
  speak(app);
  bringIn(app, tell);
  byId("speed", HTMLSelectElement).addEventListener("change", (event) => {
    player.speed = Number(/** @type {HTMLSelectElement} */ (event.target).value);
    viewer.marks.focus();
  });
  byId("frame", HTMLInputElement).addEventListener("change", (event) => {
    const place = /** @type {HTMLInputElement} */ (event.target).valueAsNumber;
    if (Number.isInteger(place)) player.step(place - 1 - app.target);
    viewer.marks.focus();
  });
  const menu = byId("file-menu", HTMLDetailsElement);
  document.addEventListener("pointerdown", (event) => {
    if (!(event.target instanceof Node && menu.contains(event.target))) menu.open = false;
  });
  menu.addEventListener("keydown", (event) => {
    if (event.key === "Escape") menu.open = false;
  });
  for (const format of /** @type {const} */ (["json", "csv", "cvat"])) byId(`export-${format}`, HTMLAnchorElement).href = exportAddress(format);
  app.listeners.push(() => viewer.draw(), () => loupe.draw(app), () => timeline.draw(), () => panels.draw(), () => status.draw());
  window.addEventListener("beforeunload", (event) => {
    if (actions.moving === null && app.session.pending === 0) return;
    actions.settle();
    event.preventDefault();
  });
  app.session.start();
  app.changed();
  await player.begin();
  viewer.marks.focus();
}

open().catch((error) => {
  const refused = error instanceof ServerError && error.status === 401;
  notices.banner("open", "error", refused
    ? "This address lacks the token, or has an old one. Use the address that `vice annotate` printed when it started."
    : `The labels cannot be opened: ${error.message}${error.hint ? ` — ${error.hint}` : ""}`);
  setText(byId("saved", HTMLElement), "Not open");
  if (!(error instanceof ServerError)) throw error;
});
