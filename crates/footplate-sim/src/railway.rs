//! A layout as surveyed, the true rails, and a circuit on them.

use footplate_core::track::Layout;
use footplate_core::{Approach, Length, Speed, SpeedStep, TimeSpan};

use crate::circuit::{Circuit, CircuitError};
use crate::track::TrueTrack;
use crate::train::Train;

/// Where trains run.
#[derive(Debug, Clone, PartialEq)]
pub struct Railway<'l> {
    /// The surveyed track: all that an estimator is given.
    pub layout: &'l Layout,
    /// The true track.
    pub track: TrueTrack,
    /// The circuit that trains run on.
    pub circuit: Circuit,
}

impl<'l> Railway<'l> {
    /// A circuit and true rails on a layout, the same for the same seed.
    ///
    /// # Errors
    /// [`CircuitError::NoneFound`] if the layout has no circuit.
    pub fn draw(layout: &'l Layout, seed: u64) -> Result<Self, CircuitError> {
        Ok(Self { layout, track: TrueTrack::draw(layout, seed), circuit: Circuit::draw(layout, seed)? })
    }

    /// The true length of the circuit.
    pub fn circuit_length(&self) -> Length {
        self.circuit.edges().iter().map(|edge| self.track.length(*edge)).sum()
    }

    /// The true mean speed of a warm train over a lap of an average run, as a stopwatch would measure it.
    ///
    /// A lap takes the sum of the times of its edges: slow curves weigh more than their length.
    pub fn lap_speed(&self, train: &Train, step: SpeedStep, approach: Approach) -> Speed {
        let level = train.speeds.speed(step, approach);
        if level <= Speed::ZERO {
            return Speed::ZERO;
        }
        let mut takes = TimeSpan::ZERO;
        for edge in self.circuit.edges() {
            let rail_factor =
                1.0 + train.curve_sensitivity * (self.track.speed_factor(*edge).as_parts() - 1.0);
            takes += self.track.length(*edge) / (level * rail_factor);
        }
        if takes > TimeSpan::ZERO { self.circuit_length() / takes } else { level }
    }
}
