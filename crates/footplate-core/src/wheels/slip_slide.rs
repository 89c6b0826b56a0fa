//! Which wheelsets slip or slide.
//!
//! A wheelset is judged against what the *train* can do, not against the speed fused, which it may have pulled along
//! itself. Four signs, from the surest to the weakest:
//!
//! - **proof**: its counts cannot be those of a wheel that rolls, because the train cannot have become so slow (or so
//!   fast) since it was last known;
//! - **acceleration**: in the next period it will change its speed faster than the train can, `a + jT` beyond the limit;
//! - **creepage**: it turns slower or faster than the train is predicted to by more than a part of the speed;
//! - **difference**: the two wheelsets differ by more than diameters explain; which of them is at fault is a
//!   [`BothAxles`] policy.
//!
//! Proof is believed at once, the others after [`raise_after`](super::Thresholds::raise_after). While one slides none is
//! said to spin, and the other way round: a wheel that regains its grip accelerates as hard as one that spins.

use super::range::{Range, larger};
use super::thresholds::Thresholds;
use super::wheelset::Axle;

/// Slowest speed at which a wheelset that slid can be seen to roll (m/s).
const SLOWEST_CLEARED: f64 = 0.3;
/// How far below the corrected speed a wheelset that rolls again may seem (m/s). From above, never from below: the
/// corrected speed may have drifted down to the wheel.
const CLEARED_BELOW: f64 = 0.1;
/// How much slower than the faster wheelset one that rolls again may be, as part of the speed.
const CLEARED_APART: f64 = 0.02;
/// How far its acceleration may be from the train's (m/s²).
const CLEARED_ACCELERATION: f64 = 0.8;

/// What is done when the wheelsets differ and nothing else tells which one is at fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BothAxles {
    /// As printed: if one is flagged and they differ, both are.
    Literal,
    /// The slower one while braking, the faster one while motoring, both if neither is known.
    OnlyIfUndetermined,
    /// Both, whenever they differ.
    AlwaysBoth,
}

/// What a wheelset was seen to do other than roll.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Loss {
    /// Traction turns it faster than the train moves.
    Spin,
    /// The brake holds it back.
    Slide,
}

/// What one wheelset shows, in the direction of travel.
#[derive(Debug, Clone, Copy)]
pub struct Signs {
    /// Speed (m/s).
    pub speed: f64,
    /// Acceleration (m/s²).
    pub acceleration: f64,
    /// Between which speeds its counts put it (m/s).
    pub range: Range,
    /// Standard deviation of the acceleration (m/s²).
    pub acceleration_deviation: f64,
    /// Its sample is one that was read.
    pub read: bool,
    /// What can make it slip or slide.
    pub axle: Axle,
}

/// What the train is doing, in the direction of travel.
#[derive(Debug, Clone, Copy)]
pub struct TrainSigns {
    /// Speed predicted before this period's counts (m/s).
    pub speed: f64,
    /// Acceleration (m/s²).
    pub acceleration: f64,
    /// Between which speeds it must be whatever the wheels say (m/s).
    pub possible: Range,
    /// Slides are possible.
    pub slide: bool,
    /// Slips are possible.
    pub slip: bool,
}

/// Follows both wheelsets.
#[derive(Debug, Clone)]
pub struct SlipSlide {
    thresholds: Thresholds,
    policy: BothAxles,
    latch: bool,
    lost: [Option<Loss>; 2],
    suspected: [f64; 2],
    rolling: [f64; 2],
    before: [f64; 2],
}

impl SlipSlide {
    /// Two wheelsets that roll.
    #[must_use]
    pub const fn new(thresholds: Thresholds, policy: BothAxles, latch: bool) -> Self {
        Self {
            thresholds,
            policy,
            latch,
            lost: [None; 2],
            suspected: [0.0; 2],
            rolling: [0.0; 2],
            before: [0.0; 2],
        }
    }

    /// What the wheelsets do now.
    #[must_use]
    pub fn lost(&self) -> [Option<Loss>; 2] {
        self.lost
    }

    /// Takes in `t` seconds more of signs.
    pub fn judge(&mut self, wheels: &[Signs; 2], train: &TrainSigns, t: f64) -> [Option<Loss>; 2] {
        for lost in &mut self.lost {
            // A wheel that nothing holds back or drives any more turns with the train.
            *lost = lost.filter(|loss| match loss {
                Loss::Slide => train.slide,
                Loss::Spin => train.slip,
            });
        }
        let latched = if self.latch { self.latched() } else { None };
        let [first, second] = wheels;
        let [first_before, second_before] = self.before;
        let own =
            [self.own(first, first_before, train, latched), self.own(second, second_before, train, latched)];
        let by_difference = self.by_difference(wheels, train, latched, [own[0].is_some(), own[1].is_some()]);
        self.before = [first.acceleration, second.acceleration];
        let [first_own, second_own] = own;
        if self.lost == [None; 2] && first_own.or(second_own).is_none() && by_difference == [None; 2] {
            // Both roll, and nothing speaks against it: almost every period of almost every run.
            self.suspected = [0.0; 2];
            return self.lost;
        }
        let fastest = larger(first.speed, second.speed);
        for (((lost, wheel), sign), timers) in self
            .lost
            .iter_mut()
            .zip(wheels)
            .zip(own.into_iter().zip(by_difference))
            .zip(self.suspected.iter_mut().zip(&mut self.rolling))
        {
            let (own, by_difference) = sign;
            let (suspected, rolling) = timers;
            let proven = own.is_some_and(|sign| sign.proven);
            let sign = own.map(|sign| sign.loss).or(by_difference);
            *suspected = if sign.is_some() && wheel.read { *suspected + t } else { 0.0 };
            let raised = proven || *suspected >= self.thresholds.raise_after.as_s() - 0.5 * t;
            match (*lost, sign) {
                (None, Some(loss)) if raised => {
                    *lost = Some(loss);
                    *rolling = 0.0;
                }
                (Some(loss), _) => {
                    let rolls = sign.is_none() && rolls_again(wheel, train, fastest, loss);
                    *rolling = if rolls { *rolling + t } else { 0.0 };
                    if *rolling >= self.thresholds.clear_after.as_s() - 0.5 * t {
                        *lost = None;
                        *suspected = 0.0;
                    }
                }
                _ => {}
            }
        }
        self.lost
    }

    /// The wheelsets are known to roll: the train stands or has been set anew.
    pub fn clear(&mut self) {
        self.lost = [None; 2];
        self.suspected = [0.0; 2];
        self.rolling = [0.0; 2];
    }

    fn latched(&self) -> Option<Loss> {
        let [first, second] = self.lost;
        first.or(second)
    }

    /// What a wheelset shows by itself.
    fn own(&self, wheel: &Signs, before: f64, train: &TrainSigns, latched: Option<Loss>) -> Option<Sign> {
        if !wheel.read {
            return None;
        }
        let limits = &self.thresholds;
        let next = 2.0 * wheel.acceleration - before;
        // Twice the acceleration less the one before: the noise of one, doubled, at three standard deviations.
        let noise = 3.0 * wheel.acceleration_deviation;
        let faster = larger(train.speed, wheel.speed);
        let apart = larger(limits.creepage * faster, limits.creepage_floor.as_m_per_s());
        let compared = faster > limits.slowest_ratio.as_m_per_s();
        if train.slide && wheel.axle.may_slide() && latched != Some(Loss::Spin) {
            let proven = wheel.range.high < train.possible.low;
            let dives = next < -limits.slide_deceleration.as_m_per_s2() - noise;
            let behind = compared && train.speed - wheel.speed > apart;
            if proven || dives || behind {
                return Some(Sign { loss: Loss::Slide, proven });
            }
        }
        if train.slip && wheel.axle.may_slip() && latched != Some(Loss::Slide) {
            let proven = wheel.range.low > train.possible.high;
            let leaps = next > limits.slip_acceleration.as_m_per_s2() + noise;
            let ahead = compared && wheel.speed - train.speed > apart;
            if proven || leaps || ahead {
                return Some(Sign { loss: Loss::Spin, proven });
            }
        }
        None
    }

    /// What the difference between the wheelsets shows.
    fn by_difference(
        &self,
        [first, second]: &[Signs; 2],
        train: &TrainSigns,
        latched: Option<Loss>,
        own: [bool; 2],
    ) -> [Option<Loss>; 2] {
        let limits = &self.thresholds;
        let apart = larger(limits.difference.as_m_per_s(), limits.difference_ratio * train.speed);
        let difference = first.speed - second.speed;
        let [first_own, second_own] = own;
        let nothing = [None, None];
        // A wheel that regains its grip overshoots; beside it the other one only seems to slide.
        let regaining = self.policy == BothAxles::OnlyIfUndetermined && self.lost != [None; 2];
        if regaining || !(first.read && second.read) || difference.abs() <= apart {
            return nothing;
        }
        let loss = match (train.slide, train.slip, latched) {
            (_, _, Some(loss)) => loss,
            (true, _, None) => Loss::Slide,
            (false, true, None) => Loss::Spin,
            (false, false, None) => return nothing,
        };
        match self.policy {
            BothAxles::AlwaysBoth => [Some(loss); 2],
            BothAxles::Literal => {
                if first_own || second_own {
                    [Some(loss); 2]
                } else {
                    nothing
                }
            }
            BothAxles::OnlyIfUndetermined if first_own || second_own => nothing,
            BothAxles::OnlyIfUndetermined => {
                let first_slower = difference < 0.0;
                let at_fault = |slower: bool, axle: Axle| match loss {
                    Loss::Slide => slower && axle.may_slide(),
                    Loss::Spin => !slower && axle.may_slip(),
                };
                [
                    at_fault(first_slower, first.axle).then_some(loss),
                    at_fault(!first_slower, second.axle).then_some(loss),
                ]
            }
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Sign {
    loss: Loss,
    proven: bool,
}

/// Whether a wheelset that slipped or slid rolls with the train now.
fn rolls_again(wheel: &Signs, train: &TrainSigns, fastest: f64, loss: Loss) -> bool {
    if !wheel.read || wheel.speed < SLOWEST_CLEARED {
        return false;
    }
    match loss {
        Loss::Slide => {
            wheel.speed >= train.speed - CLEARED_BELOW
                && wheel.speed >= fastest * (1.0 - CLEARED_APART)
                && (wheel.acceleration - train.acceleration.min(0.0)).abs() < CLEARED_ACCELERATION
        }
        Loss::Spin => {
            wheel.speed <= train.speed * (1.0 + CLEARED_APART) + CLEARED_BELOW
                && (wheel.acceleration - train.acceleration.max(0.0)).abs() < CLEARED_ACCELERATION
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Acceleration;

    const T: f64 = 0.05;

    fn thresholds() -> Thresholds {
        Thresholds::derived(Acceleration::from_m_per_s2(1.2), Acceleration::from_m_per_s2(1.4))
    }

    fn wheel(speed: f64, axle: Axle) -> Signs {
        let range = Range { low: speed - 0.2, high: speed + 0.2 };
        Signs { speed, acceleration: 0.0, range, acceleration_deviation: 0.5, read: true, axle }
    }

    fn train(speed: f64, slide: bool, slip: bool) -> TrainSigns {
        let possible = Range { low: speed - 0.3, high: speed + 0.3 };
        TrainSigns { speed, acceleration: 0.0, possible, slide, slip }
    }

    fn after(policy: BothAxles, speeds: [f64; 2], train: TrainSigns, periods: usize) -> [Option<Loss>; 2] {
        let mut slips = SlipSlide::new(thresholds(), policy, true);
        let wheels = [wheel(speeds[0], Axle::Powered), wheel(speeds[1], Axle::Trailing)];
        for _ in 0..periods {
            slips.judge(&wheels, &train, T);
        }
        slips.lost()
    }

    #[test]
    fn what_the_train_cannot_do_is_proof_at_once() {
        // 0.6 m/s slower than the train can be, and less than 8 % creepage.
        let lost = after(BothAxles::OnlyIfUndetermined, [19.4, 20.0], train(20.0, true, false), 1);
        assert_eq!(lost, [Some(Loss::Slide), None]);
    }

    #[test]
    fn a_trailing_wheelset_cannot_spin_and_none_slides_without_a_brake() {
        let spinning = train(20.0, false, true);
        assert_eq!(after(BothAxles::OnlyIfUndetermined, [22.0, 22.0], spinning, 5), [Some(Loss::Spin), None]);
        let coasting = train(20.0, false, false);
        assert_eq!(after(BothAxles::OnlyIfUndetermined, [15.0, 20.0], coasting, 5), [None, None]);
    }

    #[test]
    fn as_printed_the_difference_condemns_both() {
        let braking = train(20.0, true, false);
        assert_eq!(after(BothAxles::Literal, [16.0, 20.0], braking, 5), [Some(Loss::Slide); 2]);
        assert_eq!(after(BothAxles::OnlyIfUndetermined, [16.0, 20.0], braking, 5), [Some(Loss::Slide), None]);
        assert_eq!(after(BothAxles::AlwaysBoth, [18.9, 20.0], braking, 5), [Some(Loss::Slide); 2]);
    }

    #[test]
    fn a_wheel_that_regains_its_grip_is_not_said_to_spin() {
        let mut slips = SlipSlide::new(thresholds(), BothAxles::OnlyIfUndetermined, true);
        let both = train(20.0, true, true);
        for _ in 0..3 {
            slips.judge(&[wheel(10.0, Axle::Powered), wheel(20.0, Axle::Trailing)], &both, T);
        }
        let regained = Signs { acceleration: 20.0, ..wheel(22.0, Axle::Powered) };
        let lost = slips.judge(&[regained, wheel(20.0, Axle::Trailing)], &both, T);
        assert_eq!(lost, [Some(Loss::Slide), None], "latched");
        for _ in 0..25 {
            slips.judge(&[wheel(20.0, Axle::Powered), wheel(20.0, Axle::Trailing)], &both, T);
        }
        assert_eq!(slips.lost(), [None, None], "cleared after a second of rolling");
    }

    #[test]
    fn zeros_never_clear_a_slide() {
        let mut slips = SlipSlide::new(thresholds(), BothAxles::OnlyIfUndetermined, true);
        let standing = [wheel(0.0, Axle::Powered), wheel(0.0, Axle::Trailing)];
        for period in 0..400 {
            // The train slows down to a stop under locked wheels.
            let speed = (10.0 - 0.05 * f64::from(period)).max(0.0);
            slips.judge(&standing, &train(speed, true, false), T);
        }
        assert_eq!(slips.lost(), [Some(Loss::Slide); 2]);
    }
}
