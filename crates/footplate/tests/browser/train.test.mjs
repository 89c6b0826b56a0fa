// The page of a train in a real browser: its charts are drawn and continue, commands are sent, and a refused command shows the reason.

import assert from "node:assert/strict";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { findings } from "./axe.mjs";
import { AT, below, clickUntil, colours, launch, openQuietly, width } from "./browser.mjs";
import { PATIENCE, calibratedStore, end, say, serve } from "./railway.mjs";

/** A stop further from its target than this (mm) has failed: no interval of this train is as wide. */
const MISSED_MM = 60;

let browser;
let running;

before(async () => {
  running = await serve(calibratedStore("train"), 0);
  browser = await launch();
});

after(async () => {
  await browser?.close();
  if (running) await end(running);
});

const text = (page, selector) => page.locator(selector).textContent();
const until = (page, what, arg) => page.waitForFunction(what, arg, { timeout: PATIENCE });

test("a train runs at the step of its slider, and its charts show the detections", async () => {
  const { page, complaints } = await openQuietly(browser, `${running.url}#/train/24`);
  await say(running, "turnout all straight");
  await page.waitForSelector("#pages a[aria-current][data-train='24']");
  await until(page, () => document.querySelector("#step")?.max === "14");
  await page.locator("#step").focus();
  for (let step = 0; step < 8; step++) await page.keyboard.press("ArrowRight");
  await until(page, () => document.querySelectorAll("#passed tr").length > 6 && document.querySelector("#step-told").textContent === "8");
  assert.match(await text(page, "#at"), /^\S+ ± \d+ mm$/);
  assert.match(await text(page, "#speed"), /^\d+ ± \d+ mm\/s$/);
  assert.match(await text(page, "#due"), /^\S+ in [\d.]+ s ± \d+ ms$/);
  assert.match(await text(page, "#if-stopped"), /^stops \d+ ± \d+ mm ahead, at \S+, in [\d.]+ s$/);
  const drawn = await colours(page);
  assert.equal(drawn.length, 5);
  for (const [place, count] of drawn.entries()) assert.ok(count > 5, `chart ${place}: ${count} colours`);
  await page.screenshot({ path: join(AT, "train.png"), fullPage: true });

  // A reloaded page requests the last minutes from the server.
  await page.reload();
  await until(page, () => document.querySelectorAll("#passed tr").length > 6);
  const { t_s: times, way_mm: way } = await (await fetch(`${running.url}api/trains/24/history`)).json();
  assert.equal(times.length, way.length);
  assert.ok(times.at(-1) - times[0] > 10, `${times.length} moments`);
  assert.ok(way.at(-1) > 1000, `${way.at(-1)} mm`);

  // The charts of a live page can be paused, moved over the minutes that are kept, zoomed by dragging, and go on again.
  const shown = () => page.inputValue("#until").then(Number);
  // What was passed is listed before the last minutes have come.
  await until(page, () => Number(document.querySelector("#until").value) > 10);
  await page.click("#live");
  assert.equal(await page.getAttribute("#live", "aria-pressed"), "false");
  const paused = await shown();
  await page.locator("#until").focus();
  for (let nth = 0; nth < 30; nth++) await page.keyboard.press("ArrowLeft");
  await until(page, () => /^\d+ s ago$/.test(document.querySelector("#until-told").textContent));
  assert.ok(Math.abs(await shown() - (paused - 3)) < 0.3, "thirty steps of a tenth of a second");
  const over = page.locator("figure[data-chart=speed] .u-over");
  const { x, y, width: wide } = await over.boundingBox();
  await page.mouse.move(x + 0.25 * wide, y + 40);
  await page.mouse.down();
  await page.mouse.move(x + 0.75 * wide, y + 40, { steps: 5 });
  await page.mouse.up();
  const selected = await shown();
  const [first, last] = await page.$eval("#until", ({ min, max }) => [Number(min), Number(max)]);
  // A minute was shown, and its part from a quarter to three quarters was selected; no data is later than the last.
  const from = Math.max(first, paused - 3 - 60);
  assert.ok(Math.abs(selected - Math.min(from + 45, last)) < 1.5, `the selection ends at ${selected} of ${from} to ${last}`);
  await page.waitForTimeout(1000);
  // Four seconds of track time later; the slider shows tenths, and its greatest value rounded down.
  assert.ok(Math.abs(await shown() - selected) < 0.2, "new samples do not move a paused chart");
  await page.screenshot({ path: join(AT, "train-paused.png"), fullPage: true });
  await page.click("#live");
  await until(page, () => document.querySelector("#until-told").textContent === "now");

  // An owner's picture is kept in this browser, and shown with the train on the layout.
  await page.locator("summary", { hasText: "Picture" }).click();
  await page.setInputFiles("#portrait input", new URL("../../assets/dashboard/icon.png", import.meta.url).pathname);
  await page.waitForSelector("#portrait .portrait");
  await page.goto(`${running.url}#/layout`);
  await page.waitForSelector(".train .portrait");
  assert.deepEqual(complaints, []);
  await page.close();
});

test("a train is stopped at a clicked place, and an impossible command is refused with the reason", async () => {
  const { page, complaints } = await openQuietly(browser, `${running.url}#/train/24`);
  await until(page, () => document.querySelectorAll("#passed tr").length > 0);
  // A lap ahead, so that there is room to stop.
  await until(page, () => document.querySelector("#passed th").textContent === "E7");
  await clickUntil(page, below(page, "C13 C14", 3), () => !document.querySelector("#stop-at").disabled);
  // At four times real time a lap takes five seconds: on a busy machine the train may be too near by now, and the command is repeated.
  let said = "";
  for (let times = 0; times < 5 && !(await page.locator("#ends tr").count()); times++) {
    await page.click("#stop-at");
    await until(page, () => document.querySelector("#ends tr") || /refused/.test(document.querySelector("#stop-answer").textContent));
    said += `${await text(page, "#stop-answer")}\n`;
  }
  assert.ok(await page.locator("#ends tr").count(), `never stopped: ${said}`);
  const row = await page.locator("#ends tr").first().locator("td").allTextContents();
  const off = Number(row[3].replace("−", "-"));
  assert.ok(Math.abs(off) < MISSED_MM, `${row}`);

  await page.fill("#hold input", "4900");
  await page.click("#hold button");
  await until(page, () => /refused/.test(document.querySelector("#hold .answer").textContent));
  await page.fill("#arrive-at", "Z99");
  await page.click("#arrive button");
  await until(page, () => /Z99/.test(document.querySelector("#arrive .answer").textContent));
  assert.equal(await text(page, "#hold .answer"), "", "what comes of an order is said beside it, and nowhere else");
  assert.deepEqual(await page.$$eval(".orders label span", (all) => all.map((one) => one.textContent)),
    ["at most 1 of 1000 beyond it", "Stop from step (empty: the best)", "stop there only after passing it once", "send it so that it arrives in the direction of that sensor", "Place of arrival", "Arrive in (s)", "Speed to hold (mm/s)", "Distance to move (mm)", "Reverse, then run at step", "Train to follow", "Gap to it", "in", "Choose a picture; it stays in this browser", "Pickup (mm)", "From there to the far end (mm)"]);
  // What the prompt can say of a stop and a journey, the page can.
  const ordered = async (button) => {
    const [request] = await Promise.all([page.waitForRequest("**/api/orders"), page.click(button)]);
    return JSON.parse(request.postData()).line;
  };
  await page.locator(".orders summary", { hasText: "More about stopping" }).click();
  await page.fill("#from-step", "9");
  await page.check("#next-round");
  assert.match(await ordered("#stop-at"), /^stop 24 at (C13|C14|E7)\S* at step 9 next round$/);
  await page.check("#facing");
  assert.match(await ordered("#go-to"), /^go 24 to (C13|C14|E7)\S* facing$/);
  assert.equal(await ordered("#reverse-then button"), "reverse 24 at step 8");
  await ordered("#stop");
  // The browser logs the refusal of the last command as an error of the page.
  assert.deepEqual(complaints.filter((complaint) => !/422/.test(complaint)), []);
  await page.close();
});

test("a throttle is locked to its train on a phone, and the train stops when the page is put away", async () => {
  const { page, complaints } = await openQuietly(browser, `${running.url}#/train/24`, { viewport: { width: 390, height: 800 }, hasTouch: true });
  await until(page, () => document.querySelector("#step")?.max === "14");
  await page.click("#lock");
  assert.ok(await page.locator("#stop").isVisible());
  for (const gone of ["nav", ".charts", ".orders", "#track"]) assert.ok(await page.locator(gone).isHidden(), gone);
  for (const button of ["#slower", "#faster", "#stop", "#reverse"]) assert.ok((await page.locator(button).boundingBox()).height >= 64, button);
  // The light is shown as switched, on this page and on every other.
  const light = page.locator("#functions button").first();
  assert.equal(await light.textContent(), "Light");
  await light.click();
  await until(page, () => document.querySelector("#functions button").getAttribute("aria-pressed") === "true");
  await light.click();
  await until(page, () => document.querySelector("#functions button").getAttribute("aria-pressed") === "false");
  // A train that is at rest for a moment may be about to run again: it gets its stop, too.
  const stop = page.waitForRequest((request) => request.url().endsWith("/api/orders") && request.postData()?.includes("stop 24"));
  await page.evaluate(() => {
    Object.defineProperty(document, "hidden", { value: true, configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
    delete document.hidden;
  });
  await stop;
  for (let step = 0; step < 6; step++) await page.click("#faster");
  await until(page, () => /^Runs at \d+ mm\/s \(\d+ km\/h\), step 6\.$/.test(document.querySelector("#now").textContent));
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "throttle-locked.png") });
  // A phone that is put away reports the page as hidden.
  await page.evaluate(() => {
    Object.defineProperty(document, "hidden", { value: true, configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
  });
  await until(page, () => /^(Slows down from|At rest at)/.test(document.querySelector("#now").textContent));
  await page.evaluate(() => delete document.hidden);
  await page.click("#lock");
  assert.ok(await page.locator("nav").isVisible());
  assert.deepEqual(complaints, []);
  await page.close();
});

test("on a phone, in the dark and in German nothing is wider than the page", async () => {
  const options = { viewport: { width: 390, height: 800 }, colorScheme: "dark", locale: "de-DE", hasTouch: true };
  const { page, complaints } = await openQuietly(browser, `${running.url}#/train/24`, options);
  await until(page, () => document.querySelectorAll("#passed tr").length > 0);
  assert.equal(await width(page), 390);
  assert.equal(await text(page, "#reverse"), "Wenden");
  for (const count of await colours(page)) assert.ok(count > 1);
  await page.screenshot({ path: join(AT, "train-phone.png"), fullPage: true });
  await page.goto(`${running.url}#/train/7`);
  await until(page, () => /Zug 7 gehört nicht zu dieser Sitzung/.test(document.querySelector("#unknown").textContent));
  assert.deepEqual(complaints.filter((complaint) => !/404/.test(complaint)), []);
  await page.close();
});
