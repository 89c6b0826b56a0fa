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

/// The longest lag (s) that is an eased change: the middle of a window or a start at rate zero of 0.9 s. A longer one is the motor's.
const EASED_LAG: f64 = 0.45;

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

    /// By how much later (s) this change is for each second by which the one was late that it interrupts at a time. A change that
    /// hardly changes the speed has no time of its own: at most as late.
    pub(crate) fn later_by(&self, before: &Self, time: f64) -> f64 {
        let set_slope = |of: &Self| (of.to - of.from.set) / of.shape.ramp();
        let is_set = time - before.begins >= before.shape.ramp();
        let (was, is) = (if is_set { 0.0 } else { set_slope(before) }, set_slope(self));
        let ratio = if was == 0.0 || is == 0.0 {
            let Pace { speed, set } = before.pace(time);
            let delay = self.shape.delay();
            (set - speed) / before.shape.lag() * delay / (self.speed(self.begins + delay) - speed)
        } else {
            was / is
        };
        if ratio.is_finite() { ratio.clamp(-1.0, 1.0) } else { 0.0 }
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

    /// When a change that is eased is done (s, on the clock of the run). A decoder that eases in begins at rate zero again with
    /// each command: commanded to go down step by step before that, it hardly slows down at all.
    pub(crate) fn shown(&self) -> f64 {
        self.begins + self.shape.ramp() + 2.0 * self.shape.lag().min(EASED_LAG)
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

#[cfg(test)]
mod tests {
    use super::*;

    const TIME: f64 = 1e-3;

    /// Speed and distance by Runge and Kutta's method: the set speed goes to `to` evenly within the ramp, the speed follows it with
    /// a lag, and after the ramp friction acts on a stop. At rest it stays there; gives when.
    fn integrated(segment: &Segment, until: f64) -> (f64, f64, f64) {
        let (ramp, lag) = (segment.shape.ramp(), segment.shape.lag());
        let Pace { speed, set } = segment.from;
        let slope = |time: f64, speed: f64| {
            let set = set + (segment.to - set) * (time / ramp).min(1.0);
            let friction = segment.braking.filter(|_| time >= ramp).map_or(0.0, |braking| braking.friction);
            (set - speed) / lag - friction
        };
        let (mut speed, mut distance, mut rest) = (speed, 0.0, f64::INFINITY);
        for nth in 0..(until / TIME).round() as u32 {
            let time = (f64::from(nth) + 1e-9) * TIME;
            let half = time + 0.5 * TIME;
            let one = slope(time, speed);
            let two = slope(half, speed + 0.5 * TIME * one);
            let three = slope(half, speed + 0.5 * TIME * two);
            let four = slope(time + TIME - 2e-9 * TIME, speed + TIME * three);
            let next = speed + TIME / 6.0 * (one + 2.0 * two + 2.0 * three + four);
            if segment.is_stop() && next <= 0.0 {
                rest = rest.min(time);
                return (0.0, distance, rest);
            }
            distance += 0.5 * TIME * (speed + next) + TIME * TIME / 12.0 * (one - four);
            speed = next;
        }
        (speed, distance, rest)
    }

    fn assert_near(found: f64, expected: f64, within: f64) {
        assert!((found - expected).abs() < within, "{found} {expected}");
    }

    /// From 0.3 m/s, with the set speed at 0.35, to 0.6 m/s.
    fn interrupted() -> Segment {
        let mut segment = Segment::by_law(2.0, [0.35, 0.6], RampedLag::new(1.2, 0.5), None);
        segment.from.speed = 0.3;
        segment
    }

    fn stop() -> Segment {
        Segment::by_law(2.0, [0.5, 0.0], RampedLag::new(1.0, 0.4), Some(0.05))
    }

    #[test]
    fn a_change_is_the_solution_of_its_differential_equation() {
        for segment in [interrupted(), stop()] {
            for since in [0.3, 0.9, 1.0, 1.2, 1.5, 2.0, 6.0] {
                let (speed, distance, _) = integrated(&segment, since);
                assert_near(segment.speed(2.0 + since), speed, 1e-5);
                assert_near(segment.distance(2.0 + since), distance, 1e-5);
            }
            // Before its effect it runs as before.
            let speed = segment.from.speed;
            assert_near(segment.distance(1.0), -speed, 1e-12);
            assert_eq!(segment.speed(2.0), speed);
            assert_eq!(segment.share(2.0), 0.0);
        }
    }

    #[test]
    fn a_stop_rests_where_and_when_friction_says() {
        let stop = stop();
        let (_, distance, rest) = integrated(&stop, 10.0);
        assert_near(stop.settled() - 2.0, rest, 2.0 * TIME);
        assert_near(stop.distance_to_rest(), distance, 1e-5);
        assert_near(stop.distance(60.0), distance, 1e-5);
        let after = stop.settled() + 1e-9;
        assert_eq!((stop.speed(after), stop.share(after), stop.speed(60.0)), (0.0, 1.0, 0.0));
        assert!(stop.speed(after - 0.01) > 0.0);
        // Without friction it would run 0.5 (0.4 + 1.0/2) m: the delay at the speed before.
        assert_near(stop.displacement(), 0.45, 1e-12);
        assert!(stop.is_stop() && !interrupted().is_stop());
    }

    #[test]
    fn the_set_speed_goes_evenly() {
        let change = interrupted();
        for (since, set) in [(-1.0, 0.35), (0.6, 0.475), (1.2, 0.6), (3.0, 0.6)] {
            assert_near(change.pace(2.0 + since).set, set, 1e-12);
            assert_eq!(change.pace(2.0 + since).speed, change.speed(2.0 + since));
        }
    }

    #[test]
    fn long_after_a_change_the_distance_differs_by_its_displacement() {
        let mut change = interrupted();
        assert_near(change.distance(42.0) - 0.6 * 40.0, change.displacement(), 1e-9);
        // (0.35 − 0.6) (0.5 + 0.6) for the delay, and (0.3 − 0.35) 0.5 for catching up.
        assert_near(change.displacement(), -0.275 - 0.025, 1e-12);
        assert_near(change.delay(), 1.1, 1e-12);
        // What the law leaves over comes with the share that is done, all of it in the end.
        change.residual = 0.02;
        let law = interrupted();
        for time in [2.5, 3.5, 42.0] {
            assert_near(change.distance(time) - law.distance(time), 0.02 * law.share(time), 1e-12);
        }
        assert_near(change.distance_to_rest(), -0.28, 1e-12);
        assert_near(law.share(42.0), 1.0, 1e-12);
    }

    #[test]
    fn the_share_of_a_change_is_that_of_its_speed() {
        // Of a change from a steady speed the share is that of the speed.
        let change = Segment::by_law(2.0, [0.35, 0.6], RampedLag::new(1.2, 0.5), None);
        for time in [2.6, 3.2, 4.0] {
            let (speed, ..) = integrated(&change, time - 2.0);
            assert_near(change.share(time), (speed - 0.35) / 0.25, 1e-4);
        }
        // It is settled when the lag has left 3 % of what was missing at the end of the ramp: θ/T (1 − e^(−T/θ)).
        let missing = 0.5 / 1.2 * (1.0 - (-2.4_f64).exp());
        assert_near(change.share(change.settled()), 1.0 - 0.03 * missing, 1e-9);
        // A stop is done at rest, with a share as without friction over that at rest.
        let stop = stop();
        let free = Segment::by_law(2.0, [0.5, 0.0], RampedLag::new(1.0, 0.4), None);
        let at_rest = (0.5 - integrated(&free, stop.settled() - 2.0).0) / 0.5;
        let at_3 = (0.5 - integrated(&free, 1.0).0) / 0.5;
        assert_near(stop.share(3.0), at_3 / at_rest, 1e-3);
    }

    #[test]
    fn a_train_is_ahead_of_its_law_only_within_the_change() {
        let mut change = interrupted();
        change.ahead = [0.03, 0.01];
        let law = interrupted();
        // 4 s (1 − s) ((1 − s) early + s late).
        for time in [2.4, 3.0, 4.0, 60.0] {
            let done = law.share(time);
            let ahead = 4.0 * done * (1.0 - done) * (0.03 - 0.02 * done);
            assert_near(change.distance(time) - law.distance(time), ahead, 1e-12);
        }
        assert_near(change.ahead_of_law(0.5), 0.02, 1e-12);
        assert_eq!((change.ahead_of_law(0.0), change.ahead_of_law(1.0)), (0.0, 0.0));
    }

    #[test]
    fn the_error_of_a_shape_is_largest_in_the_middle() {
        let change = interrupted();
        let half = (0..6000).map(|nth| 2.0 + 1e-3 * f64::from(nth)).find(|time| change.share(*time) >= 0.5);
        let half = half.expect("it is done in the end");
        // 0.04 of the displacement, 0.3 m; 0.07 of the change, 0.3 m/s.
        assert_near(change.shape_error(half), 0.04 * 0.3, 1e-5);
        assert_near(change.shape_speed_error(half), 0.07 * 0.3, 1e-5);
        let quarter =
            (0..6000).map(|nth| 2.0 + 1e-3 * f64::from(nth)).find(|time| change.share(*time) >= 0.25);
        let quarter = quarter.expect("it is done in the end");
        assert_near(change.shape_error(quarter), 0.75 * 0.04 * 0.3, 2e-5);
        assert_near(change.shape_speed_error(quarter), 0.75 * 0.07 * 0.3, 4e-5);
        assert_eq!((change.shape_error(1.0), change.shape_speed_error(1.0)), (0.0, 0.0));
    }

    #[test]
    fn a_steady_train_runs_steadily() {
        let steady = Segment::steady(3.0, 0.25);
        assert!(steady.is_steady() && !interrupted().is_steady());
        assert_near(steady.distance(1.0), -0.5, 1e-12);
        assert_near(steady.distance(5.0), 0.5, 1e-12);
        assert_eq!((steady.speed(1.0), steady.speed(9.0), steady.displacement()), (0.25, 0.25, 0.0));
        let faster = Pace { speed: 0.2, set: 0.3 }.faster(core::f64::consts::LN_2);
        assert_near(faster.speed, 0.4, 1e-12);
        assert_near(faster.set, 0.6, 1e-12);
    }
}
