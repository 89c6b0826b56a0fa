//! A layout as people know it, the rails as they are, and a circuit on them.

use footplate_core::track::Layout;
use footplate_core::{Approach, Length, Speed, SpeedStep, TimeSpan};

use crate::circuit::{Circuit, CircuitError};
use crate::track::TrueTrack;
use crate::train::Train;

/// Where trains run.
#[derive(Debug, Clone, PartialEq)]
pub struct Railway<'l> {
    /// The track as the survey has it: all that an estimator is given.
    pub layout: &'l Layout,
    /// The track as it is.
    pub track: TrueTrack,
    /// Where the trains run round.
    pub circuit: Circuit,
}

impl<'l> Railway<'l> {
    /// A circuit and true rails on a layout, the same for the same seed.
    ///
    /// # Errors
    /// [`CircuitError::NoneFound`] if a train cannot run round on the layout.
    pub fn draw(layout: &'l Layout, seed: u64) -> Result<Self, CircuitError> {
        Ok(Self { layout, track: TrueTrack::draw(layout, seed), circuit: Circuit::draw(layout, seed)? })
    }

    /// The true length of the circuit.
    #[must_use]
    pub fn circuit_length(&self) -> Length {
        self.circuit.edges().iter().map(|edge| self.track.length(*edge)).sum()
    }

    /// The true mean speed of a warm train over a whole lap of an average run: what a stopwatch would find.
    ///
    /// A lap takes the sum of what its edges take, so slow curves weigh more than their length.
    #[must_use]
    pub fn lap_speed(&self, train: &Train, step: SpeedStep, approach: Approach) -> Speed {
        let level = train.speeds.speed(step, approach);
        if level <= Speed::ZERO {
            return Speed::ZERO;
        }
        let mut takes = TimeSpan::ZERO;
        for edge in self.circuit.edges() {
            let felt = 1.0 + train.curve_feel * (self.track.speed_factor(*edge).as_parts() - 1.0);
            takes += self.track.length(*edge) / (level * felt);
        }
        if takes > TimeSpan::ZERO { self.circuit_length() / takes } else { level }
    }
}
