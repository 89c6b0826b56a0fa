// What the tests of all pages have in common: a browser, a page that collects complaints, and a look at its charts.

import { createRequire } from "node:module";
import { join, resolve } from "node:path";

/** Where screenshots go, and where the package that drives the browser is. */
export const AT = resolve(process.env.BROWSER_AT);

export function launch() {
  const { chromium } = createRequire(join(AT, "package.json"))("playwright-core");
  return chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox", "--disable-gpu"] });
}

/** Opens a page; what it complains of, or asks the network for, is collected. */
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

/** Opens a live page; what it complains of is collected. */
export async function openQuietly(browser, address, options = {}) {
  const page = await browser.newPage({ viewport: { width: 1300, height: 900 }, ...options });
  const complaints = [];
  page.on("console", (message) => message.type() === "error" && complaints.push(message.text()));
  page.on("pageerror", (error) => complaints.push(String(error)));
  await page.goto(address);
  return { page, complaints };
}

/** How many different colours each chart's canvas shows: a blank one has a single one. */
export const colours = (page) => page.$$eval(".uplot canvas", (all) => all.map((canvas) => {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return new Set(new Uint32Array(data.buffer)).size;
}));

/** How wide a page is: a phone zooms out until everything fits, and what it then shows is wider than it is. */
export const width = (page) => page.evaluate(() => Math.max(document.documentElement.scrollWidth, innerWidth));
