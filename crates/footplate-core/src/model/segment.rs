//! The motion between one command's effect and the next: a change of speed and the run after it.

use super::parameters::{Answers, SHAPES};
use super::priors::SHAPE_ERROR;
use crate::kinematics::{ChangeAt, RampedLag};

/// A command, with the state of the train that receives it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct SpeedCommand {
    /// When the command left the line (s, on the clock of the run).
    pub(crate) sent: f64,
    /// The step before and the step commanded.
    pub(crate) from: u8,
    pub(crate) to: u8,
    /// Whether the train is at rest when it takes effect.
    pub(crate) at_rest: bool,
}

impl SpeedCommand {
    /// Whether the speed of its step is reached from above.
    pub(crate) const fn above(&self) -> bool {
        self.to < self.from
    }

    /// When it takes effect (s).
    pub(crate) fn effect(&self, answers: &Answers<'_>) -> f64 {
        let up = self.to > self.from;
        self.sent + if self.at_rest { answers.start_delay() } else { answers.delay(up) }
    }
}

/// Speed of a train, and set speed of its decoder at the same moment (m/s).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Pace {
    pub(crate) speed: f64,
    pub(crate) set: f64,
}

impl Pace {
    /// Of a train that has been running steadily, or at rest, for long.
    pub(crate) const fn steady(speed: f64) -> Self {
        Self { speed, set: speed }
    }

    /// Multiplied by e to the power `by`.
    pub(crate) fn faster(self, by: f64) -> Self {
        let times = libm::exp(by);
        Self { speed: times * self.speed, set: times * self.set }
    }
}

/// A change of speed that has taken effect, with distance counted from there.
///
/// It begins where the last one was interrupted: the set speed continues from its value, and the train, which lags behind it,
/// catches up. Letters as in [`RampedLag`]: with `u` the set speed and `v` the speed when the change took effect, the distance
/// is `u τ + (u′ − u) R(τ) + (v − u) θ (1 − e^(−τ/θ))`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Segment {
    /// When it took effect (s, on the clock of the run).
    pub(crate) begins: f64,
    pub(crate) from: Pace,
    pub(crate) to: f64,
    shape: RampedLag,
    /// Distance that the law leaves over.
    residual: f64,
    /// By how much the train is ahead of the law early and late in the change (m).
    #[cfg_attr(feature = "serde", serde(default))]
    ahead: [f64; SHAPES],
    braking: Option<Rolling>,
}

/// The end of a stop: without drive, friction brings the train to rest.
///
/// With `A` the speed when the set speed is down, `f` friction and `x` the time since then, `v = A e^(−x/θ) −
/// f θ (1 − e^(−x/θ))`, which is zero at `x = θ ln(1 + A/(f θ))`. Friction shortens the distance by `f θ² ln(1 + A/(f θ))`, less
/// what the lag had left of it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Rolling {
    friction: f64,
    /// Since the stop took effect (s), ...
    begins: f64,
    /// ... and from then to rest.
    lasts: f64,
}

impl Rolling {
    /// By how much friction has reduced speed and distance before the train rests.
    fn taken(&self, at: &ChangeAt, lag: f64) -> (f64, f64) {
        let (time, gone) = at.since_ramp();
        (self.friction * lag * gone, self.friction * lag * (time - lag * gone))
    }

    /// By how much friction reduces the whole distance, with what the lag alone would still have run.
    fn loss(&self, lag: f64) -> f64 {
        self.friction * lag * self.lasts
    }

    fn ends(&self) -> f64 {
        self.begins + self.lasts
    }
}

/// A change counts as done when this share of it is left: the last 3 % of a stop from 0.4 m/s are run at less than 12 mm/s.
const SETTLED: f64 = 0.03;

/// Standard deviation of the speed in the middle of a change, as part of the change: an eased ramp (3τ² − 2τ³) and an even one
/// differ by up to 0.096.
const SHAPE_SPEED_ERROR: f64 = 0.07;

impl Segment {
    /// A train at rest, or running steadily.
    pub(crate) const fn steady(begins: f64, speed: f64) -> Self {
        let from = Pace::steady(speed);
        Self {
            begins,
            from,
            to: speed,
            shape: RampedLag::new(0.0, 0.0),
            residual: 0.0,
            ahead: [0.0; SHAPES],
            braking: None,
        }
    }

    /// A start or a stop by a known law: from one steady speed to another, with friction (m/s²) where it ends at rest.
    pub(crate) fn by_law(begins: f64, speeds: [f64; 2], shape: RampedLag, friction: Option<f64>) -> Self {
        let [from, to] = speeds;
        let from = Pace::steady(from);
        let mut segment =
            Self { begins, from, to, shape, residual: 0.0, ahead: [0.0; SHAPES], braking: None };
        segment.braking = friction.map(|friction| segment.rolling(friction));
        segment
    }

    /// Whether its speed is constant.
    pub(crate) fn is_steady(&self) -> bool {
        self.from == Pace::steady(self.to)
    }

    /// The change that a command causes in a train with a pace at the time of its effect.
    pub(crate) fn of(commanded: &SpeedCommand, answers: &Answers<'_>, from: Pace) -> Self {
        Self::toward(commanded, answers, from, answers.speed(usize::from(commanded.to), commanded.above()))
    }

    /// The same where the steady speed at the step commanded is known to be `to`.
    pub(crate) fn toward(commanded: &SpeedCommand, answers: &Answers<'_>, from: Pace, to: f64) -> Self {
        let change = to - from.set;
        // The steps that the set speed still has to go: an interrupted change has not gone all of its own.
        let steps = f64::from(commanded.to) - answers.step_at(usize::from(commanded.from), from.set);
        let (lag, ramp) = answers.lag_and_ramp(change > 0.0, change, steps);
        let shape = RampedLag::new(ramp, lag);
        // A shape has no negative times; the distance stays linear in the numbers all the same.
        let cut = -change * (lag + 0.5 * ramp - shape.delay());
        let residual = if commanded.to == 0 {
            answers.stop_residual(from.set)
        } else if commanded.at_rest {
            answers.start_residual(to)
        } else {
            0.0
        };
        let begins = commanded.effect(answers);
        let mut segment =
            Self { begins, from, to, shape, residual: residual + cut, ahead: [0.0; SHAPES], braking: None };
        if commanded.to == 0 || commanded.at_rest {
            let displacement = segment.displacement().abs();
            segment.ahead = answers.shape(commanded.to > 0).map(|part| part * displacement);
        }
        if commanded.to == 0 {
            segment.braking = Some(segment.rolling(answers.friction()));
        }
        segment
    }

    /// The end of a stop.
    fn rolling(&self, friction: f64) -> Rolling {
        let (ramp, lag) = (self.shape.ramp(), self.shape.lag());
        let left = self.speed(self.begins + ramp).max(0.0);
        let lasts = lag * libm::log1p(left / (friction * lag));
        Rolling { friction, begins: ramp, lasts }
    }

    /// The remaining part of the initial difference to the set speed.
    fn behind(&self, since: f64) -> f64 {
        // Most changes begin where the one before was complete: the commonest exponential is one that nothing asks for.
        if self.from.speed == self.from.set { 0.0 } else { libm::exp(-since / self.shape.lag()) }
    }

    /// Distance (m) run since it took effect; before that, at the speed before.
    pub(crate) fn distance(&self, time: f64) -> f64 {
        let since = time - self.begins;
        let Pace { speed, set } = self.from;
        if since <= 0.0 {
            return speed * since;
        }
        if let Some(rolling) = self.braking.filter(|rolling| since >= rolling.ends()) {
            return self.distance_of_stop(rolling);
        }
        if self.is_steady() {
            return speed * since;
        }
        let (at, lag) = (self.shape.at(since), self.shape.lag());
        let caught_up = (speed - set) * lag * (1.0 - self.behind(since));
        let taken = self.braking.map_or(0.0, |rolling| rolling.taken(&at, lag).1);
        let done = self.done(&at);
        set * since + (self.to - set) * at.area() + caught_up + self.residual * done + self.ahead_of_law(done)
            - taken
    }

    /// By how much the train is ahead of the law (m) when a share of the change is done: nothing at both ends.
    fn ahead_of_law(&self, done: f64) -> f64 {
        let [early, late] = self.ahead;
        4.0 * done * (1.0 - done) * ((1.0 - done) * early + done * late)
    }

    /// Speed (m/s).
    pub(crate) fn speed(&self, time: f64) -> f64 {
        let since = time - self.begins;
        let Pace { speed, set } = self.from;
        if since <= 0.0 {
            return speed;
        }
        if self.braking.is_some_and(|rolling| since >= rolling.ends()) {
            return 0.0;
        }
        if self.is_steady() {
            return speed;
        }
        let at = self.shape.at(since);
        let taken = self.braking.map_or(0.0, |rolling| rolling.taken(&at, self.shape.lag()).0);
        (set + (self.to - set) * at.share() + (speed - set) * self.behind(since) - taken).max(0.0)
    }

    /// Speed and set speed.
    pub(crate) fn pace(&self, time: f64) -> Pace {
        let set = self.from.set + (self.to - self.from.set) * self.shape.set_share(time - self.begins);
        Pace { speed: self.speed(time), set }
    }

    /// Whether it ends at rest.
    pub(crate) const fn is_stop(&self) -> bool {
        self.braking.is_some()
    }

    /// The share of the change that is done.
    pub(crate) fn share(&self, time: f64) -> f64 {
        let since = time - self.begins;
        if since <= 0.0 {
            return 0.0;
        }
        if self.braking.is_some_and(|rolling| since >= rolling.ends()) {
            return 1.0;
        }
        self.done(&self.shape.at(since))
    }

    /// The same before the train rests. A stop is done at rest, which comes earlier with friction than with the lag alone.
    fn done(&self, at: &ChangeAt) -> f64 {
        let Some(rolling) = self.braking else { return at.share() };
        (at.share() / self.shape.share(rolling.ends())).min(1.0)
    }

    /// When the change is done but for the rest that does not count (s, on the clock of the run).
    pub(crate) fn settled(&self) -> f64 {
        self.begins + self.braking.map_or_else(|| self.shape.settled(SETTLED), |rolling| rolling.ends())
    }

    /// The whole distance of a stop (m).
    pub(crate) fn distance_to_rest(&self) -> f64 {
        self.braking.map_or_else(|| self.displacement(), |rolling| self.distance_of_stop(rolling))
    }

    fn distance_of_stop(&self, rolling: Rolling) -> f64 {
        self.displacement() - rolling.loss(self.shape.lag())
    }

    /// Mean delay (s) of the change against an instantaneous one.
    pub(crate) const fn delay(&self) -> f64 {
        self.shape.delay()
    }

    /// By how much the distance after the change differs from that of an instantaneous change (m).
    pub(crate) fn displacement(&self) -> f64 {
        let Pace { speed, set } = self.from;
        (set - self.to) * self.shape.delay() + (speed - set) * self.shape.lag() + self.residual
    }

    /// One standard deviation of the place within a change (m), because no shape fits all decoders.
    pub(crate) fn shape_error(&self, time: f64) -> f64 {
        let share = self.share(time);
        SHAPE_ERROR * 4.0 * share * (1.0 - share) * self.displacement().abs()
    }

    /// The same for the speed (m/s).
    pub(crate) fn shape_speed_error(&self, time: f64) -> f64 {
        let share = self.share(time);
        SHAPE_SPEED_ERROR * 4.0 * share * (1.0 - share) * (self.to - self.from.speed).abs()
    }
}
