// @cloudthrottle/dcc-ex--commands, which Footplate shares no line with, builds what the virtual board reads and reads what it says.
//
// Needs FOOTPLATE, the program, and STATIONS_AT, the folder with node_modules.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { createRequire } from "node:module";
import { connect } from "node:net";
import { once } from "node:events";
import { join } from "node:path";
import { createInterface } from "node:readline";

const peer = createRequire(join(process.env.STATIONS_AT, "here.js"))("@cloudthrottle/dcc-ex--commands");

const STATION = "simulate layout --station tcp:127.0.0.1:0 --protocol dcc-ex --quirks chatter,merged --trains 3850 --steps 126 --seed 7";
/** How long an answer may take (ms). */
const PATIENCE = 5000;

const station = spawn(process.env.FOOTPLATE, STATION.split(" "), { stdio: ["ignore", "pipe", "ignore"] });
const [address] = await once(createInterface({ input: station.stdout }), "line");
const port = Number(address.match(/^dcc-ex:tcp:\/\/127\.0\.0\.1:(\d+)/)[1]);

const socket = connect(port, "127.0.0.1").setNoDelay(true);
await once(socket, "connect");
let heard = "";
socket.on("data", (bytes) => (heard += bytes));

/** Writes what the peer built and returns what the peer makes of the first answer that a pattern finds. */
async function ask(command, pattern, parser) {
  heard = "";
  socket.write(command);
  const end = Date.now() + PATIENCE;
  for (;;) {
    const found = heard.match(pattern);
    if (found) return parser ? parser(found[0]).params : found[0];
    assert(Date.now() < end, `${command} was not answered with ${pattern}: ${heard}`);
    await new Promise((resolve) => setTimeout(resolve, 10));
  }
}

try {
  const on = { power: 1, track: peer.Track.MAIN };
  const power = await ask(peer.powerCommand(on), /<p1 MAIN>/, peer.powerParser);
  assert.equal(power.power, 1);

  const { FORWARD, REVERSE } = peer.Direction;
  for (const [speed, direction] of [[62, FORWARD], [126, FORWARD], [30, REVERSE], [0, REVERSE], [-1, FORWARD]]) {
    const command = peer.throttleCommand({ cab: 3850, speed, direction });
    const loco = await ask(command, /<l 3850 [^>]*>/, peer.locoParser);
    assert.deepEqual([loco.cabId, loco.speed, loco.direction], [3850, speed, direction], command);
    const register = await ask(command, /<T [^>]*>/, peer.throttleParser);
    assert.deepEqual([register.register, register.speed, register.direction], [1, speed, direction], command);
  }

  const lit = await ask(peer.cabCommand({ cab: 3850, func: 2, value: 1 }), /<l 3850 [^>]*>/, peer.locoParser);
  assert.equal(lit.functionButtons[2].value, 1);

  // It answers only when the state changes: one of the two does.
  const turnout = (thrown) => peer.turnoutCommand({ turnout: 7, thrown });
  const thrown = await ask(turnout(1) + turnout(0), /<H 7 [01]>/, peer.turnoutParser);
  assert.equal(Number(thrown.turnout ?? thrown.id), 7);

  const states = await ask(peer.listSensorsStatusCommand(), /<[Qq] 79>/);
  assert.ok(states);
  await ask(peer.emergencyStopCommand(), /<l 3850 0 (1|129) \d+>/, peer.locoParser);
  await ask(peer.forgetCabCommand({ cab: 3850 }), /<- 3850>/);
  await ask(peer.powerCommand({ power: 0 }), /<p0>/);
  console.log("dcc-ex--commands built what the board read, and read what it said");
} finally {
  socket.destroy();
  station.kill();
}
