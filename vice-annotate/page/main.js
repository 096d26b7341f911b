// Opens the state, makes the parts and joins them.

/** @import {Job} from "./types.js" */

import { Actions } from "./actions.js";
import { exportAddress, getState, ServerError } from "./api.js";
import { App } from "./app.js";
import { commands, disableWrites, listenToButtons, listenToKeys, showKeyHints } from "./commands.js";
import { byId, setText } from "./dom.js";
import { importLabels } from "./exchange.js";
import { Guide } from "./guide.js";
import { Help } from "./help.js";
import { Images } from "./images.js";
import { Keys } from "./keys.js";
import { Labels } from "./labels.js";
import { Loupe } from "./loupe.js";
import { outcome } from "./jobs.js";
import { Notices } from "./notices.js";
import { Panels } from "./panels.js";
import { Player } from "./player.js";
import { Session } from "./session.js";
import { Status } from "./status.js";
import { joinSwitches, speak } from "./switches.js";
import { Targets } from "./targets.js";
import { Timeline } from "./timeline.js";
import { Viewer } from "./viewer.js";

const IMAGE_BUDGET_BYTES = 512 * 1024 * 1024;

const notices = new Notices(byId("notes", HTMLElement), byId("banners", HTMLElement));
/** @type {(kind: "info" | "warning" | "error", text: string) => void} */
const tell = (kind, text) => notices.tell(kind, text);

/** @param {App} app @param {Status} status @returns {import("./session.js").Listener} */
function listener(app, status) {
  return {
    changed: () => app.changed(),
    tell,
    elsewhere: (change) => tell("info", `Changed in another window: ${change.label}`),
    finished: (job) => finished(app, job),
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

/** @param {App} app @param {Job} job */
function finished(app, job) {
  const { kind, text } = outcome(job, app.labels, app.keys);
  if (text) tell(kind, text);
  if (job.kind === "detect" && !app.labels.lanes.has(app.selected) && app.labels.names.length > 0) app.select(app.labels.names[0]);
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
  const guide = new Guide(app, player, actions, notices);
  const status = new Status(app, player, actions, notices);
  const help = new Help(app.keys, () => showKeyHints(app));
  app.session = new Session(labels, listener(app, status));
  const table = commands(app, actions, player, help, new Targets(app), guide);
  listenToKeys(app, table);
  listenToButtons(app, table);
  showKeyHints(app);
  disableWrites(app);
  if (labels.state.floor_suggestions) setText(byId("suggest", HTMLElement), "Suggest on the floor");
  joinSwitches(app);
  speak(app);
  importLabels(app, tell);
  byId("speed", HTMLSelectElement).addEventListener("change", (event) => {
    player.speed = Number(/** @type {HTMLSelectElement} */ (event.target).value);
    viewer.marks.focus();
  });
  byId("frame", HTMLInputElement).addEventListener("change", (event) => {
    const frame = /** @type {HTMLInputElement} */ (event.target).valueAsNumber;
    if (Number.isInteger(frame)) player.step(app.labels.placeNear(frame) - app.target);
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
  app.listeners.push(() => viewer.draw(), () => loupe.draw(app), () => timeline.draw(), () => panels.draw(), () => status.draw(), () => guide.draw());
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
    ? "This browser was not let in, or by an earlier start. Use the address that `vice annotate` printed last; each opens the page once."
    : `The labels cannot be opened: ${error.message}${error.hint ? ` — ${error.hint}` : ""}`);
  setText(byId("saved", HTMLElement), "Not open");
  if (!(error instanceof ServerError)) throw error;
});
