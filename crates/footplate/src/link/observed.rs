//! A link under observation: how the line and the loop around it keep time, for a reader elsewhere, while neither waits for them.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use footplate_core::Timestamp;

use super::line::passes_on;
use super::rhythm::{PowerCommand, Rhythm};
use super::{Heard, Link, Lost};
use crate::clock::Stopwatch;
use crate::tally::Tally;

/// How often what was counted is handed over.
const HANDED_OVER_EVERY: Duration = Duration::from_millis(500);

/// What was counted.
#[derive(Debug, Clone, Default)]
pub(crate) struct LineTallies {
    /// Time between two polls with nothing between them.
    pub(crate) periods: Tally,
    /// Time from the last bit of a poll to the first byte of the reply.
    pub(crate) first_bytes: Tally,
    /// Real time that the loop was busy between two waits.
    pub(crate) turns: Tally,
    /// The last power command, and whether the station has confirmed it.
    pub(crate) power: Option<PowerCommand>,
}

/// Where it is left for others.
pub(crate) type SharedTallies = Arc<Mutex<LineTallies>>;

/// A link of which times are counted if somebody wants them.
pub(crate) struct ObservedLink<L> {
    link: L,
    observed: Option<Observed>,
}

struct Observed {
    shared: SharedTallies,
    own: LineTallies,
    rhythm: Rhythm,
    turn: Option<Stopwatch>,
    handed_over: Stopwatch,
}

impl<L: Link> ObservedLink<L> {
    pub(crate) fn new(link: L, shared: Option<SharedTallies>) -> Self {
        let observed = shared.map(|shared| Observed {
            shared,
            own: LineTallies::default(),
            rhythm: Rhythm::default(),
            turn: None,
            handed_over: Stopwatch::start(),
        });
        Self { link, observed }
    }

    pub(crate) const fn inner(&self) -> &L {
        &self.link
    }
}

impl Observed {
    fn turn_ends(&mut self) {
        if let Some(turn) = self.turn.take() {
            self.own.turns.add(1e3 * turn.elapsed().as_secs_f64());
        }
        let power = self.rhythm.power();
        let is_news = power != self.own.power;
        self.own.power = power;
        if (is_news || self.handed_over.elapsed() >= HANDED_OVER_EVERY)
            && let Ok(mut shared) = self.shared.try_lock()
        {
            shared.clone_from(&self.own);
            self.handed_over = Stopwatch::start();
        } else if is_news {
            // A reader holds the lock: publish it at the next turn instead.
            self.own.power = None;
        }
    }
}

impl<L: Link> Link for ObservedLink<L> {
    passes_on!(self, self.link);

    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        // Single bytes go to a 6051; other stations get whole messages and are not polled.
        if let (Some(observed), [_, _, ..]) = (&mut self.observed, bytes) {
            // Messages to a DCC-EX board and to JMRI begin with a bracket, to a LocoNet server with a word, to a Z21 with their length, which is neither.
            match bytes {
                [b'<', ..] => observed.rhythm.wrote_message(bytes),
                [b'{', ..] => observed.rhythm.wrote_request(bytes),
                [b'S', b'E', ..] => observed.rhythm.wrote_line(bytes),
                // A frame of Märklin's CAN bus begins with 0, or as a line of an adapter; no length of a Z21's dataset does.
                [0 | b'T' | b'\r', ..] => observed.rhythm.wrote_frame(bytes),
                _ => observed.rhythm.wrote_datagram(bytes),
            }
        }
        if let (Some(observed), [byte]) = (&mut self.observed, bytes) {
            let request = observed.rhythm.written(self.link.now(), *byte);
            // Two polls with a command between them are no period of polls alone.
            if let Some((span, 0)) = request.and_then(|request| request.after) {
                observed.own.periods.add(span.as_ms());
            }
        }
        self.link.write(bytes)
    }

    fn wait(&mut self, until: Timestamp) -> Heard {
        let Some(observed) = &mut self.observed else { return self.link.wait(until) };
        observed.turn_ends();
        let heard = self.link.wait(until);
        observed.turn = Some(Stopwatch::start());
        if let Heard::Datagram(datagram) = &heard {
            observed.rhythm.heard_datagram(datagram);
            datagram.iter().for_each(|byte| observed.rhythm.heard_of_bus(*byte));
        }
        if let Heard::Byte(byte) = heard {
            observed.rhythm.heard_of_board(byte);
            observed.rhythm.heard_of_bus(byte);
            observed.rhythm.heard_of_server(byte);
            observed.rhythm.heard_of_jmri(byte);
            if let Some(span) = observed.rhythm.heard(self.link.now()) {
                observed.own.first_bytes.add(span.as_ms());
            }
        }
        heard
    }
}
