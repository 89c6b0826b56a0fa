//! Whether a tachometer is to be believed: dead, stuck, or saying what no wheel can do.
//!
//! A locked wheel and a dead sensor both say nothing. What tells them apart is how they came to it: a wheel of 100
//! kg m² needs some tenths of a second to stop, a cable breaks between two periods. Every exclusion is taken back once
//! the sensor agrees with the train for a while.

use super::range::larger;

/// Speed of the train above which a silent wheel that cannot slide is dead (m/s).
const DEAD_ABOVE: f64 = 1.5;
/// How long it has to be silent (s).
const DEAD_AFTER_S: f64 = 0.5;
/// How long a count has to stand still before it can be stuck (s) ...
const STUCK_AFTER_S: f64 = 1.0;
/// ... and before it is no longer asked for bounds if the other wheelset disagrees (s).
const DOUBTED_AFTER_S: f64 = 0.25;
/// By how much the other wheelset has to disagree (m/s, and as part of the speed).
const DISAGREE: (f64, f64) = (1.0, 0.05);
/// By how much it may disagree before the bounds stop asking (m/s, and as part of the speed).
const DOUBT: (f64, f64) = (0.12, 0.006);
/// A count that stands still for longer is not asked for bounds at all (s): at steady speed it moves to and fro by one.
const TOO_STEADY_S: f64 = 0.7;
/// How long a sensor has to agree with the train to be believed again (s), and how closely (m/s, part of the speed).
const AGREE_FOR_S: f64 = 1.0;
const AGREE: (f64, f64) = (0.4, 0.02);

/// What a sensor shows in one period, in the direction of travel.
#[derive(Debug, Clone, Copy)]
pub struct Shown {
    /// Pulses read.
    pub pulses: f64,
    /// Speed of the wheel followed (m/s).
    pub speed: f64,
    /// Speed of the other wheel (m/s), if it is believed.
    pub other: Option<f64>,
    /// Speed of the train (m/s).
    pub train: f64,
    /// Brake or traction can make this wheel turn otherwise than the train moves.
    pub may_differ: bool,
    /// The count cannot be that of a wheel, whatever it does ...
    pub impossible: bool,
    /// ... because no wheel can change its speed so fast.
    pub too_sudden: bool,
}

/// Follows one tachometer.
#[derive(Debug, Clone)]
pub struct SensorWatch {
    excluded: bool,
    doubted: bool,
    last: f64,
    same_for: f64,
    silent_for: f64,
    agreed_for: f64,
}

impl SensorWatch {
    /// A sensor that is believed.
    #[must_use]
    pub const fn new() -> Self {
        Self { excluded: false, doubted: false, last: -1.0, same_for: 0.0, silent_for: 0.0, agreed_for: 0.0 }
    }

    /// It is not believed.
    #[must_use]
    pub fn excluded(&self) -> bool {
        self.excluded
    }

    /// It is not asked for bounds.
    #[must_use]
    pub fn doubted(&self) -> bool {
        self.doubted || self.excluded
    }

    /// It agrees with the other sensor for so long that it is believed.
    pub fn believe(&mut self) {
        self.excluded = false;
        self.doubted = false;
    }

    /// Takes in one period of `t` seconds.
    #[inline]
    pub fn look(&mut self, shown: &Shown, t: f64) {
        let same = shown.pulses == self.last;
        self.same_for = if same { self.same_for + t } else { 0.0 };
        self.last = shown.pulses;
        self.silent_for = if shown.pulses == 0.0 { self.silent_for + t } else { 0.0 };

        let away = |from: f64, (least, part): (f64, f64)| {
            (shown.speed - from).abs() > larger(least, part * larger(from.abs(), shown.speed.abs()))
        };
        let silent = self.silent_for > 0.0;
        let dead =
            silent && shown.train.abs() > DEAD_ABOVE && !shown.may_differ && self.silent_for > DEAD_AFTER_S;
        let other_away = |how| shown.other.is_some_and(|other| away(other, how));
        let stuck = !silent && self.same_for > STUCK_AFTER_S && other_away(DISAGREE);
        let parted = self.same_for > DOUBTED_AFTER_S && other_away(DOUBT);
        self.doubted = !silent && (parted || self.same_for > TOO_STEADY_S);

        let still_silent = silent && shown.train.abs() > DEAD_ABOVE;
        let wrong = shown.impossible || still_silent || stuck || away(shown.train, AGREE);
        if wrong {
            self.agreed_for = 0.0;
        } else if !silent {
            // A silent sensor agrees with a train that stands, dead or not.
            self.agreed_for += t;
        }
        if dead || stuck || shown.impossible || shown.too_sudden {
            self.excluded = true;
            self.agreed_for = 0.0;
        } else if self.agreed_for >= AGREE_FOR_S {
            self.excluded = false;
        }
    }
}

impl Default for SensorWatch {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: f64 = 0.05;

    fn shown(pulses: f64, speed: f64, train: f64) -> Shown {
        Shown {
            pulses,
            speed,
            other: Some(train),
            train,
            may_differ: false,
            impossible: false,
            too_sudden: false,
        }
    }

    #[test]
    fn silence_at_speed_is_a_dead_sensor_unless_the_wheel_may_be_locked() {
        let (mut dead, mut locked) = (SensorWatch::new(), SensorWatch::new());
        for _ in 0..12 {
            dead.look(&shown(0.0, 0.0, 10.0), T);
            locked.look(&Shown { may_differ: true, ..shown(0.0, 0.0, 10.0) }, T);
        }
        assert!(dead.excluded() && !locked.excluded());
    }

    #[test]
    fn a_count_that_stands_still_while_the_other_moves_on_is_stuck() {
        let mut watch = SensorWatch::new();
        for period in 0..40 {
            let train = 10.0 + 0.05 * f64::from(period);
            watch.look(&shown(18.0, 10.0, train), T);
            if period > 8 {
                assert!(watch.doubted(), "period {period}: no longer asked for bounds");
            }
        }
        assert!(watch.excluded());
    }

    #[test]
    fn a_dead_sensor_is_not_believed_because_the_train_stands_and_is_once_it_counts_again() {
        let mut watch = SensorWatch::new();
        watch.look(&Shown { too_sudden: true, ..shown(0.0, 0.0, 10.0) }, T);
        for _ in 0..200 {
            watch.look(&shown(0.0, 0.0, 0.0), T);
        }
        assert!(watch.excluded(), "silent beside a train that stands");
        for period in 0..25 {
            watch.look(&shown(18.0 + f64::from(period % 2), 10.0, 10.0), T);
        }
        assert!(!watch.excluded());
    }
}
