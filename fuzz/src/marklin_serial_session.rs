//! Any bytes, any commands, any hand-shake in any order on the session's line: it always goes on, never writes while an
//! answer is due, never powers a second solenoid before the first is released, and comes to its end.

use footplate_core::{SensorId, TimeSpan, Timestamp};
use footplate_wire::marklin_serial::{BYTE_TIME, Interface, Message, Pace, Settings};
use footplate_wire::{Session, Transmit};

use crate::command::command;
use crate::timeouts::passes_timeout;

/// Longer than any end takes: eighty trains to be told with careful gaps, after a babble of a second.
const END: TimeSpan = TimeSpan::from_ms(30_000);

struct Witness {
    session: Interface,
    now: Timestamp,
    wrote: Option<Timestamp>,
    heard: Vec<u8>,
    powered: bool,
}

impl Witness {
    fn take(&mut self) {
        while let Some(output) = self.session.poll_output() {
            let Transmit::Byte(byte) = output else { continue };
            assert!(self.wrote.is_none_or(|at| self.now - at >= BYTE_TIME), "two bytes at once");
            self.wrote = Some(self.now);
            self.heard.push(byte);
            let Some((message, _)) = Message::decode(&self.heard) else { continue };
            match message {
                Message::Turnout { .. } => {
                    assert!(!self.powered, "a second solenoid before the first is released");
                    self.powered = true;
                }
                Message::SolenoidOff => self.powered = false,
                Message::Unknown { .. } => panic!("the session said {message}"),
                _ => {}
            }
            self.heard.clear();
        }
    }

    fn wait_until(&mut self, end: Timestamp) {
        self.take();
        while passes_timeout(&mut self.session, &mut self.now, end) {
            self.take();
        }
        self.now = self.now.max(end);
    }
}

pub(crate) fn fuzz(bytes: &[u8]) {
    let [modules, pace, deeds @ ..] = bytes else { return };
    let pace = [Pace::Cts, Pace::FAST, Pace::CAREFUL][usize::from(pace % 3)];
    let Ok(session) = Interface::new(Timestamp::ZERO, Settings::timed(modules % 31 + 1, pace)) else {
        return;
    };
    let mut witness =
        Witness { session, now: Timestamp::ZERO, wrote: None, heard: Vec::new(), powered: false };
    witness.session.handle_cts(witness.now, true);
    for deed in deeds.chunks_exact(3) {
        let [what, first, second] = [deed[0], deed[1], deed[2]];
        let now = witness.now;
        match what % 8 {
            0 => witness.session.handle_bytes(now, &[first, second]),
            1 => witness.session.handle_bytes(now, &vec![second; first.into()]),
            2 => witness.session.handle_cts(now, first > 127),
            3 => drop(witness.session.handle_command(now, command(first, second))),
            4 => witness.session.watch((first > 20).then_some(SensorId(first.into()))),
            5 => witness.session.hold_line((first > 20).then(|| now + TimeSpan::from_ms(second.into()))),
            6 if first > 250 => {
                // What was on the line is gone.
                (witness.heard, witness.wrote) = (Vec::new(), None);
                witness.session.handle_reopened(now);
            }
            _ => witness.wait_until(now + TimeSpan::from_us(i64::from(first) * i64::from(second) * 10)),
        }
        witness.take();
    }
    // A station that is ready lets the end through.
    witness.session.handle_cts(witness.now, true);
    witness.session.close(witness.now);
    witness.wait_until(witness.now + END);
    assert!(witness.session.closing().is_complete(), "{}", witness.session.closing());
    assert!(witness.heard.is_empty() && !witness.powered);
}
