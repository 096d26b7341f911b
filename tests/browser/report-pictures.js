// Makes the pictures of docs/report.md: `npm run report-pictures` in this folder, after `cargo build`.

import { spawnSync } from "node:child_process";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

import { browser, program, ROOT, scratch } from "./harness.js";

const folder = scratch();
// The page names the data set as it was given: run beside it.
const made = spawnSync(resolve(program()), ["demo", "--out", "demo_out", "--quiet"], { cwd: folder, encoding: "utf8" });
if (made.status !== 0) throw new Error(made.stderr);
const address = pathToFileURL(join(folder, "demo_out", "report.html")).href;
const chromium = await browser();

/**
 * @param {string} name
 * @param {{width: number, height: number, dark?: boolean, print?: boolean, at?: string}} how
 */
async function picture(name, { width, height, dark = false, print = false, at }) {
  const context = await chromium.newContext({ viewport: { width, height }, colorScheme: dark ? "dark" : "light" });
  const page = await context.newPage();
  await page.goto(address);
  if (print) await page.emulateMedia({ media: "print" });
  if (at) await page.getByRole("heading", { name: at, exact: true }).evaluate((heading) => heading.scrollIntoView());
  await page.screenshot({ path: join(ROOT, "docs", name) });
  await context.close();
}

await picture("report.png", { width: 1280, height: 800 });
await picture("report-phone.png", { width: 380, height: 760 });
await picture("report-dark.png", { width: 1280, height: 800, dark: true, at: "Over time" });
// A sheet of A4 at 96 dots an inch.
await picture("report-print.png", { width: 794, height: 1123, print: true });
await chromium.close();
