// Schedules in a real browser: written stop by stop, saved in the store, run with their progress line by line, and as route buttons.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { findings } from "./axe.mjs";
import { AT, launch, openQuietly, width } from "./browser.mjs";
import { PATIENCE, calibratedStore, end, picture, say, serve } from "./railway.mjs";

let browser, store, program;

const until = (page, what, arg) => page.waitForFunction(what, arg, { timeout: 2 * PATIENCE });
const states = (page, name) => page.$$eval(`[data-run="${name}"]`, ([run]) => [...run.closest("article").querySelectorAll("li")].map(({ dataset }) => dataset.state));

before(async () => {
  store = calibratedStore("schedules");
  program = await serve(store, 0, { speed: 10 });
  browser = await launch();
});
after(async () => {
  await browser?.close();
  if (program) await end(program);
});

test("a schedule is written stop by stop, checked, saved and run line by line", async () => {
  const { page, complaints } = await openQuietly(browser, `${program.url}#/schedules`);
  await page.waitForSelector("#no-schedule:visible");
  await until(page, () => document.querySelector("#stop-train").value === "24");
  await say(program, "turnout all straight");
  await page.selectOption("#stop-place", "C13");
  // Before C13 the place would be called by the turnout: at ten times real time, a delay of this machine's moves a stop by centimetres.
  await page.fill("#stop-beyond", "300");
  await page.fill("#stop-wait", "2");
  await page.click("#add-stop button[type=submit]");
  assert.equal(await page.inputValue("#schedule-lines"), "go 24 to C13+300mm\nwait 24 at rest\nwait 2s");
  // Each line that cannot be read is named with its column.
  await page.fill("#schedule-lines", "go 24 to C13+300mm\nwait 24 at rest\nwait 2s\nlight 24 onn\nquit");
  await page.fill("#schedule-name", "Evening");
  await page.click("#schedule-save");
  await until(page, () => document.querySelector("#schedule-answer.bad"));
  const mistakes = await page.locator("#schedule-answer").textContent();
  assert.match(mistakes, /line 4, column 10: onn should be on or off/);
  assert.match(mistakes, /line 5: quit is not for schedules/);
  await page.fill("#schedule-lines", "go 24 to C13+300mm\nwait 24 at rest\nwait 2s\nlight 24 on");
  await page.fill("#schedule-rounds", "2");
  await page.click("#schedule-save");
  await page.waitForSelector("[data-run='Evening']");
  assert.deepEqual(await findings(page), []);

  await page.click("[data-run='Evening']");
  await until(page, () => document.querySelector(".schedule li[data-state='active'] code")?.textContent === "go 24 to C13+300mm");
  await page.screenshot({ path: join(AT, "schedules.png"), fullPage: true });
  assert.match(await page.locator(".schedule [role=status]").textContent(), /Round [12] of 2/, "a busy machine may be in the second one");
  await until(page, () => /Round 2 of 2/.test(document.querySelector(".schedule [role=status]").textContent));
  await until(page, () => /Ended/.test(document.querySelector(".schedule [role=status]").textContent));
  assert.deepEqual(await states(page, "Evening"), ["done", "done", "done", "done"]);
  const { trains: [train] } = await picture(program);
  assert.match(train.at, /^C13/);
  assert.deepEqual(train.functions, [0]);
  assert.deepEqual(complaints.filter((text) => !/422/.test(text)), []);
  await page.close();
});

test("a command by hand ends the schedule of its train, and a refused line is marked", async () => {
  const post = (path, body) => fetch(program.url + path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
  const endless = { name: "Round and round", lines: ["go 24 to A13", "wait 24 at rest", "go 24 to C13", "wait 24 at rest"], rounds: null };
  assert.equal((await post("api/schedules", endless)).status, 200);
  assert.equal((await post("api/schedules/run", { name: endless.name })).status, 202);
  const twice = await post("api/schedules/run", { name: endless.name });
  assert.equal(twice.status, 422);
  assert.match((await twice.json()).error, /runs already/);
  const other = await post("api/schedules/run", { name: "other", lines: ["stop 24"] });
  assert.match((await other.json()).error, /drives train 24 already: end it first/);
  await say(program, "speed 24 0");
  const isOver = (wanted) => ({ schedules }) => schedules.some(({ name, is_over: is }) => name === wanted && is);
  const { schedules } = await picture(program, isOver(endless.name));
  assert.deepEqual(schedules.find(({ name }) => name === endless.name).active, []);

  await picture(program, ({ trains: [own] }) => own.at_rest);
  // A moving train cannot be placed: the line is refused, and the lines after it are carried out.
  await post("api/schedules/run", { name: "half", lines: ["speed 24 8", "wait 1s", "place 24 at C13", "speed 24 0", "light 24 off"] });
  const after = await picture(program, isOver("half"));
  const { refused } = after.schedules.find(({ name }) => name === "half");
  assert.deepEqual(Object.keys(refused), ["2"]);
  assert.match(refused[2], /moves|rest/);
  assert.deepEqual(after.trains[0].functions, []);
});

test("the prompt lists, begins and ends saved schedules by name", async () => {
  const { page } = await openQuietly(browser, program.url);
  await page.waitForSelector(".train");
  const give = async (line) => {
    await page.fill("#line", line);
    await page.click("#order button");
  };
  const log = (what) => until(page, (text) => document.querySelector("#said").textContent.includes(text), what);
  await give("schedule run Round and rund");
  await until(page, () => /did you mean Round and round/.test(document.querySelector("#answer").textContent));
  await give('schedule run "Round and round"');
  await log("schedule Round and round begins");
  await give("schedule list");
  await log("schedule Round and round runs: round");
  await log("schedule Evening is saved");
  await give("schedule end Round and round");
  await log("schedule Round and round was ended");
  // The next line is written while the answer to the last one is on its way.
  await page.route("**/api/orders", async (route) => {
    const response = await route.fetch();
    await until(page, () => document.querySelector("#line").value === "schedule list");
    await route.fulfill({ response });
  }, { times: 1 });
  const answered = page.waitForResponse("**/api/orders");
  await give("help");
  await page.fill("#line", "schedule list");
  await (await answered).finished();
  await page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
  assert.equal(await page.inputValue("#line"), "schedule list");
  await page.close();
});

test("saved turnouts are a button beside the track, on a phone, in the dark and in German, and survive the program", async () => {
  await end(program);
  // Schedules are among the recorded inputs: a replay decides the same.
  const replayed = execFileSync(process.env.FOOTPLATE, ["replay", store], { encoding: "utf8" });
  assert.match(replayed, /decisions, all the same/);
  program = await serve(store, 0, { speed: 10 });
  const options = { viewport: { width: 390, height: 800 }, locale: "de-DE", colorScheme: "dark", hasTouch: true };
  const { page, complaints } = await openQuietly(browser, `${program.url}#/schedules`, options);
  await page.waitForSelector("[data-run='Evening']");
  await say(program, "turnout all straight");
  await until(page, () => document.querySelector("#stop-train").value === "24");
  await say(program, "turnout 6 curved");
  await picture(program, ({ turnouts }) => turnouts[6] === "curved");
  await page.click("#turnout-choice summary");
  await page.check("#turnout-boxes input[value='6']");
  await page.check("#turnout-boxes input[value='11']");
  await page.click("#add-turnouts");
  assert.equal(await page.inputValue("#schedule-lines"), "turnout 6 curved\nturnout 11 straight");
  await page.fill("#schedule-name", "Abstellgleis");
  await page.click("#schedule-save");
  await page.waitForSelector("[data-run='Abstellgleis']");
  assert.equal(await width(page), 390);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "schedules-phone.png"), fullPage: true });
  await say(program, "turnout 6 straight");
  await picture(program, ({ turnouts }) => turnouts[6] === "straight");
  await page.goto(`${program.url}#/layout`);
  await page.locator("#routes button", { hasText: "Abstellgleis" }).click();
  await picture(program, ({ turnouts }) => turnouts[6] === "curved");
  await page.screenshot({ path: join(AT, "route-buttons-phone.png"), fullPage: true });
  assert.equal(await width(page), 390);
  assert.deepEqual(complaints, []);
  await page.close();
});
