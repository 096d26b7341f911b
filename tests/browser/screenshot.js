// Makes docs/annotate.png: `npm run screenshot` in this folder, after `cargo build`.

import { copyFileSync } from "node:fs";
import { join } from "node:path";

import { browser, flight, ROOT, scratch, SCREENSHOTS, Server, Window } from "./harness.js";

const SECONDS = 10;
const RATE_HZ = 20;
const SHOWN = 48;

const dataset = flight(SECONDS, RATE_HZ);
const estimates = ["drift", "clock-offset"].map((name) => join(dataset, "estimates", `${name}.txt`)).join(",");
const server = await Server.start(dataset, join(scratch(), "my_flight.json"), ["--fps", "10", "--estimate", estimates, "--depth", "zmap"]);
const chromium = await browser();
const window = await Window.open(chromium, server);
const { page } = window;
await window.press("s");
await page.getByRole("button", { name: /^Use all/ }).click();
await server.until("the suggestions are points", ({ points }) => points.length === 4);
await window.press("Shift+B");
await server.until("they are tracked", ({ points, jobs }) => points.some(({ observations }) => observations.length > 1) && jobs.every(({ state }) => state !== "running"));
await window.goTo(SHOWN);
const { points } = await server.state();
const longest = points.reduce((one, other) => (other.observations.length > one.observations.length ? other : one));
await window.press(longest.name, "Shift+ArrowLeft");
await server.until("a correction is tracked", (state) =>
  state.points.some(({ observations }) => observations.some(({ frame, source }) => frame > 0 && source === "manual")) &&
  state.jobs.every((job) => job.state !== "running"));
// Away from all that would light up.
await page.mouse.move(640, 568);
// Notes pass; the picture is of the work.
await page.waitForFunction(() => document.getElementById("notes")?.childElementCount === 0);
await page.waitForFunction(() => document.querySelectorAll("#dots tr").length > 0);
await window.screenshot("annotate");
copyFileSync(join(SCREENSHOTS, "annotate.png"), join(ROOT, "docs", "annotate.png"));
await chromium.close();
await server.end();
