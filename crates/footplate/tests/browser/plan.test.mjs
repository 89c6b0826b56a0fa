// The drawn layout in a real browser: parallel tracks are drawn even without coordinates; turnouts, trains and places can be clicked.

import assert from "node:assert/strict";
import { mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { findings } from "./axe.mjs";
import { AT, below, clickUntil, launch, openQuietly, width } from "./browser.mjs";
import { PATIENCE, begin, calibratedStore, end, say, serve } from "./railway.mjs";

let browser;
const running = new Set();

const folder = mkdtempSync(join(tmpdir(), "footplate-plan-"));
const until = (page, what, arg) => page.waitForFunction(what, arg, { timeout: PATIENCE });
const text = (page, selector) => page.locator(selector).textContent();

/** The oval of the guide, with or without drawing coordinates. */
function oval(name, change = (toml) => toml) {
  const guide = readFileSync(new URL("../../../../docs/formats/layout.md", import.meta.url), "utf8");
  const path = join(folder, `${name}.toml`);
  writeFileSync(path, change(/```toml\n([^]*?)```/.exec(guide)[1]));
  return path;
}

async function started(layout) {
  const program = await begin(["serve", "0", "--link", `sim:${layout}?seed=7&speed=4`, "--train", "24", "--store", join(folder, "oval.db")]);
  running.add(program);
  return program;
}

async function ended(program) {
  await end(program);
  running.delete(program);
}

/** Points along each drawn rail. */
const rails = (page) => page.$$eval("#track .rail", (all) => all.map((rail) => Array.from({ length: 9 }, (_, nth) => {
  const { x, y } = rail.getPointAtLength(rail.getTotalLength() * (nth + 0.5) / 9);
  return [x, y];
})));

const apart = (one, other) => Math.hypot(one[0] - other[0], one[1] - other[1]);

before(async () => { browser = await launch(); });
after(async () => {
  await browser?.close();
  await Promise.all([...running].map(end));
});

test("the guide's oval is drawn as an oval with its siding beside it, also if its points are one line or there are none", async () => {
  const without = (toml) => toml.replace(/, at = \[[^\]]*\]/g, "");
  for (const [name, options, change] of [["oval", {}], ["oval-without", { colorScheme: "dark", locale: "de-DE" }, without]]) {
    const program = await started(oval(name, change));
    const { page, complaints } = await openQuietly(browser, program.url, options);
    await page.waitForSelector(".train");
    const drawn = await rails(page);
    assert.equal(drawn.length, 6);
    const [xs, ys] = [0, 1].map((axis) => drawn.flat().map((point) => point[axis]));
    const [wide, high] = [xs, ys].map((all) => Math.max(...all) - Math.min(...all));
    assert.ok(high > wide / 5, `${wide} × ${high}: not a line`);
    for (const [nth, one] of drawn.entries()) {
      for (const other of drawn.slice(nth + 1)) {
        assert.ok(one.some((point) => other.every((beside) => apart(point, beside) > wide / 100)), "two rails are one line");
      }
    }
    // Each turnout shows both of its legs, and that its position is unknown.
    assert.equal(await page.locator("#track .blade.unknown").count(), 4);
    assert.equal(await page.locator("#track .rail.restricted").count(), 1);
    assert.deepEqual(await findings(page), []);
    await page.screenshot({ path: join(AT, `${name}.png`) });
    assert.deepEqual(complaints, []);
    await page.close();
    await ended(program);
  }
});

test("a click asks for the position of a turnout, then throws it, and is refused under a train", async () => {
  const store = calibratedStore("plan");
  const program = await serve(store, 0);
  running.add(program);
  const { page, complaints } = await openQuietly(browser, program.url);
  await page.waitForSelector(".train");
  await clickUntil(page, below(page, "⟨12⟩", 4), () => /position of turnout 12 is unknown/.test(document.querySelector("#picked").textContent));
  const lies = async () => (await (await fetch(`${program.url}api/picture`)).json()).turnouts;
  assert.equal((await lies())[12], null, "nothing was thrown unasked");
  await page.locator("#here-does button", { hasText: "Set straight" }).click();
  await until(page, () => document.querySelector("#picked").textContent === "Turnout 12 is set to straight.");
  assert.equal((await lies())[12], "straight");
  await page.mouse.click(...await below(page, "⟨12⟩", 4)());
  await until(page, () => document.querySelector("#picked").textContent === "Turnout 12 is set to curved.");
  await until(page, () => document.querySelector("#here-answer").textContent === "Done. Undo");
  await page.locator("#here-answer button").click();
  await until(page, () => document.querySelector("#picked").textContent === "Turnout 12 is set to straight.");
  assert.equal((await lies())[12], "straight", "undone");
  // The operator places a train on turnout 11 by a click.
  await page.click("#all-straight");
  await until(page, () => document.querySelectorAll("#track .blade.unknown").length === 0);
  await say(program, "place 24 at C14+160mm");
  await until(page, () => document.querySelector("#track .body").getAttribute("d") !== "M0 0");
  await page.locator("#turnout-list button", { hasText: "11:" }).click();
  await until(page, () => /refused: train 24 is on turnout 11/.test(document.querySelector("#here-answer").textContent));
  assert.equal((await lies())[11], "straight");

  // A click on a place puts the train there, in the chosen direction.
  await clickUntil(page, below(page, "E7 E8", 6), () => /^Selected: E[78]/.test(document.querySelector("#picked").textContent));
  const first = await text(page, "#picked");
  await page.locator("#here-does button", { hasText: "Other direction" }).click();
  assert.notEqual(await text(page, "#picked"), first);
  const place = (await text(page, "#picked")).replace("Selected: ", "");
  await page.locator("#here-does button", { hasText: "Train 24 is here" }).click();
  const name = /^[A-E]\d+/.exec(place)[0];
  await until(page, (name) => document.querySelector(".train dd").textContent.startsWith(name), name);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "plan.png") });

  // Signals follow from reservations: all show stop while no train is to run, and some proceed ahead of one that runs.
  await page.check("#signals");
  await page.waitForSelector("#track .signal.stop");
  assert.equal(await page.locator("#track .signal.proceed").count(), 0);
  await say(program, "speed 24 8");
  await page.waitForSelector("#track .signal.proceed", { timeout: PATIENCE });
  await page.screenshot({ path: join(AT, "signals.png") });
  await say(program, "stop 24");
  await until(page, () => document.querySelectorAll("#track .signal.proceed").length === 0);
  assert.deepEqual(complaints, []);
  await page.close();
  const phone = await openQuietly(browser, program.url, { viewport: { width: 390, height: 800 }, locale: "de-DE", colorScheme: "dark", hasTouch: true });
  await phone.page.waitForSelector(".train");
  assert.equal(await width(phone.page), 390);
  assert.deepEqual(await findings(phone.page), []);
  await phone.page.screenshot({ path: join(AT, "plan-phone.png"), fullPage: true });
  await phone.page.close();
  await ended(program);
});

/** An oval of 3.4 m with a level crossing, 94 mm behind A1 and 282 mm behind B1. */
const CROSSING = `format = 1
name = "crossing"
length_uncertainty_mm = 1
length_origin = "invented"
sensors = [{ names = ["A1", "A2"] }, { names = ["A3", "A4"] }, { names = ["A5", "A6"] }, { names = ["A7", "A8"] }, { names = ["B1", "B2"] }, { names = ["B3", "B4"] }]
ends = [{ names = ["EN1", "EX1"] }, { names = ["EN2", "EX2"] }]
edges = [
  { from = "A1", to = "A3", mm = 188 }, { from = "A3", to = "A5", mm = 565 }, { from = "A5", to = "A7", mm = 1130 }, { from = "A7", to = "A1", mm = 1507 },
  { from = "EN1", to = "B1", mm = 188 }, { from = "B1", to = "B3", mm = 565 }, { from = "B3", to = "EX2", mm = 500 },
]
crossings = [{ tracks = [{ from = "A1", to = "A3", mm = 94 }, { from = "B1", to = "B3", mm = 282 }] }]
`;

test("two trains beside one crossing are told why neither may start, and how it goes on", async () => {
  const path = join(folder, "crossing.toml");
  writeFileSync(path, CROSSING);
  const program = await begin(["serve", "0", "--link", `sim:${path}?seed=7&speed=4`, "--train", "24", "--store", join(folder, "crossing.db")]);
  running.add(program);
  const { page, complaints } = await openQuietly(browser, program.url);
  await page.waitForSelector(".train");
  assert.equal(await page.locator("#track .crossing.apart title").textContent(), "level crossing: one train at a time");
  const held = () => page.locator("#crossings-held").textContent();
  await say(program, "place 24 at A1+60mm");
  // 32 mm short of it, on the other track.
  await say(program, "place 58 at B1+250mm");
  await until(page, () => document.querySelector("#crossings-held").textContent);
  assert.match(await held(), /^Train 24 and train 58 are at rest near the level crossing at A1\+94mm: neither may start while .* 200 mm .* click where it is\.$/);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "crossing-held.png") });
  // A command is refused or waits; the remedy of its alarm is the same.
  await say(program, "speed 24 8");
  await page.waitForSelector("#alarmed a.button", { timeout: PATIENCE });
  await page.click("#alarmed a.button");
  await until(page, () => /less than 200 mm/.test(document.querySelector("#guide").textContent));
  assert.equal(await page.locator("#guide button", { hasText: "Reverse" }).count(), 0);
  // 600 mm from the crossing, nothing holds train 24.
  await say(program, "place 58 at B3+250mm");
  await until(page, () => document.querySelector("#crossings-held").textContent === "");
  assert.deepEqual(complaints, []);
  await page.close();
  await ended(program);
});
