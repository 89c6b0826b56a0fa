//! What a train shows of the way between two contacts when it passes the second.
//!
//! Letters: `L` the hop as the train feels it, known to the variance `σ²`; `r` how far the train was short of the contact
//! when it reported, by its motion alone; `s²` the variance that was expected of that, `σ²` included. The same report that
//! says where the train is says of the hop
//!
//! ```text
//! L ← L − (σ²/s²) r        σ² ← σ² (1 − σ²/s²)
//! ```
//!
//! A calibration narrows σ to a millimetre or two for the ways in which it drove. A train that is told something else twice
//! a second goes over the same hop otherwise each time, and what a hop then seems to be differs by more: σ never counts for
//! less than [`BEST_KNOWN`].

use super::locator::{GATE, Locator};
use super::track_context::TrackContext;
use crate::ids::SensorId;
use crate::linalg::Gaussian;
use crate::link::ContactWindow;
use crate::model::MotionModel;

/// No hop is known better (m): a third of what one report says of it is believed then (chosen by what repeats from lap to
/// lap on simulated layouts: up to 16 mm after a calibration of five minutes).
const BEST_KNOWN: f64 = 0.005;

impl Locator {
    /// What a report that this train is about to be judged to have caused says of the hop to its contact: the section,
    /// and by how much that is longer than surveyed (m). `None` unless it is the next one.
    pub(crate) fn shown_length(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        sensor: SensorId,
        window: ContactWindow,
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
