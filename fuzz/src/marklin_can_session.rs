//! Any bytes and any commands in any order on the session's line with a Märklin CAN bus: it always goes on, keeps its pace, and comes
//! to its end once the station answers.

use footplate_core::{TimeSpan, Timestamp};
use footplate_wire::marklin_can::{Client, Direction, Frame, Framing, Message, Settings, Transport, Uid};
use footplate_wire::{Session, Transmit};

use crate::command::command;
use crate::timeouts::passes_timeout;

/// Longer than any end takes: as many trains as bytes can name, at 100 frames a second.
const END: TimeSpan = TimeSpan::from_ms(30_000);
/// The hash of a real track box.
const FOREIGN: u16 = 0x9346;

struct Witness {
    client: Client,
    transport: Transport,
    now: Timestamp,
    /// Requests that are not answered yet.
    asked: Vec<Message>,
}

impl Witness {
    fn take(&mut self) {
        while let Some(output) = self.client.poll_output() {
            let Transmit::Message(bytes) = output else { continue };
            let mut framing = Framing::new(self.transport);
            let frames = bytes.iter().filter_map(|byte| framing.push(*byte));
            self.asked.extend(frames.filter(|frame| !frame.is_response).map(|frame| Message::of(&frame)));
        }
    }

    fn hear(&mut self, frame: Frame) {
        let bytes = match self.transport {
            Transport::Network => frame.encode().to_vec(),
            Transport::Adapter => (frame.to_text() + "\r").into_bytes(),
        };
        self.client.handle_bytes(self.now, &bytes);
    }

    /// The station answers everything that it was asked.
    fn answer(&mut self) {
        for message in std::mem::take(&mut self.asked) {
            let answer = match message {
                Message::Ping => Message::Participant { uid: Uid(1), version: (1, 0), kind: 0x10 },
                Message::ModulePoll { uid, .. } => Message::ModuleState { uid, module: 1, inputs: 0 },
                Message::Direction { uid, direction: None } => {
                    Message::Direction { uid, direction: Some(Direction::Forward) }
                }
                Message::Speed { uid, speed: None } => Message::Speed { uid, speed: Some(0) },
                message => message,
            };
            self.hear(answer.frame(true, FOREIGN));
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
    let transport = if options & 1 == 0 { Transport::Network } else { Transport::Adapter };
    let settings = Settings { transport, modules: options >> 1, ..Settings::default() };
    let client = Client::new(Timestamp::ZERO, settings);
    let mut witness = Witness { client, transport, now: Timestamp::ZERO, asked: Vec::new() };
    for deed in deeds.chunks_exact(4) {
        let [what, first, second, third] = [deed[0], deed[1], deed[2], deed[3]];
        let now = witness.now;
        match what % 8 {
            0 => witness.client.handle_bytes(now, &[first, second, third]),
            1 => {
                let data = [0, 0, 0, first, second, third, first, second];
                let data = footplate_wire::marklin_can::Payload::of(&data[..usize::from(what >> 3) % 9]);
                let (command, data) = (third % 0x22, data.unwrap_or_default());
                witness.hear(Frame {
                    priority: 0,
                    command,
                    is_response: second & 1 != 0,
                    hash: FOREIGN,
                    data,
                });
            }
            2 => witness.hear(
                Message::Input {
                    device: 0,
                    input: first.into(),
                    change: Some(footplate_wire::marklin_can::InputChange {
                        was_occupied: second & 1 != 0,
                        is_occupied: second & 2 != 0,
                        lasted: Some(u16::from(third) << (second >> 5)),
                    }),
                }
                .frame(true, FOREIGN),
            ),
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
    // A station that answers lets the end through.
    witness.client.handle_reopened(witness.now);
    witness.client.close(witness.now);
    witness.take();
    witness.answer();
    witness.wait_until(witness.now + END, true);
    assert!(witness.client.closing().is_complete(), "{}", witness.client.closing());
}
