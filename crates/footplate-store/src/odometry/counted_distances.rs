//! What the counts of one period say by themselves: how far each wheel has rolled, and how long that took.

use footplate_core::odometry::wheels::{Count, Direction, Period, Vehicle, WheelReading, unwrapped};
use footplate_core::{Length, Speed, TimeSpan, Timestamp};

/// Widths of running counters (bits), from the narrowest that is built.
const COUNTER_BITS: [u32; 4] = [8, 16, 24, 32];
/// A wheel turns at most this many times as fast as the train may run: it may spin. Chosen.
const SPINS: f64 = 2.0;

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
    top_speed: Speed,
    counters: [Option<Reading>; 2],
    last: Option<Timestamp>,
}

impl DistanceCounter {
    /// Begins with nothing counted; the distances follow from the diameters that the vehicle file states.
    #[must_use]
    pub fn new(vehicle: &Vehicle) -> Self {
        let pitches = vehicle.wheelsets.map(|wheelset| wheelset.pulse_pitch());
        Self { pitches, top_speed: vehicle.max_speed, counters: [None; 2], last: None }
    }

    pub(super) fn pitches(&self) -> [Length; 2] {
        self.pitches
    }

    /// Takes in a period.
    pub fn count(&mut self, period: &Period) -> CountedDistances {
        let span = self.last.map(|last| period.time - last).filter(|span| *span > TimeSpan::ZERO);
        self.last = Some(period.time);
        let pulses = [0, 1].map(|wheel| self.pulses(wheel, period));
        let distance = |wheel: usize| pulses[wheel].map(|pulses| self.pitches[wheel] * pulses as f64);
        CountedDistances { distances: [distance(0), distance(1)], span }
    }

    /// The pulses of a wheel in a period, with their sign.
    fn pulses(&mut self, wheel: usize, period: &Period) -> Option<i64> {
        let WheelReading { count, direction, .. } = period.wheels[wheel];
        match count {
            Count::Missing => None,
            Count::Pulses(pulses) if direction == Direction::Backward => Some(pulses.saturating_neg()),
            Count::Pulses(pulses) => Some(pulses),
            Count::Counter(counter) => {
                let reading = Reading { counter, time: period.time };
                let before = self.counters[wheel].replace(reading)?;
                let rolled = self.top_speed.as_m_per_s() * (period.time - before.time).as_s();
                let most = 1.0 + SPINS * rolled.max(0.0) / self.pitches[wheel].as_m();
                Some(difference(before.counter, counter, most))
            }
        }
    }
}

/// A running counter as it was read.
#[derive(Debug, Clone, Copy)]
struct Reading {
    counter: i64,
    time: Timestamp,
}

/// By how much a counter went on that wraps at the narrowest width that holds both readings: forwards through zero if that is
/// the shorter direction round, and backwards through it if the wheel cannot have turned as far forwards, more than `most`
/// pulses. A counter that is wider than both readings goes on from low ones to high ones as well.
fn difference(before: i64, after: i64, most: f64) -> i64 {
    let plain = after.saturating_sub(before);
    if plain as f64 > most {
        return unwrapped(before, after, most).map_or(plain, |turned| turned as i64);
    }
    let holds = |bits: &&u32| (0..1_i64 << **bits).contains(&before) && (0..1_i64 << **bits).contains(&after);
    let Some(bits) = COUNTER_BITS.iter().find(holds) else { return plain };
    let wrap = 1_i64 << bits;
    if plain < -wrap / 2 { plain + wrap } else { plain }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle_file::default_vehicle;

    #[test]
    fn a_counter_that_wraps_goes_on() {
        let difference = |before, after| difference(before, after, 1_000.0);
        assert_eq!(difference(250, 4), 10);
        assert_eq!(difference(65_530, 6), 12);
        assert_eq!(difference(4_294_967_290, 4), 10);
        assert_eq!(difference(7, 5), -2, "backwards");
        assert_eq!(difference(100, 300), 200);
        assert_eq!(difference(-5, 5), 10);
        assert_eq!(difference(i64::MIN, i64::MAX), i64::MAX);
    }

    #[test]
    fn a_counter_that_runs_backwards_through_zero_counts_backwards() {
        assert_eq!(difference(4, 250, 60.0), -10);
        assert_eq!(difference(6, 65_530, 60.0), -12);
        assert_eq!(difference(4, 4_294_967_290, 60.0), -10);
        assert_eq!(difference(4, 250, 300.0), 246, "a wide counter that still reads low, after a gap");
    }

    #[test]
    fn a_train_that_moves_back_over_zero_of_its_counters_moved_back() {
        // 80 teeth on 0.86 m: 33.772 mm a pulse.
        let mut counter = DistanceCounter::new(&default_vehicle().unwrap().vehicle);
        let mut period = Period::with_pulses(Timestamp::ZERO, [0, 0]);
        let mut rolled = |ms, count| {
            period.time = Timestamp::ZERO + TimeSpan::from_ms(ms);
            period.wheels = period.wheels.map(|wheel| WheelReading { count: Count::Counter(count), ..wheel });
            counter.count(&period).distances[0].map(Length::as_mm)
        };
        assert_eq!(rolled(0, 3), None);
        let back = rolled(50, 65_534).unwrap();
        assert!((back + 5.0 * 33.772).abs() < 0.01, "{back}");
    }
}
