// Common code of the browser tests: starting the browser, collecting console errors, and looking at charts.

import { createRequire } from "node:module";
import { join, resolve } from "node:path";

/** Where screenshots go, and where the package that drives the browser is. */
export const AT = resolve(process.env.BROWSER_AT);

export function launch() {
  const { chromium } = createRequire(join(AT, "package.json"))("playwright-core");
  return chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox", "--disable-gpu"] });
}

/** Opens a file as a page; collects console errors and network requests. */
export async function openPage(browser, address, options = {}) {
  const page = await browser.newPage({ viewport: { width: 1300, height: 900 }, ...options });
  const complaints = [];
  page.on("console", (message) => message.type() === "error" && complaints.push(message.text()));
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("request", (request) => request.url().startsWith("http") && complaints.push(request.url()));
  await page.goto(address);
  await page.waitForSelector(".uplot");
  return { page, complaints };
}

/** Opens a live page; collects console errors, with the address of what could not be loaded. */
export async function openQuietly(browser, address, options = {}) {
  const page = await browser.newPage({ viewport: { width: 1300, height: 900 }, ...options });
  const complaints = [];
  page.on("console", (message) => message.type() === "error" && complaints.push(`${message.text()} ${message.location().url}`));
  page.on("pageerror", (error) => complaints.push(String(error)));
  await page.goto(address);
  return { page, complaints };
}

/** How long a click may take to show (ms) before it is repeated, and how long it is repeated. */
const [SHOWS_WITHIN, REPEATED_FOR] = [3_000, 60_000];

/** Clicks the point that `at` finds until `holds` is true in the page: a notice in the header may move a drawing just before the click. */
export async function clickUntil(page, at, holds, arg) {
  for (const began = Date.now(); ;) {
    await page.mouse.click(...await at());
    try {
      return await page.waitForFunction(holds, arg, { timeout: SHOWS_WITHIN });
    } catch (error) {
      if (Date.now() - began > REPEATED_FOR) throw error;
    }
  }
}

/** The point this far (px) below the middle of a name in the drawing. */
export const below = (page, name, px) => async () => {
  const place = page.locator("#track text", { hasText: name }).first();
  await place.scrollIntoViewIfNeeded();
  const { x, y, width: wide, height } = await place.boundingBox();
  return [x + wide / 2, y + height + px];
};

/** The number of different colours on each chart's canvas: a blank canvas has one. */
export const colours = (page) => page.$$eval(".uplot canvas", (all) => all.map((canvas) => {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return new Set(new Uint32Array(data.buffer)).size;
}));

/** The width of a page: a phone zooms out until everything fits, which makes the page wider than the screen. */
export const width = (page) => page.evaluate(() => Math.max(document.documentElement.scrollWidth, innerWidth));
