// The set-up in a real browser: from starting the program without arguments to a calibrated train and its first stop.

import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { findings } from "./axe.mjs";
import { AT, launch, openQuietly, width } from "./browser.mjs";
import { drawOval } from "./oval.mjs";
import { PATIENCE, begin, end } from "./railway.mjs";

/** The time limit of a calibration: five minutes at twenty times real time, on a busy machine. */
const CALIBRATED_MS = 120_000;
/** While another program takes over the address, a browser reports that the server does not answer, or that the set-up has not what
 * the page of a session asked for last. */
const GOES_OVER = /status of 404 .*\/api\/(?:layout|schedules|truth)$|ERR_CONNECTION_REFUSED|ERR_EMPTY_RESPONSE|ERR_CONNECTION_RESET|ERR_INCOMPLETE_CHUNKED_ENCODING|ERR_SOCKET_NOT_CONNECTED/;

let browser;
const running = new Set();
const folder = mkdtempSync(join(tmpdir(), "footplate-setup-"));

async function started(store, port = 0) {
  const program = await begin(["serve", String(port), "--store", join(folder, store)]);
  running.add(program);
  return program;
}

async function ended(program) {
  running.delete(program);
  return end(program);
}

before(async () => { browser = await launch(); });
after(async () => {
  await browser?.close();
  await Promise.all([...running].map(end));
});

const isShown = (page, selector, ms = PATIENCE) => page.waitForSelector(selector, { timeout: ms });
const searched = (page) => page.waitForFunction(() => /\S/.test(document.querySelector("#stations")?.textContent ?? "") && !/searching/.test(document.querySelector("#stations").textContent), null, { timeout: PATIENCE });
const heading = (page) => page.locator("#setup-heading").textContent();

test("from nothing to a calibrated train and its first stop", async () => {
  const program = await started("railway.db");
  const { page, complaints } = await openQuietly(browser, program.url);
  await isShown(page, "#use-simulated");
  assert.match(page.url(), /#\/setup$/);
  await searched(page);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "setup-station.png"), fullPage: true });

  // An impossible entry is refused with an example of a right one.
  await page.click("#use-typed");
  assert.match(await page.locator("#setup-answer").textContent(), /such as 192\.168/);
  await page.selectOption("#sim-speed", "4");
  await page.click("#use-simulated");
  await isShown(page, "[data-layout='track-a']");
  // Its 156 edges are 78 rails in two directions.
  await page.waitForFunction(() => document.querySelectorAll("[data-layout='track-a'] .rail").length === 78, null, { timeout: PATIENCE });
  await page.screenshot({ path: join(AT, "setup-layout.png"), fullPage: true });
  await page.click("[data-layout='track-a']");
  await isShown(page, "#save-trains");
  await page.fill(".called", "Big Boy");
  await page.click("#add-train");
  await page.locator(".address").nth(1).fill("24");
  await page.click("#save-trains");
  await page.waitForFunction(() => /used twice/.test(document.querySelector("#setup-answer").textContent));
  // Only one train: with two, the position of the other must be known first (see below).
  await page.locator("#train-rows button").nth(1).click();
  assert.deepEqual(await findings(page), []);
  await page.click("#save-trains");

  await isShown(page, "#check-link");
  await page.click("#check-link");
  await isShown(page, "#link-next");
  assert.match(await page.locator("#setup-step pre").textContent(), /sensor modules/);
  await page.screenshot({ path: join(AT, "setup-link.png"), fullPage: true });

  // Each step is kept: the restarted program continues at the same step.
  assert.equal(await ended(program), 0);
  const again = await started("railway.db", program.port);
  await page.goto(`${again.url}#/setup/station`);
  await page.reload();
  // A search that is still going on when the session begins is asked of it once more by Chromium.
  await searched(page);
  await page.goto(`${again.url}#/setup`);
  await isShown(page, "[data-calibrate='24']");

  // No train moves before the owner has confirmed that the turnouts are clear.
  await page.click("[data-calibrate='24']");
  await page.waitForFunction(() => /check first that no train is standing on one/.test(document.querySelector("#setup-answer").textContent));
  await page.check("#turnouts-clear");
  await page.click("[data-calibrate='24']");
  await isShown(page, "#calibrates");
  await page.waitForFunction(() => document.querySelector("#calibrated")?.value > 0.3, null, { timeout: CALIBRATED_MS });
  assert.match(await page.locator("#reached").textContent(), /±\d+ mm/);
  await page.screenshot({ path: join(AT, "setup-calibrating.png"), fullPage: true });
  await isShown(page, "#turnouts-clear", CALIBRATED_MS);
  await page.waitForFunction(() => document.querySelector(".cards .card p").textContent === "calibrated", null, { timeout: PATIENCE });
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "setup-calibrated.png"), fullPage: true });

  await page.click("#calibrate-next");
  await isShown(page, "#drive");
  await page.click("#drive");
  await page.waitForSelector("#go:visible", { timeout: PATIENCE });
  assert.ok(await page.locator("#all-straight").isHidden(), "the calibration has set the turnouts");
  await page.selectOption("#first-place", "C13");
  await page.click("#go");
  await page.waitForFunction(() => /stopped at|refused/.test(document.querySelector("#first-result").textContent), null, { timeout: 2 * PATIENCE });
  const result = await page.locator("#first-result").textContent();
  assert.match(result, /Train 24 stopped at C13/);
  const [, low, high] = /95 %: (\S+) to (\S+) mm/.exec(result.replaceAll("−", "-")).map(Number);
  const [, truth] = /simulation: (\S+) mm/.exec(result.replaceAll("−", "-")).map(Number);
  assert.ok(low < high && Math.abs(truth) < 100, result);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "setup-stopped.png"), fullPage: true });

  // Back to the set-up and forward again; the next start drives at once.
  await page.click("#setup-again");
  await isShown(page, "#setup-steps a");
  assert.match(await heading(page), /first stop/i);
  await page.click("#drive");
  await isShown(page, "#to-layout");
  await page.click("#to-layout");
  await isShown(page, "#track .rail");
  // The two refusals above are answers with status 422.
  assert.deepEqual(complaints.filter((text) => !GOES_OVER.test(text) && !/status of 422/.test(text)), []);
  await page.close();
  await ended(again);
  const third = await started("railway.db");
  const { page: driven } = await openQuietly(browser, third.url);
  await isShown(driven, "#track .rail");
  await driven.close();
  await ended(third);
});

test("a drawn layout becomes a file beside the store", async () => {
  const program = await started("drawn.db");
  const post = async (path, body) => {
    const answer = await fetch(`${program.url}${path}`, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
    return [answer.status, await answer.json()];
  };
  const toml = readFileSync(new URL("../../../footplate-store/layouts/track-b.toml", import.meta.url), "utf8");
  const [, { error }] = await post("api/setup", { drawn: { toml } });
  assert.match(error, /another name/, "its name is that of a built-in layout");
  const renamed = toml.replace(/^name = ".*"$/m, 'name = "My attic"');
  const [status, setUp] = await post("api/setup", { drawn: { toml: renamed } });
  assert.equal(status, 200);
  assert.equal(setUp.layout, join(folder, "my-attic.toml"));
  assert.equal(readFileSync(setUp.layout, "utf8"), renamed);
  assert.equal((await post("api/setup", { drawn: { toml: "nodes = 1" } }))[0], 422);
  assert.equal((await post("api/setup", { link: "nonsense" }))[0], 422);
  assert.equal((await post("api/setup", { colour: "red" }))[0], 422);
  assert.match((await post("api/setup/drive", {}))[1].error, /command station first/);
  assert.ok(existsSync(join(folder, "drawn.setup.json")));
  await ended(program);
});

test("a layout is drawn from nothing in the set-up, and a simulated train is calibrated on it", async () => {
  const program = await started("oval.db");
  const { page, complaints } = await openQuietly(browser, program.url);
  await page.click("#use-simulated");
  await page.click("#draw");
  await isShown(page, "#pieces button");
  await drawOval(page);
  await page.fill("#draft-name", "Oval with a siding");
  await page.click("#draft-use");
  await isShown(page, "#save-trains");
  assert.match(await page.locator("#setup-chosen").textContent(), /oval-with-a-siding\.toml/);
  await page.click("#save-trains");
  await isShown(page, "#check-link");
  await page.goto(`${program.url}#/setup/calibrate`);
  await page.check("#turnouts-clear");
  await page.click("[data-calibrate='24']");
  await isShown(page, "#calibrates");
  await isShown(page, "#turnouts-clear", CALIBRATED_MS);
  await page.waitForFunction(() => document.querySelector(".cards .card p").textContent === "calibrated", null, { timeout: PATIENCE });
  const { trains: [train] } = await (await fetch(`${program.url}api/setup`)).json();
  assert.equal(train.is_calibrated, true);
  assert.match(train.calibration.report, /^Train 24 on Oval with a siding: \S+ of track time/);
  assert.deepEqual(complaints.filter((text) => !GOES_OVER.test(text)), []);
  await page.close();
  await ended(program);
});

test("a station that is gone leads back to the set-up, with the reason", async () => {
  const file = join(folder, "gone.setup.json");
  writeFileSync(file, JSON.stringify({ link: "dcc-ex:tcp://127.0.0.1:1", layout: "track-a", trains: [{ address: 24, name: "" }], is_complete: true }));
  const program = await started("gone.db");
  // The session serves its page before it finds that it cannot begin: a page that loaded only in part reloads itself.
  const page = await browser.newPage();
  while (!await page.goto(program.url).catch(() => undefined)) await new Promise((again) => { setTimeout(again, 20); });
  await page.waitForSelector("#setup-problem:visible", { timeout: PATIENCE });
  assert.match(await page.locator("#setup-problem").textContent(), /^The session could not begin: cannot connect to 127\.0\.0\.1:1/);
  await page.close();
  await ended(program);
});

test("a page that loaded only in part reloads itself", async () => {
  const program = await started("half.db");
  // The first requests fail while another program takes over the address: those for one module, or for all files but the page.
  for (const part of [/setup_page\.js/, /\.(js|css)/]) {
    const page = await browser.newPage();
    let failed = 0;
    let began;
    await page.route(part, (route) => {
      began ??= Date.now();
      return Date.now() - began < 1000 && ++failed ? route.abort() : route.continue();
    });
    await page.goto(program.url);
    await isShown(page, "#use-simulated");
    assert.ok(failed > 0, String(part));
    await page.close();
  }
  await ended(program);
});

test("with two trains the page leads to the one whose position is unknown", async () => {
  const file = join(folder, "two.setup.json");
  const trains = [{ address: 24, name: "Big Boy" }, { address: 58, name: "" }];
  writeFileSync(file, JSON.stringify({ link: "sim", speed: 4, layout: "track-a", trains, is_complete: true }));
  const program = await started("two.db");
  const page = await browser.newPage({ viewport: { width: 1300, height: 900 } });
  while (!await page.goto(`${program.url}#/setup`).catch(() => undefined)) await new Promise((again) => { setTimeout(again, 20); });
  await page.waitForSelector("#all-straight:visible", { timeout: PATIENCE });
  await page.click("#all-straight");
  await page.waitForSelector("#go:visible", { timeout: PATIENCE });
  await page.waitForFunction(() => document.querySelectorAll("#first-lost .does").length === 2, null, { timeout: PATIENCE });
  assert.match(await page.locator("#first-lost").textContent(), /Big Boy, Train 58: position unknown\. .*knows where all of them are/);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "setup-two-trains.png"), fullPage: true });
  await page.locator("#first-lost button", { hasText: "Find train 58" }).click();
  await page.waitForFunction(() => document.querySelectorAll("#first-lost .does").length === 1, null, { timeout: PATIENCE });
  await page.close();
  await ended(program);
});

test("the set-up fits a phone, in the dark and in German", async () => {
  const program = await started("phone.db");
  const { page, complaints } = await openQuietly(browser, program.url, { viewport: { width: 390, height: 800 }, locale: "de-DE", colorScheme: "dark", hasTouch: true });
  await isShown(page, "#use-simulated");
  await page.waitForFunction(() => !/gesucht …/.test(document.querySelector("#stations").textContent), null, { timeout: PATIENCE });
  assert.equal(await width(page), 390);
  assert.deepEqual(await findings(page), []);
  await page.screenshot({ path: join(AT, "setup-phone.png"), fullPage: true });
  await page.click("#use-simulated");
  await page.click("[data-layout='track-b']");
  await isShown(page, "#save-trains");
  assert.equal(await width(page), 390);
  await page.screenshot({ path: join(AT, "setup-phone-trains.png"), fullPage: true });
  // A phone's home screen shows the icon as a picture.
  const icon = await fetch(new URL(await page.getAttribute("link[rel=apple-touch-icon]", "href"), program.url));
  assert.equal(icon.headers.get("content-type"), "image/png");
  assert.deepEqual([...new Uint8Array(await icon.arrayBuffer()).slice(1, 4)], [...Buffer.from("PNG")]);
  // The report of the link is in the reader's language, too.
  await page.fill(".address", "24");
  await page.click("#save-trains");
  await isShown(page, "#check-link");
  await page.click("#check-link");
  await isShown(page, "#link-next");
  const report = await page.locator("#setup-step pre").textContent();
  assert.match(report, /Rückmeldemodule, Handshake CTS/);
  assert.doesNotMatch(report, /\b(line|polls|without|reply|median|longest|costs|later|answers)\b/);
  assert.equal(await width(page), 390);
  await page.screenshot({ path: join(AT, "setup-phone-link.png"), fullPage: true });
  assert.deepEqual(complaints, []);
  await page.close();
  await ended(program);
});

test("the reports of a link and of a calibration have no English line for German readers", async () => {
  const { inGerman } = await import("../../assets/dashboard/german_report.js");
  const table = execFileSync(process.env.FOOTPLATE, ["calibrate", "--link", "sim:track-a?seed=7", "--layout", "track-a", "--train", "24", "--budget", "1m"], { encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] });
  const german = inGerman(table.trim());
  assert.match(german, /^Zug 24 auf track-a: \S+ Fahrzeit, die vorgesehene Zeit ist um/);
  assert.doesNotMatch(german, /\b(step|below|above|stops|track time|value|repeatability)\b/);
  for (const station of ["marklin", "dcc-ex", "z21", "marklin-can", "loconet", "jmri"]) {
    // On a busy machine a station twenty times as fast as real loses replies, which is a status of 1.
    const { stdout } = spawnSync(process.env.FOOTPLATE, ["doctor", "--link", `sim:track-a?seed=7&station=${station}&speed=20`, "--layout", "track-a"], { encoding: "utf8" });
    assert.doesNotMatch(inGerman(stdout), /\b(line|polls|without|reply|median|longest|costs|later|answers|occupied|reports|taken|serial|number|unknown|refused|station at|system)\b/, station);
  }
});
