//! What can be tried with a train to learn how it moves.

use core::fmt;

use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::time::TimeSpan;

/// One thing to try.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Experiment {
    /// Run at a step until contacts have told the speed.
    Speed {
        /// The step.
        step: SpeedStep,
        /// From where it is reached.
        approach: Approach,
    },
    /// Stop from a steady step near a contact, then crawl on to the next one.
    Stop {
        /// The step.
        step: SpeedStep,
        /// From where it is reached.
        approach: Approach,
        /// Whether the train is to rest a little past the contact, so that it is timed on the way to rest; otherwise a
        /// little short of it.
        is_past: bool,
    },
    /// From rest, run for a while too short to reach the speed, stop, then crawl on to the next contact.
    Move {
        /// The step.
        step: SpeedStep,
        /// From the command to start to the command to stop.
        run: TimeSpan,
    },
}

impl Experiment {
    /// The step that it is about.
    #[must_use]
    pub const fn step(&self) -> SpeedStep {
        match self {
            Self::Speed { step, .. } | Self::Stop { step, .. } | Self::Move { step, .. } => *step,
        }
    }
}

impl fmt::Display for Experiment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let from = |approach: &Approach| match approach {
            Approach::Above => "from above",
            Approach::Below | Approach::Unknown => "from below",
        };
        match self {
            Self::Speed { step, approach } => write!(f, "speed at step {step} {}", from(approach)),
            Self::Stop { step, approach, is_past } => {
                let side = if *is_past { "past" } else { "short of" };
                write!(f, "stop from step {step} {}, {side} a sensor", from(approach))
            }
            Self::Move { step, run } => write!(f, "short move of {:.1} s at step {step}", run.as_s()),
        }
    }
}

/// Why an experiment was chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Why {
    /// Nothing is known of the step yet.
    NeverTried,
    /// It takes the most doubt away for its time: variances relative to the scatter of stops, summed, per second of
    /// track time.
    MostPerSecond {
        /// What it is expected to gain.
        gain: f64,
        /// What it is expected to take.
        takes: TimeSpan,
    },
}
