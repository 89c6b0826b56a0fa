// Measures the cost of the dashboard: first paint, state updates, frames, and the effect of a thousand clients on the control loop.
//
//   FOOTPLATE=target/debug/footplate BROWSER_AT=target/browser node crates/footplate/tests/browser/load.mjs
//
// A simulated 6051 with four trains, one of them running, in real time. Shares of a core are read from the kernel's clock of each
// thread; the loop's times are counted by the program itself (GET /api/line). All cases are measured in turns, so that
// other load on the machine affects them equally.

import { readFileSync, readdirSync } from "node:fs";
import { connect } from "node:net";

import { launch } from "./browser.mjs";
import { calibratedStore, end, say, serve } from "./railway.mjs";

const OPENED = 7;
const WATCHED_MS = 20_000;
const CLIENTS = 1000;
const TURN_MS = 15_000;
const TURNS = 5;
/** Ticks of the kernel's clock in a second (getconf CLK_TCK). */
const TICKS = 100;

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const median = (values) => [...values].sort((one, other) => one - other)[Math.floor(values.length / 2)];

/** The processor time of each thread (s), by its name. */
function threads(pid) {
  const used = {};
  for (const thread of readdirSync(`/proc/${pid}/task`)) {
    const stat = readFileSync(`/proc/${pid}/task/${thread}/stat`, "utf8");
    const name = thread === String(pid) ? "main" : /\((.*)\)/.exec(stat)[1];
    const fields = stat.slice(stat.lastIndexOf(")") + 2).split(" ");
    used[name] = (used[name] ?? 0) + (Number(fields[11]) + Number(fields[12])) / TICKS;
  }
  return used;
}

/** The load of each thread during an activity, in shares of a core. */
async function shares(pid, ms) {
  const before = threads(pid);
  const began = performance.now();
  await sleep(ms);
  const took = (performance.now() - began) / 1000;
  const after = threads(pid);
  return Object.fromEntries(Object.keys(after).map((name) => [name, (after[name] - (before[name] ?? 0)) / took]));
}

const line = async ({ url }) => (await fetch(`${url}api/line`)).json();

/** A quantile of the counts between two readings. */
function between(before, after, share) {
  const counts = new Map(after.bins.map(([, to, count]) => [to, count]));
  for (const [, to, count] of before.bins) counts.set(to, counts.get(to) - count);
  const all = [...counts].filter(([, count]) => count > 0).sort(([one], [other]) => one - other);
  const wanted = share * all.reduce((sum, [, count]) => sum + count, 0);
  let seen = 0;
  return all.find(([, count]) => (seen += count) >= wanted)[0];
}

async function turnsFor(running, ms) {
  const before = (await line(running)).loop_turn;
  await sleep(ms);
  const after = (await line(running)).loop_turn;
  return [between(before, after, 0.5), between(before, after, 0.99)];
}

/** Clients that request the events: half of them read the answer, half never do. */
async function crowd({ port }) {
  const sockets = [];
  for (let nth = 0; nth < CLIENTS; nth++) {
    await new Promise((resolve, reject) => {
      const socket = connect(port, "127.0.0.1", () => {
        socket.write(`GET /api/events HTTP/1.1\r\nHost: 127.0.0.1:${port}\r\n\r\n`);
        resolve();
      });
      socket.once("error", reject);
      if (nth % 2) socket.pause();
      else socket.resume();
      sockets.push(socket);
    });
  }
  return () => sockets.forEach((socket) => socket.destroy());
}

const store = calibratedStore("load");
const running = await serve(store, 0, { speed: 1, more: ["--train", "43", "--train", "47", "--train", "58"] });
const browser = await launch();
try {
  await say(running, "turnout all straight");
  await sleep(6000);
  // Trains at rest where the operator placed them.
  for (const [train, place] of [[43, "A13"], [47, "B11"], [58, "A15"]]) await say(running, `place ${train} at ${place}`);
  await say(running, "speed 24 8");
  await sleep(8000);
  const { trains } = await (await fetch(`${running.url}api/picture`)).json();
  console.log(`${trains.length} trains, ${trains.filter(({ at }) => at).length} of them somewhere`);

  const paints = [];
  for (let nth = 0; nth < OPENED; nth++) {
    const context = await browser.newContext();
    const page = await context.newPage();
    await page.goto(running.url);
    await page.waitForSelector(".train");
    paints.push(await page.evaluate(() => performance.getEntriesByName("first-contentful-paint")[0].startTime));
    await context.close();
  }
  console.log(`first paint: median ${median(paints).toFixed(0)} ms, longest ${Math.max(...paints).toFixed(0)} ms of ${OPENED}`);

  const alone = await shares(running.child.pid, WATCHED_MS);
  const page = await browser.newPage({ viewport: { width: 1300, height: 900 } });
  await page.goto(running.url);
  await page.waitForSelector(".train");
  const counted = page.evaluate((ms) => new Promise((resolve) => {
    const frames = [];
    let pictures = 0;
    const events = new EventSource("/api/events");
    events.addEventListener("picture", () => pictures++);
    let last = performance.now();
    const began = last;
    const frame = (now) => {
      frames.push(now - last);
      last = now;
      if (now - began < ms) requestAnimationFrame(frame);
      else { events.close(); resolve({ pictures, took: now - began, longest: Math.max(...frames.slice(5)), frames: frames.length, dropped: frames.slice(5).filter((one) => one > 100).length }); }
    };
    requestAnimationFrame(frame);
  }), WATCHED_MS);
  const watched = await shares(running.child.pid, WATCHED_MS);
  const { pictures, took, longest, frames, dropped } = await counted;
  console.log(`state updates: ${(pictures / took * 1000).toFixed(1)} a second to each of two streams; ${frames} frames, longest ${longest.toFixed(0)} ms, ${dropped} of them beyond 100 ms`);
  const percent = (share) => `${(100 * (share ?? 0)).toFixed(1)} %`;
  console.log(`server thread: ${percent(alone.dashboard)} of a core without watchers, ${percent(watched.dashboard)} with two streams`);
  console.log(`main thread (control loop, simulated station, painting): ${percent(alone.main)} without watchers, ${percent(watched.main)} with`);
  await page.close();

  const ratios = [];
  for (let turn = 0; turn < TURNS; turn++) {
    const [, quiet] = await turnsFor(running, TURN_MS);
    const leave = await crowd(running);
    await sleep(2000);
    const used = shares(running.child.pid, TURN_MS);
    const [, crowded] = await turnsFor(running, TURN_MS);
    leave();
    await sleep(2000);
    ratios.push(crowded / quiet);
    console.log(`control loop p99: ${quiet.toFixed(3)} ms alone, ${crowded.toFixed(3)} ms with ${CLIENTS} clients (ratio ${(crowded / quiet).toFixed(2)}); server thread ${percent((await used).dashboard)}`);
  }
  console.log(`control loop p99 with ${CLIENTS} clients beside alone: median ratio ${median(ratios).toFixed(2)} of ${TURNS} turns`);
} finally {
  await browser.close();
  await end(running);
}
