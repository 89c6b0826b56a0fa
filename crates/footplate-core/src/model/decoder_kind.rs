//! What kind of decoder a train most likely has, by how its stops go.
//!
//! One set of numbers describes the stopping distances of all decoders; each kind knows something beforehand that the [model](MotionModel) of
//! all does not:
//!
//! | kind | its set speed | knows |
//! |---|---|---|
//! | lagging | jumps, the motor lags behind | no ramp: κ and ρ are nothing |
//! | even | falls evenly, rounded or eased alike at both ends | ρ is nothing, θ is short |
//! | counted | falls step by step through the speed table | κ is nearly nothing, θ is short |
//!
//! What laws leave over is little in each. What the numbers are for a kind follows from their covariance: what was thought of
//! them beforehand is exchanged for what the kind knows (Gauss; Kalman, 1960), nothing is fitted anew. How well they bear that
//! is the evidence for the kind (MacKay, 1992), and the kind with most of it is taken.
#![expect(
    clippy::indexing_slicing,
    reason = "places of single numbers and nodes are below the side of the matrix"
)]

use alloc::vec::Vec;

use super::motion_model::MotionModel;
use super::parameters::{DOWN, PRIOR, SPEEDS, STOP_NODES};
use super::priors::{SHAPE_ERROR, independent_nodes};

/// Places of lag, `κ` and `ρ` while the speed falls.
const LAG: usize = DOWN + 1;
const KAPPA: usize = DOWN + 2;
const RHO: usize = DOWN + 3;

/// No ramp by speed (s² per m), give or take a tenth of a second of a usual stop.
const NO_KAPPA: (f64, f64) = (0.0, 0.2);
/// No ramp by step (s), give or take a tenth of a second of a usual stop.
const NO_RHO: (f64, f64) = (0.0, 0.015);
/// The speeds that a counter passes are no straight line: a stop from a faster step takes a little more for each, or less.
const LITTLE_KAPPA: (f64, f64) = (0.0, 1.0);
/// Motors that are held to a set speed follow within a tenth of a second; windows that round a ramp are up to 0.9 s, half of
/// which counts as lag.
const SHORT_LAG: (f64, f64) = (0.15, 0.15);
/// What the law of a kind leaves over, as part of what one for all does (published fits of stops: 1.6 to 3.6 mm by the right
/// law, where others miss by 10 to 16).
const LEFT_OVER: f64 = 0.3;

/// So many times as likely as any other kind is clearly, as ln: 150 times.
const CLEARLY: f64 = 5.0;
/// Part of a stop's displacement by which a lag that friction ends is not the shape in its middle (published fits of stops by
/// the right law: 1.6 to 3.6 mm of 0.3 to 0.9 m).
const LAG_SHAPE_ERROR: f64 = 0.01;

/// What a decoder makes of a stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DecoderKind {
    Lagging,
    Even,
    Counted,
}

impl DecoderKind {
    const ALL: [Self; 3] = [Self::Lagging, Self::Counted, Self::Even];

    /// What it knows: places with mean and standard deviation.
    const fn knows(self) -> [(usize, (f64, f64)); 2] {
        match self {
            Self::Lagging => [(KAPPA, NO_KAPPA), (RHO, NO_RHO)],
            Self::Even => [(RHO, NO_RHO), (LAG, SHORT_LAG)],
            Self::Counted => [(KAPPA, LITTLE_KAPPA), (LAG, SHORT_LAG)],
        }
    }
}

/// A model's numbers as they are if something is known that its prior did not say.
pub(super) struct Supposed {
    /// The model's, of which the first [`SPEEDS`] are exchanged.
    pub(super) values: Vec<f64>,
    /// Their covariance, row after row.
    covariance: Vec<f64>,
    /// ln of how many times as likely it makes what was seen.
    evidence: f64,
}

impl Supposed {
    fn of(model: &MotionModel, kind: DecoderKind) -> Self {
        let covariance =
            (0..SPEEDS * SPEEDS).map(|place| model.spread.between(place / SPEEDS, place % SPEEDS));
        let mut supposed =
            Self { values: model.values.clone(), covariance: covariance.collect(), evidence: 0.0 };
        for (place, known) in kind.knows() {
            supposed.exchange(&[(place, 1.0)], PRIOR[place], known);
        }
        for (sum, usual) in independent_nodes(STOP_NODES) {
            supposed.exchange(&sum, (usual, model.residual_scales[0]), (0.0, LEFT_OVER));
        }
        supposed
    }

    /// Of a sum of numbers times slopes `before` was thought; now it is `known`, more narrowly. Both are a mean and a standard
    /// deviation. The ratio of two normal densities is a measurement.
    fn exchange(&mut self, sum: &[(usize, f64)], before: (f64, f64), known: (f64, f64)) {
        let [weight_before, weight] = [before, known].map(|(_, deviation)| 1.0 / (deviation * deviation));
        let precision = weight - weight_before;
        let measured = (weight * known.0 - weight_before * before.0) / precision;
        let mut with = [0.0; SPEEDS];
        for (place, covariance) in with.iter_mut().enumerate() {
            *covariance =
                sum.iter().map(|(other, slope)| slope * self.covariance[place * SPEEDS + other]).sum();
        }
        let variance = sum.iter().map(|(place, slope)| slope * with[*place]).sum::<f64>() + 1.0 / precision;
        let off = measured - sum.iter().map(|(place, slope)| slope * self.values[*place]).sum::<f64>();
        let means = weight * known.0 * known.0
            - weight_before * before.0 * before.0
            - precision * measured * measured;
        self.evidence += libm::log(before.1 / known.1)
            - 0.5 * (means + libm::log(precision * variance) + off * off / variance);
        for place in 0..SPEEDS {
            self.values[place] += with[place] * off / variance;
            for other in 0..SPEEDS {
                self.covariance[place * SPEEDS + other] -= with[place] * with[other] / variance;
            }
        }
    }
}

impl MotionModel {
    /// The kind of decoder that its numbers bear best, with what they are then.
    pub(super) fn supposed(&self) -> (DecoderKind, Supposed) {
        let [lagging, others @ ..] = self.kinds();
        others
            .into_iter()
            .fold(lagging, |best, other| if other.1.evidence >= best.1.evidence { other } else { best })
    }

    /// Part of a stop's displacement by which no shape is true in its middle. Where a lag is clearly the kind there is no
    /// ramp whose rounding the shape could miss.
    pub(super) fn stop_shape_error(&self) -> f64 {
        let [lagging, counted, even] = self.kinds().map(|(_, supposed)| supposed.evidence);
        if lagging > counted.max(even) + CLEARLY { LAG_SHAPE_ERROR } else { SHAPE_ERROR }
    }

    fn kinds(&self) -> [(DecoderKind, Supposed); 3] {
        DecoderKind::ALL.map(|kind| (kind, Supposed::of(self, kind)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ln of a normal density.
    fn log_normal(off: f64, variance: f64) -> f64 {
        -0.5 * (off * off / variance + (core::f64::consts::TAU * variance).ln())
    }

    #[test]
    fn a_prior_that_is_exchanged_is_as_if_it_had_been_there_from_the_start() {
        // A number, measured as 0.9 ± 0.8 where 0.2 ± 1 was thought of it, and another that is half of it and 0.3 more.
        let (measured, seen, before, known) = (0.9, 0.8_f64.powi(2), (0.2, 1.0), (0.5, 0.3));
        let after = |(mean, deviation): (f64, f64)| {
            let variance = 1.0 / (1.0 / seen + 1.0 / (deviation * deviation));
            (variance * (measured / seen + mean / (deviation * deviation)), variance)
        };
        let (mean, variance) = after(before);
        let mut values = alloc::vec![0.0; SPEEDS];
        let mut covariance = alloc::vec![0.0; SPEEDS * SPEEDS];
        let [one, other] = [LAG, RHO];
        values[one] = mean;
        values[other] = 0.5 * mean + 0.3;
        for [row, column, slope] in [[one, one, 4], [one, other, 2], [other, one, 2], [other, other, 1]] {
            covariance[row * SPEEDS + column] = 0.25 * slope as f64 * variance;
        }
        let mut supposed = Supposed { values, covariance, evidence: 0.0 };
        supposed.exchange(&[(one, 1.0)], before, known);

        let (mean, variance) = after(known);
        let found = |row: usize, column: usize| supposed.covariance[row * SPEEDS + column];
        for (found, exact) in [
            (supposed.values[one], mean),
            (supposed.values[other], 0.5 * mean + 0.3),
            (found(one, one), variance),
            (found(one, other), 0.5 * variance),
            (found(other, other), 0.25 * variance),
        ] {
            assert!((found - exact).abs() < 1e-12, "{found} is {exact}");
        }
        let likely =
            |(mean, deviation): (f64, f64)| log_normal(measured - mean, seen + deviation * deviation);
        let exact = likely(known) - likely(before);
        assert!((supposed.evidence - exact).abs() < 1e-12, "{} is {exact}", supposed.evidence);
    }
}
