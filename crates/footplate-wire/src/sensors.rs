//! Sensor states on a line that loses and repeats no messages.

use alloc::vec::Vec;

use footplate_core::{SensorId, TimeSpan, Timestamp};

use crate::dialogue::Dialogue;
use crate::outstanding::Awaited;
use crate::session::LinkNotice;

/// The sensors that the station has reported, in the order of their numbers there.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sensors(Vec<(u16, bool)>);

/// What a message means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Change {
    /// It became occupied.
    Occupied,
    /// It was occupied before it was first read.
    HeldFromStart,
    /// It became free.
    Freed,
    /// No change.
    None,
}

impl Sensors {
    /// Notes a sensor's state. `listing`: all states are being read, so the first message about a sensor is no change.
    pub(crate) fn heard(&mut self, id: u16, active: bool, listing: bool) -> Change {
        let before = match self.0.binary_search_by_key(&id, |(id, _)| *id) {
            Ok(at) => self.0.get_mut(at).map(|(_, state)| core::mem::replace(state, active)),
            Err(at) => {
                self.0.insert(at, (id, active));
                None
            }
        };
        match (before, active) {
            (None, true) if listing => Change::HeldFromStart,
            (None | Some(false), true) => Change::Occupied,
            (Some(true), false) => Change::Freed,
            _ => Change::None,
        }
    }
}

/// Returns the latest time at which a sensor became occupied, and the width of the span before it. The delay of its report is about
/// uniform between the shortest and the longest.
///
/// `not_before` is the time of the last entry of the recording, whose entries stay in order: where a command went out within the
/// shortest delay the span is a little wider. `free_at`: when the station last said that the sensor is free, where that is known: for
/// what was missed when it happened and is found when asked for.
pub(crate) fn occupied(
    heard: Timestamp,
    not_before: Timestamp,
    [shortest, longest]: [TimeSpan; 2],
    free_at: Option<Timestamp>,
) -> (Timestamp, TimeSpan) {
    let latest = (heard - shortest).max(not_before).min(heard);
    let earliest = free_at.map_or(heard, |free| free.min(heard)) - longest;
    (latest, latest - earliest)
}

impl<A: Awaited> Dialogue<A> {
    /// Reports what has changed at a sensor within a span that ends at `latest`. After a silence, it may have become occupied at any time
    /// since that began.
    pub(crate) fn hear_of_change(
        &mut self,
        sensor: SensorId,
        change: Change,
        (latest, width): (Timestamp, TimeSpan),
    ) {
        match change {
            Change::Occupied => {
                let width = self.blind_since.map_or(width, |since| width.max(latest - since));
                self.report(sensor, latest, width);
            }
            Change::Freed => self.report_free(sensor, latest, width),
            Change::HeldFromStart => self.notify(LinkNotice::HeldClosed(sensor)),
            Change::None => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sensor_is_reported_once_each_time_it_becomes_occupied() {
        let mut sensors = Sensors::default();
        assert_eq!(sensors.heard(5, false, true), Change::None);
        assert_eq!(sensors.heard(3, true, true), Change::HeldFromStart);
        assert_eq!(sensors.heard(5, true, false), Change::Occupied);
        assert_eq!(sensors.heard(5, true, false), Change::None);
        assert_eq!(sensors.heard(5, false, false), Change::Freed);
        assert_eq!(sensors.heard(3, true, false), Change::None);
        assert_eq!(sensors.heard(9, true, false), Change::Occupied, "defined while the line was open");
        // Asked for again after the line was lost: what has become occupied meanwhile is reported.
        assert_eq!(sensors.heard(5, true, true), Change::Occupied);
    }

    #[test]
    fn a_report_reaches_back_over_the_delays_or_to_where_the_sensor_was_free() {
        let heard = Timestamp::from_s(10.0);
        let delays = [TimeSpan::from_us(3_600), TimeSpan::from_us(23_100)];
        let (latest, width) = occupied(heard, Timestamp::ZERO, delays, None);
        assert_eq!((heard - latest, width), (TimeSpan::from_us(3_600), TimeSpan::from_us(19_500)));
        // An entry one millisecond ago: the span ends there and begins where it did.
        let (latest, width) = occupied(heard, heard - TimeSpan::from_ms(1), delays, None);
        assert_eq!((heard - latest, width), (TimeSpan::from_ms(1), TimeSpan::from_us(22_100)));
        let free = Some(heard - TimeSpan::from_ms(200));
        let (latest, width) = occupied(heard, heard, delays, free);
        assert_eq!((heard - latest, width), (TimeSpan::ZERO, TimeSpan::from_us(223_100)));
    }
}
