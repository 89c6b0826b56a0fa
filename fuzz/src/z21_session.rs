//! Any datagrams and any commands in any order on the session's line with a Z21: it always goes on, keeps its pace, and comes to its
//! end once the station answers.

use footplate_core::{DecoderSteps, TimeSpan, Timestamp};
use footplate_wire::z21::{
    Broadcasts, CentralState, Client, Datasets, Feedback, LocomotiveState, Reply, Request, Settings, Throttle,
};
use footplate_wire::{Session, Transmit};

use crate::command::command;
use crate::timeouts::passes_timeout;

/// Longer than any end takes: as many trains as bytes can name, at 50 requests a second.
const END: TimeSpan = TimeSpan::from_ms(60_000);

struct Witness {
    client: Client,
    now: Timestamp,
    /// Requests that are not answered yet.
    asked: Vec<Request>,
}

impl Witness {
    fn take(&mut self) {
        while let Some(output) = self.client.poll_output() {
            let Transmit::Message(datagram) = output else { continue };
            let mut datasets = Datasets::of(&datagram);
            for dataset in datasets.by_ref() {
                assert!(dataset.is_sound(), "the session writes right checksums");
                self.asked.push(Request::read(&dataset).expect("the session writes what a station reads"));
            }
            assert_eq!(datasets.unread(), 0);
        }
    }

    /// The station answers everything that it was asked.
    fn answer(&mut self) {
        let mut driven: Vec<(u16, Throttle, bool)> = Vec::new();
        for request in std::mem::take(&mut self.asked) {
            let reply = match request {
                Request::SerialNumber => Reply::SerialNumber(1),
                Request::Broadcasts => Reply::Broadcasts(Broadcasts(u32::MAX)),
                Request::Status => Reply::Status(CentralState(0)),
                Request::Power { on } => Reply::Power { on },
                Request::Feedback { group } => Reply::Feedback { group, inputs: [0; 10] },
                Request::Drive { address, throttle, forward, .. } => {
                    driven.push((address, throttle, forward));
                    continue;
                }
                Request::Locomotive { address } => {
                    let known = driven.iter().rfind(|(known, ..)| *known == address);
                    let (_, throttle, forward) = known.copied().unwrap_or((address, Throttle::Stop, true));
                    let (busy, steps, functions) = (false, DecoderSteps::All, 0);
                    Reply::Locomotive(LocomotiveState { address, busy, steps, throttle, forward, functions })
                }
                _ => continue,
            };
            let mut datagram = Vec::new();
            reply.write(&mut datagram);
            self.client.handle_bytes(self.now, &datagram);
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
    let feedback = [Feedback::RBus, Feedback::Can, Feedback::LocoNet][usize::from(options % 3)];
    let steps =
        [DecoderSteps::Fourteen, DecoderSteps::TwentyEight, DecoderSteps::All][usize::from(options / 3 % 3)];
    let settings = Settings { feedback, steps, ..Settings::default() };
    let client = Client::new(Timestamp::ZERO, settings);
    let mut witness = Witness { client, now: Timestamp::ZERO, asked: Vec::new() };
    for deed in deeds.chunks_exact(3) {
        let [what, first, second] = [deed[0], deed[1], deed[2]];
        let now = witness.now;
        match what % 8 {
            0 => witness.client.handle_bytes(now, &[first, second]),
            1 => witness.client.handle_bytes(now, &[7, 0, 0x40, 0, 0x61, first, second]),
            2 => witness.client.handle_bytes(now, &[0x0a, 0, 0x40, 0, 0xef, 0, first, 4, second, 0]),
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
