//! The speed that decoders report of their trains by RailCom: at a scale that each owner has set, rounded and late.

use std::collections::{BTreeMap, VecDeque};

use footplate_core::TrainId;

use crate::draws::{Draws, Purpose};

/// What decoders report of the speed of their trains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SpeedReports {
    /// Nothing: their messages carry a number and do not announce that it is a speed.
    #[default]
    None,
    /// The speed.
    Speed,
    /// Any number, whatever the speed.
    Nonsense,
}

/// From mm/s of a model in 1:87 to km/h, ...
const SCALE_KM_H: f64 = 87.0 * 3.6e-3;
/// ... and by how much owners set it higher or lower (chosen: some set the top speed of another locomotive).
const SCALES: std::ops::Range<f64> = 0.8..1.25;
/// One standard deviation of what a decoder measures, as a part of the speed (chosen: back EMF of a few samples).
const MEASURED_TO: f64 = 0.004;
/// The most reports by which a decoder is late (chosen: it averages over a second).
const MOST_LATE: f64 = 3.0;

/// The decoders of a layout.
#[derive(Debug, Clone)]
pub(super) struct Decoders {
    kind: SpeedReports,
    draws: Draws,
    decoders: BTreeMap<TrainId, Decoder>,
}

/// One decoder.
#[derive(Debug, Clone)]
struct Decoder {
    /// What it reports at 1 mm/s.
    scale: f64,
    /// Numbers that it has not reported yet.
    late: VecDeque<u8>,
}

impl Decoders {
    pub(super) fn new(kind: SpeedReports, seed: u64) -> Self {
        Self { kind, draws: Draws::new(seed, Purpose::Decoders), decoders: BTreeMap::new() }
    }

    /// Whether their numbers are announced as speeds.
    pub(super) const fn report_speeds(&self) -> bool {
        !matches!(self.kind, SpeedReports::None)
    }

    /// The next number of a train that runs at a speed in mm/s.
    pub(super) fn next(&mut self, train: TrainId, speed: f64) -> u8 {
        let draws = &mut self.draws;
        let number = match self.kind {
            SpeedReports::None => return (speed.abs() * SCALE_KM_H).round().min(255.0) as u8,
            SpeedReports::Nonsense => draws.uniform(0.0..256.0) as u8,
            SpeedReports::Speed => 0,
        };
        let decoder = self.decoders.entry(train).or_insert_with(|| Decoder {
            scale: SCALE_KM_H * draws.uniform(SCALES),
            late: vec![0; draws.uniform(0.0..MOST_LATE) as usize].into(),
        });
        let measured = speed.abs() * decoder.scale * draws.normal(1.0, MEASURED_TO);
        let number =
            if self.kind == SpeedReports::Speed { measured.round().min(255.0) as u8 } else { number };
        decoder.late.push_back(number);
        decoder.late.pop_front().unwrap_or_default()
    }
}
