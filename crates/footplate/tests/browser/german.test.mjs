// Every message that the server can send is German on German pages: the texts are taken from the sources that write them.

import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { ENGLISH } from "../../assets/dashboard/english.js";
import { GERMAN } from "../../assets/dashboard/german.js";
import { logInGerman } from "../../assets/dashboard/german_log.js";

const CRATES = fileURLToPath(new URL("../../../", import.meta.url));
const DRIVE = "footplate/src/commands/drive";
const SERVE = "footplate/src/commands/dashboard_routes";
/** The sources of lines of the log, of refusals, and of errors of a command. */
const SOURCES = [
  `${DRIVE}/formatter.rs`, `${DRIVE}/script_runner.rs`, ...readdirSync(join(CRATES, DRIVE, "script_runner")).map((name) => `${DRIVE}/script_runner/${name}`),
  `${DRIVE}/instruction.rs`, `${DRIVE}/reader.rs`, "footplate-core/src/control/drive/refusal.rs", "footplate-core/src/control/supervise/alarm.rs",
  "footplate-core/src/track/position.rs", "footplate-core/src/track/landmark.rs",
];
/** The sources of errors of a request, among texts for the terminal. */
const REQUESTS = [`${SERVE}/set_up/routes.rs`, `${SERVE}/set_up/set_up_file.rs`, `${SERVE}/schedules.rs`, `${SERVE}/answer_queue.rs`, `${SERVE}/odometry_pages.rs`, "footplate/src/commands/odometry/uploaded.rs", `${SERVE}/archive.rs`];
/** The sources of errors of recordings and vehicle files. */
const FILES = ["footplate-store/src/tachometer/error.rs", "footplate-store/src/table/error.rs", "footplate-store/src/vehicle_file/error.rs", "footplate-core/src/odometry/wheels/vehicle.rs"];
const ERROR = /(?:bail!|with_context|context|refused|let why =)\(?\s*(?:\|\| )?\{?\s*(?:format!\()?\s*$/;
/** No page shows these: they are for programs, for developers, or for the line below the terminal's prompt. */
const FOR_OTHERS = [
  "{train} {place} ±{half:.0} mm {speed:.0} mm/s", "cannot start a process to compute the answer", "making room for an answer", "the request failed without a reason", "making room for `{name}`", "{}; write {right}", " and to ",
];
/** Values for a blank whose kind is not known from its name. */
const GUESSES = ["24", "C13", "train 24", "`stop 24 at C13`", "curved"];
const NAMED = { zone: "yard", end: "EX1", from: "C13", target: "C13", nearest: "C14", or: "by train 58", why: "the station does not answer", found: "its model is unchanged", name: "Evening", near: "", by: "early", error: "the track ends at `EX1`, 30 mm before the end of the path", moves: "at rest", file: "run.csv", 0: "run.csv" };
/** The most combinations of guesses for one text. */
const MOST_TRIED = 3000;
/** The sentences of which a text may be a part, as `…`. */
const WHOLE = [
  "…", "column 4: `sped`…", "column 4: `sped` …", "column 4: `sped` should be …", "column 4: …", "column 4: `sped` is not a command…", "schedule `Evening` …", "schedule `Evening` runs: round 1…",
  "    1.000 s  train 24 at C13…", "    1.000 s  train 24 will be at rest there…", "    1.000 s  train 24 will be at rest there, … from 3 to 9 mm/s, and stops from step 8",
  "    1.000 s  train 24 will be commanded to stop…; rests at -3 mm to +3 mm (95 %)",
  "    1.000 s  C13 was reported by train 24 or …: the next reports decide", "train 24 is in a deadlock: … makes room", "route set for train 24: about 9 s…", "train 24: C13 ± 3 mm (95 %), …",
  "`C13` is too close to stop at: the nearest possible place is `C14`, 20 mm beyond it…",
  "run.csv, line 4: …", "the vehicle's file, line 4, column 1: …", "the vehicle's file, line 4, column 1: `key` is not a key of vehicle; …",
];

/** The texts of a source that are sentences: literals with several words, outside its tests and comments. */
function sentences(path, isWanted = () => true) {
  const source = readFileSync(join(CRATES, path), "utf8").split("#[cfg(test)]")[0].replace(/^\s*\/\/.*$/gm, "");
  const literals = [...source.matchAll(/"((?:[^"\\]|\\[^])*)"/g)].filter(({ index }) => isWanted(source.slice(0, index)));
  const texts = literals.map(([, text]) => text.replace(/\\\n\s*/g, "").replaceAll("\\u{b1}", "±"));
  return texts.filter((text) => / \w+ /.test(text) && !text.includes("\n") && !FOR_OTHERS.includes(text));
}

/** Whether some values for the blanks of a text make a sentence whose German has none of its English. */
function isKnown(text) {
  const named = text.replace(/^\{\} {2}/, "    1.000 s  ").replace("yet{why}", "yet: {why}").replace(/^\{place\}: no/, "the vehicle's file: no").replace("{table}; {}", "vehicle; did you mean `teeth`?").replace(/\{(\w+)(?::[^}]*)?\}/g, (_, name) => NAMED[name] ?? "24");
  const parts = named.split(/\{[^}]*\}/);
  // The longest English of the text, which must not stay.
  const [own] = named.replace(/\(95 %\)/, "").split(/\{[^}]*\}|`[^`]*`|\d\S*/).sort((one, other) => other.length - one.length);
  for (let nth = 0; nth < Math.min(GUESSES.length ** (parts.length - 1), MOST_TRIED); nth++) {
    const filled = parts.reduce((made, part, place) => made + GUESSES[Math.floor(nth / GUESSES.length ** (place - 1)) % GUESSES.length] + part);
    if (WHOLE.some((whole) => !logInGerman(whole.replace("…", () => filled)).includes(own.trim()))) return true;
  }
  return false;
}

test("every message of the server is known in German", () => {
  const all = [...SOURCES.map((path) => [path, sentences(path)]), ...REQUESTS.map((path) => [path, sentences(path, (before) => ERROR.test(before))]), ...FILES.map((path) => [path, sentences(path)])];
  assert.ok(all.flatMap(([, texts]) => texts).length > 150, "the texts were found");
  const unknown = all.flatMap(([path, texts]) => texts.filter((text) => !isKnown(text)).map((text) => `${path}: ${text}`));
  assert.deepEqual(unknown, []);
});

/** The sources of what only one kind of station says. */
const OF_STATIONS = ["dcc_ex/session/hearing.rs", "marklin_serial/module_reads.rs", "marklin_serial/session.rs", "z21/session/hearing.rs"].map((path) => `footplate-wire/src/${path}`);
/** What the link and the server say, as pages show it: in the log, in alarms, and as the reason of a refusal. */
const OF_LINE = [
  "the station answers", "a sensor reply had 3 bytes instead of 4; it was dropped and the read repeated", "7 unexpected bytes were dropped; the line is being synchronised again",
  "the line garbles data: trains stop until it is clean; check its cable", "the line is open again; trains are stopped, and the station is asked for all states", "the station is z21, firmware 1.42, serial number 82850",
  "the station was reset; trains stopped when the power went and stay so until they are commanded anew", "the station did not confirm: train 24 step 8; check that it has not stopped",
  "the station is locked: it ignores driving over the network until its unlock code is entered in its app",
  "the station does not report everything it was asked to (broadcast flags 0x00000104): check its firmware, and what its sensors are connected to (feedback=r-bus, can or loconet)",
  "the station has no turnout 5: define it there (<T 5 DCC address sub>), or leave out `turnouts=defined`", "the station refused a request: 42",
  "the station has no free slot for train 24: release a locomotive at a throttle that drives none, or restart the station", "another throttle switched functions of train 24; on now: none", "another throttle switched functions of train 24; on now: F0, F1",
  "another throttle reversed train 24; drive it from one place only", "another throttle drives train 24; drive it from one place only",
  "the track has lost its power: a short circuit, or another program switched it off; clear it, then switch the power on",
  "the station has not been ready for 2.0 s (CTS is down); check its power and the cable, or try the timed mode if the adapter has no CTS",
  "repeated, because a reply was lost after it: turnout 5 curved", "repeated, because a reply was lost after it: train 24 F0 off", "train 24 was commanded to reverse just before a reply was lost; it may face either direction",
  "sensor 3 is occupied from the start: a train is on it, or it is stuck", "the interface answers reads of single sensor modules",
  "the interface answers reads of all sensor modules only: every read takes as long as all of them, and a sensor that is occupied for less may be missed", "turnout 5 was powered for 700 ms; check that its coil is not hot",
  "commanded to stop: 24, 58; NOT commanded to stop and possibly running: 71; solenoids released, track power switched off; the station accepted the bytes; this line gives no further confirmation",
  "solenoids not released, track power not switched off; this line gives no confirmation: check that the trains are at rest", "commanded to stop: 24; track power switched off; the station has confirmed it",
  "track power not switched off; the station did not confirm the rest: check that the trains are at rest, and switch the track power off by hand",
  "not sent: step 8 for train 24: step 8 is beyond the decoder; steps are 0 to 7", "step 8 for train 24: train 24 has no address here; addresses are 1 to 80", "turnout 400 curved: turnout 400 has no address here; addresses are 1 to 256",
  "not sent: F9 on for train 24: F9 cannot be switched over this link; functions are F0 to F4", "train 24 has 126 speed steps, and this station commands 14: leave out its steps, or use another station",
  "turn around, train 24: the station has no such command", "power on: 256 commands already wait for the line; wait until some have been sent", "power off: the link is being closed; open it again to command trains", "train 24 reverse", "turnout 5 straight",
  "train 58 stopped: its position is lost", "train 58 stopped: the stop command could not be sent", "train 24 is not calibrated, so its stops are uncertain: run `footplate calibrate` first",
  "the last commands were not recorded: the reports are not of layout `track-a`: 12 of 63 sensors cannot follow the one before: B15 after C13 2 times (next is E7), C6 after B15 once (next is A3 or A1), and others; give the layout that was recorded with --layout, or correct its edges",
  "train 24 may have been reversed just before the last session died; it may face either direction",
  "alarm 3 is over already", "`x` is not the number of an alarm; /api/picture lists them",
];

test("what the link reports and the server denies is known in German", () => {
  const source = (path) => readFileSync(join(CRATES, path), "utf8").split("#[cfg(test)]")[0];
  const texts = (path) => [...source(path).matchAll(/"((?:[^"\\]|\\[^])*)"/g)].map(([, text]) => text.replace(/\\\n\s*/g, "").replaceAll('\\"', '"'));
  const [, denied] = source("footplate/src/dashboard/guard.rs").split("fn says(self)");
  const reasons = [...denied.split("impl Guard")[0].matchAll(/"([^"]*)"/g)].map(([, text]) => text);
  assert.equal(reasons.length, 4);
  const checks = ["dcc_ex", "jmri", "loconet", "marklin_can", "z21"].flatMap((name) => texts(`footplate-wire/src/${name}/session.rs`)).filter((text) => text.startsWith("check "));
  assert.ok(checks.length > 12, "the texts were found");
  const silent = checks.flatMap((check) => [`the station has answered nothing for 1.5 s; ${check}`, `no whole reply for 1.5 s, only 3 stray bytes; ${check}`, `40 bytes came that could not be read; ${check}`]);
  for (const text of [...OF_LINE, ...reasons, ...silent]) {
    const german = logInGerman(text);
    assert.notEqual(german, text);
    assert.doesNotMatch(german, /\b(the|station|is|not|train|turnout|step|check|and|was|to|power|has|for|of|off|sent)\b/, `${text} → ${german}`);
  }
  // Every text of the link is one of those: its longest part without blanks is in one of them.
  const shown = source("footplate-wire/src/session.rs").split("impl Display for CommandError")[1];
  const own = [...shown.matchAll(/"((?:[^"\\]|\\[^])*)"/g)].map(([, text]) => text.replace(/\\\n\s*/g, "")).filter((text) => / \w+ /.test(text));
  // Those that begin with a digit are names of products.
  own.push(...OF_STATIONS.flatMap((path) => sentences(path)).filter((text) => /^[a-z]/.test(text)));
  assert.ok(own.length > 25, "the texts were found");
  const longest = (text) => text.split(/\{[^}]*\}/).sort((one, other) => other.length - one.length)[0].trim();
  assert.deepEqual(own.filter((text) => ![...OF_LINE, ...silent].some((sample) => sample.includes(longest(text)))), []);
});

test("every word of the pages is in both languages, with the same blanks", () => {
  const blanks = (text) => [...text.matchAll(/\{\d\}/g)].map(String).sort();
  assert.deepEqual(Object.keys(GERMAN).sort(), Object.keys(ENGLISH).sort());
  for (const [word, text] of Object.entries(ENGLISH)) assert.deepEqual(blanks(GERMAN[word]), blanks(text), word);
});

test("every line of the list of commands and of a calibration is known in German", () => {
  const list = readFileSync(join(CRATES, `${DRIVE}/help.txt`), "utf8").trimEnd();
  const lines = list.split("\n").filter((line) => !line.startsWith("#"));
  assert.ok(lines.length > 25, "the list was found");
  assert.deepEqual(lines.filter((line) => logInGerman(line) === line), []);
  // As `footplate calibrate` wrote them.
  for (const line of ["  speed at step 12 from above: 476 ± 7.5 mm/s, in 5 s", "  stop from step 10 from below, short of a sensor: 476 ± 37 mm (was ± 191), in 14 s", "  short move of 1.2 s at step 5: 155 ± 10 mm (was ± 10), in 13 s",
    "stop from step 7 from above, past a sensor: takes 8 s; expected information 2.4", "found at C13 at step 6", "circuit: 11 sensors in 7.51 m, turnouts 5 straight, 11 curved"]) {
    assert.doesNotMatch(logInGerman(line), /\b(step|speed|stop|from|takes|short|move|was|found|at|sensors|straight|curved)\b/, line);
  }
});
