// The odometry page in a real browser: a simulated slide is shown live and repeats for the same seed; the report of a recording is in
// the reader's language.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readdirSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { findings } from "./axe.mjs";
import { AT, colours, launch, openQuietly, width } from "./browser.mjs";
import { PATIENCE, calibratedStore, end, serve } from "./railway.mjs";

let browser;
let running;

const until = (page, what, arg) => page.waitForFunction(what, arg, { timeout: PATIENCE });
const text = (page, selector) => page.locator(selector).textContent();
const folder = () => mkdtempSync(join(tmpdir(), "footplate-slide-"));

/** The result of the command line for the same run. */
function scored(scenario, seed) {
  const out = folder();
  const footplate = (...words) => execFileSync(process.env.FOOTPLATE, words, { stdio: "pipe" }).toString();
  footplate("simulate", "line", "--scenario", scenario, "--seed", String(seed), "--out", out);
  const file = (ending) => join(out, readdirSync(out).find((name) => name.endsWith(ending)));
  return { recording: file(".csv"), score: JSON.parse(footplate("odometry", file(".csv"), "--vehicle", file(".toml"), "--score", "--json")) };
}

/** All events of a slide. */
async function events(address) {
  const answer = await fetch(running.url + address);
  assert.equal(answer.status, 200);
  return (await answer.text()).trim().split("\n\n").map((event) => {
    const lines = event.split("\n");
    const of = (name) => lines.find((line) => line.startsWith(`${name}: `))?.slice(name.length + 2);
    return { kind: of("event"), data: of("data") && JSON.parse(of("data")) };
  }).filter(({ kind }) => kind);
}

before(async () => {
  running = await serve(calibratedStore("slide"), 0);
  browser = await launch();
});

after(async () => {
  await browser?.close();
  if (running) await end(running);
});

test("a slide is shown live: both wheels lag behind the train, the bounds hold, and the score equals that of the command line", async () => {
  const { page, complaints } = await openQuietly(browser, `${running.url}#/odometry`);
  await page.selectOption("#slide", "S2");
  await page.fill("#slide-seed", "7");
  await page.selectOption("#slide-speed", "5");
  await page.click("#watch-slide button[type=submit]");
  // Both wheelsets slide and are classified as sliding; the train is faster than both.
  await until(page, () => /slides/.test(document.querySelector("#slide-wheel-1").textContent) && /slides/.test(document.querySelector("#slide-wheel-2").textContent));
  await until(page, () => {
    const of = (id) => parseFloat(document.querySelector(id).textContent);
    return of("#slide-truth") > 2 && of("#slide-wheel-1") < 0.5 * of("#slide-truth") && of("#slide-wheel-2") < 0.5 * of("#slide-truth");
  });
  await page.screenshot({ path: join(AT, "sliding.png"), fullPage: true });
  const [, early] = /(\d+) periods$/.exec(await text(page, "#slide-inside"));
  await until(page, (before) => Number(/(\d+) periods$/.exec(document.querySelector("#slide-inside").textContent)[1]) > Number(before) + 20, early);
  for (const [place, count] of (await colours(page)).entries()) assert.ok(count > 8, `chart ${place}: ${count} colours`);
  await until(page, () => /stayed within the bounds/.test(document.querySelector("#slide-score").textContent));
  const [inside, of] = (await text(page, "#slide-inside")).match(/\d+/g).map(Number);
  assert.equal(inside, of);
  const { score } = scored("S2", 7);
  const expected = score.overall.presets.recommended.speed_rms_m_s;
  const [, rms] = /Speed error: ([\d.]+) m\/s/.exec(await text(page, "#slide-score"));
  assert.ok(Math.abs(Number(rms) - expected) < 0.0006, `${rms} beside ${expected}`);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "slide.png"), fullPage: true });
  assert.deepEqual(complaints, []);
  await page.close();
});

test("a slide fits a phone in the dark and in German, and ends when its page is left", async () => {
  const { page, complaints } = await openQuietly(browser, `${running.url}#/odometry`, { viewport: { width: 390, height: 800 }, colorScheme: "dark", locale: "de-DE", hasTouch: true });
  await page.selectOption("#slide-speed", "5");
  await page.click("#watch-slide button[type=submit]");
  await until(page, () => /gleitet/.test(document.querySelector("#slide-wheel-1").textContent));
  assert.equal(await width(page), 390);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "slide-phone.png"), fullPage: true });
  // Four can run at once; a client that leaves makes room.
  await page.goto(`${running.url}#/layout`);
  for (let again = 0; again < 6; again++) {
    await page.goto(`${running.url}#/odometry`);
    await page.click("#watch-slide button[type=submit]");
    await until(page, () => /rollt|gleitet/.test(document.querySelector("#slide-wheel-1")?.textContent ?? ""));
    await page.goto(`${running.url}#/layout`);
    await page.waitForTimeout(300);
  }
  assert.deepEqual(complaints, []);
  await page.close();
});

test("the same seed repeats the same run, and an impossible request is refused with the reason", async () => {
  const rows = async (address) => (await events(address)).filter(({ kind }) => kind === "rows").flatMap(({ data }) => data.rows);
  const [one, other, another] = await Promise.all([rows("api/slides/s2?seed=7&speed=20"), rows("api/slides/S2?seed=7&speed=10"), rows("api/slides/S2?seed=8&speed=20")]);
  assert.ok(one.length > 400, `${one.length} periods`);
  assert.deepEqual(one, other);
  assert.notDeepEqual(one, another);
  for (const [address, status] of [["S99", 404], ["S2?speed=1000", 422], ["S2?seed=x", 422]]) {
    const answer = await fetch(`${running.url}api/slides/${address}`);
    assert.equal(answer.status, status, address);
    assert.ok((await answer.json()).error);
  }
  const all = await (await fetch(`${running.url}api/slides`)).json();
  assert.ok(all.some(({ name }) => name === "S2"));
});

test("the page of a recording is German for a German reader", async () => {
  const { recording } = scored("S5", 1);
  const { page, complaints } = await openQuietly(browser, `${running.url}#/odometry`, { locale: "de-DE" });
  await page.setInputFiles("#file", recording);
  const frame = page.frameLocator("#result");
  await frame.locator(".uplot").first().waitFor({ timeout: PATIENCE });
  assert.match(await frame.locator("h1").textContent(), /^Odometrie von /);
  assert.equal(await frame.locator("html").getAttribute("lang"), "de");
  const said = await frame.locator("body").innerText();
  for (const word of ["Fahrzeug:", "Räder", "Gegen die Wahrheit", "Schätzung", "Die Schätzung reicht von"]) assert.ok(said.includes(word), word);
  for (const word of ["Vehicle", "Against", "estimate", " the ", "Runs"]) assert.ok(!said.includes(word), word);
  await page.screenshot({ path: join(AT, "odometry-german.png"), fullPage: true });
  assert.deepEqual(complaints, []);
  await page.close();
});
