// Alarms in a real browser: each one stays on every page until its cause is resolved or the operator ends it, and links to its remedy.

import assert from "node:assert/strict";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { findings } from "./axe.mjs";
import { AT, launch, openQuietly, width } from "./browser.mjs";
import { PATIENCE, calibratedStore, end, picture, say, serve } from "./railway.mjs";

/** The largest difference (mm) between the true place and the one that was entered: rounding, and errors of the survey. */
const SAME_PLACE_MM = 30;

let browser, store;
const running = new Set();

const until = (page, what, arg) => page.waitForFunction(what, arg, { timeout: PATIENCE });
const get = async ({ url }, path) => (await fetch(url + path)).json();

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

test("a train of unknown position is placed where the simulation shows it, or creeps to the next sensor", async () => {
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
  // The guide and the outline of the true position disappear.
  await until(page, () => document.querySelector("#guide").hidden && !document.querySelector(".truth"));
  const mm = (place) => [place.split("+")[0], Number(/\+(\d+)mm/.exec(place)?.[1] ?? 0)];
  const [said, is] = [(await picture(program)).trains[0].at, truth.at].map(mm);
  assert.equal(said[0], is[0]);
  assert.ok(Math.abs(said[1] - is[1]) < SAME_PLACE_MM, `${said} beside ${is}`);
  assert.deepEqual(complaints, []);
  await page.close();
  running.delete(program);
  await end(program);

  // The next session does not know the position again: the train creeps to a sensor and stops there.
  const again = await started();
  await say(again, "turnout all straight");
  const { page: other } = await openQuietly(browser, `${again.url}#/layout/24`);
  await until(other, () => document.querySelector("#guide")?.hidden === false);
  await other.locator("#guide button", { hasText: "Find train 24" }).click();
  await until(other, () => document.querySelector("#guide").hidden);
  await picture(again, ({ trains: [own] }) => own.at_rest);
  const [found] = (await picture(again)).trains;
  assert.equal(found.step, 0);
  assert.ok(found.half_mm < 200, `± ${found.half_mm} mm`);
  await other.close();
  running.delete(again);
  await end(again);
});

test("each cause has one alarm, which stays on all pages until it is resolved or ended", async () => {
  const program = await started();
  const first = await openQuietly(browser, program.url);
  const second = await openQuietly(browser, `${program.url}#/health`, { viewport: { width: 390, height: 800 }, locale: "de-DE", colorScheme: "dark" });
  await say(program, "turnout all straight");
  // A train that starts on a sensor is reported by two at once, which is another alarm: something moves that is not driven.
  await say(program, "stop 24 at C13+120mm");
  await picture(program, ({ trains: [own] }) => own.at && own.at_rest);
  assert.deepEqual((await picture(program)).alarms, []);
  await say(program, "place 24 at E14");
  await say(program, "speed 24 8");
  await first.page.waitForSelector("#alarmed .danger", { timeout: PATIENCE });
  await second.page.waitForSelector("#alarmed .danger", { timeout: PATIENCE });
  await first.page.screenshot({ path: join(AT, "alarm-remedy.png"), fullPage: true });
  // Each cause has one alarm; dangers come first.
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
  // The watchdog recovers the train, or an operator ends the alarm on all pages.
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

test("the alarm of a blocked train links to ways of moving it on", async () => {
  // What the wrong position of the last test taught is in its store: this railway is another one.
  store = calibratedStore("blocked");
  const program = await started();
  const { page, complaints } = await openQuietly(browser, program.url);
  await say(program, "turnout all straight");
  for (const { train, at } of await get(program, "api/truth")) await say(program, `place ${train} at ${at}`);
  await picture(program, ({ trains }) => trains.every(({ at }) => at));
  // Turnout 8 leads to the siding of train 58.
  await say(program, "turnout 8 curved");
  await picture(program, ({ turnouts }) => turnouts[8] === "curved");
  await say(program, "speed 24 8");
  // A sensor may miss the train meanwhile, which is another alarm.
  const row = page.locator("#alarmed .warning", { hasText: "Train 24: stopped: the track ahead is reserved for train 58" });
  await row.waitFor({ timeout: PATIENCE });
  await row.locator("a.button").click();
  await until(page, () => document.querySelector("#guide")?.hidden === false);
  const buttons = await page.locator("#guide button").allTextContents();
  assert.deepEqual(buttons, ["Reverse train 24", "Reverse train 58"]);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "guide-blocked.png"), fullPage: true });
  await page.locator("#guide button", { hasText: "Reverse train 24" }).click();
  await picture(program, ({ trains: [own] }) => own.reversed);
  // The alarm stays while the train is at rest, and is over when it runs away.
  const isBlocked = ({ alarms }) => alarms.some(({ what }) => what === "track-reserved");
  assert.ok(isBlocked(await picture(program)));
  await say(program, "speed 24 5");
  await picture(program, (seen) => !isBlocked(seen));
  await until(page, () => document.querySelector("#guide").hidden);
  assert.deepEqual(complaints, []);
  await page.close();
  running.delete(program);
  await end(program);
});
