//! Trains as a person names them: by address, with the steps of the decoder.

use std::str::FromStr;

use footplate_core::{DecoderSteps, TrainId};
use footplate_wire::marklin_can::LocomotiveProtocol;

use super::parameters::number;

/// Reads the steps of a decoder.
pub(crate) fn decoder_of(value: &str) -> Result<DecoderSteps, String> {
    match value {
        "14" => Ok(DecoderSteps::Fourteen),
        "28" => Ok(DecoderSteps::TwentyEight),
        "126" | "128" => Ok(DecoderSteps::All),
        _ => Err(format!("`{value}` is no number of decoder steps; decoders have 14, 28 or 126")),
    }
}

/// A train as a person names it, `24`, or `3850:126` with the steps of its decoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NamedTrain {
    /// Its address.
    pub(crate) train: TrainId,
    /// The steps of its decoder, if they were said.
    pub(crate) decoder: Option<DecoderSteps>,
}

impl FromStr for NamedTrain {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (address, steps) = text.split_once(':').map_or((text, None), |(one, two)| (one, Some(two)));
        let highest = *LocomotiveProtocol::Mfx.addresses().end();
        let address = address.trim().parse::<u16>().ok().filter(|address| (1..=highest).contains(address));
        let wanted = || {
            format!(
                "`{text}` is no train: write its address, 1 to {highest}, such as 24, or 3850:126 with its decoder's steps"
            )
        };
        let decoder = steps.map(|steps| decoder_of(steps.trim())).transpose()?;
        Ok(Self { train: TrainId(address.ok_or_else(wanted)?), decoder })
    }
}

/// Reads trains as `24,58`.
pub(crate) fn trains(value: &str) -> Result<Vec<TrainId>, String> {
    let mut trains = Vec::new();
    for one in value.split(',') {
        let train = TrainId(number("train", one.trim(), "24,58").map_err(|_| {
            format!("`{one}` is not a train address: separate addresses with commas, for example 24,58")
        })?);
        if trains.contains(&train) {
            return Err(format!("train {train} is listed twice: each train needs its own address"));
        }
        trains.push(train);
    }
    Ok(trains)
}
