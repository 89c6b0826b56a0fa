//! A whole conversation with the interface is what `testdata/wire/marklin_serial_session.txt` shows, to the microsecond.
//!
//! It is there to be read, and to show what a change of the session changes on the line.

use std::fmt::Write;

use footplate_core::SensorId;
use footplate_wire::Session;
use footplate_wire::marklin_serial::Message;

use crate::marklin_serial_bench::{Bench, ms, speed, turnout};

const TRANSCRIPT: &str = include_str!("../../../../testdata/wire/marklin_serial_session.txt");

/// What was said, message by message, and what was recorded of it.
fn transcript(bench: &Bench) -> String {
    let mut lines: Vec<(i64, String)> = Vec::new();
    let mut bytes = Vec::new();
    for (at, byte) in &bench.written {
        bytes.push(*byte);
        if let Some((message, _)) = Message::decode(&bytes) {
            let hex: Vec<String> = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
            lines.push((at.as_ns(), format!("says {:<5}  {message}", hex.join(" "))));
            bytes.clear();
        }
    }
    let entries =
        bench.events.iter().map(|event| (event.time.as_ns(), format!("records    {:?}", event.kind)));
    lines.extend(entries);
    lines.sort_by_key(|(at, _)| *at);
    let mut text = String::from(
        "# Two modules, CTS; a train is told to drive, a turnout thrown, input 20 closed and watched, all is closed.\n\
         # Times in ms: of a message, when its last byte was written; of an entry, what it is recorded with.\n",
    );
    for (at, line) in lines {
        writeln!(text, "{:>9.3}  {line}", at as f64 * 1e-6).unwrap();
    }
    text
}

#[test]
fn a_conversation_is_what_is_committed() {
    let mut bench = Bench::new(footplate_wire::marklin_serial::Settings::with_cts(2));
    bench.run_until(ms(100));
    bench.say(speed(24, 8));
    bench.say(turnout(11));
    bench.run_until(ms(400));
    bench.session.watch(Some(SensorId(20)));
    bench.run_until(ms(450));
    bench.station.input(20, true);
    bench.run_until(ms(500));
    bench.session.close(bench.now);
    bench.run_until(ms(800));
    let now = transcript(&bench);
    assert!(now == TRANSCRIPT, "the conversation is another; if it is right, commit it:\n{now}");
}
