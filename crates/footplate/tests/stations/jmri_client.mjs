// jmri-client, which Footplate shares no line with, switches the power, throws a turnout and drives a train behind the virtual JMRI.
//
// Needs FOOTPLATE, the program, and STATIONS_AT, the folder with node_modules.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { createRequire } from "node:module";
import { once } from "node:events";
import { join } from "node:path";
import { createInterface } from "node:readline";

const { JmriClient, PowerState } = createRequire(join(process.env.STATIONS_AT, "here.js"))("jmri-client");

const STATION = "simulate layout --station tcp:127.0.0.1:0 --protocol jmri --trains 3850 --steps 126 --seed 7";
/** How long an answer may take (ms). */
const PATIENCE = 5000;

const station = spawn(process.env.FOOTPLATE, STATION.split(" "), { stdio: ["ignore", "pipe", "ignore"] });
const [address] = await once(createInterface({ input: station.stdout }), "line");
const port = Number(address.match(/^jmri:tcp:\/\/127\.0\.0\.1:(\d+)/)[1]);

async function until(what, isSo) {
  const end = Date.now() + PATIENCE;
  while (!isSo()) {
    assert(Date.now() < end, `not within ${PATIENCE} ms: ${what}`);
    await new Promise((resolve) => setTimeout(resolve, 10));
  }
}

const client = new JmriClient({ host: "127.0.0.1", port, autoConnect: false, heartbeat: { enabled: true, interval: 200, timeout: 1000 } });
const complaints = [];
client.on("error", (error) => complaints.push(error.message));
client.on("heartbeat:timeout", () => complaints.push("no answer to a ping"));
let hello;
client.on("hello", (data) => (hello = data));
let power;
client.on("power:changed", (state) => (power = state));
const lights = [];
client.wsClient.on("message:received", ({ type, data }) => type === "throttle" && lights.push(data));

try {
  await client.connect();
  await until("a greeting", () => hello?.JMRI?.includes("simulated by Footplate"));
  await client.powerOn();
  await until("power on", () => power === PowerState.ON);
  await client.throwTurnout("LT7");
  await client.closeTurnout("LT7");
  await assert.rejects(client.throwTurnout("LT9999"), "a turnout that is not there");

  const throttle = await client.acquireThrottle({ address: 3850 });
  await client.setThrottleSpeed(throttle, 0.5);
  await until("the speed", () => lights.some(({ speed }) => speed === 0.5));
  await client.setThrottleDirection(throttle, false);
  await until("the direction", () => lights.some(({ forward }) => forward === false));
  await client.releaseThrottle(throttle);
  await until("the release", () => lights.some((data) => data.release === null));
  await client.powerOff();
  await until("power off", () => power === PowerState.OFF);
  assert.deepEqual(complaints.filter((what) => !/LT9999/.test(what)), []);
  console.log("jmri-client drove a train, threw a turnout and switched the power");
} finally {
  await client.disconnect();
  station.kill();
}
