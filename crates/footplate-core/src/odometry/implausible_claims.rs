//! Claims of a vehicle file that a run contradicts.

use super::odometer::Odometer;

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
        let diameters =
            self.places.as_ref().map_or([None; 2], |places| places.diameters().beyond_tolerance());
        ImplausibleClaims { contradicted: self.bounds.contradictions(), above_top: self.above_top, diameters }
    }
}
