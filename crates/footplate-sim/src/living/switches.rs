//! The faults of a living layout, and what its trains are like.

use footplate_core::DecoderSteps;
use footplate_core::Ratio;

use crate::law::LawFamily;
use crate::physics_range::PhysicsRange;
use crate::sensors::Faults;

/// The faults of a living layout with their rates, and what its trains are like.
#[derive(Debug, Clone, PartialEq)]
pub struct LivingSwitches {
    /// The faults of sensors.
    pub faults: Faults,
    /// How often a turnout does not obey a command.
    pub turnout_failure: Ratio,
    /// Whether rails differ from the layout's lengths and are curved and dirty, or are exactly as surveyed.
    pub true_rails: bool,
    /// The law of every train drawn; `None`: each train has the next one.
    pub law: Option<LawFamily>,
    /// How warm trains are at the start, from 0, cold, to 1.
    pub warmth: f64,
    /// Whether turnouts are set for the circuits of the trains; otherwise at random.
    pub turnouts_set: bool,
    /// Whether the station remembers detections from before the start.
    pub stale_detections: bool,
    /// What is drawn from wider ranges than usual.
    pub physics: PhysicsRange,
    /// The decoders of all trains; those of published trains have 14 steps.
    pub decoder: DecoderSteps,
}

impl LivingSwitches {
    /// A well-kept laboratory: rates of faults chosen from what course reports complain about.
    pub fn well_kept() -> Self {
        Self {
            faults: Faults {
                missed: Ratio::from_percent(0.3),
                stuck: Ratio::from_percent(0.1),
                spurious_per_minute: 0.05,
                flicker: Ratio::from_percent(1.0),
                ..Faults::default()
            },
            turnout_failure: Ratio::from_percent(0.3),
            ..Self::faultless()
        }
    }

    /// The same rails and trains, and nothing that fails.
    pub fn faultless() -> Self {
        Self {
            faults: Faults::default(),
            turnout_failure: Ratio::ZERO,
            true_rails: true,
            law: None,
            warmth: 0.5,
            turnouts_set: false,
            stale_detections: true,
            physics: PhysicsRange::Usual,
            decoder: DecoderSteps::Fourteen,
        }
    }
}

impl Default for LivingSwitches {
    fn default() -> Self {
        Self::well_kept()
    }
}
