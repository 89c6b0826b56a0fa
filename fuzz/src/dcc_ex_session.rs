//! Any bytes and any commands in any order on the session's line with a DCC-EX board: it always goes on, never writes faster than
//! the board reads, and comes to its end once the board answers.

use footplate_core::{TimeSpan, Timestamp};
use footplate_wire::dcc_ex::{Client, Framing, Reply, Request, Settings, TurnoutRequests};
use footplate_wire::{Session, Transmit};

use crate::command::command;
use crate::timeouts::passes_timeout;

/// Longer than any end takes: as many trains as bytes can name, at 20 requests a second.
const END: TimeSpan = TimeSpan::from_ms(60_000);
/// What an urgent request keeps from the one before.
const CLOSEST: TimeSpan = TimeSpan::from_ms(10);

struct Witness {
    client: Client,
    now: Timestamp,
    /// When requests were written, the newest last.
    written: Vec<Timestamp>,
    /// Requests that are not answered yet.
    asked: Vec<Request>,
}

impl Witness {
    fn take(&mut self) {
        while let Some(output) = self.client.poll_output() {
            let Transmit::Message(bytes) = output else { continue };
            if let [.., first, _, _] = self.written[..] {
                assert!(self.now - first >= CLOSEST, "four requests at once");
            }
            self.written.push(self.now);
            let mut framing = Framing::default();
            let request = bytes.iter().find_map(|byte| framing.push(*byte).map(Request::read));
            self.asked.push(request.flatten().expect("the session writes what the board reads"));
        }
    }

    /// The board answers everything that it was asked.
    fn answer(&mut self) {
        for request in std::mem::take(&mut self.asked) {
            let text = match request {
                Request::Status => Reply::Identity("DCC-EX".into()).to_string(),
                Request::Slots => Reply::Slots(50).to_string(),
                Request::Power { on, .. } => Reply::Power { on, track: String::new() }.to_string(),
                Request::Drive { cab, throttle, forward } => {
                    Reply::Locomotive { cab, register: 0, throttle, forward, functions: 0 }.to_string()
                }
                Request::Locomotive { cab } => format!("<l {cab} -1 128 0>"),
                Request::Examine { .. } => Reply::Failed.to_string(),
                Request::Define { id, address } => {
                    Reply::Definition { id, address: Some(address), thrown: true }.to_string()
                }
                Request::Turnout { id, thrown } => Reply::Turnout { id, thrown }.to_string(),
                _ => continue,
            };
            self.client.handle_bytes(self.now, text.as_bytes());
        }
        self.take();
    }

    fn wait_until(&mut self, end: Timestamp, answers: bool) {
        self.take();
        while passes_timeout(&mut self.client, &mut self.now, end) {
            self.take();
            if answers {
                self.answer();
            }
        }
        self.now = self.now.max(end);
    }
}

pub(crate) fn fuzz(bytes: &[u8]) {
    let [options, deeds @ ..] = bytes else { return };
    let turnouts = match options >> 1 & 3 {
        0 => TurnoutRequests::Accessory,
        1 => TurnoutRequests::Defined,
        _ => TurnoutRequests::Confirmed,
    };
    let settings =
        Settings { resets_on_open: options & 1 != 0, turnouts, first_sensor: u16::from(options >> 3) };
    let client = Client::new(Timestamp::ZERO, settings);
    let mut witness = Witness { client, now: Timestamp::ZERO, written: Vec::new(), asked: Vec::new() };
    for deed in deeds.chunks_exact(3) {
        let [what, first, second] = [deed[0], deed[1], deed[2]];
        let now = witness.now;
        match what % 8 {
            0 => witness.client.handle_bytes(now, &[first, second]),
            1 => witness.client.handle_bytes(now, format!("<{} {second}>", char::from(first)).as_bytes()),
            2 => witness.client.handle_bytes(now, format!("<l {first} 0 {second} 0>").as_bytes()),
            3 | 4 => drop(witness.client.handle_command(now, command(first, second))),
            5 => witness.answer(),
            6 if first > 250 => witness.client.handle_reopened(now),
            _ => {
                let span = TimeSpan::from_us(i64::from(first) * i64::from(second) * 10);
                witness.wait_until(now + span, false);
            }
        }
        witness.take();
    }
    // A board that answers lets the end through.
    witness.client.handle_reopened(witness.now);
    witness.client.close(witness.now);
    witness.take();
    witness.answer();
    witness.wait_until(witness.now + END, true);
    assert!(witness.client.closing().is_complete(), "{}", witness.client.closing());
}
