// The dashboard in a real browser: a simulated train is located, driven by clicking and stopped at its target; the space bar is an
// emergency stop; requests of other sites are refused; a page finds a server that comes back.

import assert from "node:assert/strict";
import { request } from "node:http";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { AT, below, clickUntil, launch, openQuietly } from "./browser.mjs";
import { PATIENCE, calibratedStore, end, serve } from "./railway.mjs";

/** A stop further from its target than this (mm) has failed: no interval of this train is as wide. */
const MISSED_MM = 60;

let browser;
let running;
let store;

/** The status of a request with headers that no browser would send. */
function ask(path, headers, body) {
  return new Promise((resolve, reject) => {
    const sent = request({ host: "127.0.0.1", port: running.port, path, method: body ? "POST" : "GET", headers }, (answer) => {
      answer.resume();
      resolve(answer.statusCode);
    });
    sent.on("error", reject);
    sent.end(body);
  });
}

const picture = async () => (await fetch(`${running.url}api/picture`)).json();

before(async () => {
  store = calibratedStore("dashboard");
  running = await serve(store, 0);
  browser = await launch();
});

after(async () => {
  await browser?.close();
  if (running) await end(running);
});

test("a train is located, driven by clicking, stopped at its target, and stopped by the space bar", async () => {
  const { page, complaints } = await openQuietly(browser, running.url);
  await page.waitForSelector(".train");
  await page.fill("#line", "turnout all straight");
  await page.click("#order button");
  await page.waitForFunction(() => /turnout 156 set/.test(document.querySelector("#said").textContent), null, { timeout: PATIENCE });
  await page.fill("#step-24", "8");
  await page.locator(".train button", { hasText: "Set" }).first().click();
  const card = page.locator(".train").first();
  await page.waitForFunction(() => /±/.test(document.querySelector(".train dd").textContent), null, { timeout: PATIENCE });
  await page.screenshot({ path: join(AT, "dashboard.png") });

  // After E7, C13 is a lap away. A click selects it, and the button on the card stops the train there.
  await page.waitForFunction(() => /at E7,[^]*$/.test(document.querySelector("#said").lastElementChild.textContent), null, { timeout: PATIENCE });
  await clickUntil(page, below(page, "C13 C14", 6), () => /Stop at [A-E]\d/.test(document.querySelector(".train").textContent));
  const named = /Stop at (\S+)/.exec(await card.locator("button", { hasText: "Stop at" }).textContent())?.[1];
  await card.locator("button", { hasText: "Stop at" }).click();
  await page.waitForFunction(() => document.querySelectorAll(".train dd")[2].textContent !== "–", null, { timeout: PATIENCE });
  await page.screenshot({ path: join(AT, "dashboard-stopping.png") });
  await page.waitForFunction(() => /from the target/.test(document.querySelector("#said").textContent), null, { timeout: PATIENCE });
  const off = /([+-][\d.]+) mm from the target/.exec(await page.locator("#said").textContent())[1];
  assert.ok(Math.abs(Number(off)) < MISSED_MM, `stop at ${named}: ${off} mm`);

  await page.fill("#step-24", "6");
  await page.locator(".train button", { hasText: "Set" }).first().click();
  await page.waitForFunction(() => /step 6/.test(document.querySelectorAll(".train dd")[1].textContent), null, { timeout: PATIENCE });
  await page.locator("h1").click();
  await page.keyboard.press("Space");
  await page.waitForFunction(() => /commanded to stop|NOT CONFIRMED/.test(document.querySelector("#halted").textContent), null, { timeout: PATIENCE });
  const { trains } = await picture();
  assert.equal(trains[0].step, 0);
  // The command was sent and the station has answered since; the page never claims that the power is off.
  await page.waitForFunction(() => /NOT CONFIRMED, check that all trains have stopped/.test(document.querySelector("#halted").textContent), null, { timeout: PATIENCE });
  await page.click("#power-on");
  await page.waitForFunction(() => document.querySelector("#halted").hidden, null, { timeout: PATIENCE });
  assert.deepEqual(complaints, []);
  await page.close();
});

test("requests of other origins, hosts and content types are refused, and errors name the mistake", async () => {
  const own = { Host: `127.0.0.1:${running.port}`, "Content-Type": "application/json" };
  const order = JSON.stringify({ line: "where" });
  assert.equal(await ask("/api/orders", own, order), 202);
  assert.equal(await ask("/api/orders", { ...own, Origin: "http://evil.example" }, order), 403);
  assert.equal(await ask("/api/orders", { ...own, Host: `evil.example:${running.port}` }, order), 421);
  assert.equal(await ask("/api/picture", { Host: "evil.example" }), 421);
  assert.equal(await ask("/api/orders", { ...own, "Content-Type": "text/plain" }, order), 415);
  assert.equal(await ask("/api/orders", own, JSON.stringify({ line: "sped 24 8" })), 422);
  assert.equal(await ask("/api/orders", own, "{"), 400);
  assert.equal(await ask("/api/orders", own, JSON.stringify({ line: "x".repeat(10_000) })), 413);
  assert.equal(await ask("/nothing", own), 404);
});

test("other machines need the token, and the page works with it", async () => {
  const refused = await serve(store, "0.0.0.0:0", { token: "s3cret" }).catch((error) => error);
  assert.match(String(refused), /FOOTPLATE_TOKEN has 6 characters/);
  const generated = await serve(store, "0.0.0.0:0");
  assert.match(generated.url, /\?token=[0-9a-f]{32}$/);
  await end(generated);
  // A token with all characters that Base64 uses.
  const token = "c2VjcmV0IHRva2Vu+/8=";
  const open = await serve(store, "0.0.0.0:0", { token });
  const url = `http://127.0.0.1:${open.port}/`;
  assert.equal((await fetch(`${url}api/picture`)).status, 401);
  assert.equal((await fetch(`${url}api/picture`, { headers: { Authorization: `Bearer ${token.slice(1)}` } })).status, 401);
  assert.equal((await fetch(`${url}api/picture`, { headers: { Authorization: `Bearer ${token}` } })).status, 200);
  const { page, complaints } = await openQuietly(browser, `${url}?token=${token}`);
  await page.waitForSelector(".train");
  await page.fill("#line", "where");
  await page.click("#order button");
  await page.waitForFunction(() => /train 24/.test(document.querySelector("#said").textContent), null, { timeout: PATIENCE });
  assert.deepEqual(complaints, []);
  await page.close();
  await end(open);
});

test("the dashboard can be installed, and opens without its server", async () => {
  const installed = await serve(store, 0);
  const manifest = await (await fetch(`${installed.url}manifest.webmanifest`)).json();
  assert.ok(manifest.name && manifest.start_url && manifest.display === "standalone", JSON.stringify(manifest));
  for (const { src } of manifest.icons) assert.equal((await fetch(new URL(src, installed.url))).status, 200, src);
  const { page } = await openQuietly(browser, installed.url);
  await page.waitForSelector(".train");
  // The worker has taken over, and has kept the page and its modules.
  await page.waitForFunction(async () => (await (await caches.open("shell")).keys()).length > 20, null, { timeout: PATIENCE });
  await end(installed);
  await page.reload();
  await page.waitForSelector("#connection.red", { timeout: PATIENCE });
  assert.equal(await page.locator("#halt").textContent(), "Emergency stop");
  await page.close();
});

test("the dashboard fits a phone, in the dark and in German, and reconnects to a restarted server", async () => {
  const page = await browser.newPage({ viewport: { width: 390, height: 800 }, colorScheme: "dark", locale: "de-DE", hasTouch: true });
  await page.goto(running.url);
  await page.waitForSelector(".train");
  assert.equal(await page.locator("#halt").textContent(), "Nothalt");
  const wide = await page.evaluate(() => Math.max(document.documentElement.scrollWidth, innerWidth));
  assert.equal(wide, 390);
  await page.screenshot({ path: join(AT, "dashboard-phone.png") });
  const { port } = running;
  await page.evaluate(() => { window.isOfFirst = true; });
  await end(running);
  await page.waitForSelector("#connection.red", { timeout: PATIENCE });
  running = await serve(store, port);
  await page.waitForSelector("#connection.green", { timeout: PATIENCE });
  // It is another session, perhaps with another layout: the page is loaded again.
  await page.waitForFunction(() => window.isOfFirst === undefined, null, { timeout: PATIENCE });
  await page.waitForSelector("#connection.green", { timeout: PATIENCE });
  await page.close();
});
