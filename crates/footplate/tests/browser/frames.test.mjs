// Four trains at fifty pictures a second: the browser draws each, and no frame takes longer than a tenth of a second.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { launch } from "./browser.mjs";
import { calibratedStore, end, picture, say, serve } from "./railway.mjs";

const WATCHED_MS = 10_000;
/** The longest frame, and the fewest pictures a second of fifty that are sent: other tests share the machine. */
const LONGEST_FRAME_MS = 100;
const FEWEST_A_SECOND = 40;
/** A frame of a machine that does something else is no frame of the page: so many are allowed (chosen). */
const STRAY_FRAMES = 2;

let browser, program;
before(async () => {
  program = await serve(calibratedStore("frames"), 0, { speed: 1, more: ["--train", "43", "--train", "47", "--train", "58"] });
  browser = await launch();
});
after(async () => {
  await browser?.close();
  if (program) await end(program);
});

test("with four trains at fifty pictures a second no frame is longer than 100 ms", async () => {
  await say(program, "turnout all straight");
  await picture(program, ({ turnouts }) => Object.values(turnouts).every(Boolean));
  for (const [train, place] of [[43, "A13"], [47, "B11"], [58, "A15"]]) await say(program, `place ${train} at ${place}`);
  await say(program, "speed 24 8");
  await picture(program, ({ trains }) => trains.every(({ at }) => at));
  const page = await browser.newPage({ viewport: { width: 1300, height: 900 } });
  await page.goto(program.url);
  await page.waitForFunction(() => document.querySelectorAll(".train").length === 4);
  const { took, pictures, long } = await page.evaluate(({ ms, longest }) => new Promise((resolve) => {
    let pictures = 0;
    const events = new EventSource("/api/events");
    events.addEventListener("picture", () => pictures++);
    const began = performance.now();
    let last = began;
    const long = [];
    const frame = (now) => {
      if (now - last > longest) long.push(Math.round(now - last));
      last = now;
      if (now - began < ms) requestAnimationFrame(frame);
      else { events.close(); resolve({ took: now - began, pictures, long }); }
    };
    requestAnimationFrame(frame);
  }), { ms: WATCHED_MS, longest: LONGEST_FRAME_MS });
  const each = 1000 * pictures / took;
  assert.ok(each > FEWEST_A_SECOND, `${each.toFixed(1)} pictures a second`);
  assert.ok(long.length <= STRAY_FRAMES, `frames of ${long.join(", ")} ms`);
  await page.close();
});
