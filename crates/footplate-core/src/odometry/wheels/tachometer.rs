//! From what a tachometer reports to how far its wheel turned, with the quality of every sample.
//!
//! Nothing is overwritten silently: a count that no wheel can have made is replaced by what its wheel was expected to
//! turn, and said to be [`Quality::Substituted`]. One such count is a spike; a second in a row is passed on, and the
//! first with it, because a real slide does not come alone. Whether a wheel or a fault made them, hypotheses decide.

use super::period::{Count, Direction, WheelReading};
use super::range::larger;

/// Widths of running counters in use, narrowest first (bits).
const COUNTER_BITS: [u32; 4] = [8, 16, 24, 32];
/// Periods in a row in which the direction told has to contradict the train before it is taken for wired the wrong way.
const CONTRADICTIONS: u32 = 20;
/// Part of a period by which a span has to exceed it before rows are taken to be lost.
const LOST_ROWS: f64 = 1.5;

/// How good one sample is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quality {
    /// As read.
    Ok,
    /// Replaced by what was expected: a spike, a drop-out or pulses of lost rows.
    Substituted,
    /// Nothing was read, or nothing that can be a count; what was expected stands for it.
    Missing,
}

/// How far a wheel turned in one period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    /// Pulses, negative backwards. A whole number unless something was substituted.
    pub pulses: f64,
    /// How good that is.
    pub quality: Quality,
    /// By how many pulses it may be wrong, beyond the one that every count may be.
    pub doubt: f64,
    /// Those of its pulses that were not read in the period: they belong to the one before, or are only expected.
    pub late: f64,
}

/// What the tachometer is expected to say, in signed pulses of the period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected {
    /// The most likely count.
    pub pulses: f64,
    /// By how much it can be larger ...
    pub more: f64,
    /// ... or smaller without surprise.
    pub fewer: f64,
    /// By how much it can differ without surprise if the wheel rolls.
    pub rolling: f64,
    /// The most pulses that the fastest wheel gives.
    pub most: f64,
}

/// Which way the train moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heading {
    /// 1 the way in which distance grows, −1 the other.
    pub direction: f64,
    /// It is too fast to have turned round: a sensor that says so is wrong.
    pub certain: bool,
    /// The two sensors say different ways, so that neither is believed.
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
    /// What was taken away from the last sample as a spike.
    withheld: f64,
    /// The last sample surprised and was passed on: the next is no spike, whatever it says. Withheld again, it would feed
    /// the expectation that it surprised.
    passes: bool,
    /// The sensor is wired the wrong way round: 1 or −1.
    wiring: f64,
    contradictions: u32,
    /// The way it turned at the last pulse, and whether this period's pulses were the other way: some of them may have
    /// been both.
    last_way: f64,
    turned_round: bool,
}

impl Tachometer {
    /// A tachometer that has said nothing yet.
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
            last_way: 0.0,
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
                    doubt: f64::INFINITY,
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
                    doubt: f64::INFINITY,
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
            let either_way = self.turned_round || heading.disputed;
            let doubt = unusual + if either_way { 2.0 * pulses.abs() } else { 0.0 };
            return Turn { pulses, quality, doubt, late: 0.0 };
        }
        if self.passes || self.withheld * surprise > 0.0 {
            let late = self.withheld;
            self.withheld = 0.0;
            self.passes = true;
            let doubt = surprise.abs() + 1.0;
            return Turn { pulses: pulses + late, quality: Quality::Ok, doubt, late };
        }
        let stand_in = libm::round(expected.pulses);
        self.withheld = pulses - stand_in;
        let doubt = expected.more.max(expected.fewer);
        // A stand-in that is larger than what was read may be an expectation that ran ahead.
        let late = if self.withheld * heading.direction < 0.0 { -self.withheld } else { 0.0 };
        Turn { pulses: stand_in, quality: Quality::Substituted, doubt, late }
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
                        let told = if turned < 0.0 { -self.wiring } else { self.wiring };
                        // A running counter is counted down by a tooth that is shaken back: its sign is its own.
                        let heading = Heading { disputed: false, ..heading };
                        let turned =
                            turned.abs() * if turned == 0.0 { 1.0 } else { self.believed(told, heading) };
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
                let way = self.sign(reading.direction, heading, pulses != 0);
                self.turned_round = pulses != 0 && way * self.last_way < 0.0;
                if pulses != 0 {
                    self.last_way = way;
                }
                let counted = counted * way;
                let expected_in_all = expected.pulses + self.assumed;
                let expected_in_one = expected_in_all / larger(span, 1.0);
                // A count after lost rows may cover them or its own period only: whichever is nearer to the expected.
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

    /// 1, or −1 for a sensor that was found to be wired the wrong way round.
    #[must_use]
    pub fn wiring(&self) -> f64 {
        self.wiring
    }

    /// Which way the pulses count, minding a sensor that is wired the wrong way round.
    fn sign(&mut self, direction: Direction, heading: Heading, turned: bool) -> f64 {
        let told = match direction {
            Direction::Unknown => return heading.direction,
            Direction::Forward => self.wiring,
            Direction::Backward => -self.wiring,
        };
        if turned { self.believed(told, heading) } else { heading.direction }
    }

    /// Which way a wheel turned that is told to have turned so.
    fn believed(&mut self, told: f64, heading: Heading) -> f64 {
        if told == heading.direction {
            self.contradictions = 0;
            return told;
        }
        if heading.certain {
            self.contradictions += 1;
            if self.contradictions >= CONTRADICTIONS {
                self.wiring = -self.wiring;
                self.contradictions = 0;
            }
        }
        if heading.certain || heading.disputed { heading.direction } else { told }
    }
}

/// What a reading adds.
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

/// What a running counter moved by, through a wrap if only that is possible.
fn unwrapped(before: i64, now: i64, most: f64) -> Option<f64> {
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
    fn two_surprises_in_a_row_are_believed_with_all_their_pulses() {
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
    fn a_sensor_wired_the_wrong_way_round_is_found_out() {
        let mut tachometer = Tachometer::new();
        let reading = WheelReading { direction: Direction::Backward, ..WheelReading::pulses(20) };
        for _ in 0..CONTRADICTIONS {
            assert_eq!(tachometer.read(&reading, 1.0, FORWARD, &CALM).pulses, 20.0);
        }
        // At standstill it is now read the right way round.
        assert_eq!(tachometer.read(&reading, 1.0, Heading { certain: false, ..FORWARD }, &CALM).pulses, 20.0);
    }
}
