//! Which wheelsets slip or slide by the published rules, in both possible readings.
//!
//! With the speed `v` and acceleration `a` of the train, those of wheelset i, and limits of acceleration `a_min`, `a_max`,
//! of the creepage `λ` and of the difference of both wheelsets `Δv`:
//!
//! - a wheelset slides if it will decelerate beyond `a_min` in the next period or if `(v − vᵢ)/v > λ`; it spins likewise;
//! - if both differ by more than `Δv`, both are flagged.
//!
//! To the letter ([`Reading::Literal`]) the second rule sends every slide of one wheelset into correction, and the corrected
//! speed keeps `λ` above its limit when both wheelsets have long rolled again. The printed figures show neither
//! ([`Reading::Figures`]): the wheelset that meets a criterion of its own is flagged alone, and the correction is left
//! once both accelerate as a train can and differ by less than `Δv` over several samples, whatever `v` has become.

use crate::odometry::wheels::{Axle, Loss, Thresholds, larger};

/// Slower than this no turning wheel is seen to roll again (m/s).
const SLOWEST_CLEARED: f64 = 0.3;

/// How much harder than commanded wheels that roll decelerate (part of it).
const ROLLS_BEYOND: f64 = 1.2;
/// Share of the noise of an acceleration that is left over the samples for which it has to hold.
const SMOOTHED: f64 = 0.1;

/// How the printed rules are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// So that the printed figures come out.
    Figures,
    /// To the letter.
    Literal,
}

/// What one wheelset shows, in the direction of travel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shown {
    /// Speed (m/s).
    pub(super) speed: f64,
    /// Acceleration (m/s²) and its standard deviation.
    pub(super) acceleration: f64,
    pub(super) acceleration_deviation: f64,
    /// Its count was read.
    pub(super) read: bool,
    pub(super) axle: Axle,
}

/// Follows both wheelsets.
#[derive(Debug, Clone)]
pub(super) struct PublishedFlags {
    thresholds: Thresholds,
    reading: Reading,
    lost: [Option<Loss>; 2],
    suspected: [f64; 2],
    rolling: [f64; 2],
    before: [f64; 2],
}

impl PublishedFlags {
    pub(super) const fn new(thresholds: Thresholds, reading: Reading) -> Self {
        let nothing = [0.0; 2];
        Self { thresholds, reading, lost: [None; 2], suspected: nothing, rolling: nothing, before: nothing }
    }

    /// Whether they are read to the letter.
    pub(super) fn is_literal(&self) -> bool {
        self.reading == Reading::Literal
    }

    pub(super) fn lost(&self) -> [Option<Loss>; 2] {
        self.lost
    }

    /// The train is known to stand or to have turned round.
    pub(super) fn clear(&mut self) {
        *self = Self::new(self.thresholds, self.reading);
    }

    /// Takes in `t` seconds more, of a train that runs at `train` (m/s), may slide or slip by its command, and is commanded to
    /// accelerate so (m/s²).
    pub(super) fn judge(
        &mut self,
        wheels: &[Shown; 2],
        train: f64,
        [may_slide, may_slip]: [bool; 2],
        commanded: f64,
        t: f64,
    ) -> [Option<Loss>; 2] {
        let limits = self.thresholds;
        // Wheels that roll again slow down as commanded, and no faster than a speed that is corrected.
        let rolls_by = larger(limits.correction.as_m_per_s2(), ROLLS_BEYOND * -commanded);
        let [first, second] = wheels;
        let [first_lost, second_lost] = self.lost;
        // A wheel that regains its grip accelerates as hard as one that spins.
        let latched = first_lost.or(second_lost).filter(|_| self.reading == Reading::Figures);
        let own = |wheel: &Shown, before: f64| {
            let next = 2.0 * wheel.acceleration - before;
            let noise = 3.0 * wheel.acceleration_deviation;
            let faster = larger(train, wheel.speed);
            let compared = faster > limits.slowest_ratio.as_m_per_s();
            let apart = larger(limits.creepage * faster, limits.creepage_floor.as_m_per_s());
            let slides = next < -limits.slide_deceleration.as_m_per_s2() - noise
                || compared && train - wheel.speed > apart;
            let spins = next > limits.slip_acceleration.as_m_per_s2() + noise
                || compared && wheel.speed - train > apart;
            if may_slide && wheel.axle.may_slide() && latched != Some(Loss::Spin) && slides {
                Some(Loss::Slide)
            } else if may_slip && wheel.axle.may_slip() && latched != Some(Loss::Slide) && spins {
                Some(Loss::Spin)
            } else {
                None
            }
        };
        let [first_before, second_before] = self.before;
        let mut signs = [own(first, first_before), own(second, second_before)];
        self.before = [first.acceleration, second.acceleration];
        let apart = larger(limits.difference.as_m_per_s(), limits.difference_ratio * train);
        let together = (first.speed - second.speed).abs() < apart;
        if !together && first.read && second.read {
            self.by_difference(&mut signs, first.speed < second.speed, may_slide, may_slip);
        }
        let smooth = |wheel: &Shown| {
            let noise = 3.0 * wheel.acceleration_deviation;
            wheel.acceleration > -rolls_by - SMOOTHED * noise
                && wheel.acceleration < limits.slip_acceleration.as_m_per_s2() + noise
        };
        // A wheel beside one that is not read is judged by itself.
        let coherent = wheels.iter().all(|wheel| !wheel.read || smooth(wheel))
            && (together || !(first.read && second.read));
        for ((lost, (sign, wheel)), (suspected, rolling)) in self
            .lost
            .iter_mut()
            .zip(signs.into_iter().zip(wheels))
            .zip(self.suspected.iter_mut().zip(&mut self.rolling))
        {
            *suspected = if sign.is_some() && wheel.read { *suspected + t } else { 0.0 };
            let rolls = match self.reading {
                Reading::Figures => coherent && wheel.read && wheel.speed > SLOWEST_CLEARED,
                Reading::Literal => sign.is_none() && wheel.read,
            };
            *rolling = if rolls { *rolling + t } else { 0.0 };
            let enough = *rolling >= limits.clear_after.as_s() - 0.5 * t;
            match (*lost, sign) {
                // While both roll alike and smoothly, a speed that was carried away flags nothing.
                (None, Some(_)) if self.reading == Reading::Figures && enough => {}
                (None, Some(loss)) if *suspected >= limits.raise_after.as_s() - 0.5 * t => *lost = Some(loss),
                (Some(_), _) if enough => *lost = None,
                _ => {}
            }
        }
        self.lost
    }

    /// Both differ by more than diameters explain.
    fn by_difference(&self, signs: &mut [Option<Loss>; 2], first_slower: bool, slide: bool, slip: bool) {
        let [first, second] = signs;
        match self.reading {
            Reading::Literal => {
                let both = first.or(*second);
                *signs = [both; 2];
            }
            // Which of them it is the command says, unless it is known.
            Reading::Figures if first.is_none() && second.is_none() && self.lost == [None; 2] => {
                if slide {
                    *(if first_slower { first } else { second }) = Some(Loss::Slide);
                } else if slip {
                    *(if first_slower { second } else { first }) = Some(Loss::Spin);
                }
            }
            Reading::Figures => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Acceleration;

    /// A period (s): two of them are `raise_after`, twenty `clear_after`.
    const T: f64 = 0.05;
    const SLIDES: Option<Loss> = Some(Loss::Slide);
    const SPINS: Option<Loss> = Some(Loss::Spin);

    /// Of a train that can do 1.0 m/s² and brake with 1.1: slips beyond 1.4, slides beyond 1.5 m/s².
    fn flags(reading: Reading) -> PublishedFlags {
        let [traction, brake] = [1.0, 1.1].map(Acceleration::from_m_per_s2);
        PublishedFlags::new(Thresholds::derived(traction, brake), reading)
    }

    /// A powered wheelset, whose acceleration is known to 0.1 m/s².
    fn wheel((speed, acceleration): (f64, f64)) -> Shown {
        Shown { speed, acceleration, acceleration_deviation: 0.1, read: true, axle: Axle::Powered }
    }

    /// The flags after so many periods with these speeds and accelerations, at the train's speed.
    fn after(
        flags: &mut PublishedFlags,
        periods: u32,
        wheels: [(f64, f64); 2],
        train: f64,
    ) -> [Option<Loss>; 2] {
        (0..periods).for_each(|_| {
            flags.judge(&wheels.map(wheel), train, [true, true], 0.0, T);
        });
        flags.lost()
    }

    /// The flags of both wheelsets at one speed for two periods.
    fn alike(reading: Reading, speed: f64, train: f64) -> [Option<Loss>; 2] {
        after(&mut flags(reading), 2, [(speed, 0.0); 2], train)
    }

    #[test]
    fn creepage_beyond_8_per_cent_of_the_faster_speed_and_30_cm_per_s_is_a_loss() {
        for reading in [Reading::Figures, Reading::Literal] {
            // 8 % of 20 m/s are 1.6 m/s.
            assert_eq!(alike(reading, 18.41, 20.0), [None; 2]);
            assert_eq!(alike(reading, 18.39, 20.0), [SLIDES; 2]);
            // The wheels are the faster ones: 21.74 less 8 % are 20.
            assert_eq!(alike(reading, 21.73, 20.0), [None; 2]);
            assert_eq!(alike(reading, 21.75, 20.0), [SPINS; 2]);
            // At 2 m/s 0.3 m/s are more than 8 %.
            assert_eq!([alike(reading, 1.71, 2.0), alike(reading, 1.69, 2.0)], [[None; 2], [SLIDES; 2]]);
            assert_eq!([alike(reading, 2.29, 2.0), alike(reading, 2.31, 2.0)], [[None; 2], [SPINS; 2]]);
            // Below 1 m/s speeds are not compared.
            assert_eq!([alike(reading, 0.5, 1.0), alike(reading, 0.5, 1.01)], [[None; 2], [SLIDES; 2]]);
        }
    }

    #[test]
    fn an_acceleration_counts_as_it_will_be_in_the_next_period_and_beyond_its_noise() {
        let flagged = |first: f64, then: f64| {
            let mut flags = flags(Reading::Figures);
            assert_eq!(after(&mut flags, 1, [(20.0, first), (20.0, 0.0)], 20.0), [None; 2], "once is noise");
            after(&mut flags, 1, [(20.0, then), (20.0, 0.0)], 20.0)
        };
        // Three deviations beyond 1.5 m/s²: −1.8. Next would be −1.9, and then 2 · −1.42 + 0.95 = −1.89 or 2 · −1.35 + 0.95 = −1.75.
        assert_eq!([flagged(-0.95, -1.42), flagged(-0.95, -1.35)], [[SLIDES, None], [None; 2]]);
        assert_eq!(flagged(-0.89, -1.42), [None; 2], "first −1.78, then −1.95: only once");
        // Three deviations beyond 1.4 m/s²: 1.7. Then 2 · 1.32 − 0.9 = 1.74 or 2 · 1.28 − 0.9 = 1.66.
        assert_eq!([flagged(0.9, 1.32), flagged(0.9, 1.28)], [[SPINS, None], [None; 2]]);
    }

    #[test]
    fn what_command_axle_or_sensor_exclude_is_not_flagged() {
        let two = |wheel: Shown, may: [bool; 2]| {
            let mut flags = flags(Reading::Figures);
            flags.judge(&[wheel; 2], 20.0, may, 0.0, T);
            flags.judge(&[wheel; 2], 20.0, may, 0.0, T)
        };
        let (slow, fast) = (wheel((18.0, 0.0)), wheel((22.0, 0.0)));
        assert_eq!([two(slow, [true, false]), two(slow, [false, true])], [[SLIDES; 2], [None; 2]]);
        assert_eq!([two(fast, [false, true]), two(fast, [true, false])], [[SPINS; 2], [None; 2]]);
        assert_eq!(two(Shown { axle: Axle::Unbraked, ..slow }, [true; 2]), [None; 2]);
        assert_eq!(two(Shown { axle: Axle::Trailing, ..fast }, [true; 2]), [None; 2]);
        assert_eq!(two(Shown { read: false, ..slow }, [true; 2]), [None; 2]);
    }

    #[test]
    fn wheels_that_differ_by_more_than_their_limit_are_flagged_by_either_reading() {
        // 2.5 % of 60 m/s are 1.5 m/s, and far less than 8 %.
        let mut figures = flags(Reading::Figures);
        assert_eq!(after(&mut figures, 2, [(58.6, 0.0), (60.0, 0.0)], 60.0), [None; 2]);
        assert_eq!(after(&mut figures, 2, [(58.4, 0.0), (60.0, 0.0)], 60.0), [SLIDES, None]);
        assert_eq!(after(&mut flags(Reading::Figures), 2, [(60.0, 0.0), (58.4, 0.0)], 60.0), [None, SLIDES]);
        // At 10 m/s the least limit, 1 m/s, counts, and is more than 8 %; with a command to pull the faster one spins.
        let pulled = |faster: f64| {
            let mut flags = flags(Reading::Figures);
            let wheels = [(10.0, 0.0), (faster, 0.0)].map(wheel);
            flags.judge(&wheels, 10.5, [false, true], 0.0, T);
            flags.judge(&wheels, 10.5, [false, true], 0.0, T)
        };
        assert_eq!([pulled(10.99), pulled(11.01)], [[None; 2], [None, SPINS]]);
        // To the letter, the loss of one is that of both, and none of either is none.
        assert_eq!(after(&mut flags(Reading::Literal), 2, [(18.3, 0.0), (20.0, 0.0)], 20.0), [SLIDES; 2]);
        assert_eq!(after(&mut flags(Reading::Literal), 2, [(58.4, 0.0), (60.0, 0.0)], 60.0), [None; 2]);
        // In the figures it is flagged alone.
        assert_eq!(after(&mut flags(Reading::Figures), 2, [(18.3, 0.0), (20.0, 0.0)], 20.0), [SLIDES, None]);
    }

    /// Whether a slide of both is over after so many periods with these speeds and accelerations, at 20 m/s.
    fn cleared(reading: Reading, periods: u32, wheels: [(f64, f64); 2], commanded: f64) -> bool {
        let mut flags = flags(reading);
        assert_eq!(after(&mut flags, 2, [(18.0, -1.0); 2], 20.0), [SLIDES; 2]);
        (0..periods).for_each(|_| {
            flags.judge(&wheels.map(wheel), 20.0, [true, true], commanded, T);
        });
        flags.lost() == [None; 2]
    }

    #[test]
    fn by_the_figures_a_slide_ends_after_a_second_of_wheels_that_roll_smoothly_and_alike() {
        let figures = |wheels, commanded| cleared(Reading::Figures, 20, wheels, commanded);
        let alike = [(18.0, -0.5); 2];
        assert!(!cleared(Reading::Figures, 19, alike, 0.0) && figures(alike, 0.0));
        assert!(cleared(Reading::Figures, 60, alike, 0.0), "a speed that was carried away flags nothing");
        assert!(!figures([(18.0, -0.5), (16.9, -0.5)], 0.0), "1.1 m/s are apart");
        assert!(figures([(18.0, -0.5), (17.1, -0.5)], 0.0));
        // As fast as the corrected speed falls, 0.6 m/s², or 1.2 of what is commanded, and 0.03 for noise.
        assert!(figures([(18.0, -0.62); 2], 0.0) && !figures([(18.0, -0.5), (18.0, -0.64)], 0.0));
        assert!(figures([(18.0, -0.74); 2], -0.6) && !figures([(18.0, -0.76), (18.0, -0.5)], -0.6));
        assert!(figures([(18.0, 1.69); 2], 0.0) && !figures([(18.0, 1.71), (18.0, 0.0)], 0.0));
        assert!(figures([(0.31, 0.0); 2], 0.0) && !figures([(0.29, 0.0); 2], 0.0), "nearly locked");
    }

    #[test]
    fn to_the_letter_a_slide_ends_after_a_second_without_a_sign_of_it() {
        let literal = |periods, speed| cleared(Reading::Literal, periods, [(speed, 0.0); 2], 0.0);
        assert!(!literal(19, 18.5) && literal(20, 18.5));
        assert!(!literal(60, 18.3), "as long as the speed is carried away");
    }

    #[test]
    fn a_wheel_that_regains_its_grip_is_not_taken_for_one_that_spins() {
        let mut figures = flags(Reading::Figures);
        assert_eq!(after(&mut figures, 2, [(18.0, 0.0), (20.0, 0.0)], 20.0), [SLIDES, None]);
        assert_eq!(after(&mut figures, 2, [(18.5, 4.0), (20.0, 4.0)], 20.0), [SLIDES, None]);
        figures.clear();
        assert_eq!(figures.lost(), [None; 2]);
        assert_eq!(after(&mut figures, 2, [(20.0, 4.0), (20.0, 0.0)], 20.0), [SPINS, None]);
    }
}
