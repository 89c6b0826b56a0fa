// A report in a real browser: every chart is drawn, in dark and light, on a phone, and by keyboard.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { copyFileSync, mkdirSync, mkdtempSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";

import { AT, colours, launch, openPage, width } from "./browser.mjs";

const LOGS = resolve(import.meta.dirname, "../../../../testdata/sensor-logs");
const log = (train, kind) => join(LOGS, `choochoos_2020_track_a_train${train}_${kind}.csv`);

let browser;
let address;

before(async () => {
  const folder = mkdtempSync(join(tmpdir(), "footplate-report-"));
  mkdirSync(AT, { recursive: true });
  // A recording has the name of its file; this one would run as a script if it were not escaped.
  const hostile = join(folder, "<img src=x onerror=document.title='taken-over'>.csv");
  copyFileSync(log(74, "run"), hostile);
  const out = join(folder, "report.html");
  const report = (...rest) => execFileSync(process.env.FOOTPLATE, ["report", ...rest, "--layout", "track-a"], { stdio: "pipe" });
  report(log(24, "run"), log(24, "stop"), log(74, "run"), log(74, "stop"), "--out", out);
  report(hostile, "--train", "74", "--out", join(folder, "hostile.html"));
  address = (name) => pathToFileURL(join(folder, name)).href;
  browser = await launch();
});
after(() => browser?.close());

/** Opens the report, or another page beside it. */
const open = (options = {}, name = "report.html") => openPage(browser, address(name), options);

for (const colorScheme of ["light", "dark"]) {
  test(`every chart is drawn in ${colorScheme}`, async () => {
    const { page, complaints } = await open({ colorScheme });
    const found = await colours(page);
    // Two trains: speeds, four of a change, two of forecasts, stops.
    assert.equal(found.length, 16);
    assert.ok(found.every((count) => count > 8), String(found));
    await page.screenshot({ path: join(AT, `report-${colorScheme}.png`), fullPage: true });
    assert.deepEqual(complaints, []);
    await page.close();
  });
}

test("a phone shows the page without scrolling sideways", async () => {
  const { page, complaints } = await open({ viewport: { width: 390, height: 844 }, isMobile: true, deviceScaleFactor: 2 });
  assert.equal(await width(page), 390);
  await page.screenshot({ path: join(AT, "report-phone.png"), fullPage: true });
  assert.deepEqual(complaints, []);
  await page.close();
});

test("the mouse and the arrow keys read values off a chart", async () => {
  const { page } = await open();
  const chart = page.locator("figure[data-chart=speeds]").first();
  await chart.locator(".u-over").hover();
  assert.match(await chart.locator(".u-legend").innerText(), /\d+\.\d mm\/s \(± \d/);
  const change = page.locator("figure[data-chart=change]").first();
  await page.mouse.move(0, 0);
  await change.locator(".u-over").first().focus();
  await page.keyboard.press("ArrowRight");
  assert.match(await change.locator(".u-legend").first().innerText(), /law:?\s*−?\d+ mm/);
  await page.close();
});

test("dragging zooms, Escape shows all again", async () => {
  const { page } = await open();
  const over = page.locator("figure[data-chart=forecasts] .u-over").first();
  const axis = () => page.locator("figure[data-chart=forecasts] canvas").first().evaluate((canvas) => canvas.toDataURL());
  const whole = await axis();
  await over.scrollIntoViewIfNeeded();
  const { x, y, width } = await over.boundingBox();
  await page.mouse.move(x + 0.2 * width, y + 50);
  await page.mouse.down();
  await page.mouse.move(x + 0.5 * width, y + 60, { steps: 4 });
  await page.mouse.up();
  const zoomed = await axis();
  assert.notEqual(zoomed, whole);
  await over.focus();
  await page.keyboard.press("Escape");
  assert.equal(await axis(), whole);
  await page.close();
});

test("another change can be selected", async () => {
  const { page, complaints } = await open();
  const pick = page.locator("figure[data-chart=change] select").first();
  const before = await page.locator("figure[data-chart=change] canvas").first().evaluate((canvas) => canvas.toDataURL());
  await pick.selectOption({ index: 0 });
  const now = await page.locator("figure[data-chart=change] canvas").first().evaluate((canvas) => canvas.toDataURL());
  assert.notEqual(now, before);
  assert.deepEqual(complaints, []);
  await page.close();
});

test("a name with markup is shown as text", async () => {
  const { page, complaints } = await open({}, "hostile.html");
  assert.equal(await page.title(), "Train 74 on track-a");
  assert.equal(await page.locator("img").count(), 0);
  assert.deepEqual(complaints, []);
  await page.close();
});

test("without scripts the page still shows its numbers", async () => {
  const page = await browser.newPage({ javaScriptEnabled: false });
  await page.goto(address("report.html"));
  const text = await page.locator("#train-24").innerText();
  for (const said of ["This chart needs JavaScript", "Speed by throttle step", "Stops measured with a tape, counted from the command", "to add"]) {
    assert.ok(text.includes(said), said);
  }
  await page.close();
});
