// The other pages in a real browser: calibration with the measurements behind a number, health, recordings replayed and compared,
// and odometry of a file. All pages pass axe in light and dark, and fit a phone.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { findings } from "./axe.mjs";
import { AT, colours, launch, openQuietly, width } from "./browser.mjs";
import { PATIENCE, calibratedStore, end, say, serve } from "./railway.mjs";

const PAGES = ["layout", "train/24", "calibration", "health", "recordings", "odometry", "editor", "schedules"];

let browser;
let running;

const until = (page, what, arg) => page.waitForFunction(what, arg, { timeout: PATIENCE });
const text = (page, selector) => page.locator(selector).textContent();

/** Waits for this many samples: then every chart has data. */
async function runsAround(contacts) {
  for (;;) {
    const { t_s: times } = await (await fetch(`${running.url}api/trains/24/history`)).json();
    if (times?.length > contacts) return;
    await new Promise((resolve) => setTimeout(resolve, 500));
  }
}

before(async () => {
  const store = calibratedStore("pages");
  // An earlier session, to be replayed.
  running = await serve(store, 0);
  await say(running, "turnout all straight");
  await say(running, "speed 24 8");
  await runsAround(120);
  await end(running);
  running = await serve(store, 0);
  await say(running, "turnout all straight");
  await say(running, "speed 24 9");
  await runsAround(120);
  browser = await launch();
});

after(async () => {
  await browser?.close();
  if (running) await end(running);
});

test("a calibration shows both sides of each step and the measurements behind a number; exclusions can be undone", async () => {
  const { page, complaints } = await openQuietly(browser, `${running.url}#/calibration`);
  await until(page, () => document.querySelectorAll("#steps tr").length > 10);
  await until(page, () => !document.querySelector("#of-store").hidden);
  for (const [place, count] of (await colours(page)).entries()) assert.ok(count > 5, `chart ${place}: ${count} colours`);
  await page.screenshot({ path: join(AT, "calibration.png"), fullPage: true });
  await page.fill("#why-of", "SPEED:8");
  await page.click("#ask button");
  // The number of passes in the first session depends on when the command arrived: five to seven.
  await until(page, () => document.querySelectorAll("#listings tbody tr").length > 2);
  const first = page.locator("#listings tbody tr button").first();
  // An exclusion needs a reason.
  await first.click();
  assert.match(await text(page, "#why-answer"), /reason/);
  await page.fill("#reason", "a hand on the track");
  await first.click();
  await until(page, () => document.querySelectorAll("#marks li").length === 1);
  assert.match(await text(page, "#marks"), /a hand on the track/);
  await page.locator("#marks button").click();
  await until(page, () => document.querySelector("#marked").hidden);
  await page.fill("#why-of", "MOOD:8");
  await page.click("#ask button");
  await until(page, () => /SPEED:14/.test(document.querySelector("#why-answer").textContent));
  assert.deepEqual(complaints.filter((complaint) => !/422/.test(complaint)), []);
  await page.close();
});

test("health shows prediction errors with their intervals, and the timing of the line", async () => {
  const { page, complaints } = await openQuietly(browser, `${running.url}#/health`);
  await until(page, () => document.querySelectorAll("#fares tr").length === 1);
  await until(page, () => /times: median/.test(document.querySelector("#poll").textContent));
  const period = Number(/median ([\d.]+) ms/.exec(await text(page, "#poll"))[1]);
  // Five modules of two bytes and a request at 2400 baud with eleven bits a byte: 50 ms, and the response time of the station.
  assert.ok(period > 50 && period < 75, `${period} ms`);
  await until(page, () => document.querySelectorAll(".uplot canvas").length === 5);
  for (const [place, count] of (await colours(page)).entries()) assert.ok(count > 4, `chart ${place}: ${count} colours`);
  await page.screenshot({ path: join(AT, "health.png"), fullPage: true });
  assert.deepEqual(complaints, []);
  await page.close();
});

test("sessions are replayed with a slider and at a speed, and two are compared", async () => {
  const { page, complaints } = await openQuietly(browser, `${running.url}#/recordings`);
  await until(page, () => document.querySelectorAll("#recordings input:not([disabled])").length === 3);
  const boxes = page.locator("#recordings tr", { hasText: "driving" }).locator("input");
  await boxes.last().check();
  await until(page, () => document.querySelectorAll(".session").length === 1 && Number(document.querySelector("#time").max) > 5);
  const before = await text(page, ".where");
  await page.locator("#time").focus();
  await page.keyboard.press("End");
  await until(page, (was) => document.querySelector(".where").textContent !== was, before);
  assert.match(await text(page, ".where"), /Train 24: \S+ ± \d+ mm, \d+ mm\/s/);
  await boxes.first().check();
  await until(page, () => document.querySelectorAll(".session").length === 2 && document.querySelectorAll("#figures tr").length === 2);
  // Both charts share their time axis with the slider: a click goes to that time, and playing goes on at the chosen speed.
  const charts = page.locator("#walked .uplot");
  assert.equal(await charts.count(), 2);
  for (const [place, count] of (await colours(page)).entries()) assert.ok(count > 4, `chart ${place}: ${count} colours`);
  const over = page.locator("#walked .u-over").first();
  const { width: wide } = await over.boundingBox();
  await over.click({ position: { x: wide / 2, y: 20 } });
  const most = Number(await page.getAttribute("#time", "max"));
  const time = () => page.locator("#time").inputValue().then(Number);
  assert.ok(Math.abs(await time() - most / 2) < 0.05 * most, `${await time()} of ${most}`);
  await page.selectOption("#played", "30");
  await page.click("#play");
  await until(page, () => document.querySelector("#time").value === document.querySelector("#time").max);
  assert.equal(await text(page, "#play"), "Play");
  assert.doesNotMatch(await page.locator("#walked .u-legend").first().textContent(), /–/);
  const [picture] = await Promise.all([page.waitForEvent("download"), page.locator("#walked .csv", { hasText: "PNG" }).first().click()]);
  assert.match(picture.suggestedFilename(), /\.png$/);
  await page.screenshot({ path: join(AT, "recordings.png"), fullPage: true });
  // Two quick ticks open both sessions once.
  const ticked = () => page.evaluate(() => [...document.querySelectorAll("#recordings input:checked")].forEach((box) => box.click()));
  await ticked();
  await until(page, () => document.querySelectorAll(".session").length === 0);
  await boxes.evaluateAll((all) => [all[0], all.at(-1)].forEach((box) => box.click()));
  await until(page, () => document.querySelectorAll("#figures tr").length === 2 && document.querySelector("#answer").textContent === "");
  assert.equal(await page.locator(".session").count(), 2);
  assert.deepEqual(complaints, []);
  await page.close();
});

test("a tachometer recording is analysed, and a wrong file is refused with the reason", async () => {
  const { page, complaints } = await openQuietly(browser, `${running.url}#/odometry`);
  const folder = mkdtempSync(join(tmpdir(), "footplate-slide-"));
  execFileSync(process.env.FOOTPLATE, ["simulate", "line", "--scenario", "S5", "--seed", "1", "--teeth", "80", "--out", folder], { stdio: "pipe" });
  const recording = join(folder, readdirSync(folder).find((name) => name.endsWith(".csv")));
  await page.setInputFiles("#file", recording);
  await until(page, () => /Odometry of/.test(document.querySelector("#answer").textContent));
  const frame = page.frameLocator("#result");
  await frame.locator(".uplot").first().waitFor({ timeout: PATIENCE });
  await page.screenshot({ path: join(AT, "odometry.png"), fullPage: true });
  const vehicle = readFileSync(recording.replace(/csv$/, "toml"), "utf8").replace(/^name = .*$/m, 'name = "the one that was dropped"');
  await page.setInputFiles("#file", { name: "train.toml", mimeType: "application/toml", buffer: Buffer.from(vehicle) });
  await frame.getByText("Vehicle: the one that was dropped.").waitFor({ timeout: PATIENCE });
  await page.setInputFiles("#file", { name: "broken.csv", mimeType: "text/csv", buffer: Buffer.from("t_s,pulses_1\n0.1,3\n") });
  await until(page, () => /pulses_2/.test(document.querySelector("#answer").textContent));
  assert.match(await text(page, "#answer"), /^broken\.csv/);
  await page.setInputFiles("#file", { name: "train.toml", mimeType: "application/toml", buffer: Buffer.from("name = 3") });
  await until(page, () => /^the vehicle's file/.test(document.querySelector("#answer").textContent));
  assert.deepEqual(complaints.filter((complaint) => !/422/.test(complaint)), []);
  await page.close();
});

for (const colorScheme of ["light", "dark"]) {
  test(`no page has a serious finding of axe in the ${colorScheme}`, async () => {
    const { page } = await openQuietly(browser, running.url, { colorScheme });
    for (const name of PAGES) {
      await page.goto(`${running.url}#/${name}`);
      await until(page, (wanted) => document.querySelector("#page").dataset.page === wanted, name.split("/")[0]);
      await page.waitForTimeout(600);
      assert.deepEqual(await findings(page), [], name);
    }
    await page.close();
  });
}

test("every page fits a phone, in German", async () => {
  const { page } = await openQuietly(browser, running.url, { viewport: { width: 390, height: 800 }, locale: "de-DE", hasTouch: true });
  for (const name of PAGES) {
    await page.goto(`${running.url}#/${name}`);
    await until(page, (wanted) => document.querySelector("#page").dataset.page === wanted, name.split("/")[0]);
    await page.waitForTimeout(600);
    assert.equal(await width(page), 390, name);
    assert.deepEqual(await findings(page), [], name);
    // A missing text is shown as its key.
    const untranslated = await page.evaluate(() => [...document.querySelectorAll("[data-word]")].filter((one) => one.textContent === one.dataset.word && /-/.test(one.dataset.word)).map((one) => one.dataset.word));
    assert.deepEqual(untranslated, [], name);
    await page.screenshot({ path: join(AT, `phone-${name.replace("/", "-")}.png`), fullPage: true });
  }
  await page.close();
});

test("every path of the description answers as it says", async () => {
  const described = await (await fetch(`${running.url}api/openapi.json`)).json();
  const examples = Object.entries(described.paths);
  for (const [path, methods] of examples) {
    for (const [method, { parameters = [], responses, requestBody }] of Object.entries(methods)) {
      // An emergency stop would end the other tests, and a stream never ends.
      if (["/api/emergency-stop", "/api/events", "/api/slides/{scenario}"].includes(path)) continue;
      // A session answers only the request for its mode; the set-up answers the others (setup.test.mjs).
      if (path.startsWith("/api/setup") && method !== "get" || path.startsWith("/api/setup/")) continue;
      const filled = path.replace(/\{(\w+)\}/g, (_, name) => encodeURIComponent(parameters.find((one) => one.name === name).example));
      const kind = requestBody && Object.keys(requestBody.content)[0];
      const body = kind === "application/json" ? JSON.stringify({ line: "where" }) : kind ? "t_s\n" : undefined;
      const answer = await fetch(running.url + filled.slice(1), { method: method.toUpperCase(), body, headers: kind ? { "Content-Type": kind } : {} });
      assert.ok(String(answer.status) in responses, `${method} ${filled}: ${answer.status}`);
      if (!answer.ok) assert.ok((await answer.json()).error, `${method} ${filled}`);
    }
  }
});
