//! How likely it is that a train closed a contact, as one of several things that may have.
//!
//! A density of the time at which the contact closed, in 1/s, so that trains, lost trains and contacts that close by
//! themselves can be weighed against each other. Two components: a train that runs as its model says, and, seldom, one
//! that has changed and is a good part of its way since the last contact off. Without the second a train with dirty
//! wheels would not be followed for long enough to notice that it has.

use super::locator::{CONTACT_SCATTER_M, LEAST_SPEED_M_PER_S, Locator, log_density};
use super::path_length::{LOG_CHANCE_OF_SILENCE, path_reaches};
use super::track_context::TrackContext;
use crate::ids::SensorId;
use crate::linalg::Gaussian;
use crate::link::ContactWindow;
use crate::model::MotionModel;

/// One train in a thousand is not as its model says when it comes to a contact, as ln (chosen: engines are exchanged and
/// wheels get dirty once in an afternoon, after as many contacts).
const LOG_CHANGED: f64 = -6.908;
/// A changed train is off by about this part of its way since the last contact (chosen: dirt takes a fifth, other
/// engines of a course differ by up to a half).
const CHANGED_PART: f64 = 0.3;

impl Locator {
    /// The logarithm of the density (1/s) with which this train closed a contact within a window; `None` while it is
    /// lost, and where no way as the turnouts lie leads there past at most two silent contacts.
    #[must_use]
    pub fn claim(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        sensor: SensorId,
        window: ContactWindow,
    ) -> Option<f64> {
        let (node, place, speed) = self.motion_at(model, window.middle())?;
        let speed = speed.max(LEAST_SPEED_M_PER_S);
        let noise = CONTACT_SCATTER_M * CONTACT_SCATTER_M + speed * speed * window.variance_s2();
        let off = CHANGED_PART * place.mean;
        let density = path_reaches(context, model, node, sensor).map(|reach| {
            let variance = place.variance + reach.length.variance + noise;
            let short = Gaussian { mean: reach.length.mean - place.mean, variance };
            let changed = Gaussian { variance: variance + off * off, ..short };
            let silent = LOG_CHANCE_OF_SILENCE * reach.missed as f64;
            libm::exp(log_density(short) + silent) + libm::exp(log_density(changed) + LOG_CHANGED + silent)
        });
        let density = speed * density.sum::<f64>();
        (density > 0.0).then(|| libm::log(density))
    }
}
