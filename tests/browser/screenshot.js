// Makes docs/annotate.png: `npm run screenshot` in this folder, after `cargo build`.

import { copyFileSync } from "node:fs";
import { join } from "node:path";

import { browser, flight, ROOT, scratch, SCREENSHOTS, Server, Window } from "./harness.js";

const SECONDS = 10;
const RATE_HZ = 20;
const SHOWN = 36;

const dataset = flight(SECONDS, RATE_HZ);
const estimates = ["drift", "clock-offset"].map((name) => join(dataset, "estimates", `${name}.txt`)).join(",");
const server = await Server.start(dataset, join(scratch(), "my_flight.json"), ["--fps", "10", "--estimate", estimates, "--depth", "floor"]);
const chromium = await browser();
const window = await Window.open(chromium, server);
const { page } = window;
await window.press("s");
await page.getByRole("button", { name: /^Use all/ }).click();
await server.until("the suggestions are points", ({ points }) => points.length === 4);
await window.press("Shift+B");
await server.until("they are tracked", ({ points, jobs }) => points.some(({ observations }) => observations.length > 1) && jobs.length > 0 && jobs.every(({ state }) => state !== "running"));
await window.goTo(SHOWN);
await window.press("1", "Shift+ArrowLeft");
await server.until("a correction is tracked", ({ points, jobs }) =>
  points[0].observations.some(({ frame, source }) => frame > 0 && source === "manual") && jobs.every(({ state }) => state !== "running"));
// Notes pass; the picture is of the work.
await page.waitForFunction(() => document.getElementById("notes")?.childElementCount === 0);
await page.waitForFunction(() => document.querySelectorAll("#dots tr").length > 0);
await window.screenshot("annotate");
copyFileSync(join(SCREENSHOTS, "annotate.png"), join(ROOT, "docs", "annotate.png"));
await chromium.close();
await server.end();
