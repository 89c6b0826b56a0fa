//! A run along a line as one body, from the first stop to the last: running times, places and speeds.
//!
//! The motion is integrated by the midpoint rule; the driver's effort holds for a step. The work of every force is
//! added up beside it, so that energy can be balanced.

use footplate_core::{Acceleration, Length, Speed, TimeSpan};

use super::driver::{Driver, DrivingPhase, State, Style, StyleError};
use super::profile::LineProfile;
use super::train::{Train, TrainError};

/// A run that takes longer than two days is none (s).
const LONGEST_S: f64 = 2.0 * 86_400.0;
/// More moments than any use has for them (half a gigabyte).
const MOST_MOMENTS: usize = 10_000_000;
/// Steps between which a run can be computed (ms).
const STEPS_MS: [i64; 2] = [1, 1000];

/// A moment of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Since the run began.
    pub time: TimeSpan,
    /// Where the front is.
    pub front: Length,
    /// The speed.
    pub speed: Speed,
    /// The acceleration from here on.
    pub acceleration: Acceleration,
    /// What the driver is about.
    pub phase: DrivingPhase,
}

/// A stop that was made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Call {
    /// Which of the line's stops.
    pub stop: usize,
    /// When the train came to stand; zero at the first.
    pub arrives: TimeSpan,
    /// When it went on; at the last stop, when it came to stand.
    pub departs: TimeSpan,
    /// How far beyond the place it stands; negative before it.
    pub beyond: Length,
}

/// The work of each force over a run (J).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Work {
    /// What traction gave.
    pub traction_j: f64,
    /// What the brake took.
    pub brake_j: f64,
    /// What resistance took.
    pub resistance_j: f64,
    /// What gradients and curves took; negative where the line fell.
    pub line_j: f64,
}

/// A run from the first stop of a line to the last.
#[derive(Debug, Clone, PartialEq)]
pub struct Journey {
    /// One moment a step while the train moves; of a stop the first and the last.
    pub moments: Vec<Moment>,
    /// The stops, from the first to the last.
    pub calls: Vec<Call>,
    /// What every force did.
    pub work: Work,
}

impl Journey {
    /// Runs a train along a line, one `step` after the other (1 ms to 1 s; 50 ms is as good as exact).
    ///
    /// # Errors
    /// A value that no train or driver has, a step out of range, or a train that does not get there.
    pub fn run(
        train: &Train,
        line: &LineProfile,
        style: Style,
        step: TimeSpan,
    ) -> Result<Self, JourneyError> {
        train.check()?;
        style.check()?;
        let [shortest, longest] = STEPS_MS.map(TimeSpan::from_ms);
        if step < shortest || longest < step {
            return Err(JourneyError::Step { step_s: step.as_s() });
        }
        let mut driver = Driver::new(train.clone(), line.clone(), style);
        let begins = line.stops().first().map_or(Length::ZERO, |stop| stop.at);
        let mut state = State { front: begins, speed: Speed::ZERO };
        let mut time = TimeSpan::ZERO;
        let first = Call { stop: 0, arrives: time, departs: time, beyond: Length::ZERO };
        let mut run = Self { moments: Vec::new(), calls: vec![first], work: Work::default() };
        let mut standing = true;
        loop {
            let command = driver.command(state, step);
            let stands = command.phase == DrivingPhase::Standing;
            if stands && !standing {
                let stop = driver.stop();
                let beyond = line.stops().get(stop).map_or(Length::ZERO, |stop| state.front - stop.at);
                run.calls.push(Call { stop, arrives: time, departs: time, beyond });
            }
            if let Some(call) = run.calls.last_mut().filter(|_| !stands && standing) {
                call.departs = time;
            }
            standing = stands;
            if stands {
                // The driver calls it standing a last few millimetres per second early; the brake takes them.
                let v = state.speed.as_m_per_s();
                run.work.brake_j += 0.5 * train.inertia_kg() * v * v;
                state.speed = Speed::ZERO;
            }
            let line_n = train.line_force(line, state.front);
            let acceleration = if stands {
                Acceleration::ZERO
            } else {
                train.acceleration(command.force_n, line_n, state.speed)
            };
            let State { front, speed } = state;
            let moment = Moment { time, front, speed, acceleration, phase: command.phase };
            match run.moments.as_mut_slice() {
                [.., before, last]
                    if stands && before.phase == DrivingPhase::Standing && before.front == front =>
                {
                    *last = moment;
                }
                _ => run.moments.push(moment),
            }
            if driver.has_arrived() {
                return Ok(run);
            }
            if !stands && state.speed == Speed::ZERO && acceleration <= Acceleration::ZERO {
                return Err(JourneyError::Stalled {
                    at_m: front.as_m(),
                    pulls_n: command.force_n,
                    needs_n: line_n + train.resistance.at(speed),
                });
            }
            if run.moments.len() > MOST_MOMENTS {
                return Err(JourneyError::TooManySteps { step_s: step.as_s(), at_m: front.as_m() });
            }
            if time.as_s() > LONGEST_S {
                return Err(JourneyError::TooSlow { at_m: front.as_m() });
            }
            if !stands {
                run.advance(train, line, command.effort, &mut state, step);
            }
            time += step;
        }
    }

    /// Moves the train on by a step by the midpoint rule, or until it stands.
    fn advance(&mut self, train: &Train, line: &LineProfile, effort: f64, state: &mut State, step: TimeSpan) {
        let forces = |at: State| {
            (train.force(effort, at.speed), train.line_force(line, at.front), train.resistance.at(at.speed))
        };
        let acceleration = |(force, line, resistance): (f64, f64, f64)| {
            Acceleration::from_m_per_s2((force - line - resistance) / train.inertia_kg())
        };
        let half = TimeSpan::from_s(0.5 * step.as_s());
        let first = acceleration(forces(*state));
        let middle = State {
            front: state.front + state.speed * half,
            speed: (state.speed + first * half).max(Speed::ZERO),
        };
        let forces = forces(middle);
        let mean = acceleration(forces);
        let reached = state.speed + mean * step;
        let distance = if reached < Speed::ZERO {
            let (v, a) = (state.speed.as_m_per_s(), mean.as_m_per_s2());
            state.speed = Speed::ZERO;
            Length::from_m(-v * v / (2.0 * a))
        } else {
            let distance = (state.speed + reached) * half;
            state.speed = reached;
            distance
        };
        state.front += distance;
        let (force, line, resistance) = forces;
        let metres = distance.as_m();
        self.work.traction_j += force.max(0.0) * metres;
        self.work.brake_j += (-force).max(0.0) * metres;
        self.work.resistance_j += resistance * metres;
        self.work.line_j += line * metres;
    }

    /// The running time from the first stop to the last, dwells included.
    pub fn time(&self) -> TimeSpan {
        self.moments.last().map_or(TimeSpan::ZERO, |moment| moment.time)
    }

    /// The moment at which the front passes a place; `None` before the first stop and beyond the last.
    pub fn passing(&self, place: Length) -> Option<Moment> {
        let next = self.moments.partition_point(|moment| moment.front < place);
        let to = self.moments.get(next)?;
        let Some(from) = next.checked_sub(1).and_then(|before| self.moments.get(before)) else {
            return (to.front == place).then_some(*to);
        };
        // Acceleration is even within a step, so v² grows evenly with the distance.
        let share = (place - from.front) / (to.front - from.front);
        let squared = |moment: &Moment| moment.speed.as_m_per_s() * moment.speed.as_m_per_s();
        let speed = libm::sqrt(squared(from) + share * (squared(to) - squared(from)));
        let mean = 0.5 * (from.speed.as_m_per_s() + speed);
        let time = from.time + TimeSpan::from_s((place - from.front).as_m() / mean);
        Some(Moment { time, front: place, speed: Speed::from_m_per_s(speed), ..*from })
    }
}

/// A run that cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum JourneyError {
    /// The train is none.
    #[error(transparent)]
    Train(#[from] TrainError),
    /// The driver is none.
    #[error(transparent)]
    Style(#[from] StyleError),
    /// A step that is no use.
    #[error("a step of {step_s} s is out of range; it should lie between 0.001 and 1 s")]
    Step {
        /// The step.
        step_s: f64,
    },
    /// The train stands and cannot pull away.
    #[error("the train stalls at {at_m:.0} m: it pulls {pulls_n:.0} N and would need {needs_n:.0} N")]
    Stalled {
        /// Where.
        at_m: f64,
        /// What it pulls.
        pulls_n: f64,
        /// What holds it.
        needs_n: f64,
    },
    /// A run of more steps than are kept.
    #[error(
        "after {MOST_MOMENTS} steps of {step_s} s the train is at {at_m:.0} m; take longer ones, up to 1 s"
    )]
    TooManySteps {
        /// The step.
        step_s: f64,
        /// Where.
        at_m: f64,
    },
    /// The train has not arrived after two days.
    #[error("after two days the train is at {at_m:.0} m; can it climb what lies there?")]
    TooSlow {
        /// Where.
        at_m: f64,
    },
}
