// Starts the program, a browser and data sets for the tests. All that is made lies in folders that are removed at the end,
// but for the pictures in `target/browser-screenshots`, which are for a person to look at.

import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, dirname, join, resolve } from "node:path";
import { after } from "node:test";
import { fileURLToPath } from "node:url";

import { chromium } from "playwright-core";

/** @import {ChildProcess} from "node:child_process" */
/** @import {Browser, Page} from "playwright-core" */
/** @import {State} from "../../vice-annotate/page/types.js" */

export const ROOT = resolve(dirname(fileURLToPath(import.meta.url)), "../..");
const TARGET = resolve(ROOT, process.env.CARGO_TARGET_DIR ?? "target");
export const SCREENSHOTS = join(TARGET, "browser-screenshots");
const START_MS = 60_000;
export const WAIT_MS = 30_000;

/**
 * Programs that were started. One that a failed test leaves behind would keep the test's own process waiting.
 * @type {Set<ChildProcess>}
 */
const children = new Set();
after(() => children.forEach((child) => child.kill("SIGKILL")));

/** @returns {string} */
export function program() {
  const found = resolve(process.env.VICE_BIN ?? join(TARGET, "debug", "vice"));
  assert.ok(existsSync(found), `${found} is missing: run \`cargo build\`, or say in VICE_BIN where \`vice\` is`);
  return found;
}

/** @returns {string} */
function browserProgram() {
  const names = process.env.VICE_BROWSER ? [process.env.VICE_BROWSER] : ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
  const found = names.find((name) => existsSync(name));
  assert.ok(found, "no chromium found: install Debian's, or say in VICE_BROWSER where one is");
  return found;
}

/**
 * @param {string} command
 * @param {string[]} args
 */
function run(command, args) {
  const { status, stderr, error } = spawnSync(command, args, { encoding: "utf8" });
  assert.equal(status, 0, `${command} ${args.join(" ")}: ${error?.message ?? stderr}`);
}

/**
 * The program, to its end.
 * @param {string[]} args
 */
export function vice(args) {
  return spawnSync(program(), args, { encoding: "utf8", maxBuffer: 256 * 1024 * 1024 });
}

/**
 * A folder of the shared data, by default in `../shared`.
 * @param {string} relative
 * @returns {string | null} null where it is missing, which is said; with `VICE_REQUIRE_DATA=1` it fails instead
 */
export function shared(relative) {
  const path = resolve(ROOT, process.env.VICE_SHARED ?? "../shared", relative);
  if (existsSync(path)) return path;
  assert.notEqual(process.env.VICE_REQUIRE_DATA, "1", `${path} is missing`);
  console.log(`skipped: ${path} is missing (set VICE_SHARED to the folder of shared data)`);
  return null;
}

/** @returns {string} a new folder that goes away with this process */
export function scratch() {
  const folder = mkdtempSync(join(tmpdir(), "vice-browser-"));
  process.on("exit", () => rmSync(folder, { recursive: true, force: true }));
  return folder;
}

/**
 * A rendered flight with exact labels.
 * @param {number} seconds
 * @param {number} [rateHz]
 * @param {number} [seed]
 * @returns {string} its folder
 */
export function flight(seconds, rateHz = 10, seed = 1) {
  const folder = join(scratch(), "flight");
  run(program(), ["synth", folder, "--duration", String(seconds), "--rate", String(rateHz), "--seed", String(seed)]);
  return folder;
}

/**
 * Moving pictures in the EuRoC layout.
 * @param {number} width
 * @param {number} height
 * @param {number} count
 * @returns {string} its folder
 */
export function film(width, height, count) {
  const folder = join(scratch(), "film");
  const camera = join(folder, "mav0", "cam0");
  mkdirSync(join(camera, "data"), { recursive: true });
  const pattern = `testsrc2=size=${width}x${height}:rate=10,noise=alls=20:allf=t,format=gray`;
  const stamps = Array.from({ length: count }, (_, at) => String(1_600_000_000_000_000_000n + BigInt(at) * 100_000_000n));
  run("ffmpeg", ["-v", "error", "-f", "lavfi", "-i", pattern, "-frames:v", String(count), "-start_number", "0", join(camera, "data", "%d.png")]);
  writeFileSync(join(camera, "data.csv"), `#timestamp [ns],filename\n${stamps.map((stamp, at) => `${stamp},${at}.png\n`).join("")}`);
  writeFileSync(join(camera, "sensor.yaml"), `sensor_type: camera
T_BS:
  cols: 4
  rows: 4
  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
rate_hz: 10
resolution: [${width}, ${height}]
camera_model: pinhole
intrinsics: [${width / 2}, ${width / 2}, ${width / 2}, ${height / 2}]
distortion_model: radial-tangential
distortion_coefficients: [0, 0, 0, 0]
`);
  return folder;
}

/**
 * The exact labels of a rendered flight.
 * @param {string} folder
 * @returns {Map<string, Map<string, {u: number, v: number}>>} by point, then stamp
 */
export function truth(folder) {
  const points = new Map();
  for (const line of readFileSync(join(folder, "labels", "scene.csv"), "utf8").trim().split("\n").slice(1)) {
    const [point, stamp, u, v] = line.split(",");
    if (!points.has(point)) points.set(point, new Map());
    points.get(point).set(stamp, { u: Number(u), v: Number(v) });
  }
  return points;
}

/** The program with its address. */
export class Server {
  /**
   * @param {ChildProcess} child
   * @param {string} url which opens the page once
   */
  constructor(child, url) {
    this.child = child;
    this.url = url;
    this.origin = new URL(url).origin;
    this.cookie = "";
  }

  /** Uses the address up, as a browser does. */
  async enter() {
    const answer = await fetch(this.url);
    if (answer.status !== 200) throw new Error(`${this.url}: ${answer.status}`);
    this.cookie = (answer.headers.get("set-cookie") ?? "").split(";")[0] ?? "";
  }

  /**
   * @param {string} dataset
   * @param {string} labels the file, in a folder that is there
   * @param {string[]} [more] arguments
   * @param {boolean} [enter] whether its address is used up
   * @returns {Promise<Server>}
   */
  static async start(dataset, labels, more = [], enter = true) {
    const child = spawn(program(), ["annotate", dataset, "--labels", basename(labels), "--no-open", "--port", "0", ...more], {
      cwd: dirname(labels),
      stdio: ["ignore", "pipe", "pipe"],
    });
    let said = "";
    /** @type {string} */
    const url = await new Promise((resolve, reject) => {
      const timer = setTimeout(() => reject(new Error(`no address within ${START_MS} ms: ${said}`)), START_MS);
      /** @param {Buffer} part */
      const heard = (part) => {
        said += part;
        const found = said.match(/http:\/\/\S+token=[\w.~-]+/);
        if (!found) return;
        clearTimeout(timer);
        resolve(found[0]);
      };
      child.stdout.on("data", heard);
      child.stderr.on("data", heard);
      child.on("exit", (code) => reject(new Error(`annotate ended with ${code}: ${said}`)));
    });
    const server = new Server(child, url);
    children.add(child);
    if (enter) await server.enter();
    return server;
  }

  /**
   * Shows a page the cookie that this was let in with.
   * @param {Page} page
   */
  async admit(page) {
    const [name = "", value = ""] = this.cookie.split("=");
    await page.context().addCookies([{ name, value, url: this.origin, httpOnly: true, sameSite: "Strict" }]);
  }

  /**
   * @param {NodeJS.Signals} [signal]
   * @returns {Promise<void>} when it has ended
   */
  async end(signal = "SIGTERM") {
    if (this.child.exitCode !== null || this.child.signalCode !== null) return;
    const ended = new Promise((resolve) => this.child.once("exit", resolve));
    this.child.kill(signal);
    await ended;
  }

  /**
   * @param {string} path
   * @param {RequestInit} [init]
   */
  request(path, init = {}) {
    return fetch(this.origin + path, { ...init, headers: { Cookie: this.cookie, "Content-Type": "application/json", ...init.headers } });
  }

  /** @returns {Promise<State>} */
  async state() {
    return (await this.request("/api/state")).json();
  }

  /**
   * Waits until the labels are as they should be.
   * @param {string} what
   * @param {(state: State) => boolean} holds
   * @returns {Promise<State>}
   */
  async until(what, holds) {
    const deadline = Date.now() + WAIT_MS;
    for (;;) {
      const state = await this.state();
      if (holds(state)) return state;
      assert.ok(Date.now() < deadline, `waited in vain until ${what}: ${JSON.stringify(state.points).slice(0, 2000)}`);
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
  }
}

/**
 * The observation of a point in a frame.
 * @param {State} state
 * @param {string} point
 * @param {number} frame
 */
export function observation(state, point, frame) {
  return state.points.find(({ name }) => name === point)?.observations.find((each) => each.frame === frame);
}

/** @returns {Promise<Browser>} */
export function browser() {
  // A browser has no sandbox for root, as whom containers run their tests.
  const args = process.getuid?.() === 0 ? ["--no-sandbox"] : [];
  return chromium.launch({ executablePath: browserProgram(), args });
}

/** A window with the page, at the size that it must be usable at. */
export class Window {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    /** @type {string[]} what went wrong in it, with what the browser blocked */
    this.complaints = [];
    page.on("console", (message) => message.type() === "error" && this.complaints.push(message.text()));
    page.on("pageerror", (error) => this.complaints.push(String(error.stack)));
  }

  /**
   * @param {Browser} from
   * @param {Server} server
   * @param {(page: Page) => Promise<unknown>} [prepare]
   */
  static async open(from, server, prepare = async () => undefined) {
    const context = await from.newContext({ viewport: { width: 1280, height: 720 } });
    const window = new Window(await context.newPage());
    window.page.setDefaultTimeout(WAIT_MS);
    await prepare(window.page);
    await window.goto(server);
    return window;
  }

  /** @param {Server} server */
  async goto(server) {
    await server.admit(this.page);
    await this.page.goto(server.origin);
    await this.shows(0);
    await this.page.waitForFunction(() => document.activeElement?.id === "marks");
  }

  /** @param {number} frame */
  async shows(frame) {
    await this.page.waitForFunction((wanted) => document.getElementById("image")?.dataset.frame === wanted, String(frame));
  }

  /** @param {...string} keys */
  async press(...keys) {
    for (const key of keys) await this.page.keyboard.press(key);
  }

  /** @param {number} frame of the data set */
  async goTo(frame) {
    await this.page.fill("#frame", String(frame));
    await this.page.keyboard.press("Enter");
    await this.page.waitForFunction((wanted) => document.getElementById("timeline")?.getAttribute("aria-valuenow") === wanted, String(frame));
  }

  /**
   * Where a pixel lies in the window, of an image that is shown whole.
   * @param {{u: number, v: number}} pixel
   * @param {{width: number, height: number}} image
   */
  async place({ u, v }, { width, height }) {
    const box = await this.page.locator("#marks").boundingBox();
    assert.ok(box);
    const scale = Math.min(box.width / width, box.height / height);
    return {
      x: box.x + (box.width - scale * width) / 2 + (u + 0.5) * scale,
      y: box.y + (box.height - scale * height) / 2 + (v + 0.5) * scale,
    };
  }

  /** All is on disk. */
  async saved() {
    await this.page.waitForFunction(() => document.getElementById("saved")?.textContent === "All saved");
  }

  /** @param {string | RegExp} text that a note or a banner holds */
  async told(text) {
    await this.page.locator("#notes, #banners").getByText(text).first().waitFor();
  }

  /** @param {string} name */
  async screenshot(name) {
    mkdirSync(SCREENSHOTS, { recursive: true });
    await this.page.screenshot({ path: join(SCREENSHOTS, `${name}.png`) });
  }

  async close() {
    await this.page.context().close();
  }
}
