// Alarms in a real browser: each stays on every page until it is over or the operator ends it, and leads to its remedy.

import assert from "node:assert/strict";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { findings } from "./axe.mjs";
import { AT, launch, openQuietly, width } from "./browser.mjs";
import { PATIENCE, calibratedStore, end, say, serve } from "./railway.mjs";

/** The train really is at most this far from where it was said to be: two trains' lengths of rounding and survey. */
const SAME_PLACE_MM = 30;

let browser, store;
const running = new Set();

const until = (page, what, arg) => page.waitForFunction(what, arg, { timeout: PATIENCE });
const get = async ({ url }, path) => (await fetch(url + path)).json();
const picture = (program) => get(program, "api/picture");

/** Ends an alarm for the operator. */
const ends = async ({ url }, id) => (await fetch(`${url}api/alarms/${id}/end`, { method: "POST", headers: { "Content-Type": "application/json" }, body: "{}" })).status;

async function started(options) {
  const program = await serve(store, 0, options);
  running.add(program);
  return program;
}

before(async () => {
  store = calibratedStore("alarms");
  browser = await launch();
});
after(async () => {
  await browser?.close();
  await Promise.all([...running].map(end));
});

test("a train of unknown position is found by the truth of the simulation, or finds itself at the next sensor", async () => {
  const program = await started();
  const { page, complaints } = await openQuietly(browser, `${program.url}#/layout/24`);
  await until(page, () => document.querySelector("#guide")?.hidden === false);
  assert.match(await page.locator("#guide h3").textContent(), /Position of train 24 unknown/);
  assert.deepEqual(await findings(page), []);
  await page.click("#show-truth");
  await page.waitForSelector(".truth");
  await page.waitForSelector("#use-truth");
  const [truth] = await get(program, "api/truth");
  assert.equal(await page.locator("#use-truth").textContent(), `Train 24 is at ${truth.at}`);
  await page.screenshot({ path: join(AT, "guide.png"), fullPage: true });
  await page.click("#use-truth");
  // The way out is over, and with it the outline of the truth.
  await until(page, () => document.querySelector("#guide").hidden && !document.querySelector(".truth"));
  const mm = (place) => [place.split("+")[0], Number(/\+(\d+)mm/.exec(place)?.[1] ?? 0)];
  const [said, is] = [(await picture(program)).trains[0].at, truth.at].map(mm);
  assert.equal(said[0], is[0]);
  assert.ok(Math.abs(said[1] - is[1]) < SAME_PLACE_MM, `${said} beside ${is}`);
  assert.deepEqual(complaints, []);
  await page.close();
  running.delete(program);
  await end(program);

  // Another session knows nothing of it again: the train creeps to a sensor, stops there, and is known.
  const again = await started();
  await say(again, "turnout all straight");
  const { page: other } = await openQuietly(browser, `${again.url}#/layout/24`);
  await until(other, () => document.querySelector("#guide")?.hidden === false);
  await other.locator("#guide button", { hasText: "Find train 24" }).click();
  await until(other, () => document.querySelector("#guide").hidden);
  for (let own; !own?.at_rest;) [own] = (await picture(again)).trains;
  const [found] = (await picture(again)).trains;
  assert.equal(found.step, 0);
  assert.ok(found.half_mm < 200, `± ${found.half_mm} mm`);
  await other.close();
  running.delete(again);
  await end(again);
});

test("an alarm stays for everybody until it is over or ended, and is one for each cause", async () => {
  const program = await started();
  const first = await openQuietly(browser, program.url);
  const second = await openQuietly(browser, `${program.url}#/health`, { viewport: { width: 390, height: 800 }, locale: "de-DE", colorScheme: "dark" });
  await say(program, "turnout all straight");
  await say(program, "speed 24 8");
  for (let own; !own?.at;) [own] = (await picture(program)).trains;
  await say(program, "stop 24");
  for (let own; !own?.at_rest;) [own] = (await picture(program)).trains;
  assert.deepEqual((await picture(program)).alarms, []);
  const elsewhere = (await picture(program)).trains[0].at.startsWith("E") ? "A13" : "E14";
  await say(program, `place 24 at ${elsewhere}`);
  await say(program, "speed 24 8");
  for (const { page } of [first, second]) await page.waitForSelector("#alarmed .danger", { timeout: PATIENCE });
  // The danger leads to where the train is, on the page that shows it.
  const link = first.page.locator("#alarmed .danger a.button");
  assert.equal(await link.textContent(), "Say where train 24 is");
  await link.click();
  await until(first.page, () => document.querySelector("#guide")?.hidden === false || document.querySelector("#alarmed").hidden);
  await first.page.screenshot({ path: join(AT, "alarm-way-out.png"), fullPage: true });
  // No two alarms are of one cause, and what is graver comes first.
  for (let look = 0; look < 20; look++) {
    const { alarms } = await picture(program);
    const grades = alarms.map(({ grade }) => grade);
    assert.deepEqual(grades, [...grades].sort(), "dangers before warnings");
    assert.equal(new Set(alarms.map(({ id }) => id)).size, alarms.length);
    assert.ok(alarms.filter(({ train, what }) => train === 24 && /lost|stands|person|unknown|overdue/.test(what)).length <= 1, JSON.stringify(alarms));
    await first.page.waitForTimeout(100);
  }
  assert.deepEqual(await findings(second.page), []);
  assert.equal(await width(second.page), 390);
  await second.page.screenshot({ path: join(AT, "alarms-phone.png"), fullPage: true });
  // The watchdog brings the train back, or somebody ends the alarm: for all who watch.
  const { alarms } = await picture(program);
  if (alarms.length > 0) {
    assert.ok([202, 422].includes(await ends(program, alarms[0].id)));
  }
  await until(second.page, () => document.querySelector("#alarms li.over"));
  assert.match(await second.page.locator("#alarms li.over").first().textContent(), /Vorbei:|wieder/);
  assert.equal(await ends(program, 99999), 422, "it is over already");
  assert.deepEqual(first.complaints, []);
  await first.page.close();
  await second.page.close();
  running.delete(program);
  await end(program);
});
