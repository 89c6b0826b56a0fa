//! The inertial sensor beside the wheels: it carries the speed while none of them does, and narrows its bounds.

use super::inertial::{InertialBounds, InertialFilter, InertialLimits, InertialNoise};
use super::wheels::Range;
use crate::time::TimeSpan;
use crate::units::{Acceleration, Speed};

/// How exactly the speed of wheels that roll freely is known (m/s).
const ROLLING: f64 = 0.05;
/// Deviation of wheels that pull or brake, as part of the speed: their creepage is one-sided and lasts, and would be
/// learnt as a bias.
const CREEPAGE: f64 = 0.03;

/// Bounds of the wheels that are narrower (m/s) tell more than the sum of readings.
const TELLING: f64 = 1.2;

/// What the inertial sensor has learnt.
#[derive(Debug, Clone)]
pub(super) struct Inertia {
    filter: InertialFilter,
    bounds: InertialBounds,
}

impl Inertia {
    /// A sensor of which nothing was learnt, in a train that runs at `speed` within `bounds` (m/s).
    pub(super) fn new(speed: f64, bounds: Range) -> Self {
        let mut filter = InertialFilter::new(InertialNoise::default());
        filter.begin(Speed::from_m_per_s(speed), Speed::from_m_per_s(0.5 * bounds.width()));
        let mut limits = InertialBounds::new(InertialLimits::default());
        limits.hold(Speed::from_m_per_s(bounds.low), Speed::from_m_per_s(bounds.high));
        Self { filter, bounds: limits }
    }

    /// `t` seconds in which the sensor read this (m/s²).
    pub(super) fn read(&mut self, reading: Option<f64>, t: f64) {
        let reading = reading.map(Acceleration::from_m_per_s2);
        self.filter.predict(TimeSpan::from_s(t), reading);
        self.bounds.predict(TimeSpan::from_s(t), reading);
    }

    /// Holds the bounds of the wheels against its own; what is left of both.
    pub(super) fn hold(&mut self, bounds: Range) -> Range {
        let speed = Speed::from_m_per_s;
        let own = |limits: &InertialBounds| {
            limits.speed().map(|[low, high]| Range { low: low.as_m_per_s(), high: high.as_m_per_s() })
        };
        let before = own(&self.bounds).unwrap_or(Range::ANY);
        // Every hold begins the sum of readings anew and pays for their vibration: only what tells something is held.
        if bounds.width() < TELLING {
            self.bounds.hold(speed(bounds.low), speed(bounds.high));
        } else if bounds.low > before.low {
            self.bounds.hold(speed(bounds.low), speed(f64::INFINITY));
        }
        let both = bounds.and(own(&self.bounds).unwrap_or(Range::ANY));
        if both.is_empty() { bounds } else { both }
    }

    /// Wheels that are trusted say the speed (m/s); `free` if nothing pulls or brakes them.
    pub(super) fn align(&mut self, speed: f64, free: bool) {
        let deviation = if free { ROLLING } else { ROLLING + CREEPAGE * speed.abs() };
        self.filter.align(Speed::from_m_per_s(speed), Speed::from_m_per_s(deviation));
    }

    /// How the speed changes, as it is felt (m/s²).
    pub(super) fn acceleration(&self) -> f64 {
        self.filter.acceleration().as_m_per_s2()
    }
}
