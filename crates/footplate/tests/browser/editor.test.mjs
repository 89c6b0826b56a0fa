// A layout is drawn from nothing in a real browser: an oval with a siding, from catalogue pieces. The program takes its file, and a
// simulated train is calibrated on it.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { findings } from "./axe.mjs";
import { AT, clickUntil, launch, openQuietly, width } from "./browser.mjs";
import { drawOval, pressJoint } from "./oval.mjs";
import { PATIENCE, begin, end } from "./railway.mjs";

let browser;
const running = new Set();
const folder = mkdtempSync(join(tmpdir(), "footplate-editor-"));
const footplate = (...commands) => execFileSync(process.env.FOOTPLATE, commands, { stdio: "pipe", encoding: "utf8" });

async function started(link, store) {
  const program = await begin(["serve", "0", "--link", link, "--train", "24", "--store", join(folder, store)]);
  running.add(program);
  return program;
}

before(async () => { browser = await launch(); });
after(async () => {
  await browser?.close();
  await Promise.all([...running].map(end));
});

test("an oval with a siding is drawn from nothing, its file is valid, and a train is calibrated on it", async () => {
  const program = await started("sim:track-a?seed=7", "any.db");
  const { page, complaints } = await openQuietly(browser, `${program.url}#/editor`);
  await page.waitForSelector("#pieces button");
  const joints = (kind) => page.locator(`#draft .joint.${kind}`);
  const says = () => page.locator("#draft-says").textContent();

  // An empty drawing is refused with what to do.
  assert.ok(await page.locator("#draft-save").isDisabled());
  assert.match(await says(), /Choose a piece to begin/);
  await drawOval(page);
  assert.equal(await joints("sensor").count(), 4);
  assert.match(await says(), /Track ends: 0\. Turnouts: 2\. Sensors: 4\./);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "editor.png") });

  // The drawing survives a reload.
  await page.reload();
  await page.waitForSelector("#draft .joint.sensor");
  assert.equal(await joints("sensor").count(), 4);
  await page.fill("#draft-name", 'My "first" oval');
  const [download] = await Promise.all([page.waitForEvent("download", { timeout: PATIENCE }), page.click("#draft-save")]);
  assert.equal(download.suggestedFilename(), "my-first-oval.toml");
  const file = join(folder, "oval.toml");
  await download.saveAs(file);
  assert.match(footplate("layout", "check", file), /a sound layout of 12 nodes and 14 edges/);
  assert.match(readFileSync(file, "utf8"), /^name = "My \\"first\\" oval"$/m);
  // The circumference follows from the catalogue: six straights on either side, and twelve curves of 30° and 360 mm.
  const { hops } = JSON.parse(footplate("layout", "show", file, "--json"));
  const round = 2 * (4 * 188.3 + 2 * 171.7) + 2 * Math.PI * 360;
  const main = hops.filter(({ from, to }) => !/^A[78]$/.test(from) && !/^A[78]$/.test(to));
  const sum = main.reduce((all, { length_mm: mm }) => all + mm, 0) / 2;
  assert.ok(Math.abs(sum - round) < 0.5, `${sum} beside ${round}`);
  assert.deepEqual(complaints, []);
  await page.close();
  await end(program);
  running.delete(program);

  const link = `sim:${file}?seed=7`;
  footplate("calibrate", "--link", link, "--layout", file, "--train", "24", "--store", join(folder, "oval.db"));
  const drives = await started(`${link}&speed=4`, "oval.db");
  const seen = await openQuietly(browser, drives.url);
  await seen.page.waitForSelector(".train");
  assert.equal(await seen.page.locator("#track .rail").count(), 7);
  await seen.page.fill("#line", "turnout all straight");
  await seen.page.click("#order button");
  await seen.page.waitForFunction(() => document.querySelectorAll("#track .blade.unknown").length === 0, null, { timeout: PATIENCE });
  await seen.page.fill("#step-24", "8");
  await seen.page.locator(".train button", { hasText: "Set" }).first().click();
  await seen.page.waitForFunction(() => /±/.test(document.querySelector(".train dd").textContent), null, { timeout: PATIENCE });
  await seen.page.screenshot({ path: join(AT, "editor-driven.png") });
  assert.deepEqual(seen.complaints, []);
  await seen.page.close();
  await end(drives);
  running.delete(drives);
});

test("a level crossing is placed and joined, and the file says where its tracks cross", async () => {
  const program = await started("sim:track-a?seed=7", "crossing.db");
  const { page, complaints } = await openQuietly(browser, `${program.url}#/editor`);
  await page.waitForSelector("#pieces button");
  const lay = (name) => page.locator("#pieces button", { hasText: name }).first().click();
  await page.click("#hand-right");
  await lay("24640");
  await lay("24188");
  assert.equal(await page.locator("#draft .joint.open").count(), 4);
  // The ends of the other track, by the angle of 24.3° about the middle of the first one.
  await pressJoint(page, "open", 180, 39);
  await lay("24172");
  assert.equal(await page.locator("#draft .joint.open").count(), 4);
  for (const [x, y] of [[188, 0], [180, 39]]) {
    await pressJoint(page, "joined", x, y);
    await page.click("#draft-sensor");
  }
  // A reed contact, say, which reports both directions under one number.
  await page.fill("#draft-number", "12");
  await page.locator("#draft-number").blur();
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "editor-crossing.png") });
  const [download] = await Promise.all([page.waitForEvent("download", { timeout: PATIENCE }), page.click("#draft-save")]);
  const file = join(folder, "crossing.toml");
  await download.saveAs(file);
  assert.match(footplate("layout", "check", file), /a sound layout of 12 nodes and 8 edges, with 1 crossing$/m);
  assert.match(readFileSync(file, "utf8"), /names = \["A3", "A4"\], number = 12, at = /);
  // Half of 188.3 mm from the sensor at either end of the piece.
  assert.match(footplate("layout", "show", file), /^cross   A2 to EX1 after 94 mm crosses A4 to EX2 after 94 mm$/m);
  assert.deepEqual(complaints, []);
  await page.close();
  await end(program);
  running.delete(program);
});

test("a double slip is two turnouts in one place, and a click on either end throws that one", async () => {
  const program = await started("sim:track-a?seed=7", "slip.db");
  const { page, complaints } = await openQuietly(browser, `${program.url}#/editor`);
  await page.waitForSelector("#pieces button");
  const lay = (name) => page.locator("#pieces button", { hasText: name }).first().click();
  await page.click("#hand-right");
  // In a straight of an oval; the other track leads from one end to another.
  const half = Array(6).fill("24130");
  for (const name of ["24188", "24624", "24188", ...half, "24188", "24188", "24188", ...half]) await lay(name);
  // The other track crosses the middle of the slip by 24.3°: 94.15 mm from there, 85.8 mm along the first track and 38.7 mm beside it.
  for (const [x, y] of [[368, 39], [197, -39]]) {
    await pressJoint(page, "open", x, y);
    await lay("24172");
  }
  for (const [x, y] of [[188, 0], [377, 0], [188, 720], [368, 39], [197, -39]]) {
    await pressJoint(page, "joined", x, y);
    await page.click("#draft-sensor");
  }
  assert.match(await page.locator("#draft-says").textContent(), /Track ends: 2\. Turnouts: 2\. Sensors: 5\./);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "editor-slip.png") });
  const [download] = await Promise.all([page.waitForEvent("download", { timeout: PATIENCE }), page.click("#draft-save")]);
  const file = join(folder, "slip.toml");
  await download.saveAs(file);
  assert.match(footplate("layout", "check", file), /a sound layout of 18 nodes and 18 edges$/m);
  const toml = readFileSync(file, "utf8");
  assert.match(toml, /from = "MR1", to = "BR2", mm = 0\.0/);
  // Half the mean of 188.3 mm and of an arc of 437.5 mm and 24.3°.
  assert.equal([...toml.matchAll(/to = "MR[12] (?:straight|curved)", mm = 93\.4 /g)].length, 4);
  assert.deepEqual(complaints, []);
  await page.close();
  await end(program);
  running.delete(program);

  const drives = await started(`sim:${file}?seed=7`, "slip.db");
  const seen = await openQuietly(browser, drives.url);
  await seen.page.waitForSelector(".train");
  await seen.page.locator("#track").scrollIntoViewIfNeeded();
  // The straight blades come first.
  for (const [blade, turnout] of [[0, 1], [1, 2]]) {
    const middle = () => seen.page.$$eval("#track .blade", (all, nth) => {
      const { x, y } = all[nth].getPointAtLength(all[nth].getTotalLength() / 2);
      const at = new DOMPoint(x, y).matrixTransform(all[nth].getScreenCTM());
      return [at.x, at.y];
    }, blade);
    await clickUntil(seen.page, middle, (number) => document.querySelector("#picked").textContent.includes(`turnout ${number} is unknown`), turnout);
    await seen.page.locator("#here-does button", { hasText: "Set curved" }).click();
    await seen.page.waitForFunction((number) => document.querySelector("#picked").textContent === `Turnout ${number} is set to curved.`, turnout, { timeout: PATIENCE });
  }
  await seen.page.screenshot({ path: join(AT, "slip-driven.png") });
  assert.deepEqual(seen.complaints, []);
  await seen.page.close();
  await end(drives);
  running.delete(drives);
});

test("the editor fits a phone, in the dark and in German", async () => {
  const program = await started("sim:track-a?seed=7", "phone.db");
  const { page, complaints } = await openQuietly(browser, `${program.url}#/editor`, { viewport: { width: 390, height: 800 }, locale: "de-DE", colorScheme: "dark", hasTouch: true });
  await page.waitForSelector("#pieces button");
  for (const system of await page.$$eval("#library option", (all) => all.map(({ value }) => value))) {
    await page.selectOption("#library", system);
    await page.locator("#pieces button").last().click();
    await page.locator("#pieces button").first().click();
  }
  assert.equal(await width(page), 390);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "editor-phone.png"), fullPage: true });
  assert.deepEqual(complaints, []);
  await page.close();
  await end(program);
  running.delete(program);
});
