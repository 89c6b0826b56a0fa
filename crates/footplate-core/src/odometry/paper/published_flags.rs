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
        let coherent = together && smooth(first) && smooth(second) && first.read && second.read;
        for ((lost, (sign, wheel)), (suspected, rolling)) in self
            .lost
            .iter_mut()
            .zip(signs.into_iter().zip(wheels))
            .zip(self.suspected.iter_mut().zip(&mut self.rolling))
        {
            *suspected = if sign.is_some() && wheel.read { *suspected + t } else { 0.0 };
            let rolls = match self.reading {
                Reading::Figures => coherent && wheel.speed > SLOWEST_CLEARED,
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
