//! The inertial sensor beside the wheels: it predicts the speed while no wheel measures it, and narrows the bounds.

use super::inertial::{InertialBounds, InertialFilter, InertialLimits, InertialNoise};
use super::wheels::Range;
use crate::time::TimeSpan;
use crate::units::{Acceleration, Speed};

/// Standard deviation of the speed from wheels that roll freely (m/s).
const ROLLING: f64 = 0.05;
/// Additional deviation of driven or braked wheels (part of the speed): their creepage is one-sided and persistent, and
/// would be learnt as a bias.
const CREEPAGE: f64 = 0.03;

/// Bounds of the wheels narrower than this (m/s) improve on the integrated readings.
const TELLING: f64 = 1.2;

/// Filter and bounds of the inertial sensor.
#[derive(Debug, Clone)]
pub(super) struct Inertia {
    filter: InertialFilter,
    bounds: InertialBounds,
}

impl Inertia {
    /// A sensor of unknown bias, in a train at `speed` within `bounds` (m/s).
    pub(super) fn new(speed: f64, bounds: Range) -> Self {
        let mut filter = InertialFilter::new(InertialNoise::default());
        filter.begin(Speed::from_m_per_s(speed), Speed::from_m_per_s(0.5 * bounds.width()));
        let mut limits = InertialBounds::new(InertialLimits::default());
        limits.hold(Speed::from_m_per_s(bounds.low), Speed::from_m_per_s(bounds.high));
        Self { filter, bounds: limits }
    }

    /// Takes in the reading (m/s²) of a period of `t` seconds.
    pub(super) fn read(&mut self, reading: Option<f64>, t: f64) {
        let reading = reading.map(Acceleration::from_m_per_s2);
        self.filter.predict(TimeSpan::from_s(t), reading);
        self.bounds.predict(TimeSpan::from_s(t), reading);
    }

    /// Returns the intersection of the bounds of the wheels with its own.
    pub(super) fn hold(&mut self, bounds: Range) -> Range {
        let speed = Speed::from_m_per_s;
        let own = |limits: &InertialBounds| {
            limits.speed().map(|[low, high]| Range { low: low.as_m_per_s(), high: high.as_m_per_s() })
        };
        let before = own(&self.bounds).unwrap_or(Range::ANY);
        // Each correction restarts the integral and adds its vibration, so only bounds that narrow it are used.
        if bounds.width() < TELLING {
            self.bounds.hold(speed(bounds.low), speed(bounds.high));
        } else if bounds.low > before.low {
            self.bounds.hold(speed(bounds.low), speed(f64::INFINITY));
        }
        let both = bounds.and(own(&self.bounds).unwrap_or(Range::ANY));
        if both.is_empty() { bounds } else { both }
    }

    /// Corrects the bias by the speed from trusted wheels (m/s); `free` if they are neither driven nor braked.
    pub(super) fn align(&mut self, speed: f64, free: bool) {
        let deviation = if free { ROLLING } else { ROLLING + CREEPAGE * speed.abs() };
        self.filter.align(Speed::from_m_per_s(speed), Speed::from_m_per_s(deviation));
    }

    /// The measured acceleration, corrected for bias (m/s²).
    pub(super) fn acceleration(&self) -> f64 {
        self.filter.acceleration().as_m_per_s2()
    }
}
