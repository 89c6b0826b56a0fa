//! Random bytes against everything that reads what others wrote, on stable Rust.
//!
//! `./ci.sh fuzz` gives each target some seconds. A target is a function that must return: a panic is a finding, and so is an
//! input that takes longer than [`SLOW`]. Inputs are files of `testdata` and what a target has for itself, changed in ways
//! that break readers: bits, lengths, copies, words of the format, other inputs cut in. There is no feedback from coverage;
//! what that costs is made good by inputs that are whole to begin with.
#![expect(
    clippy::print_stderr,
    clippy::expect_used,
    clippy::panic,
    reason = "a target panics where it finds something"
)]

mod column_mapping;
mod command;
mod dcc_ex;
mod dcc_ex_session;
mod jmri;
mod layout_file;
mod loconet;
mod loconet_session;
mod marklin_can;
mod marklin_can_session;
mod marklin_serial;
mod marklin_serial_session;
mod measurements;
mod odometer;
mod parquet;
mod sensor_log;
mod speed_profile;
mod tachometer_recording;
mod timeouts;
mod trains_and_lines;
mod vehicle_file;
mod withrottle;
mod z21;
mod z21_session;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use footplate_eval::seeds::Choice;

/// An input that takes longer is a finding, too (chosen: none of a few kilobytes takes a tenth of it).
const SLOW: Duration = Duration::from_secs(5);
/// No input is longer: what is said in few bytes is found in few bytes.
const LONGEST: usize = 4_096;
const MOST_CHANGES: f64 = 8.0;

struct Target {
    name: &'static str,
    fuzz: fn(&[u8]),
    /// Folders and files with inputs to begin with.
    begins: &'static [&'static str],
    /// Words that formats are made of.
    words: &'static [&'static [u8]],
}

const ORDERS: &[&[u8]] = &[
    b"stop 24 at C13+120mm at step 8",
    b"go 24 to D5 facing",
    b"go 3850 to C13",
    b"follow 3850 behind 24 by 1.5s",
    b"arrive 24 at D5 in 12s",
    b"hold 24 250mm/s",
    b"wait 24 at rest",
    b"turnout all straight",
    b"not-beyond 0.1%",
    b"schedule run Evening",
    b"-1",
    b"1e309",
    b"NaN",
    b"999999999999999999999",
    b" ",
    b"\n",
    b"#",
    b"\xf0",
];
const JSON: &[&[u8]] = &[
    br#"{"line":"go 24 to D5"}"#,
    br#""rounds":4294967296"#,
    br#""lines":["wait 1s"]"#,
    br#""name":"""#,
    b"null",
    b"-1",
    b"1e999",
    b"[[[[",
    b"\\u0000",
    b"\"",
    b",",
    b"\xf0",
];
const BYTES: &[&[u8]] = &[b"\0", b"\xff", b"\x7f", b"\x80"];
const TEXT: &[&[u8]] =
    &[b"-1", b"1e309", b"NaN", b"999999999999999999999", b"\n", b",", b"=", b"[[", b"\"", b"\xf0"];
const BOARD: &[&[u8]] =
    &[b"<l 24 0 128 0>", b"<t 24 72 1>", b"<iDCC-EX V-5>", b"<Q 7>", b"<q 7>", b"<", b">", b"<p1 MAIN>"];
const FRAMES: &[&[u8]] = &[b"\x00\x23\x93\x46\x08", b"T00239346", b"\r", b"\x00\x11\x03\x00\x08"];
const LINES: &[&[u8]] = &[
    b"RECEIVE 83 7C\r\n",
    b"SEND ",
    b"SENT OK\r\n",
    b"VERSION ",
    b"E7 0E 05 33 18 3F 10 07 00 00 00 00 00 10",
    b"\n",
];
const MESSAGES: &[&[u8]] = &[
    br#"{"type":"sensor","data":{"name":"LS1","state":2}}"#,
    br#"[{"type":"power","data":{"name":"LocoNet","prefix":"L","default":true,"state":4}}]"#,
    br#"{"type":"throttle","data":{"name":"24","address":24,"speed":0.5,"forward":true,"F0":true}}"#,
    b"\n",
    b"1e999",
    b"null",
    b"[[[[",
];
const DATASETS: &[&[u8]] =
    &[b"\x0f\x00\x80\x00", b"\x07\x00\x40\x00\x61", b"\x09\x00\x40\x00\x43", b"\x04\x00\x10\x00"];
const PROFILE: &[&[u8]] = &[
    b"<speed><step>500</step><forward>220.0</forward></speed>",
    b"<attributepairs/>",
    b"<speedprofile></speedprofile>",
    b"<!DOCTYPE a [<!ENTITY b \"&b;\">]>",
    b"&#0;",
    b"-1",
    b"1e308",
    b"NaN",
    b"]]>",
    b"<!--",
];
const VEHICLE: &[&[u8]] =
    &[odometer::VEHICLE.as_bytes(), b"-1", b"1e309", b"nan", b"axle = ", b"[[wheelset]]\n", b"\""];
const PHONE: &[&[u8]] = &[
    b"NPhone\n",
    b"HU1234\n",
    b"*+\n",
    b"M0+S24<;>S24\n",
    b"M0+L3850<;>L3850\n",
    b"M0A*<;>V63\n",
    b"M0A*<;>R0\n",
    b"M0A*<;>F12\n",
    b"M0AS24<;>X\n",
    b"M0-*<;>r\n",
    b"PPA0\n",
    b"PTAC2\n",
    b"Q\n",
    b"!A\n",
    b"?\n",
];
const NAMES: &[&[u8]] = &[
    b"t_s=t\nspeed_1_km_h=v1\nspeed_2_km_h=v2\n---\nt,v1,v2\n0.0,10,10\n0.05,10,10.5\n",
    b"pulses_1 = \"a\"\npulses_2 = \"b\"\n",
    b"counter_1=a\n",
    b"run_id=run\n",
    b"t_ms=t\n",
    b"speed_1_m_s=v\n",
    b"\n---\n",
    b"1e309",
    b"nan",
    b",",
    b"\"",
];
const ACCELERATION: &[&[u8]] = &[
    b"t_s,ax_m_s2,ay_m_s2,az_m_s2\n0.0,0.1,0.0,9.81\n0.01,0.2,0.0,9.81\n",
    b"t_s,accel_m_s2\n",
    b"nan",
    b"1e309",
];
const MODEL: &[&[u8]] =
    &[b"model_version = ", b"[[steps]]\n", b"{\"train\":24,", b"null", b"-1", b"1e309", b"nan", b"["];
const WARD: &[&[u8]] = &[
    b"w\x02\0\x07\x08",
    b"a\x01\0\x01",
    b"l\0\0",
    b"o\0\0",
    b"g\0\0",
    b"H\xff\xff",
    b"C\x01\0\x02",
    b"?\0\0",
];
const SET_UP: &[&[u8]] = &[
    br#"{"link":"sim","speed":5.0,"layout":"track-a","trains":[{"address":24,"name":"V 60"}]}"#,
    br#"{"link":"z21:192.168.0.111","layout":"track-b","trains":[{"address":0}],"is_complete":true}"#,
    br#""line":{"status":0,"report":"sound"},"#,
    br#""calibrations":{"24":{"status":1,"report":""}},"#,
    br#""speed":1e308"#,
    br#""link":"dcc-ex:/dev/ttyUSB0""#,
    b"null",
    b"-1",
    b"65536",
    b"[[[[",
    b"\"",
];
const TACHOMETER: &[&str] = &["testdata/tachometer"];

const fn target(
    name: &'static str,
    fuzz: fn(&[u8]),
    begins: &'static [&'static str],
    words: &'static [&'static [u8]],
) -> Target {
    Target { name, fuzz, begins, words }
}

const TARGETS: &[Target] = &[
    target("marklin_serial", marklin_serial::fuzz, &[], BYTES),
    target("marklin_serial_session", marklin_serial_session::fuzz, &[], BYTES),
    target("dcc_ex", dcc_ex::fuzz, &[], BOARD),
    target("dcc_ex_session", dcc_ex_session::fuzz, &[], BOARD),
    target("jmri", jmri::fuzz, &["testdata/wire/jmri.csv"], MESSAGES),
    target("loconet", loconet::fuzz, &["testdata/wire/loconet.csv"], LINES),
    target("loconet_session", loconet_session::fuzz, &["testdata/wire/loconet.csv"], LINES),
    target("withrottle", withrottle::fuzz, &[], PHONE),
    target("marklin_can", marklin_can::fuzz, &[], FRAMES),
    target("marklin_can_session", marklin_can_session::fuzz, &[], FRAMES),
    target("z21", z21::fuzz, &[], DATASETS),
    target("z21_session", z21_session::fuzz, &[], DATASETS),
    target("sensor_log", sensor_log::fuzz, &["testdata/sensor-logs"], TEXT),
    target("speed_profile", speed_profile::fuzz, &["testdata/profiles"], PROFILE),
    target("layout_file", layout_file::fuzz, &["crates/footplate-store/layouts"], TEXT),
    target("trains_and_lines", trains_and_lines::fuzz, &["testdata/trains", "testdata/lines"], TEXT),
    target("vehicle_file", vehicle_file::fuzz, &[], VEHICLE),
    target("tachometer_recording", tachometer_recording::fuzz, TACHOMETER, TEXT),
    target("parquet", parquet::fuzz, &[], BYTES),
    target("column_mapping", column_mapping::fuzz, &[], NAMES),
    target("accelerometer", measurements::accelerometer, &[], ACCELERATION),
    target("position_series", measurements::position_series, &["testdata/position-series"], TEXT),
    target("short_moves", measurements::short_moves, &["testdata/short-moves"], TEXT),
    target("published_table", measurements::published_table, &["testdata/published-tables"], TEXT),
    target("motion_file", measurements::motion_file, &[], MODEL),
    target("orders", footplate::fuzzed::orders, &["testdata/orders"], ORDERS),
    target("http_body", footplate::fuzzed::http_body, &["testdata/http-bodies"], JSON),
    target("guardian_frames", footplate::fuzzed::guardian_frames, &[], WARD),
    target("set_up_file", footplate::fuzzed::set_up_file, &[], SET_UP),
    target("odometer", odometer::fuzz, TACHOMETER, TEXT),
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match asked(&arguments) {
        Some(Asked::All { seconds, seed }) => fuzz_all(TARGETS, seconds, seed),
        Some(Asked::Only { target, seconds }) => fuzz_all(core::slice::from_ref(target), seconds, 1),
        Some(Asked::One { target, input }) => {
            let bytes = std::fs::read(&input).expect("the input can be read");
            (target.fuzz)(&bytes);
            eprintln!("{} found nothing in {}", target.name, input.display());
            ExitCode::SUCCESS
        }
        None => {
            let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
            eprintln!(
                "usage: footplate-fuzz SECONDS [SEED], footplate-fuzz TARGET SECONDS, or footplate-fuzz TARGET FILE; targets: {}",
                names.join(", ")
            );
            ExitCode::from(2)
        }
    }
}

enum Asked {
    /// Each target for so long.
    All { seconds: f64, seed: u64 },
    /// One target for so long.
    Only { target: &'static Target, seconds: f64 },
    /// One input again.
    One { target: &'static Target, input: PathBuf },
}

fn asked(arguments: &[String]) -> Option<Asked> {
    match arguments {
        [name, input] if TARGETS.iter().any(|target| target.name == name) => {
            let target = TARGETS.iter().find(|target| target.name == name)?;
            Some(match input.parse() {
                Ok(seconds) => Asked::Only { target, seconds },
                Err(_) => Asked::One { target, input: input.into() },
            })
        }
        [seconds] => Some(Asked::All { seconds: seconds.parse().ok()?, seed: 1 }),
        [seconds, seed] => Some(Asked::All { seconds: seconds.parse().ok()?, seed: seed.parse().ok()? }),
        _ => None,
    }
}

fn fuzz_all(targets: &[Target], seconds: f64, seed: u64) -> ExitCode {
    let mut found = 0;
    for target in targets {
        let begins = inputs(target.begins);
        let mut choice = Choice::new(seed);
        let (began, mut count) = (now(), 0_u64);
        let mut finding = None;
        while finding.is_none() && began.elapsed().as_secs_f64() < seconds {
            let input = changed(&mut choice, &begins, target.words);
            count += 1;
            finding = trouble(target, &input).map(|what| (what, input));
        }
        match finding {
            None => eprintln!("{}: nothing found in {count} inputs", target.name),
            Some((what, input)) => {
                found += 1;
                let input = shortened(target, input);
                let path = std::env::temp_dir().join(format!("footplate-fuzz-{}", target.name));
                std::fs::write(&path, &input).expect("the input can be written");
                eprintln!(
                    "{}: {what} after {count} inputs, with {} bytes; only this again: footplate-fuzz {} {}",
                    target.name,
                    input.len(),
                    target.name,
                    path.display()
                );
            }
        }
    }
    if found == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

#[expect(clippy::disallowed_methods, reason = "how long a target is given, and takes")]
fn now() -> Instant {
    Instant::now()
}

/// What a target has against an input.
fn trouble(target: &Target, input: &[u8]) -> Option<String> {
    let began = now();
    let ended = std::panic::catch_unwind(|| (target.fuzz)(input));
    match ended {
        Err(_) => Some("a panic".to_owned()),
        Ok(()) if began.elapsed() > SLOW => Some(format!("{:.1} s", began.elapsed().as_secs_f64())),
        Ok(()) => None,
    }
}

/// The files, and those of the folders, in the order of their bytes; nothing that is not there.
fn inputs(begins: &[&str]) -> Vec<Vec<u8>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let paths = begins.iter().flat_map(|begin| {
        let path = root.join(begin);
        let inside = std::fs::read_dir(&path).into_iter().flatten().filter_map(Result::ok);
        let inside: Vec<PathBuf> = inside.map(|entry| entry.path()).collect();
        if path.is_file() { vec![path] } else { inside }
    });
    let mut files: Vec<Vec<u8>> = paths.filter_map(|path| std::fs::read(path).ok()).collect();
    files.sort();
    files.iter_mut().for_each(|file| file.truncate(LONGEST));
    files
}

fn below(choice: &mut Choice, count: usize) -> usize {
    (choice.between(0.0, count as f64) as usize).min(count.saturating_sub(1))
}

/// An input that was there, or bytes of nothing, changed some times.
fn changed(choice: &mut Choice, begins: &[Vec<u8>], words: &[&[u8]]) -> Vec<u8> {
    let mut bytes = choice.of(begins).cloned().unwrap_or_default();
    if bytes.is_empty() {
        let length = below(choice, 200);
        bytes = (0..length).map(|_| below(choice, 256) as u8).collect();
    }
    for _ in 0..=below(choice, MOST_CHANGES as usize) {
        let at = below(choice, bytes.len() + 1);
        let until = (at + below(choice, 64)).min(bytes.len());
        match below(choice, 7) {
            0 if at < bytes.len() => bytes[at] ^= 1 << below(choice, 8),
            1 if at < bytes.len() => bytes[at] = below(choice, 256) as u8,
            2 => drop(bytes.drain(at..until)),
            3 => {
                let copy = bytes[at..until].to_vec();
                bytes.splice(at..at, copy);
            }
            4 => bytes.truncate(at),
            5 => {
                let other = choice.of(begins).cloned().unwrap_or_default();
                let from = below(choice, other.len() + 1);
                bytes.splice(at..until, other.into_iter().skip(from).take(64));
            }
            _ => {
                let word = choice.of(words).copied().unwrap_or_default();
                bytes.splice(at..at, word.iter().copied());
            }
        }
    }
    bytes.truncate(LONGEST);
    bytes
}

/// The input without what the finding does not need.
fn shortened(target: &Target, mut input: Vec<u8>) -> Vec<u8> {
    let mut piece = input.len() / 2;
    while piece > 0 {
        let mut at = 0;
        while at < input.len() {
            let mut shorter = input.clone();
            shorter.drain(at..(at + piece).min(input.len()));
            if trouble(target, &shorter).is_some() {
                input = shorter;
            } else {
                at += piece;
            }
        }
        piece /= 2;
    }
    input
}
