// A simulated railway for the tests of live pages: a store with a calibrated train, and the program that drives it.

import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

/** The simulated railway of all tests. */
export const LINK = "sim:track-a?seed=7";
/** The time limit of a step (ms): a lap of the track at four times real time takes less. */
export const PATIENCE = 60_000;

/** A new store with a calibration of train 24. */
export function calibratedStore(name) {
  const store = join(mkdtempSync(join(tmpdir(), `footplate-${name}-`)), "railway.db");
  execFileSync(process.env.FOOTPLATE, ["calibrate", "--link", LINK, "--layout", "track-a", "--train", "24", "--store", store], { stdio: "pipe" });
  return store;
}

/**
 * Starts the program with a dashboard; resolves with the address that it prints. What it writes is collected in `wrote`, and `over`
 * resolves with its status when it has ended.
 */
export function begin(commands, env = process.env) {
  const child = spawn(process.env.FOOTPLATE, commands, { stdio: ["ignore", "pipe", "pipe"], env });
  const wrote = { output: "", errors: "" };
  const over = new Promise((resolve) => child.on("close", resolve));
  child.stdout.on("data", (text) => { wrote.output += text; });
  return new Promise((resolve, reject) => {
    child.stderr.on("data", (text) => {
      wrote.errors += text;
      const found = /the dashboard is at (http:\S+)/.exec(wrote.errors);
      if (found) resolve({ child, url: found[1], port: Number(new URL(found[1]).port), wrote, over });
    });
    child.on("exit", () => reject(new Error(wrote.errors)));
  });
}

/** Starts the program at a port, 0 for any, at a multiple of real time. */
export function serve(store, port, { speed = 4, more = [], token } = {}) {
  const env = { ...process.env, ...(token && { FOOTPLATE_TOKEN: token }) };
  return begin(["serve", String(port), "--link", `${LINK}&speed=${speed}`, "--train", "24", "--store", store, ...more], env);
}

export function end({ child, over }) {
  child.kill("SIGTERM");
  return over;
}

/** Gives an order over HTTP. */
export async function say({ url }, line) {
  const answer = await fetch(`${url}api/orders`, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ line }) });
  if (!answer.ok) throw new Error(await answer.text());
}

/** The picture of a session once `is` holds for it; without `is`, the present one. */
export async function picture({ url }, is = () => true) {
  for (const began = Date.now(); ;) {
    const seen = await (await fetch(`${url}api/picture`)).json();
    if (seen && is(seen)) return seen;
    if (Date.now() - began > 2 * PATIENCE) throw new Error(`the state never came: ${is}`);
    await new Promise((again) => { setTimeout(again, 50); });
  }
}
