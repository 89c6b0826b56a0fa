//! What is known of any model train before this one has moved, as measurements.

use alloc::vec::Vec;

use super::parameters::{
    BEND, HYSTERESIS_SPREAD, NODES, PRIOR, START_NODES, STOP_NODES, count, hysteresis_at, node_covariance,
    speed_at, speed_prior,
};
use super::survey::SectionIndex;
use crate::linalg::NormalEquations;

/// Nobody sees the last centimetres of a stop: dry friction and gears end it elsewhere than any law, the same way each time, and
/// a start that seems later makes up for it. Healthy trains of two simulators that were written by other equations rested 5 to
/// 8 mm further than believed (m).
pub(crate) const END_OF_STOP: f64 = 0.0035;
/// Part of a change's displacement by which no shape for all decoders is true in its middle.
pub(super) const SHAPE_ERROR: f64 = 0.04;
/// A train feels a hop up to some per cent longer or shorter than it is, for curves and slopes (published section
/// means: 1 to 3 %).
pub(crate) const FELT: f64 = 0.02;
/// A start is late or early by a tenth of its delay (seen on trains that need 0.5 to 1 s to stir).
pub(crate) const LATE_START: f64 = 0.06;
/// Repeats of a run differ by 0.3 to 0.8 %, ...
pub(crate) const TRIP_DEVIATION: f64 = 0.006;
/// ... and within a run speed wanders by some tenths of a per cent over ten seconds.
pub(crate) const WANDER: f64 = 0.002;
/// Part of the displacement of a change by which no law is true.
const CHANGE_ERROR: f64 = 0.05;
/// ... and what is left where the displacement is nothing (m).
const LEAST_CHANGE_ERROR: f64 = 0.001;

/// Half the published starts from one speed to another displace by about so much a speed change (s): only for the size
/// of doubts.
const USUAL_DELAY: f64 = 0.8;

/// Variance beforehand of what a section is longer than its survey (m²).
pub(crate) fn section_variance(sections: &SectionIndex, section: usize) -> f64 {
    let felt = FELT * sections.surveyed_length(section);
    sections.survey_variance(section) + felt * felt
}

/// Standard deviation of what a change adds to the way over what its law says (m), by its change of speed (m/s).
pub(crate) fn change_error(change: f64) -> f64 {
    CHANGE_ERROR * USUAL_DELAY * change.abs() + LEAST_CHANGE_ERROR
}

/// Variance of ln of a speed by which a run differs from all others. A speed that is known for certain is that of the run: an
/// oracle was told it.
pub(crate) fn run_variance(of_step: f64) -> f64 {
    if of_step > 0.0 { TRIP_DEVIATION * TRIP_DEVIATION } else { 0.0 }
}

/// What is known of the numbers of any train: the equations that a fit begins with.
pub(crate) fn prior(highest: usize) -> NormalEquations {
    let mut equations = NormalEquations::new(count(highest));
    for (column, (mean, deviation)) in PRIOR.iter().enumerate() {
        equations.add(&[(column, 1.0)], *mean, deviation * deviation);
    }
    for first in [STOP_NODES, START_NODES] {
        add_nodes(&mut equations, first);
    }
    for step in 1..=highest {
        let (mean, deviation) = speed_prior(step, highest);
        equations.add(&[(speed_at(step), 1.0)], mean, deviation * deviation);
        let spread = HYSTERESIS_SPREAD * HYSTERESIS_SPREAD;
        equations.add(&[(hysteresis_at(step, highest), 1.0)], 0.0, spread);
    }
    for step in 2..highest {
        // Over three steps ln speed bends as the usual shape does, give or take; more freely at the lowest steps.
        let bend = |step: usize| speed_prior(step, highest).0;
        let usual = bend(step + 1) - 2.0 * bend(step) + bend(step - 1);
        let deviation = BEND * (1.0 + 6.0 / (step * step) as f64);
        let terms = [(speed_at(step + 1), 1.0), (speed_at(step), -2.0), (speed_at(step - 1), 1.0)];
        equations.add(&terms, usual, deviation * deviation);
    }
    equations
}

/// The nodes of what a law leaves over, alike where their speeds are: rows of the inverse of the covariance's root.
fn add_nodes(equations: &mut NormalEquations, first: usize) {
    for (node, terms) in whitened().iter().enumerate() {
        let terms: Vec<(usize, f64)> =
            terms.iter().take(node + 1).enumerate().map(|(i, weight)| (first + i, *weight)).collect();
        equations.add(&terms, 0.0, 1.0);
    }
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
