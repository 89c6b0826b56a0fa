//! Any lines of a LocoNet server and any commands in any order: the session always goes on, and writes lines that read back.

use footplate_core::{TimeSpan, Timestamp};
use footplate_wire::loconet::{Client, Line, Settings};
use footplate_wire::{Session, Transmit};

use crate::command::command;
use crate::timeouts::passes_timeout;

/// Between two pieces of input.
const STEP: TimeSpan = TimeSpan::from_ms(3);
/// Longer than any end takes: as many trains as bytes can name, at the pace of the bus.
const END: TimeSpan = TimeSpan::from_ms(120_000);

struct Witness {
    client: Client,
    now: Timestamp,
}

impl Witness {
    fn take(&mut self) {
        while let Some(output) = self.client.poll_output() {
            if let Transmit::Message(text) = output {
                let text = String::from_utf8(text).expect("text");
                assert!(Line::read(text.trim_end()).is_ok(), "{text}");
            }
        }
    }

    fn wait_until(&mut self, end: Timestamp) {
        while passes_timeout(&mut self.client, &mut self.now, end) {
            self.take();
        }
        self.now = self.now.max(end);
    }
}

pub(crate) fn fuzz(bytes: &[u8]) {
    let client = Client::new(Timestamp::ZERO, Settings::default());
    let mut witness = Witness { client, now: Timestamp::ZERO };
    witness.take();
    for (nth, line) in bytes.split_inclusive(|byte| *byte == b'\n').enumerate() {
        let now = witness.now;
        // A line that begins with an exclamation mark is commands, two bytes each.
        match line {
            [b'!', commands @ ..] => {
                for two in commands.chunks_exact(2) {
                    let _ = witness.client.handle_command(now, command(two[0], two[1]));
                }
            }
            [b'~', ..] => witness.client.handle_reopened(now),
            _ => witness.client.handle_bytes(now, line),
        }
        witness.take();
        let steps = if nth % 7 == 0 { 500 } else { 1 };
        for _ in 0..steps {
            witness.wait_until(witness.now + STEP);
        }
    }
    witness.client.close(witness.now);
    witness.take();
    witness.wait_until(witness.now + END);
}
