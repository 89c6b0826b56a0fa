//! What a detection shows of the length of the hop before it.
//!
//! Letters: `L` the path length of the hop, with variance `σ²`; `r` how far the train was short of the sensor when it
//! reported, by its motion alone; `s²` the predicted variance of that, `σ²` included. The report that updates the position
//! also updates the hop:
//!
//! ```text
//! L ← L − (σ²/s²) r        σ² ← σ² (1 − σ²/s²)
//! ```
//!
//! A calibration narrows σ to a millimetre or two for the speeds at which it drove. A train that changes speed twice a second
//! covers the same hop differently each time, and the apparent length varies more: σ never counts for less than
//! [`BEST_KNOWN`].

use super::locator::{GATE, Locator};
use super::track_context::TrackContext;
use crate::ids::SensorId;
use crate::linalg::Gaussian;
use crate::link::DetectionWindow;
use crate::model::MotionModel;

/// Least standard deviation of a hop (m): a report then moves the length by a third of its innovation (chosen by what repeats
/// from lap to lap on simulated layouts: up to 16 mm after a calibration of five minutes).
const BEST_KNOWN: f64 = 0.005;

impl Locator {
    /// What a report that is about to be assigned to this train shows of the hop to its sensor: the section, and by how much its
    /// path length exceeds the survey (m). `None` unless it is the next sensor.
    pub(crate) fn shown_length(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        sensor: SensorId,
        window: DetectionWindow,
    ) -> Option<(usize, Gaussian)> {
        let hop = context.hop_from(self.node()?).filter(|hop| hop.sensor == Some(sensor))?;
        let section = context.sections.section(hop.id)?;
        let (reach, short, _) = self.best_reach(context, model, sensor, window)?;
        if reach.missed > 0 || short.mean * short.mean > GATE * GATE * short.variance {
            return None;
        }
        let unknown = reach.length.variance.max(BEST_KNOWN * BEST_KNOWN);
        let part = unknown / (short.variance - reach.length.variance + unknown);
        let longer = reach.length.mean - hop.length.as_m() - part * short.mean;
        let variance = unknown * (1.0 - part);
        Some((section, Gaussian { mean: longer, variance }))
    }
}
