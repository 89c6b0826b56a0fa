//! A decoder and its motor, integrated in steps of one millisecond.
//!
//! After its dead time, a command moves the decoder's *set speed* by the law; the motor follows the set speed with a
//! lag. At step 0 nothing drives the motor, and friction brings the wheels to rest in finite time; at any other step,
//! load control compensates for friction. From rest, the wheels stick until the set speed exceeds the breakaway speed
//! of this start: low steps may never start the train.
//!
//! Speeds in mm/s, times in s; the influence of the track is added in [`load`](crate::load).

use core::ops::Deref;
use std::collections::VecDeque;

use footplate_core::{Acceleration, Approach, Speed, SpeedStep, TimeSpan};

use crate::draws::Draws;
use crate::law::{Law, counts_per_step};
use crate::train::Train;
use crate::traits::Session;

/// The step of the integration. The shortest time constant of a drawn train is forty times longer.
pub(crate) const STEP_S: f64 = 1e-3;

/// Lag of a motor with load control behind a smooth set speed (chosen: below half a poll).
const RAMPED_MOTOR_LAG_S: f64 = 0.04;
/// Lag of a motor behind a counter that moves in jumps (chosen: jumps of 5 mm/s do not show at the rail).
const COUNTED_MOTOR_LAG_S: f64 = 0.12;
/// Time in which the difference between the two speeds of a step is taken up (chosen; only counters show it).
const PLAY_S: f64 = 1.0;
/// Relative standard deviation of the breakaway speed from start to start (chosen).
const START_SD: f64 = 0.3;
/// Relative standard deviation of the dead time from start to start (chosen).
const DEAD_TIME_SD: f64 = 0.1;
/// Below this speed without drive, the wheels are at rest (chosen: 1 mm in 20 s).
const REST_MM_PER_S: f64 = 0.05;
/// The range of the factor on the duration of a stop (chosen: beyond ten standard deviations).
const STRETCH: core::ops::RangeInclusive<f64> = 0.75..=1.25;
/// Relative stretch of the trial stop that measures the effect of stretching (chosen: small, far above rounding).
const TRIAL_STRETCH: f64 = 0.01;
/// Samples in the longest moving average (chosen: ten seconds of them).
const MAX_SAMPLES: f64 = 10_000.0;
/// Smallest friction of a train that rolls downhill without drive, relative to the level (chosen: worm gears).
const MIN_FRICTION: f64 = 0.3;
/// Longest stop (chosen: ten times the longest measured).
const MAX_STOP_S: f64 = 60.0;

/// The state of the decoder, one form for each law.
#[derive(Debug, Clone)]
enum Process {
    /// A constant rate.
    Ramp { up: f64, down: f64 },
    /// A rate that is a parabola over the change.
    Eased { up: f64, down: f64, shortest: f64, change: f64, lasts: f64, elapsed: f64 },
    /// A ramp through a moving average.
    Averaged { up: f64, down: f64, ramp: f64, window: VecDeque<f64>, sum: f64, level: usize },
    /// A jump; the motor does the rest.
    Direct,
    /// Counts through internal steps; `play` is 0 at speeds reached from below, 1 from above.
    Counted { up_s: f64, down_s: f64, count: u16, until_next: f64, play: f64 },
    /// A ramp upwards, a jump downwards.
    RampUp { up: f64 },
    /// An unusual law; `phase` is the time in s since its last jump.
    Other { phase: f64 },
}

/// A decoder and its motor in operation; `T` is how its train is owned.
#[derive(Debug, Clone)]
pub(crate) struct Motor<T> {
    train: T,
    process: Process,
    step: SpeedStep,
    approach: Approach,
    /// The steady speed of the step, approached from its side.
    target: f64,
    /// The speed that the decoder demands of the motor.
    set_speed: f64,
    /// The wheel speed on level straight track.
    wheel_speed: f64,
    /// A received command, and the rest of its dead time in s.
    pending: Option<(SpeedStep, f64)>,
    /// The set speed at which the wheels break away; `None` while they turn.
    breakaway: Option<f64>,
    /// The rate of the decoder's time: 1, except for stops, which vary.
    pace: f64,
    /// How much earlier than usual the next start is, in s.
    start_advance: f64,
    /// The factors of this session.
    session: Session,
    /// The deceleration by the gradient while nothing drives it, in mm/s².
    pub(crate) slope: f64,
}

impl<T: Deref<Target = Train> + Clone> Motor<T> {
    /// A train at rest.
    pub(crate) fn at_rest(train: T) -> Self {
        let mm = Acceleration::as_mm_per_s2;
        let process = match train.law {
            _ if train.traits.other_law.is_some() => Process::Other { phase: 0.0 },
            Law::Constant { up, down } => Process::Ramp { up: mm(up), down: mm(down) },
            Law::Smooth { up, down, shortest } => Process::Eased {
                up: mm(up),
                down: mm(down),
                shortest: shortest.as_s(),
                change: 0.0,
                lasts: 1.0,
                elapsed: 1.0,
            },
            Law::SCurve { up, down, rounding } => {
                let samples = (rounding.as_s() / STEP_S).clamp(1.0, MAX_SAMPLES) as usize;
                let window = VecDeque::from(vec![0.0; samples]);
                Process::Averaged { up: mm(up), down: mm(down), ramp: 0.0, window, sum: 0.0, level: samples }
            }
            Law::Lag { .. } => Process::Direct,
            Law::Momentum { up_per_count, down_per_count } => Process::Counted {
                up_s: up_per_count.as_s(),
                down_s: down_per_count.as_s(),
                count: 0,
                until_next: 0.0,
                play: 0.0,
            },
            Law::Mixed { up, .. } => Process::RampUp { up: mm(up) },
        };
        Self {
            train,
            process,
            step: SpeedStep::STAND,
            approach: Approach::Below,
            target: 0.0,
            set_speed: 0.0,
            wheel_speed: 0.0,
            pending: None,
            breakaway: Some(0.0),
            pace: 1.0,
            start_advance: 0.0,
            session: Session::AVERAGE,
            slope: 0.0,
        }
    }

    /// A train that has been running steadily for long.
    pub(crate) fn running(train: T, step: SpeedStep, approach: Approach) -> Self {
        let mut motor = Self::at_rest(train);
        motor.aim(step, approach);
        let speed = motor.target;
        let counts = motor.counts(step);
        match &mut motor.process {
            Process::Averaged { ramp, window, sum, .. } => {
                *ramp = speed;
                window.iter_mut().for_each(|sample| *sample = speed);
                *sum = speed * window.len() as f64;
            }
            Process::Counted { count, play, .. } => {
                *count = counts;
                *play = above(approach);
            }
            Process::Ramp { .. }
            | Process::Eased { .. }
            | Process::Direct
            | Process::RampUp { .. }
            | Process::Other { .. } => {}
        }
        motor.set_speed = speed;
        motor.wheel_speed = speed;
        motor.breakaway = if speed > 0.0 { None } else { Some(0.0) };
        motor
    }

    /// The decoder receives a command.
    pub(crate) fn command(&mut self, step: SpeedStep, draws: &mut Draws) {
        if self.is_at_rest() && self.step == SpeedStep::STAND {
            let breakaway = self.train.breakaway.as_mm_per_s();
            self.breakaway = Some(breakaway * draws.normal_within(1.0, START_SD, 2.5));
            let mut dead_time =
                self.train.start_dead_time.as_s() * draws.normal_within(1.0, DEAD_TIME_SD, 2.5);
            if let Some(sticky) = self.train.traits.sticky {
                match sticky.draw(draws) {
                    Some(late) => dead_time = (dead_time + late).max(0.0),
                    None => self.stall(),
                }
            }
            dead_time -= std::mem::take(&mut self.start_advance);
            self.pending = Some((step, dead_time));
            return;
        }
        self.command_without_scatter(step);
        if step == SpeedStep::STAND {
            // Dead time and averages do not stretch with the rest: measure the effect of a slower process on the
            // stopping distance.
            let usual = self.clone().stopping_distance_mm();
            let slower = Self { pace: 1.0 / (1.0 + TRIAL_STRETCH), ..self.clone() };
            let per_stretch = (slower.stopping_distance_mm() - usual) / TRIAL_STRETCH;
            let scatter = self.train.stop_scatter.sd(Speed::from_mm_per_s(self.wheel_speed)).as_mm();
            let sd = if per_stretch > scatter { scatter / per_stretch } else { 0.0 };
            let stretch = draws.normal(1.0, sd).clamp(*STRETCH.start(), *STRETCH.end());
            self.pace = self.session.stop / stretch;
        }
    }

    /// The decoder of a running train receives a command and obeys as on an average day.
    pub(crate) fn command_without_scatter(&mut self, step: SpeedStep) {
        self.pace = 1.0;
        self.pending = Some((step, self.train.change_dead_time.as_s()));
    }

    /// The decoder of a train at rest receives a command and obeys as on an average day.
    pub(crate) fn start_without_scatter(&mut self, step: SpeedStep) {
        self.breakaway = Some(self.train.breakaway.as_mm_per_s());
        self.pending = Some((step, self.train.start_dead_time.as_s()));
    }

    /// The distance that the wheels roll within a time, in mm.
    pub(crate) fn distance_within_mm(&mut self, within: TimeSpan) -> f64 {
        let steps = (within.as_s().clamp(0.0, 600.0) / STEP_S) as usize;
        (0..steps).fold(0.0, |distance, _| {
            let before = self.wheel_speed;
            distance + 0.5 * (before + self.advance()) * STEP_S
        })
    }

    /// The remaining stopping distance on level straight track, without variation, in mm.
    pub(crate) fn stopping_distance_mm(mut self) -> f64 {
        let mut distance = 0.0;
        for _ in 0..(MAX_STOP_S / STEP_S) as usize {
            if self.stays_at_rest() {
                break;
            }
            let before = self.wheel_speed;
            distance += 0.5 * (before + self.advance()) * STEP_S;
        }
        distance
    }

    /// Starts another session with its factors.
    pub(crate) fn begin_session(&mut self, session: Session) {
        self.session = session;
    }

    /// Makes the next start from rest earlier by a time in s.
    pub(crate) fn advance_next_start(&mut self, by: f64) {
        self.start_advance = by;
    }

    /// The same train at rest in the same session, with its decoder reset.
    pub(crate) fn reset(&self) -> Self {
        Self {
            session: self.session,
            slope: self.slope,
            start_advance: self.start_advance,
            ..Self::at_rest(self.train.clone())
        }
    }

    /// Loses the current from the rail at low speed: the wheels stick until a higher step is commanded.
    pub(crate) fn stall(&mut self) {
        self.breakaway = Some(f64::INFINITY);
    }

    /// Wheel speed on level straight track, in mm/s.
    pub(crate) fn wheel_speed(&self) -> f64 {
        self.wheel_speed
    }

    /// `true` while the wheels do not turn.
    pub(crate) fn is_at_rest(&self) -> bool {
        self.wheel_speed == 0.0
    }

    /// `true` while the wheels are at rest and no command will turn them.
    pub(crate) fn stays_at_rest(&self) -> bool {
        self.is_at_rest() && self.pending.is_none() && (self.step == SpeedStep::STAND || self.is_stalled())
    }

    /// `true` while the wheels stick at a step other than 0.
    pub(crate) fn is_stalled(&self) -> bool {
        let sticks = self.breakaway.is_some_and(|needs| needs > self.target);
        self.is_at_rest() && self.step != SpeedStep::STAND && sticks
    }

    /// Wheel speed on level straight track in mm/s, after one more step of [`STEP_S`].
    pub(crate) fn advance(&mut self) -> f64 {
        if let Some((step, left)) = self.pending {
            if left <= 0.0 {
                self.start_change(step);
            } else {
                self.pending = Some((step, left - STEP_S));
            }
        }
        let dt = STEP_S * if self.step == SpeedStep::STAND { self.pace } else { 1.0 };
        self.set_speed = self.update_set_speed(dt);
        self.update_wheel_speed(dt);
        self.wheel_speed
    }

    fn aim(&mut self, step: SpeedStep, approach: Approach) {
        self.step = step;
        self.approach = approach;
        self.target = self.train.speeds.speed(step, approach).as_mm_per_s();
    }

    fn start_change(&mut self, step: SpeedStep) {
        self.pending = None;
        if step == self.step {
            return;
        }
        // A stalled train starts when a higher step is commanded.
        let is_pushed = self.step != SpeedStep::STAND && step > self.step;
        if is_pushed && self.breakaway == Some(f64::INFINITY) {
            self.breakaway = Some(self.train.breakaway.as_mm_per_s());
        }
        self.aim(step, if step < self.step { Approach::Above } else { Approach::Below });
        if let Process::Eased { up, down, shortest, change, lasts, elapsed } = &mut self.process {
            *change = self.target - self.set_speed;
            *lasts = *shortest + if *change > 0.0 { *change / *up } else { -*change / *down };
            *elapsed = 0.0;
        }
    }

    /// The decoder's internal step for a throttle step.
    fn counts(&self, step: SpeedStep) -> u16 {
        (f64::from(step.get()) * counts_per_step(self.train.speeds.highest())).round() as u16
    }

    /// The set speed after `dt`.
    fn update_set_speed(&mut self, dt: f64) -> f64 {
        let target = self.target;
        let counts = self.counts(self.step);
        match &mut self.process {
            Process::Ramp { up, down } => toward(self.set_speed, target, *up * dt, *down * dt),
            Process::Eased { change, lasts, elapsed, .. } => {
                // The rate at mid-step: a parabola over the change whose area is the change.
                let part = (*elapsed + 0.5 * dt) / *lasts;
                *elapsed += dt;
                if part >= 1.0 {
                    target
                } else {
                    let rate = 6.0 * *change / *lasts * part * (1.0 - part);
                    self.set_speed + rate * dt
                }
            }
            Process::Averaged { up, down, ramp, window, sum, level } => {
                *ramp = toward(*ramp, target, *up * dt, *down * dt);
                let oldest = window.pop_front().unwrap_or(*ramp);
                window.push_back(*ramp);
                *sum += *ramp - oldest;
                *level = if *ramp == target { *level + 1 } else { 0 };
                // With equal samples throughout, the running sum would still carry its rounding errors.
                if *level > window.len() { target } else { *sum / window.len() as f64 }
            }
            Process::Direct => target,
            Process::Counted { up_s, down_s, count, until_next, play } => {
                *until_next -= dt;
                if *until_next <= 0.0 && *count != counts {
                    let rises = counts > *count;
                    *count = if rises { *count + 1 } else { count.saturating_sub(1) };
                    *until_next += if rises { *up_s } else { *down_s };
                }
                *until_next = until_next.max(-dt);
                let taken_up = dt / PLAY_S;
                *play = toward(*play, above(self.approach), taken_up, taken_up);
                let speeds = &self.train.speeds;
                speeds.mm_per_s(f64::from(*count) / counts_per_step(speeds.highest()), *play)
            }
            Process::RampUp { up } => toward(self.set_speed, target, *up * dt, f64::INFINITY),
            Process::Other { phase } => match self.train.traits.other_law {
                Some(law) => law.advance(self.set_speed, target, dt, phase),
                None => target,
            },
        }
    }

    /// The motor: the wheels follow the set speed.
    fn update_wheel_speed(&mut self, dt: f64) {
        if let Some(needs) = self.breakaway {
            if self.wheel_speed == 0.0 && self.set_speed < needs {
                return;
            }
            if needs.is_finite() {
                self.breakaway = None;
            }
        }
        let stuck = self.breakaway.is_some();
        let drive = if stuck { 0.0 } else { self.set_speed };
        let lag = if stuck { RAMPED_MOTOR_LAG_S } else { self.lag(drive > self.wheel_speed) };
        let friction = if drive == 0.0 { self.rolling_friction().min(self.wheel_speed / dt) } else { 0.0 };
        // Semi-implicit: with the new speed on both sides, no lag however short can overshoot.
        let next = (self.wheel_speed + dt * (drive / lag - friction)) / (1.0 + dt / lag);
        self.wheel_speed = if drive == 0.0 && next < REST_MM_PER_S { 0.0 } else { next };
        if self.wheel_speed == 0.0 && self.breakaway.is_none() {
            self.breakaway = Some(0.0);
        }
    }

    /// The deceleration while nothing drives it, in mm/s²; a worm gear never rolls on by itself.
    fn rolling_friction(&self) -> f64 {
        let flat = self.train.friction.as_mm_per_s2();
        (flat + self.slope).max(MIN_FRICTION * flat)
    }

    fn lag(&self, speeds_up: bool) -> f64 {
        self.session.mass * self.unloaded_lag(speeds_up)
    }

    fn unloaded_lag(&self, speeds_up: bool) -> f64 {
        match self.train.law {
            _ if self.train.traits.other_law.is_some() => RAMPED_MOTOR_LAG_S,
            Law::Lag { up, down } | Law::Mixed { up_lag: up, down, .. } => {
                TimeSpan::as_s(if speeds_up { up } else { down }).max(STEP_S)
            }
            Law::Momentum { .. } => COUNTED_MOTOR_LAG_S,
            Law::Constant { .. } | Law::Smooth { .. } | Law::SCurve { .. } => RAMPED_MOTOR_LAG_S,
        }
    }
}

/// 1 for speeds reached from above, else 0.
fn above(approach: Approach) -> f64 {
    if approach == Approach::Above { 1.0 } else { 0.0 }
}

/// `from`, moved towards `to` by at most `up` or `down`.
fn toward(from: f64, to: f64, up: f64, down: f64) -> f64 {
    if to > from { (from + up).min(to) } else { (from - down).max(to) }
}
