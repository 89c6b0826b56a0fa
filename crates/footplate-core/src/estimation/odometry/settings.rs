//! Which of the ways to estimate is taken.

use super::virtual_sensor::Envelope;
use crate::wheels::BothAxles;

/// How an [`Odometer`](super::Odometer) works.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometrySettings {
    /// What is done when the wheelsets differ and nothing else tells which one is at fault.
    pub both_axles: BothAxles,
    /// While a wheelset slides none is said to spin, and the other way round.
    pub latch: bool,
    /// How the speed falls while both wheelsets slide.
    pub envelope: Envelope,
    /// Spectral density of the train's jerk (m²/s⁵).
    pub jerk_density: f64,
}

impl OdometrySettings {
    /// The published algorithm (Zhang, Yang, Cheng and Li, China Railway Science 43(1), 2022), as closely as it can be
    /// read.
    #[must_use]
    pub const fn paper() -> Self {
        Self { both_axles: BothAxles::Literal, latch: false, envelope: Envelope::Fixed, jerk_density: 0.02 }
    }

    /// What is best on every scenario.
    #[must_use]
    pub const fn recommended() -> Self {
        Self {
            both_axles: BothAxles::OnlyIfUndetermined,
            latch: true,
            envelope: Envelope::Touches,
            jerk_density: 0.02,
        }
    }
}
