//! Who drives: the plan of a scenario, or a driver who knows the line.

use footplate_core::{Length, Speed, TimeSpan};

use super::driver::{Driver, State};
use super::motion::Command;
use super::plan::Plan;

/// How often a driver who knows the line looks at the speed (ms).
const LOOKS_EVERY_MS: i64 = 50;

/// Who drives.
#[derive(Debug, Clone)]
pub(crate) enum Steering {
    /// Stage by stage.
    Plan(Plan),
    /// Along a line with limits and stops.
    Line(Box<LineDriver>),
}

/// A driver who looks up now and then.
#[derive(Debug, Clone)]
pub(crate) struct LineDriver {
    driver: Driver,
    /// When to look up again (s).
    looks_at: f64,
    effort: f64,
}

impl LineDriver {
    /// A driver at the first stop, who has not looked up yet.
    pub(crate) fn new(driver: Driver) -> Self {
        Self { driver, looks_at: f64::NEG_INFINITY, effort: 0.0 }
    }
}

impl Steering {
    /// What is asked for `dt` more seconds, with the front of the train at a place (m) and a speed (m/s).
    pub(crate) fn step(&mut self, dt: f64, time: f64, place: f64, speed: f64) -> Command {
        match self {
            Self::Plan(plan) => {
                let (effort, backwards) = plan.step(dt, time, speed);
                Command { effort, backwards }
            }
            Self::Line(line) => {
                if time >= line.looks_at {
                    let looks_every = TimeSpan::from_ms(LOOKS_EVERY_MS);
                    // Half a nanosecond for rounding.
                    line.looks_at = time + looks_every.as_s() - 5e-10;
                    let state = State { front: Length::from_m(place), speed: Speed::from_m_per_s(speed) };
                    line.effort = line.driver.command(state, looks_every).effort;
                }
                Command { effort: line.effort, backwards: false }
            }
        }
    }

    /// Whether the journey is over: never by a plan.
    pub(crate) fn has_arrived(&self) -> bool {
        match self {
            Self::Plan(_) => false,
            Self::Line(line) => line.driver.has_arrived(),
        }
    }
}
