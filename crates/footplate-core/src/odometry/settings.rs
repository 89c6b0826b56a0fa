//! Which odometer estimates.

use super::diameter::BaliseAccuracy;
use super::paper::Fusion;
use super::paper::ManoeuvreSettings;
use super::paper::Reading;

/// How an [`Odometer`](super::Odometer) works.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometrySettings {
    /// What carries the estimate.
    pub carrier: Carrier,
    /// Probability that the truth lies within the confidence interval.
    pub confidence: f64,
    /// Diameters are learnt from balises and between the wheelsets, and distances corrected at balises; nothing of it if
    /// absent.
    pub balises: Option<BaliseAccuracy>,
    /// An inertial sensor, where there is one, carries the estimate through slides and narrows its bounds.
    pub inertial: bool,
}

/// What carries the estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Carrier {
    /// The mean over the competing hypotheses.
    Hypotheses,
    /// Counts per period as speeds, in the published federated filter.
    Published {
        /// How shares work.
        fusion: Fusion,
        /// How the motion model adapts.
        manoeuvre: ManoeuvreSettings,
        /// How the printed rules are read.
        reading: Reading,
    },
}

/// The probability of the interval if nothing else is asked for.
const CONFIDENCE: f64 = 0.9999;

impl OdometrySettings {
    /// The published algorithm (Zhang, Yang, Cheng and Li, China Railway Science 43(1), 2022), read so that it does what
    /// its three figures show: measurements coupled to shares, an adaptation that goes on adapting, and a correction
    /// that ends.
    #[must_use]
    pub const fn paper() -> Self {
        Self::published(Reading::Figures)
    }

    /// The same with the rules for slip and slide to the letter.
    #[must_use]
    pub const fn literal() -> Self {
        Self::published(Reading::Literal)
    }

    const fn published(reading: Reading) -> Self {
        Self {
            carrier: Carrier::Published {
                fusion: Fusion::Reset,
                manoeuvre: ManoeuvreSettings::recommended(),
                reading,
            },
            confidence: CONFIDENCE,
            balises: None,
            inertial: false,
        }
    }

    /// What is best on every scenario.
    #[must_use]
    pub fn recommended() -> Self {
        Self {
            carrier: Carrier::Hypotheses,
            confidence: CONFIDENCE,
            balises: Some(BaliseAccuracy::default()),
            inertial: true,
        }
    }
}
