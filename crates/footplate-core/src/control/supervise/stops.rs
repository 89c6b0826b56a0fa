//! Stop commands and their confirmation, first by the link, then by the train.

use alloc::collections::BTreeMap;

use crate::ids::TrainId;
use crate::time::{TimeSpan, Timestamp};

/// The power goes off if a stop command has not been sent after this time; a link that answers needs a tenth of a
/// second.
pub(super) const CONFIRMED_WITHIN: TimeSpan = TimeSpan::from_ms(1_000);
/// A train that does not stop reaches the sensor ahead within this time after it should be at rest.
pub(super) const WATCHED_FOR: TimeSpan = TimeSpan::from_s(10.0);

/// The stop of an alarm is commanded again this long after it was sent (chosen: a train at 400 mm/s runs 120 mm), ...
const REPEATED_AFTER: TimeSpan = TimeSpan::from_ms(300);
/// ... this often: a line that confirms nothing may garble a command without a trace. Of two bytes of which 5 in 100 are
/// garbled, three arrive once with a probability of 999 in 1000. The last one counts, though: a bit makes step 8 of step 0. While the
/// line garbles data or the station is silent it is always repeated.
const REPEATS: u8 = 2;

/// A stop command to a train.
#[derive(Debug, Clone, Copy)]
struct Stop {
    commanded: Timestamp,
    /// When it was sent last, and how often it may be repeated.
    sent: Option<Timestamp>,
    repeats: u8,
    /// When the train should be at rest, once the command has been sent.
    at_rest: Option<Timestamp>,
}

impl Stop {
    fn repeat_due(&self) -> Option<Timestamp> {
        self.sent.filter(|_| self.repeats > 0).map(|sent| sent + REPEATED_AFTER)
    }
}

/// All stop commands.
#[derive(Debug, Clone, Default)]
pub(super) struct Stops {
    stops: BTreeMap<TrainId, Stop>,
}

impl Stops {
    /// A stop was commanded.
    pub(super) fn command(&mut self, train: TrainId, now: Timestamp) {
        self.stops.insert(train, Stop { commanded: now, sent: None, repeats: REPEATS, at_rest: None });
    }

    /// The command was sent; the train should be at rest at a time.
    pub(super) fn sent(&mut self, train: TrainId, sent: Timestamp, at_rest: Timestamp) {
        if let Some(stop) = self.stops.get_mut(&train) {
            stop.sent = Some(sent);
            stop.at_rest.get_or_insert(at_rest);
        }
    }

    /// The trains whose stops may be commanded again now.
    pub(super) fn repeats_due(&self, now: Timestamp) -> impl Iterator<Item = TrainId> {
        let due = self.stops.iter().filter(move |(_, stop)| stop.repeat_due().is_some_and(|due| due <= now));
        due.map(|(train, _)| *train)
    }

    /// A stop is commanded again, as one of those that are always, or over a line that is not to be relied on.
    pub(super) fn repeat(&mut self, train: TrainId, unreliable: bool) {
        if let Some(stop) = self.stops.get_mut(&train) {
            stop.sent = None;
            stop.repeats = if unreliable { REPEATS } else { stop.repeats.saturating_sub(1) };
        }
    }

    /// When the next stop of an alarm is commanded again.
    pub(super) fn next_repeat(&self, is_alarmed: impl Fn(TrainId) -> bool) -> Option<Timestamp> {
        let alarmed = self.stops.iter().filter(|(train, _)| is_alarmed(**train));
        alarmed.filter_map(|(_, stop)| stop.repeat_due()).min()
    }

    /// The train was commanded to move again, or the power is off.
    pub(super) fn forget(&mut self, train: TrainId) {
        self.stops.remove(&train);
    }

    /// Whether the stop command of a train has not been sent yet.
    pub(super) fn is_pending(&self, train: TrainId) -> bool {
        self.stops.get(&train).is_some_and(|stop| stop.at_rest.is_none())
    }

    /// When a train should be at rest; `None` until its stop command was sent.
    pub(super) fn at_rest(&self, train: TrainId) -> Option<Timestamp> {
        self.stops.get(&train)?.at_rest
    }

    /// Whether a train should be at rest, recently enough for a sensor ahead to show that it is not.
    pub(super) fn should_be_at_rest(&self, train: TrainId, now: Timestamp) -> bool {
        self.at_rest(train).is_some_and(|at_rest| now > at_rest && now - at_rest < WATCHED_FOR)
    }

    /// A train whose stop command was not sent in time.
    pub(super) fn overdue(&self, now: Timestamp) -> Option<TrainId> {
        let late = |stop: &Stop| stop.at_rest.is_none() && now - stop.commanded >= CONFIRMED_WITHIN;
        self.stops.iter().find(|(_, stop)| late(stop)).map(|(train, _)| *train)
    }

    /// The earliest time by which a stop command has to be sent.
    pub(super) fn next(&self) -> Option<Timestamp> {
        let open = self.stops.values().filter(|stop| stop.at_rest.is_none());
        open.map(|stop| stop.commanded + CONFIRMED_WITHIN).min()
    }
}
