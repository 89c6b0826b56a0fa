//! The decoders of the simulated locomotives: the step that is nearest to what a station carries.

use footplate_core::{DecoderSteps, SpeedStep, Timestamp, TrainId};

use crate::living::world::LivingLayout;

/// A speed command on the track.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum DecoderSpeed {
    /// A step of `highest` steps; 0 stops with the braking of the decoder.
    Step { step: u8, highest: u8 },
    /// An immediate stop.
    EmergencyStop,
}

impl LivingLayout<'_> {
    /// The steps of a train's decoder.
    pub(crate) fn decoder(&self, train: TrainId) -> DecoderSteps {
        let engine = self.truth().engine(train);
        engine.map_or(DecoderSteps::Fourteen, |engine| DecoderSteps::with(engine.speeds.highest()))
    }

    /// Sends direction and speed to a locomotive over the track.
    pub(crate) fn carry(&mut self, train: TrainId, forward: bool, speed: DecoderSpeed, at: Timestamp) {
        self.face(train, forward, at);
        match speed {
            DecoderSpeed::Step { step, highest } => {
                let own = self.decoder(train).highest().get();
                self.command(train, nearest(step, highest, own), at);
            }
            DecoderSpeed::EmergencyStop => self.halt(train, at),
        }
    }
}

/// The step of a decoder with `own` steps that is nearest to a step of `highest`; only 0 gives 0.
fn nearest(step: u8, highest: u8, own: u8) -> SpeedStep {
    if step == 0 {
        return SpeedStep::STAND;
    }
    let highest = u16::from(highest.max(1));
    let nearest = (u16::from(step) * u16::from(own) + highest / 2) / highest;
    SpeedStep::new(nearest.clamp(1, own.into()) as u8).unwrap_or_default()
}
