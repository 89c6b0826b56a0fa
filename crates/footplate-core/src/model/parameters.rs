//! The parameter vector of a train's response to commands, and its prior.
//!
//! SI units throughout. Letters: `q` delay from command to effect, `θ` lag, `κ` ramp time for a change of speed (half of
//! it, so that a stop takes κv², which is v²/2a), `ρ` ramp time a throttle step, `h` by how much a step reached from above
//! is faster.

use alloc::vec::Vec;
use core::cell::Cell;

/// Places of the single numbers.
pub(super) const HYSTERESIS: usize = 0;
/// Delay, lag, `κ` and `ρ` of a direction, from here.
pub(super) const UP: usize = 1;
/// See [`UP`].
pub(super) const DOWN: usize = 5;
/// Delay of a start from rest.
pub(super) const START_DELAY: usize = 9;
/// Deceleration by friction alone, without drive (m/s²).
pub(super) const FRICTION: usize = 10;
/// What the law of stops leaves over, by node of speed.
pub(super) const STOP_NODES: usize = 11;
/// The same for starts: how much further the train has run once it is steady.
pub(super) const START_NODES: usize = STOP_NODES + NODES;
/// ln of the steady speeds from below, from knot 1 on.
pub(super) const SPEEDS: usize = START_NODES + NODES;

/// Nodes of what laws leave over.
pub(super) const NODES: usize = 8;
/// Their speeds (m/s): model trains on 14 steps run at up to 0.65 m/s (published tables).
const NODE_SPACING: f64 = 0.1;

/// Prior mean and standard deviation of the single numbers.
///
/// Hysteresis: 13 to 31 mm/s in 7 of 8 published tables. Delays of running trains: 0.16 to 0.26 s from the stop command
/// to the first slowing (trains 45, 47, 49); of starts up to 1.0 s. Lags up to 1.5 s, rates from 130 to 980 mm/s²
/// (κ = 1/2a), momentum from 0 to 0.35 s a step (CV 3 and 4 up to 6). Friction ends
/// stops that would else never end: within 3.3 s on trains 47 and 49.
pub(super) const PRIOR: [(f64, f64); STOP_NODES] = [
    (0.018, 0.010),
    (0.18, 0.06),
    (0.45, 0.45),
    (1.6, 1.6),
    (0.04, 0.08),
    (0.18, 0.06),
    (0.55, 0.50),
    (1.6, 1.6),
    (0.04, 0.08),
    (0.55, 0.35),
    (0.015, 0.008),
];

/// Top speed of all published trains on 14 steps: 0.57 to 0.65 m/s; nothing is published for others.
const TOP_SPEED: (f64, f64) = (0.61, 0.2);
/// Exponent of speed over step, between even and steep trains, and standard deviation of ln speed at the lowest step.
const SPEED_POWER: f64 = 1.35;
const SPEED_SPREAD: f64 = 0.8;
/// How much ln speed bends from step to step beyond that shape (published tables, steps 3 and up).
pub(super) const BEND: f64 = 0.12;
/// Standard deviation of hysteresis from step to step (m/s).
pub(super) const HYSTERESIS_SPREAD: f64 = 0.004;
/// Below this speed hysteresis shrinks in proportion (trains 1 and 78: 7 mm/s at 16 mm/s, 15 at 70).
const FULL_HYSTERESIS_FROM: f64 = 0.12;

/// Prior standard deviation of what laws leave over: a few millimetres at creep speed, and this share of the speed (m per m/s).
const RESIDUAL_FLOOR: f64 = 0.003;
const RESIDUAL_BY_SPEED: f64 = 0.06;
/// Stops end further than their law by this, and starts are later by the same (m): no sum of a stop and the next start shows it,
/// and trains with other equations came to rest 5 to 8 mm beyond an estimate without it.
const LONGER_STOP: f64 = 0.004;
/// Correlation length of what laws leave over, as a difference of speed (m/s).
const RESIDUAL_LENGTH: f64 = 0.2;

/// How many numbers describe the shape of stops, and as many that of starts: see [`Answers::shape`].
pub(super) const SHAPES: usize = 2;
/// Prior standard deviation of each. In the middle of a change both together make twice [`SHAPE_ERROR`](super::priors::SHAPE_ERROR):
/// braking in two stages and constant power differ by more from their nearest law than published decoders do.
pub(super) const SHAPE_DEVIATION: f64 = 2.0 * core::f64::consts::SQRT_2 * super::priors::SHAPE_ERROR;

/// Decoders of 28 and 126 steps have numbers of their own at this many steps, evenly spread. All published tables are of 14
/// steps, and a track has no time for more.
const MOST_KNOTS: usize = 14;

/// How many steps of a decoder have numbers of their own: its knots. Knot `k` is step `k` times [`stride`]; in between, speed is a
/// power of the step.
pub(super) const fn knots(highest: usize) -> usize {
    if highest.is_multiple_of(MOST_KNOTS) && highest > 0 { MOST_KNOTS } else { highest }
}

/// Steps from one knot to the next: 1 for a decoder of 14 steps, 2 for 28, 9 for 126.
pub(super) const fn stride(highest: usize) -> usize {
    match highest.checked_div(knots(highest)) {
        Some(stride) => stride,
        None => 1,
    }
}

/// The knots at or next to a step, with their weights in ln speed and in hysteresis. Below the first knot, the first counts alone.
pub(super) fn knots_about(step: usize, highest: usize) -> [(usize, f64); 2] {
    let stride = stride(highest);
    let knot = (step / stride).clamp(1, knots(highest).max(1));
    let at = knot * stride;
    if step <= at {
        return [(knot, 1.0), (knot, 0.0)];
    }
    let along = |step: usize| libm::log(step as f64 / at as f64);
    let part = along(step) / along(at + stride);
    [(knot, 1.0 - part), (knot + 1, part)]
}

/// Standard deviation of ln speed at a step for being between two knots: a line between two of three points that bend by
/// [`BEND`] is off by an eighth of it in the middle.
pub(super) fn between_knots(step: usize, highest: usize) -> f64 {
    let [(knot, left), (_, right)] = knots_about(step, highest);
    0.5 * left * right * bend_deviation(knot)
}

/// How many numbers a train has: the single ones, nodes, speeds and hysteresis by knot, shapes.
pub(super) const fn count(highest: usize) -> usize {
    SPEEDS + 2 * knots(highest) + 2 * SHAPES
}

/// Place of the first shape number of starts (`up`) or stops.
pub(super) const fn shape_at(up: bool, highest: usize) -> usize {
    SPEEDS + 2 * knots(highest) + if up { SHAPES } else { 0 }
}

/// Place of ln speed from below at a knot from 1 on.
pub(super) const fn speed_at(knot: usize) -> usize {
    SPEEDS + knot - 1
}

/// Place of the deviation of hysteresis at a knot.
pub(super) const fn hysteresis_at(knot: usize, highest: usize) -> usize {
    SPEEDS + knots(highest) + knot - 1
}

/// Standard deviation of the bend of ln speed at a knot: freer at the lowest.
pub(super) fn bend_deviation(knot: usize) -> f64 {
    BEND * (1.0 + 6.0 / (knot * knot) as f64)
}

/// Prior mean and standard deviation of ln speed at a step.
pub(super) fn speed_prior(step: usize, highest: usize) -> (f64, f64) {
    let part = step as f64 / highest.max(1) as f64;
    let mean = libm::log(TOP_SPEED.0) + SPEED_POWER * libm::log(part);
    (mean, TOP_SPEED.1 + SPEED_SPREAD * (1.0 - part))
}

/// All prior means, speeds included.
pub(super) fn prior_means(highest: usize) -> Vec<f64> {
    let mut means: Vec<f64> = PRIOR.iter().map(|(mean, _)| *mean).collect();
    means.resize(START_NODES, usual_residual(STOP_NODES));
    means.resize(SPEEDS, usual_residual(START_NODES));
    let knots = knots(highest);
    means.extend((1..=knots).map(|knot| speed_prior(knot, knots).0));
    means.resize(count(highest), 0.0);
    means
}

/// Speed (m/s) of a node.
pub(super) const fn node_speed(node: usize) -> f64 {
    NODE_SPACING * (node + 1) as f64
}

/// Prior covariance of two nodes of what laws leave over: nodes of similar speed are similar.
pub(super) fn node_covariance(i: usize, j: usize) -> f64 {
    let size = |node: usize| RESIDUAL_FLOOR + RESIDUAL_BY_SPEED * node_speed(node).min(0.5);
    let apart = (node_speed(i) - node_speed(j)) / RESIDUAL_LENGTH;
    // A hundredth of its own keeps the matrix well conditioned.
    let own = if i == j { 1.01 } else { 1.0 };
    own * size(i) * size(j) * libm::exp(-0.5 * apart * apart)
}

/// Prior mean (m) of what is left over at each of the nodes from `first` on.
pub(super) const fn usual_residual(first: usize) -> f64 {
    if first == START_NODES { -LONGER_STOP } else { LONGER_STOP }
}

/// The two nodes next to a speed with their weights; below the first node the value falls to zero at standstill.
pub(super) fn nodes_about(speed: f64) -> [(usize, f64); 2] {
    let along = speed / NODE_SPACING - 1.0;
    if along <= 0.0 {
        return [(0, (speed / NODE_SPACING).max(0.0)), (1, 0.0)];
    }
    let low = (along as usize).min(NODES - 2);
    let part = (along - low as f64).clamp(0.0, 1.0);
    [(low, 1.0 - part), (low + 1, part)]
}

/// Two speeds whose logarithms differ by more are not equal by rounding: thousands of times what exp and log may be off by.
const LN_ROUNDING: f64 = 1e-9;

/// Least friction (m/s²): a tenth of that of a wheel on a level rail.
const LEAST_FRICTION: f64 = 1e-3;

/// How a train answers, read from a vector of numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Answers<'v> {
    values: &'v [f64],
    highest: usize,
    /// Notes the places of the numbers that are read, if someone asks.
    read: Option<&'v Read>,
}

/// The places of numbers that were read. What was not read cannot have changed the result, so that its slope is zero.
#[derive(Debug)]
pub(super) struct Read(Cell<u128>);

impl Read {
    pub(super) const fn nothing() -> Self {
        Self(Cell::new(0))
    }

    fn note(&self, place: usize) {
        self.0.set(self.0.get() | Self::bit(place));
    }

    /// Whether a number may have been read: places beyond the last bit share it.
    pub(super) fn contains(&self, place: usize) -> bool {
        self.0.get() & Self::bit(place) != 0
    }

    fn bit(place: usize) -> u128 {
        1 << place.min(127)
    }
}

impl<'v> Answers<'v> {
    pub(super) const fn new(values: &'v [f64], highest: usize) -> Self {
        Self { values, highest, read: None }
    }

    /// The same, noting what is read.
    pub(super) const fn noting(values: &'v [f64], highest: usize, read: &'v Read) -> Self {
        Self { values, highest, read: Some(read) }
    }

    fn at(&self, place: usize) -> f64 {
        if let Some(read) = self.read {
            read.note(place);
        }
        self.values.get(place).copied().unwrap_or(0.0)
    }

    /// Steady speed (m/s) at a step, reached from above or not.
    pub(crate) fn speed(&self, step: usize, above: bool) -> f64 {
        let step = step.min(self.highest);
        if step == 0 {
            return 0.0;
        }
        let below = libm::exp(self.bounded_ln_speed(step));
        if above { self.speed_above(step, below) } else { below }
    }

    /// ln of the steady speed from below, where exponentials have meaning.
    pub(super) fn bounded_ln_speed(&self, step: usize) -> f64 {
        self.ln_speed(step).clamp(-12.0, 3.0)
    }

    /// Steady speed from above at a step with this speed from below.
    fn speed_above(&self, step: usize, below: f64) -> f64 {
        let [low, high] = knots_about(step, self.highest)
            .map(|(knot, weight)| weight * self.at(hysteresis_at(knot, self.highest)));
        let full = self.at(HYSTERESIS) + (low + high);
        (below + full * Self::hysteresis_part(below)).max(0.5 * below)
    }

    /// ln of the steady speed from below at a step from 1 on.
    pub(super) fn ln_speed(&self, step: usize) -> f64 {
        let first = stride(self.highest);
        let [low, high] =
            knots_about(step, self.highest).map(|(knot, weight)| weight * self.at(speed_at(knot)));
        let ln_speed = low + high;
        if step < first {
            ln_speed + SPEED_POWER * libm::log(step.max(1) as f64 / first as f64)
        } else {
            ln_speed
        }
    }

    /// The fractional step that corresponds to a set speed (m/s) of a train commanded to `near`. Other steps count with their
    /// speeds from below, as a ramp passes them.
    pub(super) fn step_at(&self, near: usize, set: f64) -> f64 {
        let near = near.min(self.highest);
        let below = self.speed(near, false);
        let above = if near == 0 { 0.0 } else { self.speed_above(near, below) };
        if (below..=above).contains(&set) {
            return near as f64;
        }
        let stride = stride(self.highest);
        // Logarithms tell most steps apart without an exponential, which costs more than all else here.
        let surely_slower = libm::log(set) - LN_ROUNDING;
        for step in (1..=knots(self.highest)).map(|knot| knot * stride) {
            if self.bounded_ln_speed(step) < surely_slower {
                continue;
            }
            let speed = self.speed(step, false);
            if speed >= set {
                let low = self.speed(step - stride, false);
                let part = ((set - low) / (speed - low).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                return (step - stride) as f64 + stride as f64 * part;
            }
        }
        self.highest as f64
    }

    /// The part of full hysteresis at a speed (m/s).
    pub(super) const fn hysteresis_part(speed: f64) -> f64 {
        (speed / FULL_HYSTERESIS_FROM).min(1.0)
    }

    /// Delay from command to effect of a running train (s).
    pub(super) fn delay(&self, up: bool) -> f64 {
        self.at(if up { UP } else { DOWN }).max(0.0)
    }

    /// Delay from command to effect of a train at rest (s).
    pub(super) fn start_delay(&self) -> f64 {
        self.at(START_DELAY).max(0.0)
    }

    /// Deceleration by friction alone (m/s²).
    pub(super) fn friction(&self) -> f64 {
        self.at(FRICTION).max(LEAST_FRICTION)
    }

    /// Lag and ramp (s) of a change by so much speed over so many steps, of which `ρ` counts from knot to knot. Either may be negative where the numbers trade off
    /// against each other, and counts as such in displacements.
    pub(super) fn lag_and_ramp(&self, up: bool, change: f64, steps: f64) -> (f64, f64) {
        let first = if up { UP } else { DOWN };
        let lag = self.at(first + 1);
        let kappa = self.at(first + 2);
        let rho = self.at(first + 3);
        (lag, 2.0 * kappa * change.abs() + rho * (steps.abs() / stride(self.highest) as f64))
    }

    /// What the law leaves over of a stop from a speed (m).
    pub(super) fn stop_residual(&self, speed: f64) -> f64 {
        self.residual(STOP_NODES, speed)
    }

    /// What the law leaves over of a start to a speed (m).
    pub(super) fn start_residual(&self, speed: f64) -> f64 {
        self.residual(START_NODES, speed)
    }

    /// By how much a train is ahead of its law early and late in a start (`up`) or stop, as parts of its displacement: no
    /// law has the shape of every decoder.
    pub(super) fn shape(&self, up: bool) -> [f64; SHAPES] {
        let first = shape_at(up, self.highest);
        core::array::from_fn(|nth| self.at(first + nth))
    }

    fn residual(&self, first: usize, speed: f64) -> f64 {
        nodes_about(speed).iter().map(|(node, weight)| weight * self.at(first + node)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decoder_of_14_steps_has_a_knot_at_each_and_finer_ones_at_as_many() {
        for (highest, spacing) in [(14, 1), (28, 2), (126, 9), (5, 1)] {
            assert_eq!((knots(highest), stride(highest)), (highest / spacing, spacing));
            for knot in 1..=knots(highest) {
                assert_eq!(knots_about(knot * spacing, highest)[0], (knot, 1.0));
                assert_eq!(between_knots(knot * spacing, highest), 0.0);
            }
        }
        assert_eq!(count(126), count(14));
    }

    #[test]
    fn speed_rises_through_the_knots_and_by_a_power_of_the_step_between_them() {
        // A straight line, known only at every ninth step.
        let speed = |step: usize| 0.005 * (step as f64 - 4.0);
        let mut values = prior_means(126);
        for knot in 1..=14 {
            values[speed_at(knot)] = libm::log(speed(9 * knot));
        }
        let answers = Answers::new(&values, 126);
        for step in 1..126 {
            assert!(answers.speed(step, false) < answers.speed(step + 1, false), "step {step}");
            assert!((0.0..0.125 * BEND * 7.0).contains(&between_knots(step, 126)), "step {step}");
        }
        for step in 18..=126 {
            let error = answers.speed(step, false) / speed(step) - 1.0;
            // Within one of the standard deviations that the model states, and never a hundredth.
            assert!(error.abs() < (between_knots(step, 126) + 1e-9).min(0.01), "step {step}: {error}");
        }
        for step in (18..=126).step_by(9) {
            let at = answers.step_at(0, speed(step));
            assert!((at - step as f64).abs() < 1e-6, "step {step}: {at}");
        }
    }
}
