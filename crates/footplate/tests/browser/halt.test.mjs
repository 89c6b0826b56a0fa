// The emergency stop at a station that reports the track power, in a real browser: the banner says what the station reports.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { launch, openQuietly } from "./browser.mjs";
import { PATIENCE, begin, calibratedStore, end } from "./railway.mjs";

let browser, store;

before(async () => {
  store = calibratedStore("halt");
  browser = await launch();
});
after(() => browser?.close());

for (const station of ["dcc-ex", "z21", "marklin-can", "loconet", "jmri"]) {
  test(`the banner says that a ${station} station has confirmed the emergency stop`, async () => {
    const program = await begin(["serve", "0", "--link", `sim:track-a?seed=7&station=${station}&speed=4`, "--train", "24", "--store", store]);
    const { page, complaints } = await openQuietly(browser, program.url);
    await page.waitForSelector(".train");
    await page.waitForFunction(() => document.querySelector("#halted").hidden, null, { timeout: PATIENCE });
    await page.locator("h1").click();
    await page.keyboard.press("Space");
    await page.waitForFunction(() => /^the station reports that the track power is off: check/.test(document.querySelector("#halted").textContent), null, { timeout: PATIENCE });
    const { power } = await (await fetch(`${program.url}api/line`)).json();
    assert.deepEqual(power, { is_on: false, has_answered: true, reports_power: true, reported: false });
    await page.click("#power-on");
    await page.waitForFunction(() => document.querySelector("#halted").hidden, null, { timeout: PATIENCE });
    assert.deepEqual(complaints, []);
    await page.close();
    await end(program);
  });
}
