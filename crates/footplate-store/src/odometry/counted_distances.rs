//! What the counts of one period say by themselves: how far each wheel has rolled, and how long that took.

use footplate_core::odometry::wheels::{Count, Direction, Period, Vehicle, WheelReading};
use footplate_core::{Length, TimeSpan, Timestamp};

/// Widths of running counters (bits), from the narrowest that is built.
const COUNTER_BITS: [u32; 4] = [8, 16, 24, 32];

/// What the counts of one period say.
#[derive(Debug, Clone, Copy)]
pub struct CountedDistances {
    /// How far each wheel has rolled; absent without a count.
    pub distances: [Option<Length>; 2],
    /// How long that took; absent for the first period and where time does not go on.
    pub span: Option<TimeSpan>,
}

/// Turns counts into distances, period by period.
#[derive(Debug, Clone)]
pub struct DistanceCounter {
    pitches: [Length; 2],
    counters: [Option<i64>; 2],
    last: Option<Timestamp>,
}

impl DistanceCounter {
    /// Begins with nothing counted; the distances follow from the diameters that the vehicle file states.
    #[must_use]
    pub fn new(vehicle: &Vehicle) -> Self {
        let pitches = vehicle.wheelsets.map(|wheelset| wheelset.pulse_pitch());
        Self { pitches, counters: [None; 2], last: None }
    }

    pub(super) fn pitches(&self) -> [Length; 2] {
        self.pitches
    }

    /// Takes in a period.
    pub fn count(&mut self, period: &Period) -> CountedDistances {
        let span = self.last.map(|last| period.time - last).filter(|span| *span > TimeSpan::ZERO);
        self.last = Some(period.time);
        let [first, second] = &mut self.counters;
        let [one, other] = period.wheels;
        let pulses = [pulses(first, one), pulses(second, other)];
        let distance = |wheel: usize| pulses[wheel].map(|pulses| self.pitches[wheel] * pulses as f64);
        CountedDistances { distances: [distance(0), distance(1)], span }
    }
}

/// The pulses of a period, with their sign; `last` is the counter before it.
fn pulses(last: &mut Option<i64>, wheel: WheelReading) -> Option<i64> {
    match wheel.count {
        Count::Missing => None,
        Count::Pulses(pulses) if wheel.direction == Direction::Backward => Some(pulses.saturating_neg()),
        Count::Pulses(pulses) => Some(pulses),
        Count::Counter(counter) => {
            let before = last.replace(counter)?;
            Some(difference(before, counter))
        }
    }
}

/// By how much a counter went on, if it wraps at the narrowest width that holds both readings and the shorter direction
/// round is the right one.
fn difference(before: i64, after: i64) -> i64 {
    let plain = after.saturating_sub(before);
    let holds = |bits: &&u32| (0..1_i64 << **bits).contains(&before) && (0..1_i64 << **bits).contains(&after);
    let Some(bits) = COUNTER_BITS.iter().find(holds) else { return plain };
    let wrap = 1_i64 << bits;
    if plain < -wrap / 2 { plain + wrap } else { plain }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_that_wraps_goes_on() {
        assert_eq!(difference(250, 4), 10);
        assert_eq!(difference(65_530, 6), 12);
        assert_eq!(difference(4_294_967_290, 4), 10);
        assert_eq!(difference(7, 5), -2, "backwards");
        assert_eq!(difference(100, 300), 200);
        assert_eq!(difference(-5, 5), 10);
        assert_eq!(difference(i64::MIN, i64::MAX), i64::MAX);
    }
}
