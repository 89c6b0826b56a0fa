//! The prior of any model train, as measurements.

use alloc::vec::Vec;

use super::parameters::{
    HYSTERESIS_SPREAD, NODES, PRIOR, SHAPE_DEVIATION, SHAPES, bend_deviation, count, hysteresis_at, knots,
    node_covariance, shape_at, speed_at, speed_prior, usual_residual,
};
use super::survey::SectionIndex;
use crate::linalg::NormalEquations;

/// A sum of a stop and the next start is observed, never the stop alone: a stop that is longer and a start that is later by the
/// same distance fit as well. The laws decide, and trains whose laws differ came to rest elsewhere than estimated, by 5 to 8 mm
/// in two other simulators and by 12 mm (rms over trains, 80 to 260 mm/s) in a third, less at creep speed. Hence one standard
/// deviation as a time (s) at the speed that a train has before the end of its stop, ...
const END_OF_STOP_TIME: f64 = 0.07;
/// ... which is at most this (m/s).
const END_OF_STOP_SPEED: f64 = 0.1;
/// Standard deviation of a law's shape in the middle of a change, as part of its displacement: no shape fits all decoders.
pub(super) const SHAPE_ERROR: f64 = 0.04;
/// Path lengths differ from surveyed lengths by some per cent because of curves and slopes (published section means: 1 to
/// 3 %).
pub(crate) const PATH_LENGTH_SPREAD: f64 = 0.02;
/// Starts are late or early by a tenth of their delay (observed on trains that need 0.5 to 1 s to start), in s.
pub(crate) const LATE_START: f64 = 0.06;
/// Repeats of a run differ by 0.3 to 0.8 %, ...
pub(crate) const TRIP_DEVIATION: f64 = 0.006;
/// ... and within a run speed wanders by some tenths of a per cent over ten seconds.
pub(crate) const WANDER: f64 = 0.002;
/// Standard deviation of the displacement of a single change, as part of it.
const CHANGE_ERROR: f64 = 0.05;
/// ... and its least value (m).
const LEAST_CHANGE_ERROR: f64 = 0.001;

/// Displacement per change of speed in half of the published changes (s); only used for uncertainties.
const USUAL_DELAY: f64 = 0.8;

/// Prior variance of a section's path length over its surveyed length (m²).
pub(crate) fn section_variance(sections: &SectionIndex, section: usize) -> f64 {
    let spread = PATH_LENGTH_SPREAD * sections.surveyed_length(section);
    sections.survey_variance(section) + spread * spread
}

/// Standard deviation of the distance that a change adds to its law (m), by its change of speed (m/s).
pub(crate) fn change_error(change: f64) -> f64 {
    CHANGE_ERROR * USUAL_DELAY * change.abs() + LEAST_CHANGE_ERROR
}

/// Standard deviation (m) of where a stop from a speed (m/s) ends, beyond the uncertainty of the fit: see [`END_OF_STOP_TIME`].
pub(crate) fn end_of_stop(speed: f64) -> f64 {
    END_OF_STOP_TIME * speed.clamp(0.0, END_OF_STOP_SPEED)
}

/// Variance of ln speed between runs. A speed without uncertainty was given to an oracle for this very run.
pub(crate) fn run_variance(of_step: f64) -> f64 {
    if of_step > 0.0 { TRIP_DEVIATION * TRIP_DEVIATION } else { 0.0 }
}

/// The prior of the numbers of any train: the equations that a fit begins with.
pub(crate) fn prior(highest: usize) -> NormalEquations {
    let mut equations = NormalEquations::new(count(highest));
    for (column, (mean, deviation)) in PRIOR.iter().enumerate() {
        equations.add(&[(column, 1.0)], *mean, deviation * deviation);
    }
    for place in (shape_at(false, highest)..).take(2 * SHAPES) {
        equations.add(&[(place, 1.0)], 0.0, SHAPE_DEVIATION * SHAPE_DEVIATION);
    }
    let knots = knots(highest);
    for knot in 1..=knots {
        let (mean, deviation) = speed_prior(knot, knots);
        equations.add(&[(speed_at(knot), 1.0)], mean, deviation * deviation);
        let spread = HYSTERESIS_SPREAD * HYSTERESIS_SPREAD;
        equations.add(&[(hysteresis_at(knot, highest), 1.0)], 0.0, spread);
    }
    for knot in 2..knots {
        // Over three knots ln speed bends as the usual shape does, with this standard deviation.
        let bend = |knot: usize| speed_prior(knot, knots).0;
        let usual = bend(knot + 1) - 2.0 * bend(knot) + bend(knot - 1);
        let deviation = bend_deviation(knot);
        let terms = [(speed_at(knot + 1), 1.0), (speed_at(knot), -2.0), (speed_at(knot - 1), 1.0)];
        equations.add(&terms, usual, deviation * deviation);
    }
    equations
}

/// Sums of the nodes from `first` on that are independent with variance one where laws leave over what is usual, each with its
/// usual value: rows of the inverse Cholesky factor of their covariance.
pub(super) fn independent_nodes(first: usize) -> impl Iterator<Item = (Vec<(usize, f64)>, f64)> {
    whitened().into_iter().enumerate().map(move |(node, terms)| {
        let terms = terms.into_iter().take(node + 1);
        let usual = terms.clone().sum::<f64>() * usual_residual(first);
        (terms.enumerate().map(|(i, weight)| (first + i, weight)).collect(), usual)
    })
}

/// The inverse of the lower Cholesky factor of the covariance of the nodes.
#[expect(
    clippy::indexing_slicing,
    clippy::needless_range_loop,
    reason = "indices stay below the number of nodes"
)]
pub(crate) fn whitened() -> [[f64; NODES]; NODES] {
    let mut root = [[0.0; NODES]; NODES];
    for i in 0..NODES {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| root[i][k] * root[j][k]).sum();
            let left = node_covariance(i, j) - sum;
            root[i][j] = if i == j { libm::sqrt(left.max(1e-12)) } else { left / root[j][j] };
        }
    }
    let mut inverse = [[0.0; NODES]; NODES];
    for j in 0..NODES {
        for i in j..NODES {
            let sum: f64 = (j..i).map(|k| root[i][k] * inverse[k][j]).sum();
            let unit = if i == j { 1.0 } else { 0.0 };
            inverse[i][j] = (unit - sum) / root[i][i];
        }
    }
    inverse
}
