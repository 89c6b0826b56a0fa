// A layout with block detectors in a real browser: occupancy on the plan and as a list, boundaries as places, and blocks that are drawn in
// the editor, named and checked by the program.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { findings } from "./axe.mjs";
import { AT, below, clickUntil, launch, openQuietly, width } from "./browser.mjs";
import { pressJoint } from "./oval.mjs";
import { PATIENCE, begin, end, picture, say } from "./railway.mjs";

/** The detectors of the curves of `oval-blocks`, each 1374 mm long: a train that stands is in one or two of the six blocks. */
const DETECTORS = [0, 1, 2, 3, 4, 5];

let browser;
let running;
const folder = mkdtempSync(join(tmpdir(), "footplate-blocks-"));
const store = join(folder, "blocks.db");
const link = "sim:oval-blocks?seed=7&trains=24";
const footplate = (...commands) => execFileSync(process.env.FOOTPLATE, commands, { stdio: "pipe", encoding: "utf8" });
const until = (page, what, arg) => page.waitForFunction(what, arg, { timeout: PATIENCE });
const occupied = ({ blocks }) => DETECTORS.filter((detector) => blocks?.[detector] === "occupied");

before(async () => {
  footplate("calibrate", "--link", `${link}&speed=max`, "--layout", "oval-blocks", "--train", "24", "--budget", "8m", "--store", store);
  running = await begin(["serve", "0", "--link", `${link}&speed=2`, "--train", "24", "--store", store]);
  browser = await launch();
});
after(async () => {
  await browser?.close();
  if (running) await end(running);
});

test("a block is occupied from the start and while the train is in it, and boundaries are places", async () => {
  const { page, complaints } = await openQuietly(browser, running.url);
  await page.waitForSelector(".train");
  // The position of the train is unknown, but the detector of its block reports it.
  const seen = await picture(running, (state) => occupied(state).length > 0);
  assert.equal(seen.trains[0].at, null);
  await until(page, () => document.querySelectorAll("#track .rail.occupied").length > 0);
  assert.equal(await page.locator("#track .name.of-block").count(), 6);
  await say(running, "speed 24 8");
  const began = occupied(seen);
  const later = await picture(running, (state) => state.trains[0].at && began.every((detector) => state.blocks[detector] === "free"));
  assert.ok(occupied(later).length <= 2, "one train of less than 600 mm is in two blocks at most");
  await say(running, "stop 24");
  const { trains: [train], blocks } = await picture(running, ({ trains: [own] }) => own.at_rest);
  const names = ["front left", "front right", "right curve", "back right", "back left", "left curve"];
  await page.locator("details.of-blocks").last().locator("summary").click();
  const listed = await page.$$eval("#block-list li", (all) => all.map(({ textContent }) => textContent));
  assert.deepEqual(listed, names.map((name, detector) => `${name}: ${blocks[detector]}`), train.at);
  await page.screenshot({ path: join(AT, "blocks.png"), fullPage: true });
  assert.deepEqual(await findings(page), []);

  await clickUntil(page, below(page, "B5 B6", 4), () => /^Selected: B[3456]\S*, in block (front right|right curve)$/.test(document.querySelector("#picked").textContent));
  assert.deepEqual(complaints, []);
  await page.close();
});

test("a recording shows the blocks as they were", async () => {
  const { page, complaints } = await openQuietly(browser, `${running.url}#/recordings`);
  const box = page.locator("#recordings tr", { hasText: "driving" }).locator("input").first();
  await box.check();
  await until(page, () => document.querySelectorAll(".session .track-view .rail").length > 0);
  const { pictures } = await (await fetch(`${running.url}api/recordings/${await box.inputValue()}/pictures`)).json();
  // The train stands: what was occupied at the end of the recording is occupied now. Blocks that never reported are not known.
  const { blocks: now } = await picture(running);
  const then = pictures.at(-1).blocks;
  assert.ok(Object.keys(then).length >= 2, JSON.stringify(then));
  for (const [detector, state] of Object.entries(then)) assert.equal(state, now[detector], `block ${detector}`);
  assert.ok(occupied(pictures[0]).length > 0, "the block in which the train began was occupied from the start");
  await page.locator("#time").focus();
  await page.keyboard.press("End");
  await until(page, () => document.querySelectorAll(".session .track-view .rail.occupied").length > 0);
  await page.screenshot({ path: join(AT, "blocks-recorded.png"), fullPage: true });
  assert.deepEqual(complaints, []);
  await page.close();
});

test("blocks fit a phone, in the dark and in German", async () => {
  const { page, complaints } = await openQuietly(browser, running.url, { viewport: { width: 390, height: 844 }, locale: "de-DE", colorScheme: "dark", hasTouch: true });
  await until(page, () => document.querySelectorAll("#track .rail.occupied").length > 0);
  assert.match(await page.locator("#block-list").textContent(), /: belegt.*: frei|: frei.*: belegt/);
  assert.equal(await width(page), 390);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "blocks-phone.png"), fullPage: true });
  assert.deepEqual(complaints, []);
  await page.close();
});

test("blocks are drawn between boundaries, named and numbered, and the program checks the file", async () => {
  const { page, complaints } = await openQuietly(browser, `${running.url}#/editor`);
  await page.waitForSelector("#pieces button");
  const lay = async (name, times) => {
    for (let nth = 0; nth < times; nth++) await page.locator("#pieces button", { hasText: name }).first().click();
  };
  await page.click("#hand-right");
  for (const [name, times] of [["24188", 4], ["24130", 6], ["24188", 4], ["24130", 6]]) await lay(name, times);
  assert.equal(await page.locator("#draft .joint.open").count(), 0);
  for (const [x, y] of [[0, 0], [753, 0], [753, 720], [0, 720]]) {
    await pressJoint(page, "joined", x, y);
    await page.click("#draft-boundary");
  }
  assert.match(await page.locator("#draft-says").textContent(), /Blocks: 4\./);
  const rows = page.locator("#block-rows [role=group]");
  assert.equal(await rows.count(), 4);
  // Two detectors of one number are refused, as `layout check` does.
  const number = (nth) => rows.nth(nth).locator("input[type=number]");
  await number(1).fill("0");
  await number(1).blur();
  await until(page, () => /detector 0 belongs to/.test(document.querySelector("#draft-refused").textContent));
  await number(1).fill("9");
  await number(1).blur();
  await until(page, () => !document.querySelector("#draft-refused").textContent);
  await rows.nth(1).locator("input").first().fill("platform");
  await rows.nth(3).locator("input[type=checkbox]").uncheck();
  await page.fill("#draft-name", "Blocks of mine");
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "editor-blocks.png"), fullPage: true });
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#draft-save")]);
  const file = join(folder, "mine.toml");
  await download.saveAs(file);
  assert.match(footplate("layout", "check", file), /a sound layout of 8 nodes and 8 edges/);
  assert.match(readFileSync(file, "utf8"), /\{ name = "platform", number = 9 \}/);
  // The complaint is the refusal of the wrong number.
  assert.deepEqual(complaints.filter((text) => !/422/.test(text)), []);
  await page.close();
});
