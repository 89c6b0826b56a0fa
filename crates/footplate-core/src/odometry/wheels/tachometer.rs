//! Turns the readings of a tachometer into rotation of its wheel, with the quality of every sample.
//!
//! A count that no wheel can have made is replaced by the expected one and marked [`Quality::Substituted`]. One such count is a
//! spike. A second in a row is passed on together with the first, because a real slide lasts; hypotheses decide whether a
//! wheel or a fault made them.

use super::period::{Count, Direction, WheelReading};
use super::range::larger;

/// Widths of running counters in use, narrowest first (bits).
const COUNTER_BITS: [u32; 4] = [8, 16, 24, 32];
/// A sensor is taken to have swapped wires after its direction has contradicted the train in so many periods in a row.
const CONTRADICTIONS: u32 = 20;
/// Rows are taken to be lost if a time step is longer than this (periods).
const LOST_ROWS: f64 = 1.5;

/// The quality of one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quality {
    /// As read.
    Ok,
    /// Replaced by what was expected: a spike, a drop-out or pulses of lost rows.
    Substituted,
    /// Nothing was read that can be a count; the expected count stands in.
    Missing,
}

/// How far a wheel turned in one period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    /// Pulses, negative backwards. A whole number unless something was substituted.
    pub pulses: f64,
    /// Its quality.
    pub quality: Quality,
    /// How many pulses it may be wrong by, beyond the one of every count.
    pub uncertainty: f64,
    /// Those of its pulses that were not read in the period: they belong to the one before, or are only expected.
    pub late: f64,
}

/// The expected count of a period, in signed pulses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected {
    /// The most likely count.
    pub pulses: f64,
    /// How much more the wheel can count ...
    pub more: f64,
    /// ... and how much less.
    pub fewer: f64,
    /// How much the count of a rolling wheel can differ.
    pub rolling: f64,
    /// Pulses of the fastest wheel.
    pub most: f64,
}

/// The direction of travel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heading {
    /// 1 where distance grows, −1 where it falls.
    pub direction: f64,
    /// The train is too fast to have reversed: a sensor that reports it is wrong.
    pub certain: bool,
    /// The two sensors report different directions, so that neither counts.
    pub disputed: bool,
}

/// Reads one tachometer.
#[derive(Debug, Clone)]
pub struct Tachometer {
    /// The last value of a running counter.
    counter: Option<i64>,
    /// What was assumed for periods without a reading since the last one.
    assumed: f64,
    /// Periods since the last reading, this one included.
    unread: f64,
    /// Pulses withheld from the last sample as a spike.
    withheld: f64,
    /// The last sample was surprising and passed on, so that the next is passed on, too. Withheld again and again, counts would feed
    /// the expectation that they are compared with.
    passes: bool,
    /// −1 for a sensor with swapped wires, otherwise 1.
    wiring: f64,
    contradictions: u32,
    /// The direction at the last pulse, and whether it changed in this period, which may then hold pulses of both.
    last_sign: f64,
    turned_round: bool,
}

impl Tachometer {
    /// A tachometer before its first reading.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            counter: None,
            assumed: 0.0,
            unread: 0.0,
            withheld: 0.0,
            passes: false,
            wiring: 1.0,
            contradictions: 0,
            last_sign: 0.0,
            turned_round: false,
        }
    }

    /// What the wheel turned in a period that is `periods` odometry periods long.
    #[inline]
    pub fn read(
        &mut self,
        reading: &WheelReading,
        periods: f64,
        heading: Heading,
        expected: &Expected,
    ) -> Turn {
        self.turned_round = false;
        let read = self.increment(reading, periods, heading, expected);
        let (pulses, whole) = match read {
            Increment::Turned { pulses, whole } => (pulses, whole),
            Increment::Nothing => {
                self.assumed += expected.pulses;
                self.unread += periods;
                self.withheld = 0.0;
                return Turn {
                    pulses: expected.pulses,
                    quality: Quality::Missing,
                    uncertainty: f64::INFINITY,
                    late: 0.0,
                };
            }
            Increment::Restarted => {
                self.assumed = 0.0;
                self.unread = 0.0;
                self.withheld = 0.0;
                return Turn {
                    pulses: expected.pulses,
                    quality: Quality::Missing,
                    uncertainty: f64::INFINITY,
                    late: 0.0,
                };
            }
        };
        self.assumed = 0.0;
        self.unread = 0.0;
        let surprise = pulses - expected.pulses;
        if surprise <= expected.more && surprise >= -expected.fewer {
            self.withheld = 0.0;
            self.passes = false;
            let quality = if whole { Quality::Ok } else { Quality::Substituted };
            let unusual =
                if whole && surprise.abs() <= expected.rolling { 0.0 } else { surprise.abs() + 1.0 };
            let is_ambiguous = self.turned_round || heading.disputed;
            let uncertainty = unusual + if is_ambiguous { 2.0 * pulses.abs() } else { 0.0 };
            return Turn { pulses, quality, uncertainty, late: 0.0 };
        }
        if self.passes || self.withheld * surprise > 0.0 {
            let late = self.withheld;
            self.withheld = 0.0;
            self.passes = true;
            let uncertainty = surprise.abs() + 1.0;
            return Turn { pulses: pulses + late, quality: Quality::Ok, uncertainty, late };
        }
        let stand_in = libm::round(expected.pulses);
        self.withheld = pulses - stand_in;
        let uncertainty = expected.more.max(expected.fewer);
        // The expectation may have run ahead of the wheel.
        let late = if self.withheld * heading.direction < 0.0 { -self.withheld } else { 0.0 };
        Turn { pulses: stand_in, quality: Quality::Substituted, uncertainty, late }
    }

    /// Signed pulses since the last reading, if they can be a count.
    #[inline]
    fn increment(
        &mut self,
        reading: &WheelReading,
        periods: f64,
        heading: Heading,
        expected: &Expected,
    ) -> Increment {
        let span = self.unread + periods;
        let most = expected.most * larger(span, 1.0);
        match reading.count {
            Count::Missing => Increment::Nothing,
            Count::Counter(value) => {
                let moved = self.counter.replace(value).and_then(|before| unwrapped(before, value, most));
                match moved {
                    Some(turned) => {
                        let reported = if turned < 0.0 { -self.wiring } else { self.wiring };
                        // A running counter counts backwards itself.
                        let heading = Heading { disputed: false, ..heading };
                        let turned =
                            turned.abs() * if turned == 0.0 { 1.0 } else { self.accepted(reported, heading) };
                        Increment::Turned { pulses: turned - self.assumed, whole: true }
                    }
                    None => Increment::Restarted,
                }
            }
            Count::Pulses(pulses) => {
                let counted = pulses as f64;
                if !(0.0..=most).contains(&counted) {
                    return Increment::Nothing;
                }
                let sign = self.sign(reading.direction, heading, pulses != 0);
                self.turned_round = pulses != 0 && sign * self.last_sign < 0.0;
                if pulses != 0 {
                    self.last_sign = sign;
                }
                let counted = counted * sign;
                let expected_in_all = expected.pulses + self.assumed;
                let expected_in_one = expected_in_all / larger(span, 1.0);
                // A count after lost rows covers them, or its own period only: whichever is nearer to the expectation.
                let covers_one =
                    span > LOST_ROWS && (counted - expected_in_one).abs() < (counted - expected_in_all).abs();
                if covers_one {
                    Increment::Turned { pulses: counted + expected.pulses - expected_in_one, whole: false }
                } else {
                    Increment::Turned { pulses: counted - self.assumed, whole: true }
                }
            }
        }
    }

    /// −1 for a sensor that was found to have swapped wires, otherwise 1.
    #[must_use]
    pub fn wiring(&self) -> f64 {
        self.wiring
    }

    /// The sign of the pulses, with swapped wires taken into account.
    fn sign(&mut self, direction: Direction, heading: Heading, turned: bool) -> f64 {
        let reported = match direction {
            Direction::Unknown => return heading.direction,
            Direction::Forward => self.wiring,
            Direction::Backward => -self.wiring,
        };
        if turned { self.accepted(reported, heading) } else { heading.direction }
    }

    /// The direction of a wheel whose sensor reports `reported`.
    fn accepted(&mut self, reported: f64, heading: Heading) -> f64 {
        if reported == heading.direction {
            self.contradictions = 0;
            return reported;
        }
        if heading.certain {
            self.contradictions += 1;
            if self.contradictions >= CONTRADICTIONS {
                self.wiring = -self.wiring;
                self.contradictions = 0;
            }
        }
        if heading.certain || heading.disputed { heading.direction } else { reported }
    }
}

/// What a reading contributes.
enum Increment {
    /// Pulses since the last reading, and whether all of them were read.
    Turned { pulses: f64, whole: bool },
    /// No reading, or none that can be a count.
    Nothing,
    /// A running counter begins here.
    Restarted,
}

impl Default for Tachometer {
    fn default() -> Self {
        Self::new()
    }
}

/// The difference of two readings of a running counter (pulses), through a wrap in either direction if a plain difference
/// is more than the wheel can have turned, `most` pulses; `None` if no difference is possible.
#[must_use]
pub fn unwrapped(before: i64, now: i64, most: f64) -> Option<f64> {
    let moved = now.saturating_sub(before) as f64;
    if moved.abs() <= most {
        return Some(moved);
    }
    let larger = now.max(before);
    if now.min(before) < 0 {
        return None;
    }
    let wraps = COUNTER_BITS.iter().map(|bits| 1_i64 << bits).filter(|modulus| larger < *modulus);
    wraps
        .map(|modulus| if moved < 0.0 { moved + modulus as f64 } else { moved - modulus as f64 })
        .find(|wrapped| wrapped.abs() <= most)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    const FORWARD: Heading = Heading { direction: 1.0, certain: true, disputed: false };
    const CALM: Expected = Expected { pulses: 20.0, more: 3.0, fewer: 3.0, rolling: 1.5, most: 60.0 };

    fn turns(counts: &[Count]) -> Vec<Turn> {
        let mut tachometer = Tachometer::new();
        let read = |count: &Count| WheelReading { count: *count, ..WheelReading::MISSING };
        counts.iter().map(|count| tachometer.read(&read(count), 1.0, FORWARD, &CALM)).collect()
    }

    fn total(turns: &[Turn]) -> f64 {
        turns.iter().map(|turn| turn.pulses).sum()
    }

    #[test]
    fn a_spike_is_replaced_and_said_to_be() {
        let turns = turns(&[Count::Pulses(20), Count::Pulses(45), Count::Pulses(20)]);
        assert_eq!((turns[1].pulses, turns[1].quality), (20.0, Quality::Substituted));
        assert_eq!(turns[2].quality, Quality::Ok);
        assert_eq!(total(&turns), 60.0);
    }

    #[test]
    fn two_surprises_in_a_row_are_accepted_with_all_their_pulses() {
        let turns = turns(&[Count::Pulses(20), Count::Pulses(12), Count::Pulses(8)]);
        assert_eq!(turns[2].quality, Quality::Ok);
        assert_eq!(total(&turns), 40.0, "no pulse is lost");
    }

    #[test]
    fn a_counter_wraps_and_goes_over_missing_readings() {
        let turns = turns(&[
            Count::Counter(65_500),
            Count::Counter(65_520),
            Count::Counter(4),
            Count::Missing,
            Count::Counter(44),
        ]);
        assert_eq!(turns[0].quality, Quality::Missing, "the first value of a counter says nothing");
        assert_eq!((turns[2].pulses, turns[2].quality), (20.0, Quality::Ok));
        assert_eq!(turns[3].quality, Quality::Missing);
        assert_eq!(total(&turns[1..]), 80.0, "65 500 to 65 536 + 44");
    }

    #[test]
    fn a_counter_that_starts_anew_is_missing_once() {
        let turns =
            turns(&[Count::Counter(1000), Count::Counter(1020), Count::Counter(0), Count::Counter(20)]);
        assert_eq!(turns[2].quality, Quality::Missing);
        assert_eq!((turns[3].pulses, turns[3].quality), (20.0, Quality::Ok));
    }

    #[test]
    fn what_cannot_be_a_count_is_missing() {
        let turns = turns(&[Count::Pulses(-3), Count::Pulses(1_000_000), Count::Pulses(i64::MAX)]);
        assert!(turns.iter().all(|turn| turn.quality == Quality::Missing && turn.pulses == 20.0));
    }

    #[test]
    fn pulses_of_lost_rows_are_filled_in_only_if_the_count_lacks_them() {
        for (counted, quality) in [(40, Quality::Ok), (20, Quality::Substituted)] {
            let mut tachometer = Tachometer::new();
            let expected = Expected { pulses: 40.0, ..CALM };
            let turn = tachometer.read(&WheelReading::pulses(counted), 2.0, FORWARD, &expected);
            assert_eq!((turn.pulses, turn.quality), (40.0, quality));
        }
    }

    #[test]
    fn a_sensor_wired_backward_is_found_out() {
        let mut tachometer = Tachometer::new();
        let reading = WheelReading { direction: Direction::Backward, ..WheelReading::pulses(20) };
        for _ in 0..CONTRADICTIONS {
            assert_eq!(tachometer.read(&reading, 1.0, FORWARD, &CALM).pulses, 20.0);
        }
        // At standstill it is now read in the right direction.
        assert_eq!(tachometer.read(&reading, 1.0, Heading { certain: false, ..FORWARD }, &CALM).pulses, 20.0);
    }

    #[test]
    fn a_sensor_that_dies_is_withheld_once_and_then_read() {
        let pulses: Vec<f64> = turns(&[Count::Pulses(0); 6]).iter().map(|turn| turn.pulses).collect();
        assert_eq!(pulses, [20.0, -20.0, 0.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn after_a_missing_reading_a_count_covers_its_period_or_both_whichever_is_nearer() {
        // 20 stood in for the missing one. Of both 40 are expected: 42 are two more, 22 two more in the last period alone.
        for (counted, quality) in [(42, Quality::Ok), (22, Quality::Substituted)] {
            let turns =
                turns(&[Count::Pulses(20), Count::Missing, Count::Pulses(counted), Count::Pulses(20)]);
            assert_eq!((turns[1].pulses, turns[1].quality), (20.0, Quality::Missing));
            assert_eq!((turns[2].pulses, turns[2].quality), (22.0, quality));
            assert_eq!((turns[3].pulses, turns[3].quality), (20.0, Quality::Ok), "counts its own period");
        }
        let missing = turns(&[Count::Missing, Count::Missing, Count::Pulses(60)]);
        assert_eq!((missing[2].pulses, missing[2].quality), (20.0, Quality::Ok), "60 cover three periods");
    }

    #[test]
    fn a_turn_says_how_wrong_it_may_be_and_what_came_late() {
        let turns = turns(&[Count::Pulses(21), Count::Pulses(22), Count::Pulses(12), Count::Pulses(8)]);
        let turn = |pulses, quality, uncertainty, late| Turn { pulses, quality, uncertainty, late };
        assert_eq!(turns[0], turn(21.0, Quality::Ok, 0.0, 0.0), "as a rolling wheel");
        assert_eq!(
            turns[1],
            turn(22.0, Quality::Ok, 3.0, 0.0),
            "two more than expected, and one for the phase"
        );
        assert_eq!(turns[2], turn(20.0, Quality::Substituted, 3.0, 8.0), "8 of them are only expected");
        assert_eq!(
            turns[3],
            turn(0.0, Quality::Ok, 13.0, -8.0),
            "they are taken back: 12 fewer than expected"
        );
    }

    #[test]
    fn a_count_at_a_reversal_may_be_wrong_by_all_its_pulses_either_direction() {
        let standing = Expected { pulses: 0.0, more: 60.0, fewer: 60.0, rolling: 1.5, most: 60.0 };
        let heading = Heading { certain: false, ..FORWARD };
        let mut tachometer = Tachometer::new();
        let mut read = |direction, pulses, heading| {
            let reading = WheelReading { direction, ..WheelReading::pulses(pulses) };
            let turn = tachometer.read(&reading, 1.0, heading, &standing);
            (turn.pulses, turn.uncertainty)
        };
        assert_eq!(read(Direction::Forward, 10, heading), (10.0, 11.0));
        assert_eq!(read(Direction::Backward, 10, heading), (-10.0, 31.0), "twice 10 more");
        assert_eq!(read(Direction::Backward, 10, heading), (-10.0, 11.0));
        assert_eq!(read(Direction::Backward, 0, heading), (0.0, 0.0));
        let disputed = Heading { disputed: true, ..heading };
        assert_eq!(read(Direction::Forward, 10, disputed), (10.0, 31.0), "the sensors contradict each other");
        assert_eq!(read(Direction::Unknown, 10, heading), (10.0, 11.0), "as the train runs");
    }

    #[test]
    fn a_counter_wraps_only_where_both_readings_have_so_many_bits() {
        assert_eq!(unwrapped(65_530, 4, 60.0), Some(10.0));
        assert_eq!(unwrapped(4, 65_530, 60.0), Some(-10.0));
        assert_eq!(unwrapped(65_536, 10, 60.0), None, "no counter of 16 bits reads 65 536");
        assert_eq!(unwrapped(-1, 65_530, 60.0), None, "none that wraps is negative");
        assert_eq!([unwrapped(100, 160, 60.0), unwrapped(160, 100, 60.0)], [Some(60.0), Some(-60.0)]);
    }
}
