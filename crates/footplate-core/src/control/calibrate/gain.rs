//! What an experiment is expected to bring.
//!
//! The objective is the mean, over usable steps and both approaches, of the doubt of a stop against the scatter that no
//! knowledge would narrow: `(d² + u²) / s²` with `d` the doubt of the stop, `u` that of the way in a second of running, and
//! `s` the scatter. An experiment at one step that measures with noise `n` takes `ρ² d_j² d² / (d² + n²)` from the variance
//! of another step `j` whose doubt shares the part `ρ` with its own: the gain of one scalar measurement (Kalman, 1960).

use super::accuracy::usable_steps;
use super::experiment::Experiment;
use crate::calibration::motion::MotionModel;
use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::time::TimeSpan;
use crate::units::Length;

/// Steps over which what is learnt of one is worth 1/e of it at another: stops follow laws that are smooth in speed.
const SHARED_OVER_STEPS: f64 = 2.0;

/// How much of the doubt at a step the two approaches share.
const SHARED_BY_APPROACHES: f64 = 0.8;

/// A crawl to a contact tells where the train stood this well: a poll of 70 ms at 80 mm/s, and the start before it.
const CRAWL_NOISE: Length = Length::from_mm(4.0);

/// A hop at a steady step is timed this well: two polls of 70 ms, each with a standard deviation of 1/√12 of it.
const TIMING_NOISE: TimeSpan = TimeSpan::from_ms(29);

/// A typical hop, from contact to contact (the mean of the built-in layouts' circuits).
pub(super) const TYPICAL_HOP: Length = Length::from_mm(390.0);

/// A usable scatter never counts as less than this: below it nobody would see the difference.
const LEAST_SCATTER: Length = Length::from_mm(2.0);

/// How much the objective falls by an experiment, summed over usable steps and both approaches.
#[must_use]
pub fn gain(model: &MotionModel, experiment: &Experiment) -> f64 {
    match *experiment {
        Experiment::Stop { step, approach } => gain_of_stop(model, step, approach),
        Experiment::Speed { step, approach } => gain_of_speed(model, step, approach),
        Experiment::Move { step, run } => gain_of_move(model, step, run),
    }
}

fn gain_of_stop(model: &MotionModel, step: SpeedStep, approach: Approach) -> f64 {
    let stop = model.stop(step, approach);
    let own = square(stop.doubt);
    let noise = square(stop.scatter) + square(CRAWL_NOISE);
    let part = own / (own + noise);
    let mut sum = 0.0;
    for other in usable_steps(model) {
        for side in [Approach::Below, Approach::Above] {
            let there = model.stop(other, side);
            let shared = shared_doubt(step, approach, other, side);
            sum += shared * shared * part * square(there.doubt) / square(there.scatter.max(LEAST_SCATTER));
        }
    }
    sum
}

fn gain_of_speed(model: &MotionModel, step: SpeedStep, approach: Approach) -> f64 {
    let speed = model.speed(step, approach);
    let (value, doubt) = (speed.value.as_m_per_s(), speed.uncertainty.as_m_per_s());
    let hop = (TYPICAL_HOP / speed.value.max(crate::units::Speed::from_mm_per_s(10.0))).as_s();
    let noise = value * TIMING_NOISE.as_s() / hop;
    let own = doubt * doubt;
    let part = own / (own + noise * noise);
    // Metres in a second of running.
    let scatter = model.stop(step, approach).scatter.max(LEAST_SCATTER);
    if part.is_finite() { part * own / square(scatter) } else { 0.0 }
}

/// A short move is half a start and half a stop: it narrows what the stop from its step would.
fn gain_of_move(model: &MotionModel, step: SpeedStep, run: TimeSpan) -> f64 {
    let settles = model.settles_within(SpeedStep::STAND, step).as_s().max(0.1);
    let reached = (run.as_s() / settles).clamp(0.0, 1.0);
    0.5 * reached * gain_of_stop(model, step, Approach::Below)
}

fn shared_doubt(step: SpeedStep, approach: Approach, other: SpeedStep, side: Approach) -> f64 {
    let apart = f64::from(step.get().abs_diff(other.get()));
    let across = if approach == side { 1.0 } else { SHARED_BY_APPROACHES };
    across * libm::exp(-apart / SHARED_OVER_STEPS)
}

fn square(length: Length) -> f64 {
    length.as_m() * length.as_m()
}
