//! Claims of a vehicle file that a run contradicts.

use super::diameter::WheelScale;
use super::odometer::Odometer;

/// Deviations beyond which a learnt diameter is clearly another.
const CLEARLY: f64 = 3.0;

/// Claims of a vehicle that a run contradicts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ImplausibleClaims {
    /// Periods in which no speed agreed with both the counts and the claims.
    pub contradicted: u64,
    /// Periods in which both wheelsets turned clearly faster than the highest speed of the train.
    pub above_top: u64,
    /// True over assumed diameter of each wheelset by known places, where that is beyond its tolerance.
    pub diameters: [Option<f64>; 2],
}

impl Odometer {
    /// Claims of the vehicle that the run contradicts.
    #[must_use]
    pub fn implausible_claims(&self) -> ImplausibleClaims {
        let outside = |scale: WheelScale, tolerance: f64| {
            let deviation = CLEARLY * scale.estimate.uncertainty;
            let off = (scale.estimate.value - 1.0).abs();
            (off - deviation > tolerance).then_some(scale.estimate.value)
        };
        let [first, second] = self.vehicle.wheelsets.map(|wheelset| wheelset.diameter_tolerance);
        let diameters =
            self.diameters().map_or([None; 2], |[one, other]| [outside(one, first), outside(other, second)]);
        ImplausibleClaims { contradicted: self.bounds.contradictions(), above_top: self.above_top, diameters }
    }
}
