// The report in a browser: nothing is blocked, all text can be read, and what moves moves together.

import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { after, before, test } from "node:test";

import { browser, flight, scratch, SCREENSHOTS, vice } from "./harness.js";

/** @import {Browser, Page} from "playwright-core" */

/** Text smaller than this cannot be read on a phone. */
const SMALLEST_PX = 11.9;

/** @type {Browser} */
let chromium;
let address = "";

before(async () => {
  const dataset = flight(4, 10);
  const page = join(scratch(), "report.html");
  const estimates = ["drift", "clock-offset"].map((name) => join(dataset, "estimates", `${name}.txt`)).join(",");
  const made = vice(["evaluate", dataset, "--labels", join(dataset, "labels", "floor.csv"), "--estimate", estimates, "--depth", "floor,zcam", "--report", page]);
  assert.equal(made.status, 0, made.stderr);
  address = pathToFileURL(page).href;
  chromium = await browser();
});
after(() => chromium.close());

/**
 * @param {number} width
 * @returns {Promise<{page: Page, complaints: string[]}>}
 */
async function open(width) {
  const context = await chromium.newContext({ viewport: { width, height: 800 } });
  const page = await context.newPage();
  /** @type {string[]} */
  const complaints = [];
  page.on("console", (message) => message.type() === "error" && complaints.push(message.text()));
  page.on("pageerror", (error) => complaints.push(String(error.stack)));
  page.on("request", (request) => !/^(file|data):/.test(request.url()) && complaints.push(request.url()));
  await page.goto(address);
  return { page, complaints };
}

for (const width of [380, 1280]) {
  test(`at ${width} pixels all text can be read and nothing sticks out`, async () => {
    const { page, complaints } = await open(width);
    const small = await page.evaluate((smallest) => {
      const found = [];
      for (const element of document.querySelectorAll("main *")) {
        const own = [...element.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && node.textContent?.trim());
        if (!own || element.getClientRects().length === 0) continue;
        let size = parseFloat(getComputedStyle(element).fontSize);
        if (element instanceof SVGTextElement) size *= element.getScreenCTM()?.a ?? 1;
        if (size < smallest) found.push(`${element.textContent?.slice(0, 40)}: ${size.toFixed(1)} px`);
      }
      return found;
    }, SMALLEST_PX);
    assert.deepEqual(small, []);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth);
    assert.ok(wide <= width, `${wide} pixels wide`);
    assert.deepEqual(complaints, []);
    mkdirSync(SCREENSHOTS, { recursive: true });
    await page.screenshot({ path: join(SCREENSHOTS, `report-${width}.png`), fullPage: true });
    await page.context().close();
  });
}

test("the first screen says whether each estimate can be trusted", async () => {
  const { page } = await open(1280);
  const questions = await page.locator(".answer h3").allTextContents();
  assert.deepEqual(questions, ["Can drift be trusted?", "Can clock-offset be trusted?"]);
  for (const answer of await page.locator(".answer").all()) {
    const box = await answer.locator(".trust").boundingBox();
    assert.ok(box && box.y + box.height < 800, "below the first screen");
    assert.match((await answer.textContent()) ?? "", /RMSE_2D [\d.]+ /);
  }
  await page.context().close();
});

test("plots, images and streams move together", async () => {
  const { page, complaints } = await open(1280);
  const plot = page.locator("svg.plot:has(.view)").first();
  // It may be higher than the window, and the switches stay at the top.
  await plot.evaluate((each) => window.scrollTo(0, window.scrollY + each.getBoundingClientRect().top - 150));
  const box = await plot.boundingBox();
  assert.ok(box);
  const at = (/** @type {number} */ share) => box.x + box.width * share;
  const y = box.y + 60;
  // Values under the pointer, of all streams of the panel.
  await page.mouse.move(at(0.5), y);
  const tip = await page.locator(".tip:visible").textContent();
  assert.match(tip ?? "", /^[\d.]+ s\n/);
  assert.match(tip ?? "", /drift [\d.]+ px/);
  assert.match(tip ?? "", /clock-offset [\d.]+ px/);
  // The same time in all plots.
  const panels = await page.locator("svg.view").count();
  assert.equal(await page.locator(".cursor").count(), panels);
  // A part of the time, everywhere.
  const marks = () => page.locator(".xmarks text").allTextContents();
  const before = await marks();
  await page.mouse.down();
  await page.mouse.move(at(0.7), y, { steps: 4 });
  await page.mouse.up();
  assert.equal(await page.locator("svg.view.zoomed").count(), panels);
  assert.notDeepEqual(await marks(), before);
  await page.keyboard.press("0");
  assert.equal(await page.locator("svg.view.zoomed").count(), 0);
  // A click leads to the frame of that time.
  const shown = () => page.locator(".strip figure.on").getAttribute("data-t");
  await page.mouse.click(at(0.95), y);
  assert.ok(Number(await shown()) > 3.2, `${await shown()} s`);
  assert.equal(await page.locator(".strip figure:visible").count(), 1);
  // A stream off is off everywhere, and on again.
  const drawn = () => page.locator('[data-name="drift"]:visible').count();
  assert.ok((await drawn()) > 0);
  await page.keyboard.press("2");
  assert.equal(await drawn(), 0);
  await page.keyboard.press("2");
  assert.ok((await drawn()) > 0);
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test("frames step by keys, and a picture of a bad moment grows to its full size", async () => {
  const { page } = await open(380);
  const strip = page.locator(".strip");
  await strip.focus();
  for (let i = 0; i < 60; i += 1) await page.keyboard.press("ArrowLeft");
  const first = Number(await strip.locator("figure.on").getAttribute("data-t"));
  await page.keyboard.press("ArrowRight");
  assert.ok(Number(await strip.locator("figure.on").getAttribute("data-t")) > first);
  const moment = page.locator(".moment").first();
  const picture = moment.locator("img");
  const wide = async () => (await picture.boundingBox())?.width ?? 0;
  const small = await wide();
  await moment.locator(".whole").click();
  assert.equal(await wide(), Number(await picture.getAttribute("width")));
  assert.ok((await wide()) > small);
  await page.context().close();
});
