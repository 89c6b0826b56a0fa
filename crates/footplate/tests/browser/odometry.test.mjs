// An odometry report in a real browser: every chart is drawn and all zoom together, in dark and light, on a phone, by keyboard.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";

import { AT, colours, launch, openPage, width } from "./browser.mjs";

const PERIOD_S = 0.05;
/** The distance of one pulse of the vehicle below (m). */
const PITCH_M = (Math.PI * 0.86) / 80;
const KINDS = ["speed", "wheels", "shares", "distance", "acceleration"];

/** Two minutes of a train that starts, coasts and stops; on wet rail one wheelset slips, and later both slide. */
function rows(name, wet) {
  let [speed, distance] = [0, 0];
  const [rolled, counted] = [[0, 0], [0, 0]];
  return Array.from({ length: 2400 }, (_, row) => {
    const time = row * PERIOD_S;
    const effort = time < 30 ? 0.8 : time < 60 ? 0 : time < 100 ? -0.6 : 0;
    const acceleration = effort > 0 ? 0.7 : effort < 0 && speed > 0 ? -0.55 : 0;
    if (row > 0) speed = Math.max(0, speed + acceleration * PERIOD_S);
    distance += speed * PERIOD_S;
    const creepage = [0, 0];
    if (wet && time > 10 && time < 14) creepage[0] = 0.3 * Math.sin(((time - 10) / 4) * Math.PI);
    if (wet && time > 65 && time < 75) creepage[0] = -0.25 * Math.abs(Math.sin((time - 65) * 1.2));
    if (wet && time > 68 && time < 75) creepage[1] = -0.2 * Math.abs(Math.sin((time - 68) * 1.1));
    const pulses = [0, 1].map((wheel) => {
      rolled[wheel] += (speed * (1 + creepage[wheel]) * PERIOD_S) / PITCH_M;
      const whole = Math.floor(rolled[wheel]);
      const more = whole - counted[wheel];
      counted[wheel] = whole;
      return more;
    });
    return [name, time.toFixed(2), ...pulses, effort, acceleration.toFixed(3), speed.toFixed(5), distance.toFixed(5)].join(",");
  });
}

const HEADER = "run_id,t_s,pulses_1,pulses_2,effort,accel_m_s2,true_speed_m_s,true_distance_m";
/** The vehicle file: without it, every page warns. */
const VEHICLE = `name = "wet train"
period_s = ${PERIOD_S}
max_speed_m_s = 50.0
max_traction_m_s2 = 1.5
max_brake_m_s2 = 1.5
${["powered", "trailing"].map((axle) => `
[[wheelset]]
teeth = 80
diameter_m = 0.86
diameter_tolerance = 0.001
axle = "${axle}"
`).join("")}`;
let browser;
let address;

before(async () => {
  const folder = mkdtempSync(join(tmpdir(), "footplate-odometry-"));
  mkdirSync(AT, { recursive: true });
  const write = (name, lines) => {
    writeFileSync(join(folder, `${name}.csv`), `${lines.join("\n")}\n`);
    const files = [join(folder, `${name}.csv`), "--vehicle", join(folder, "vehicle.toml"), "--report", join(folder, `${name}.html`)];
    execFileSync(process.env.FOOTPLATE, ["odometry", ...files], { stdio: "pipe" });
  };
  writeFileSync(join(folder, "vehicle.toml"), VEHICLE);
  // A name that would run as a script if it were not escaped.
  write("runs", [HEADER, ...rows("<img src=x onerror=document.title='taken-over'>", true), ...rows("dry", false)]);
  // Only counts, with times of a clock.
  const counts = rows("", true).map((row) => row.split(","));
  write("counts", ["t_s,pulses_1,pulses_2", ...counts.map(([, time, ...rest]) => [1.7e9 + Number(time), rest[0], rest[1]].join(","))]);
  address = (name) => pathToFileURL(join(folder, `${name}.html`)).href;
  browser = await launch();
});
after(() => browser?.close());

const open = (name = "runs", options = {}) => openPage(browser, address(name), options);
const chart = (page, kind) => page.locator(`figure[data-chart=${kind}]`);
const picture = (page, kind) => chart(page, kind).locator("canvas").first().evaluate((canvas) => canvas.toDataURL());
const pictures = (page) => Promise.all(KINDS.map((kind) => picture(page, kind)));

for (const colorScheme of ["light", "dark"]) {
  test(`every chart is drawn in ${colorScheme}`, async () => {
    const { page, complaints } = await open("runs", { colorScheme });
    const found = await colours(page);
    // One chart of each kind, and one of the effort.
    assert.equal(found.length, KINDS.length + 1);
    assert.ok(found.every((count) => count > 8), String(found));
    await page.screenshot({ path: join(AT, `odometry-${colorScheme}.png`), fullPage: true });
    assert.deepEqual(complaints, []);
    await page.close();
  });
}

test("a recording of counts alone is drawn without truth, effort and accelerometer", async () => {
  const { page, complaints } = await open("counts");
  assert.equal((await colours(page)).length, KINDS.length);
  assert.match(await chart(page, "distance").innerText(), /width of the interval/);
  assert.ok(!(await page.locator("#pick").isVisible()), "there is only one run");
  await chart(page, "speed").locator(".u-over").hover();
  assert.match(await chart(page, "speed").locator(".u-legend").innerText(), /\d s \(t_s 17000000\d\d\.\d\d\)/);
  assert.deepEqual(complaints, []);
  await page.close();
});

test("a phone shows the page without scrolling sideways", async () => {
  const { page, complaints } = await open("runs", { viewport: { width: 390, height: 844 }, isMobile: true, deviceScaleFactor: 2 });
  assert.equal(await width(page), 390);
  await page.screenshot({ path: join(AT, "odometry-phone.png"), fullPage: true });
  assert.deepEqual(complaints, []);
  await page.close();
});

test("dragging over one chart zooms all, a double click shows all again", async () => {
  const { page } = await open();
  const whole = await pictures(page);
  const over = chart(page, "wheels").locator(".u-over");
  await over.scrollIntoViewIfNeeded();
  const box = await over.boundingBox();
  await page.mouse.move(box.x + 0.5 * box.width, box.y + 50);
  await page.mouse.down();
  await page.mouse.move(box.x + 0.7 * box.width, box.y + 60, { steps: 4 });
  await page.mouse.up();
  await page.screenshot({ path: join(AT, "odometry-zoomed.png"), fullPage: true });
  const zoomed = await pictures(page);
  KINDS.forEach((kind, place) => assert.notEqual(zoomed[place], whole[place], kind));
  await over.dblclick();
  assert.deepEqual(await pictures(page), whole);
  await page.close();
});

test("keys read values, zoom all charts and show all again", async () => {
  const { page, complaints } = await open();
  const whole = await pictures(page);
  await chart(page, "speed").locator(".u-over").focus();
  for (let times = 0; times < 3; times++) await page.keyboard.press("ArrowRight");
  // The cursors of all charts are at the third row.
  for (const kind of KINDS) assert.match(await chart(page, kind).locator(".u-legend").first().innerText(), /0\.10 s/, kind);
  await page.keyboard.press("+");
  const zoomed = await pictures(page);
  KINDS.forEach((kind, place) => assert.notEqual(zoomed[place], whole[place], kind));
  await page.keyboard.press("Escape");
  assert.deepEqual(await pictures(page), whole);
  assert.deepEqual(complaints, []);
  await page.close();
});

test("another run can be selected, and a name with markup is shown as text", async () => {
  const { page, complaints } = await open();
  const wet = await pictures(page);
  assert.match(await chart(page, "wheels").innerText(), /wheelset 1 slips/);
  assert.ok((await page.locator("#marks summary").innerText()).includes("<img"));
  await page.locator("#pick select").selectOption({ label: "dry" });
  const dry = await pictures(page);
  KINDS.slice(0, 4).forEach((kind, place) => assert.notEqual(dry[place], wet[place], kind));
  assert.match(await chart(page, "wheels").innerText(), /wheelset 1 always rolls/);
  assert.equal(await page.title(), "Odometry of runs.csv");
  assert.equal(await page.locator("img").count(), 0);
  assert.deepEqual(complaints, []);
  await page.close();
});

test("without scripts the page still shows its numbers", async () => {
  const page = await browser.newPage({ javaScriptEnabled: false });
  await page.goto(address("runs"));
  const text = await page.locator("body").innerText();
  for (const said of ["This chart needs JavaScript", "Against the truth", "the share of periods in each mode", "root mean square"]) {
    assert.ok(text.includes(said), said);
  }
  await page.close();
});
