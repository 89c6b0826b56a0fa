//! Likelihood that a train closed a sensor, for data association.
//!
//! A density of the time at which the sensor closed, in 1/s, so that trains, lost trains and spurious reports can be compared.
//! Two components: a train that runs by its model and, rarely, one that has changed and is off by a good part of its path since
//! the last sensor. Without the second, a train with dirty wheels would not be tracked for long enough to notice the
//! change.

use super::locator::{LEAST_SPEED_M_PER_S, Locator, log_density};
use super::track_context::TrackContext;
use crate::ids::SensorId;
use crate::linalg::Gaussian;
use crate::link::DetectionWindow;
use crate::model::MotionModel;

/// Chance that a train no longer runs by its model when it reaches a sensor, one in a thousand, as ln (chosen: engines are
/// exchanged and wheels get dirty once in an afternoon, after as many sensors).
const LOG_CHANGED: f64 = -6.908;
/// A changed train is off by about this part of its path since the last sensor (chosen: dirt takes a fifth, other engines of a
/// course differ by up to a half).
const CHANGED_PART: f64 = 0.3;

impl Locator {
    /// The logarithm of the density (1/s) with which this train closed a sensor within a window; `None` while it is lost, and
    /// where no path as the turnouts lie leads there with few missed detections ([`MAX_MISSED`](crate::track::MAX_MISSED)), of
    /// which sensors miss a share.
    pub fn claim(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        sensor: SensorId,
        window: DetectionWindow,
        missed_share: f64,
    ) -> Option<f64> {
        let (_, place, speed) = self.motion_at(model, window.middle())?;
        let speed = speed.max(LEAST_SPEED_M_PER_S);
        let noise = model.sensor_variance(Some(sensor)) + speed * speed * window.variance_s2();
        let off = CHANGED_PART * place.mean;
        let density = self.reaches(context, model, sensor).map(|reach| {
            let variance = place.variance + reach.length.variance + noise;
            let short = Gaussian { mean: reach.length.mean - place.mean, variance };
            let changed = Gaussian { variance: variance + off * off, ..short };
            let silent = libm::log(missed_share) * reach.missed as f64;
            libm::exp(log_density(short) + silent) + libm::exp(log_density(changed) + LOG_CHANGED + silent)
        });
        let density = speed * density.sum::<f64>();
        (density > 0.0).then(|| libm::log(density))
    }
}
