//! Noise: detections all over the layout that no train explains. A line without checksums garbles replies, or a sensor module fails;
//! what sensors report is not to be relied on then, and no train may be searched by it.
//!
//! One such detection may be spurious, and those at adjacent sensors may be of something that moves. Sensors that are neither the
//! same nor adjacent, [`MANY`] of them within [`WITHIN`], are neither: a layout of 80 sensors makes a spurious detection in 1000 s.

use alloc::collections::VecDeque;

use crate::ids::SensorId;
use crate::time::{TimeSpan, Timestamp};
use crate::track::Layout;

use super::intruder::are_adjacent;

/// So many sensors, each away from all others, ...
const MANY: usize = 4;
/// ... within this time are noise.
const WITHIN: TimeSpan = TimeSpan::from_s(5.0);
/// Noise is over when no such detection has come for this time, as on a line that garbles data.
const CLEAN_FOR: TimeSpan = TimeSpan::from_s(3.0);
/// Noise counts as over after this time even so: all stops are commanded again then, and a train that does not stop is noticed.
const AT_MOST: TimeSpan = TimeSpan::from_s(10.0);

/// A detection that no train explains.
#[derive(Debug, Clone, Copy)]
struct Detection {
    sensor: SensorId,
    at: Timestamp,
    /// Whether it is away from all that were recent then: what moves is detected beside where it was.
    is_apart: bool,
}

/// What is known of noise.
#[derive(Debug, Clone, Default)]
pub(super) struct Noise {
    /// Recent detections that no train explains, the oldest first.
    recent: VecDeque<Detection>,
    /// Since when there is noise, and until when if nothing more comes.
    lasts: Option<(Timestamp, Timestamp)>,
    /// The last noise that is over.
    before: Option<(Timestamp, Timestamp)>,
}

impl Noise {
    /// Takes a detection that no train explains. Returns whether noise begins with it.
    pub(super) fn take(&mut self, now: Timestamp, layout: &Layout, sensor: SensorId) -> bool {
        self.recent.retain(|detection| now - detection.at <= WITHIN);
        let is_near = |Detection { sensor: other, .. }: &Detection| {
            *other == sensor || are_adjacent(layout, *other, sensor) || are_adjacent(layout, sensor, *other)
        };
        let is_apart = !self.recent.iter().any(is_near);
        self.recent.push_back(Detection { sensor, at: now, is_apart });
        if let Some((since, until)) = &mut self.lasts {
            // One sensor that reports again and again is no noise, nor is something that moves.
            if is_apart {
                *until = (now + CLEAN_FOR).min(*since + AT_MOST).max(*until);
            }
            return false;
        }
        let apart = self.recent.iter().filter(|detection| detection.is_apart);
        let since = apart.clone().next().map_or(now, |first| first.at);
        let begins = apart.count() >= MANY;
        if begins {
            self.lasts = Some((since, now + CLEAN_FOR));
        }
        begins
    }

    /// Whether there is noise.
    pub(super) const fn is_on(&self) -> bool {
        self.lasts.is_some()
    }

    /// When it is over if nothing more comes.
    pub(super) fn next(&self) -> Option<Timestamp> {
        self.lasts.map(|(_, until)| until)
    }

    /// Ends it if it is over; returns since when it was.
    pub(super) fn end(&mut self, now: Timestamp) -> Option<Timestamp> {
        let (since, until) = self.lasts.filter(|(_, until)| *until <= now)?;
        self.recent.clear();
        self.before = self.lasts.take();
        debug_assert!(since <= until);
        Some(since)
    }

    /// Whether a detection was made in noise.
    pub(super) fn covers(&self, at: Timestamp) -> bool {
        self.lasts.into_iter().chain(self.before).any(|(since, until)| since <= at && at <= until)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::example::oval;

    #[test]
    fn what_runs_past_one_sensor_after_the_other_is_no_noise() {
        let layout = oval();
        let round = ["A1", "C1", "D1"].map(|name| layout.sensor_named(name).unwrap());
        let mut noise = Noise::default();
        for (nth, sensor) in (0..20_u8).zip(round.into_iter().cycle()) {
            assert!(!noise.take(Timestamp::from_s(f64::from(nth) * 0.5), &layout, sensor));
        }
        assert!(!noise.is_on());
    }

    #[test]
    fn noise_that_does_not_end_counts_as_over_after_ten_seconds() {
        let mut noise = Noise::default();
        for nth in 0..60_u16 {
            let now = Timestamp::from_s(1.0 + 0.2 * f64::from(nth));
            noise.take(now, &oval(), SensorId(1_001 + nth));
            if let Some(since) = noise.end(now) {
                assert_eq!((since, now), (Timestamp::from_s(1.0), Timestamp::from_s(11.0)));
                return;
            }
        }
        panic!("it has not ended");
    }

    #[test]
    fn noise_lasts_until_nothing_has_been_reported_for_three_seconds() {
        let mut noise = Noise::default();
        let at = Timestamp::from_s;
        // No sensor of this layout has a number above 1000: none is adjacent to another.
        let take =
            |noise: &mut Noise, seconds: f64, sensor: u16| noise.take(at(seconds), &oval(), SensorId(sensor));
        assert!(!take(&mut noise, 1.0, 1_001));
        assert!(!take(&mut noise, 2.0, 1_002));
        assert!(!take(&mut noise, 2.0, 1_001), "the same sensor again");
        assert!(!take(&mut noise, 3.0, 1_003));
        assert!(take(&mut noise, 4.0, 1_004));
        assert!(noise.covers(at(1.0)) && !noise.covers(at(0.9)));
        assert!(!take(&mut noise, 6.0, 1_005));
        assert!(!take(&mut noise, 8.5, 1_005), "one sensor that repeats itself prolongs nothing");
        assert_eq!(noise.end(at(8.9)), None);
        assert_eq!(noise.end(at(9.0)), Some(at(1.0)));
        assert!(!noise.is_on() && noise.covers(at(8.0)) && !noise.covers(at(9.1)));
        // Too far apart in time.
        for second in 0..8_u16 {
            assert!(!take(&mut noise, 20.0 + 2.0 * f64::from(second), 1_001 + second));
        }
    }
}
