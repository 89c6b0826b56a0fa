//! Which of the ways to estimate is taken.

use super::federated_filter::Fusion;
use super::manoeuvre::ManoeuvreSettings;
use super::virtual_sensor::Envelope;
use crate::calibration::BaliseAccuracy;
use crate::wheels::BothAxles;

/// How an [`Odometer`](super::Odometer) works.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometrySettings {
    /// What carries the estimate while a wheel rolls.
    pub carrier: Carrier,
    /// What is done when the wheelsets differ and nothing else tells which one is at fault.
    pub both_axles: BothAxles,
    /// While a wheelset slides none is said to spin, and the other way round.
    pub latch: bool,
    /// A wheelset is flagged at once if its counts cannot be those of one that rolls.
    pub proof: bool,
    /// How the speed falls while both wheelsets slide.
    pub envelope: Envelope,
    /// Diameters are learnt from balises and between the wheelsets, and distances corrected at balises; nothing of it if
    /// absent.
    pub balises: Option<BaliseAccuracy>,
    /// An inertial sensor, where there is one, carries the estimate through slides and narrows its bounds.
    pub inertial: bool,
}

/// What carries the estimate while a wheel rolls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Carrier {
    /// The accumulated counts of the wheels as places, in one filter of place, speed and acceleration.
    Counts {
        /// Spectral density of the train's jerk (m²/s⁵).
        jerk_density: f64,
    },
    /// Counts per period as speeds, in the published federated filter.
    Published {
        /// How shares work.
        fusion: Fusion,
        /// How the motion model adapts.
        manoeuvre: ManoeuvreSettings,
    },
}

/// 0.14 m/s² in a second: what a driver's hand does to a cruising train.
const JERK_DENSITY: f64 = 0.02;

impl OdometrySettings {
    /// The published algorithm (Zhang, Yang, Cheng and Li, China Railway Science 43(1), 2022) as closely as it can be read
    /// and work: measurements coupled to shares, and an adaptation that does not fall asleep.
    #[must_use]
    pub const fn paper() -> Self {
        Self {
            carrier: Carrier::Published {
                fusion: Fusion::Reset,
                manoeuvre: ManoeuvreSettings::recommended(),
            },
            both_axles: BothAxles::Literal,
            latch: false,
            proof: false,
            envelope: Envelope::Fixed,
            balises: None,
            inertial: false,
        }
    }

    /// What is best on every scenario.
    #[must_use]
    pub fn recommended() -> Self {
        Self {
            carrier: Carrier::Counts { jerk_density: JERK_DENSITY },
            both_axles: BothAxles::OnlyIfUndetermined,
            latch: true,
            proof: true,
            envelope: Envelope::Touches,
            balises: Some(BaliseAccuracy::default()),
            inertial: true,
        }
    }
}
