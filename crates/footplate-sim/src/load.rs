//! Speed factors of a train beyond its table: the run, the day, the rail.

use core::ops::Deref;

use footplate_core::Approach;

use crate::draws::Draws;
use crate::motor::STEP_S;
use crate::train::Train;
use crate::traits::Session;

/// Time constant with which the speed follows a change of the rail (chosen: a coach length at mid speed).
const RAIL_LAG_S: f64 = 0.15;
/// Update interval of the slow influences, wander and warmth (chosen: well below their time constants).
const SLOW_STEP_S: f64 = 0.02;
/// Speed factor while the shoe crosses a dirty spot (chosen; the lag passes little of it).
const DIRTY_FACTOR: f64 = 0.85;
/// Length of a dirty spot (chosen).
pub(crate) const DIRTY_MM: f64 = 15.0;
/// Below this wheel speed a train may stall on a dirty spot (chosen: steps 1 to 4 of steep engines).
const STALL_BELOW_MM_PER_S: f64 = 50.0;
/// Probability of that (chosen).
const STALL_CHANCE: f64 = 0.15;

/// All influences on the speed of a run, as a factor of the wheel speed; `T` is how the train is owned.
#[derive(Debug, Clone)]
pub(crate) struct Load<T> {
    train: T,
    draws: Draws,
    run: f64,
    wander: f64,
    until_slow: f64,
    /// 0 cold, 1 warm.
    warmth: f64,
    /// The factor after the lag.
    factor: f64,
    /// The factors of this session.
    session: Session,
}

impl<T: Deref<Target = Train>> Load<T> {
    /// The influences at the start of a run on a rail with a speed factor.
    pub(crate) fn new(train: T, warmth: f64, rail: f64, mut draws: Draws) -> Self {
        let run = draws.normal(1.0, train.run_deviation.as_parts());
        let wander = draws.normal(0.0, train.wander.as_parts());
        let session = Session::AVERAGE;
        let mut load =
            Self { train, draws, run, wander, until_slow: SLOW_STEP_S, warmth, factor: 1.0, session };
        load.factor = load.goal(rail);
        load
    }

    /// Starts another run from rest on a rail with a speed factor: draws its deviation; wander and warmth continue.
    pub(crate) fn begin_run(&mut self, rail: f64) {
        self.run = self.draws.normal(1.0, self.train.run_deviation.as_parts());
        self.factor = self.goal(rail);
    }

    /// Starts another session with its factors.
    pub(crate) fn begin_session(&mut self, session: Session) {
        self.session = session;
    }

    /// The session's speed factor at a wheel speed (mm/s).
    pub(crate) fn session_factor(&self, wheel: f64) -> f64 {
        let top = self.train.speeds.speed(self.train.speeds.highest(), Approach::Below).as_mm_per_s();
        let part = wheel / top.max(1.0);
        self.session.speed * (1.0 + self.session.top * part * part)
    }

    /// The train was at rest for a while: equal to as many single steps at rest.
    pub(crate) fn stand(&mut self, for_s: f64) {
        self.warmth *= libm::exp(-for_s / self.train.warm_up_time.as_s().max(SLOW_STEP_S));
        let kept = libm::exp(-for_s / self.train.wander_time.as_s().max(SLOW_STEP_S));
        let fresh = self.train.wander.as_parts() * libm::sqrt(1.0 - kept * kept);
        self.wander = kept * self.wander + self.draws.normal(0.0, fresh);
    }

    /// The speed factor of this run.
    pub(crate) fn run(&self) -> f64 {
        self.run
    }

    /// The present speed factor relative to level straight track.
    pub(crate) fn factor(&self) -> f64 {
        self.factor
    }

    /// The present warmth.
    pub(crate) fn warmth(&self) -> f64 {
        self.warmth
    }

    /// The factor after one more integration step, on a rail with a speed factor.
    pub(crate) fn advance(&mut self, rail: f64, is_dirty: bool, moves: bool) -> f64 {
        self.until_slow -= STEP_S;
        if self.until_slow <= 0.0 {
            self.until_slow += SLOW_STEP_S;
            self.warmth = warmth_after(&self.train, self.warmth, moves, SLOW_STEP_S);
            // A first-order autoregression: its spread is independent of the step.
            let kept = 1.0 - SLOW_STEP_S / self.train.wander_time.as_s().max(SLOW_STEP_S);
            let fresh = self.train.wander.as_parts() * libm::sqrt(1.0 - kept * kept);
            self.wander = kept * self.wander + self.draws.normal(0.0, fresh);
        }
        let goal = self.goal(rail) * if is_dirty { DIRTY_FACTOR } else { 1.0 };
        self.factor += (goal - self.factor) * (STEP_S / RAIL_LAG_S);
        self.factor
    }

    /// Draws whether a train at a wheel speed stalls on the dirty spot that it has just reached.
    pub(crate) fn stalls(&mut self, wheel_mm_per_s: f64) -> bool {
        wheel_mm_per_s < STALL_BELOW_MM_PER_S && self.draws.chance(STALL_CHANCE)
    }

    fn goal(&self, rail: f64) -> f64 {
        let rail_factor = 1.0 + self.train.curve_sensitivity * (rail - 1.0);
        let warm = 1.0 - self.train.warm_up.as_parts() * (1.0 - self.warmth);
        self.run * (1.0 + self.wander) * rail_factor * warm
    }
}

/// The warmth some time later, in motion or at rest; for small steps only.
pub(crate) fn warmth_after(train: &Train, warmth: f64, moves: bool, for_s: f64) -> f64 {
    let goal = if moves { 1.0 } else { 0.0 };
    let rate = for_s / train.warm_up_time.as_s().max(for_s);
    warmth + (goal - warmth) * rate
}
