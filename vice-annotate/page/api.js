// The server, as functions. The browser shows the cookie that it was let in with.

/** @import {Change, Direction, Edit, Empty, Job, Pixel, Projections, ReviewState, State, Suggestions, Summary, Targets, Verdict} from "./types.js" */

/** An answer that is no success: one clear line, and perhaps what to do. */
export class ServerError extends Error {
  /**
   * @param {number} status 0 where no answer came
   * @param {string} message
   * @param {string} hint
   * @param {boolean} stale refused since the labels had changed
   */
  constructor(status, message, hint, stale = false) {
    super(message);
    this.status = status;
    this.hint = hint;
    this.stale = stale;
  }
}

/**
 * @param {string} path
 * @param {RequestInit} [init]
 * @returns {Promise<Response>}
 */
async function send(path, init = {}) {
  let response;
  try {
    response = await fetch(path, init);
  } catch (cause) {
    if (cause instanceof DOMException && cause.name === "AbortError") throw cause;
    throw new ServerError(0, "the server does not answer", "is `vice annotate` still running?");
  }
  if (response.ok) return response;
  /** @type {{error?: unknown, hint?: unknown, revision?: unknown}} */
  const body = await response.json().catch(() => ({}));
  const line = typeof body.error === "string" ? body.error : `the server answers ${response.status}`;
  // Only what is stale is told with the revision that holds.
  throw new ServerError(response.status, line, typeof body.hint === "string" ? body.hint : "", typeof body.revision === "number");
}

/**
 * @param {string} path
 * @param {unknown} body
 * @returns {Promise<any>}
 */
async function post(path, body) {
  const response = await send(path, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(body),
  });
  return response.json();
}

/** @returns {Promise<State>} */
export async function getState() {
  return (await send("/api/state", { cache: "no-store" })).json();
}

/**
 * The stored image of a frame.
 * @param {number} frame
 * @param {AbortSignal} [signal]
 * @returns {Promise<Blob>}
 */
export async function getFrame(frame, signal) {
  return (await send(`/api/frames/${frame}`, { signal })).blob();
}

/** @returns {Promise<Projections | null>} */
export async function getProjections() {
  return (await send("/api/projections", { cache: "no-store" })).json();
}

/**
 * @param {number} frame
 * @param {number} count
 * @param {number | null} until the frame where the lane goes on: to stay in view for longer is worth nothing
 * @returns {Promise<Suggestions>}
 */
export async function getSuggestions(frame, count, until) {
  const end = until === null ? "" : `&until=${until}`;
  const response = await send(`/api/suggestions?frame=${frame}&count=${count}${end}`, { cache: "no-store" });
  return response.json();
}

/**
 * @param {number} revision the state that the edits were made on
 * @param {Edit[]} edits one step of undo
 * @returns {Promise<Change>}
 */
export function postEdits(revision, edits) {
  return post("/api/edits", { revision, edits });
}

/**
 * Says that there is nothing to label of a point from one frame to another, or takes it back.
 * @param {Empty & {nothing: boolean}} note
 * @returns {Promise<{empty: Empty[]}>}
 */
export function postNote(note) {
  return post("/api/notes", note);
}

/**
 * @param {"undo" | "redo"} which
 * @param {number} revision
 * @returns {Promise<Change>}
 */
export function postHistory(which, revision) {
  return post(`/api/${which}`, { revision });
}

/**
 * @param {number} revision
 * @param {{points: string[], frame: number, direction: Direction, until: number | null}} request
 * @returns {Promise<Job>}
 */
export function postTrack(revision, request) {
  return post("/api/track", { revision, ...request });
}

/**
 * @param {number} revision
 * @param {Targets} targets
 * @returns {Promise<Job>}
 */
export function postDetect(revision, targets) {
  return post("/api/detect", { revision, ...targets });
}

/** Of any kind. @param {number | string} job */
export async function stopJob(job) {
  await send(`/api/track/${encodeURIComponent(job)}`, { method: "DELETE", headers: { "Content-Type": "application/json" } });
}

/**
 * @param {"json" | "csv" | "cvat"} format
 * @returns {string} an address that downloads the labels
 */
export function exportAddress(format) {
  return `/api/export?format=${format}`;
}

/**
 * @param {string} format
 * @param {{content: string, encoding: "text" | "base64", replace: boolean}} body
 * @returns {Promise<Change>}
 */
export function postImport(format, body) {
  return post(`/api/import?format=${format}`, body);
}

/** @returns {Promise<ReviewState>} */
export async function getReview() {
  return (await send("/api/review", { cache: "no-store" })).json();
}

/**
 * @param {number} sample its place in the list
 * @param {Pixel | null} pixel where the point is; null: it cannot be told
 * @returns {Promise<{verdict: Verdict, summary: Summary}>}
 */
export function postVerdict(sample, pixel) {
  return post("/api/review", { sample, px: pixel && [pixel.u, pixel.v] });
}

/**
 * Follows what other windows and running jobs do.
 * @param {{change: (change: Change) => void, job: (job: Job) => void, notes: (empty: Empty[]) => void, save: (problem: string | null) => void,
 *   closed: () => void, lost: () => void, open: () => void}} on
 */
export function follow(on) {
  const events = new EventSource("/api/events");
  events.addEventListener("open", () => on.open());
  events.addEventListener("change", (event) => on.change(JSON.parse(event.data)));
  events.addEventListener("job", (event) => on.job(JSON.parse(event.data)));
  events.addEventListener("notes", (event) => on.notes(JSON.parse(event.data).empty));
  events.addEventListener("save", (event) => on.save(JSON.parse(event.data).save_problem));
  events.addEventListener("closed", () => {
    events.close();
    on.closed();
  });
  events.addEventListener("error", () => {
    on.lost();
    // A stream that was refused (the cookie is of an earlier start) is not tried again by the browser.
    if (events.readyState === EventSource.CLOSED) on.closed();
  });
}
