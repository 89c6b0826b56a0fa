// A calibration and a demonstration in a real browser. The numbers on the page equal those of the interface, of the printed result
// and of the store; the emergency stop ends both.

import assert from "node:assert/strict";
import { mkdtempSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { findings } from "./axe.mjs";
import { AT, colours, launch, openQuietly, width } from "./browser.mjs";
import { LINK, PATIENCE, begin, calibratedStore, end, say, serve } from "./railway.mjs";

const PHONE = { viewport: { width: 390, height: 800 }, locale: "de-DE", hasTouch: true };
/** What the browser logs when the server ends with the calibration. */
const GONE = /ERR_CONNECTION_REFUSED|ERR_INCOMPLETE_CHUNKED_ENCODING|ERR_CONNECTION_RESET|ERR_EMPTY_RESPONSE/;
/** The standard deviation between sessions relative to the speed: 2 % of all steps together, 1.2 % of each step. */
const BETWEEN_SESSIONS = Math.hypot(0.02, 0.012);
/** The largest standard deviation of the speed difference of a step reached from above: of all steps, and of one. */
const HYSTERESIS_MM_PER_S = Math.hypot(2, 1);

let browser;
const running = new Set();

const until = (page, what, arg) => page.waitForFunction(what, arg, { timeout: PATIENCE });
const text = (page, selector) => page.locator(selector).textContent();
const folder = () => mkdtempSync(join(tmpdir(), "footplate-watched-"));

async function started(...commands) {
  const program = await begin(commands);
  running.add(program);
  program.over.then(() => running.delete(program));
  return program;
}

const calibrating = (store, { budget = "2m", speed = 4 } = {}) => started("calibrate", "--link", `${LINK}&speed=${speed}`,
  "--layout", "track-a", "--train", "24", "--budget", budget, "--store", store, "--serve", "0", "--json");

const get = async ({ url }, path) => (await fetch(url + path)).json();

/** The rows of the table of steps, by step and side. */
const rows = (page) => page.$$eval("#steps tr", (all) => all.map((row) => [...row.children].map((cell) => cell.textContent)));

/** Repeats until the page shows the value that another source gives for the same moment. */
async function agree(page, said, expected) {
  let last;
  for (const began = Date.now(); Date.now() - began < PATIENCE;) {
    last = [await said(), await expected()];
    if (JSON.stringify(last[0]) === JSON.stringify(last[1])) return last[0];
    await page.waitForTimeout(100);
  }
  assert.deepEqual(...last);
}

before(async () => { browser = await launch(); });
after(async () => {
  await browser?.close();
  await Promise.all([...running].map(end));
});

test("a calibration shows its experiment and the reason; its table equals the interface, the printed result and the store", async () => {
  const store = join(folder(), "railway.db");
  const program = await calibrating(store);
  const { page, complaints } = await openQuietly(browser, `${program.url}#/calibration`);
  await until(page, () => document.querySelector("#progress")?.hidden === false);
  await until(page, () => /within|: |step/.test(document.querySelector("#about").textContent) && /^\d+ s of 120 s/.test(document.querySelector("#left").textContent));
  await agree(page, () => text(page, "#about"), async () => (await get(program, "api/picture")).calibration.experiment);
  await agree(page, async () => Number((await text(page, "#left")).split(" ")[0]), async () => Math.round((await get(program, "api/picture")).calibration.left_s));
  // The page shows why the next experiment was selected: its duration and its expected information.
  await until(page, () => /most informative experiment per second; it takes \d+ s \(value [\d.]+, in variances of one stop\)/.test(document.querySelector("#because").textContent));
  await until(page, () => /at step \d+: stops within \d+ mm, speed within [\d.]+ %/.test(document.querySelector("#expected").textContent));
  await until(page, () => document.querySelectorAll("#steps tr").length > 8);
  // While it runs, the table of steps equals the model of the interface.
  const of = (steps) => steps.filter(({ uses, contacts }) => uses === "moves" || contacts > 0).map((one) => [String(one.step), one.approach,
    `${one.speed_mm_per_s.toFixed(1)} ± ${one.speed_half_mm_per_s.toFixed(1)}`, String(one.contacts), `${one.stop_mm.toFixed(0)} ± ${one.stop_half_mm.toFixed(0)}`]);
  await agree(page, async () => (await rows(page)).map((cells) => cells.slice(0, 5)), async () => of((await get(program, "api/trains/24/model")).steps));

  for (const [place, count] of (await colours(page)).entries()) if (place < 2) assert.ok(count > 5, `chart ${place}: ${count} colours`);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "calibrating.png"), fullPage: true });

  // Afterwards a session with the same store shows the printed result: intervals are 1.96 standard deviations, to which a later
  // session adds the difference between sessions.
  assert.equal(await program.over, 0);
  await page.waitForSelector("#connection.red", { timeout: PATIENCE });
  assert.deepEqual(complaints.filter((complaint) => !GONE.test(complaint) && !/422/.test(complaint)), []);
  await page.close();
  const printed = JSON.parse(program.wrote.output).steps;
  const driving = await serve(store, 0);
  running.add(driving);
  const later = await openQuietly(browser, `${driving.url}#/calibration`);
  await until(later.page, (least) => document.querySelectorAll("#steps tr").length >= least, printed.length);
  const shown = new Map((await rows(later.page)).map(([step, side, speed, contacts, stop]) => [`${step} ${side}`, [speed, contacts, stop]]));
  for (const { step, approach, speed_mm_s: speed, speed_uncertainty_mm_s: sigma, contacts, stop_mm: stop } of printed) {
    const [said, from, way] = shown.get(`${step} ${approach}`);
    const [value, half] = said.split(" ± ").map(Number);
    const above = approach === "above";
    const least = 1.959964 * Math.hypot(sigma, above ? 0 : BETWEEN_SESSIONS * speed);
    const most = 1.959964 * Math.hypot(sigma, BETWEEN_SESSIONS * speed, above ? HYSTERESIS_MM_PER_S : 0);
    assert.ok(Math.abs(value - speed) < 0.06 && half > least - 0.06 && half < most + 0.06, `step ${step} ${approach}: ${said} beside ${speed} ± ${sigma}`);
    assert.equal(Number(from), contacts, `step ${step} ${approach}`);
    assert.ok(Math.abs(Number(way.split(" ± ")[0]) - stop) < 0.6, `step ${step} ${approach}: ${way} beside ${stop}`);
  }
  // The page also shows the calibration in the store with its number of detections.
  await until(later.page, () => document.querySelector("#of-store")?.hidden === false);
  // The calibration is replayed with its train and its experiments.
  await later.page.goto(`${driving.url}#/recordings`);
  const box = later.page.locator("#recordings tr", { hasText: "calibration" }).locator("input");
  await box.check({ timeout: PATIENCE });
  await until(later.page, () => document.querySelectorAll(".session").length === 1 && Number(document.querySelector("#time")?.max) > 100);
  await later.page.locator("#time").focus();
  for (let page = 0; page < 5; page++) await later.page.keyboard.press("PageUp");
  await until(later.page, () => /^Train 24: \S+ ± \d+ mm, \d+ mm\/s; (speed at|stop from|short move)/.test(document.querySelector(".where").textContent));
  assert.match(await text(later.page, ".said"), /circuit|speed at step|stop from step/);
  await later.page.screenshot({ path: join(AT, "calibration-walked.png"), fullPage: true });
  assert.deepEqual(later.complaints, []);
  await later.page.close();
  await end(driving);
});

test("a calibration fits a phone in the dark and in German, takes no orders, and ends at an emergency stop", async () => {
  const program = await calibrating(join(folder(), "railway.db"), { budget: "10m", speed: 4 });
  const { page, complaints } = await openQuietly(browser, `${program.url}#/calibration`, { ...PHONE, colorScheme: "dark" });
  await until(page, () => document.querySelectorAll("#steps tr").length > 4 && /^\d+ s von 600 s/.test(document.querySelector("#left").textContent));
  assert.equal(await width(page), 390);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "calibrating-phone.png"), fullPage: true });
  const refused = await fetch(`${program.url}api/orders`, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ line: "speed 24 8" }) });
  assert.equal(refused.status, 422);
  assert.match((await refused.json()).error, /a calibration runs by itself/);
  await page.click("#halt");
  // The station may have confirmed before the browser paints.
  await until(page, () => /allen Zügen ist Halt befohlen|Abschaltbefehl gesendet/.test(document.querySelector("#halted").textContent));
  await program.over;
  assert.equal(JSON.parse(program.wrote.output).ended, "interrupted");
  assert.deepEqual(complaints.filter((complaint) => !GONE.test(complaint) && !/422/.test(complaint)), []);
  await page.close();
});

test("a demonstration is shown from its first detection to its last stop, and the page equals the printed result", async () => {
  const program = await started("demo", "--seed", "7", "--speed", "30", "--serve", "0", "--json");
  const { page, complaints } = await openQuietly(browser, program.url);
  await page.waitForSelector(".train");
  await until(page, () => /±/.test(document.querySelector(".train dd").textContent));
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "demo.png"), fullPage: true });
  // A stop in progress shows its target and its predicted interval.
  await until(page, () => /^stop \d+ at \S+ from step \d+ \(predicted [+−]?\d+ … [+−]?\d+ mm\)$/.test(document.querySelectorAll(".train dd")[2]?.textContent));
  await page.waitForSelector("#track .target", { state: "attached" });
  await page.screenshot({ path: join(AT, "demo-stopping.png"), fullPage: true });
  await until(page, () => document.querySelectorAll("#said li").length >= 5);
  const phone = await openQuietly(browser, `${program.url}#/layout`, { ...PHONE, colorScheme: "dark" });
  await phone.page.waitForSelector(".train");
  assert.equal(await width(phone.page), 390);
  assert.deepEqual(await findings(phone.page), []);
  await phone.page.screenshot({ path: join(AT, "demo-phone.png"), fullPage: true });
  await phone.page.close();
  // The page shows every stop with the true error that the program writes.
  await until(page, () => document.querySelectorAll("#said li").length >= 11);
  const said = await page.$$eval("#said li", (all) => all.map((one) => one.textContent));
  const lines = program.wrote.output.trim().split("\n").map((line) => JSON.parse(line));
  const stops = lines.filter(({ stop }) => stop).map(({ stop }) => stop);
  assert.ok(stops.length >= 9, `${stops.length} stops`);
  for (const { train, target, error_mm: error } of stops.slice(0, 9)) {
    // What is written has a tenth of a millimetre, of which a half rounds either way.
    const mm = [-0.05, 0.05].map((less) => Math.abs(Math.round(Math.abs(error) + less))).join("|");
    const expected = new RegExp(`train ${train} stopped (?:${mm}) mm ${error < -0.5 ? "short of" : "(beyond|short of)"} ${target.replace("+", "\\+")},`);
    assert.ok(said.some((line) => expected.test(line)), `${expected} in ${said.join(" | ")}`);
  }
  assert.deepEqual(complaints.filter((complaint) => !GONE.test(complaint) && !/422/.test(complaint)), []);
  await page.close();
  assert.equal(await program.over, 0);
});

test("every page shows active alarms in the reader's language until they are resolved or ended, and health lists them", async () => {
  const store = calibratedStore("alarmed");
  const program = await serve(store, 0);
  running.add(program);
  const { page, complaints } = await openQuietly(browser, program.url, { locale: "de-DE" });
  await say(program, "turnout all straight");
  await say(program, "speed 24 8");
  await until(page, () => /±/.test(document.querySelector(".train dd")?.textContent ?? ""));
  assert.ok(await page.locator("#alarmed").isHidden());
  await say(program, "stop 24");
  await until(page, () => /^0 /.test(document.querySelectorAll(".train dd")[1].textContent));
  // The operator enters a wrong position. The next detections cannot be of this train.
  const elsewhere = (await get(program, "api/picture")).trains[0].at.startsWith("E") ? "A13" : "E14";
  await say(program, `place 24 at ${elsewhere}`);
  await say(program, "speed 24 8");
  await until(page, () => !document.querySelector("#alarmed").hidden);
  const alarm = await text(page, "#alarmed");
  assert.match(alarm, /hat gemeldet, aber dort kann kein Zug sein|wohin er nicht gefahren sein kann|überfällig|verloren/);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "alarmed.png") });
  // A danger stays on every page, and in the state of the connection, until it is resolved or ended.
  await until(page, () => document.querySelector("#alarmed .danger") && document.querySelector("#connection.red")
    && /Alarme/.test(document.querySelector("#connection").textContent));
  const causes = await page.$$eval("#alarmed .alarm span", (all) => all.map((one) => one.textContent));
  assert.equal(new Set(causes).size, causes.length, `one alarm a cause: ${causes}`);
  await page.goto(`${program.url}#/health`);
  await until(page, () => document.querySelector("#page").dataset.page === "health" && document.querySelectorAll("#alarms li").length > 0);
  // Opening the health page does not end it.
  await until(page, () => !document.querySelector("#alarmed").hidden || document.querySelector("#alarms li.over"));
  // The list has no other grades.
  const listed = await page.$$eval("#alarms li", (all) => all.map((one) => one.className));
  assert.ok(listed.every((grade) => ["danger", "warning", "over"].includes(grade)), String(listed));
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "alarms.png"), fullPage: true });
  await page.goto(`${program.url}#/layout`);
  await until(page, () => document.querySelector("#page").dataset.page === "layout");
  await until(page, () => {
    for (const end of document.querySelectorAll("#alarmed .danger button")) end.click();
    return document.querySelector("#connection.green");
  });
  // An alarm may be resolved in the moment of the click, which the server answers with 422.
  assert.deepEqual(complaints.filter((complaint) => !/422/.test(complaint)), []);
  await page.close();
  await end(program);
});
