// A simulated railway for the tests of live pages: a store with a calibrated train, and the program that drives it.

import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const LINK = "sim:track-a?seed=7";
/** The longest that anything takes in a test: a lap of the track, at four times real time. */
export const PATIENCE = 60_000;

/** A new store that knows train 24. */
export function calibratedStore(name) {
  const store = join(mkdtempSync(join(tmpdir(), `footplate-${name}-`)), "railway.db");
  execFileSync(process.env.FOOTPLATE, ["calibrate", "--link", LINK, "--layout", "track-a", "--train", "24", "--store", store], { stdio: "pipe" });
  return store;
}

/** Starts the program at a port, 0 for any, so many times as fast as real; resolves with the address that it prints. */
export function serve(store, port, { speed = 4, more = [], token } = {}) {
  const env = { ...process.env, ...(token && { FOOTPLATE_TOKEN: token }) };
  const child = spawn(process.env.FOOTPLATE, ["serve", String(port), "--link", `${LINK}&speed=${speed}`, "--train", "24", "--store", store, ...more], { stdio: ["ignore", "ignore", "pipe"], env });
  return new Promise((resolve, reject) => {
    let said = "";
    child.stderr.on("data", (text) => {
      said += text;
      const found = /the dashboard is at (http:\S+)/.exec(said);
      if (found) resolve({ child, url: found[1], port: Number(new URL(found[1]).port) });
    });
    child.on("exit", () => reject(new Error(said)));
  });
}

export function end({ child }) {
  const gone = new Promise((resolve) => child.on("exit", resolve));
  child.kill("SIGTERM");
  return gone;
}

/** Gives an order over HTTP. */
export async function say({ url }, line) {
  const answer = await fetch(`${url}api/orders`, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ line }) });
  if (!answer.ok) throw new Error(await answer.text());
}
