//! A run as a wheel counts its pulses, and the score of an estimate of it; the generator shares no formula with the
//! filters.

use std::f64::consts::PI;
use std::ops::Range;

use footplate_core::odometry::paper::LocalFilter;

use crate::draw::Draw;

pub(crate) const PERIOD: f64 = 0.05;
const DIAMETER: f64 = 0.86;
/// Initial speed of every run (m/s).
pub(crate) const FIRST_SPEED: f64 = 16.0;
pub(crate) const SEEDS: Range<u64> = 1..11;

/// Variance of a count over a period of random phase, with a little jitter, in pulses².
pub(crate) const VARIANCE_OF_A_COUNT: f64 = 1.0 / 6.0 + 0.05;
/// The variance given to a filter: errors of successive counts cancel, because a pulse missed now is counted next
/// time, and a mean over many is much better than with independent errors.
pub(crate) const FILTER_VARIANCE: f64 = 1.0 / 40.0;

/// Decelerations (m/s²).
pub(crate) const SERVICE_BRAKE: f64 = 0.6;
pub(crate) const EMERGENCY_BRAKE: f64 = 1.3;

/// 16 m/s for 200 s, acceleration to 89 m/s, and deceleration from 575 s on.
pub(crate) struct Run {
    /// Speed and acceleration at the end of every period.
    pub(crate) truth: Vec<[f64; 2]>,
    /// Counts of two rolling wheels, as speeds.
    pub(crate) counts: Vec<[f64; 2]>,
    /// The speed of one pulse in a period (m/s).
    pub(crate) quantum: f64,
}

impl Run {
    pub(crate) fn new(teeth: f64, braking: f64, seed: u64) -> Self {
        let mut draw = Draw::new(seed);
        let pitch = PI * DIAMETER / teeth;
        let phases = [draw.share(), draw.share()];
        let jerk = 0.5 + braking;
        let (mut distance, mut speed, mut acceleration): (f64, f64, f64) = (0.0, FIRST_SPEED, 0.0);
        let mut counted = [0.0; 2];
        let (mut truth, mut counts) = (Vec::new(), Vec::new());
        let fine = PERIOD / 10.0;
        for moment in 0..120_000 {
            let time = f64::from(moment) * fine;
            let wanted = match time {
                ..200.0 => 0.0,
                // Full tractive effort, then full power, then what is left to 89 m/s.
                ..575.0 => (0.5_f64).min(20.0 / speed).min(0.3 * (89.0 - speed)),
                _ => -braking,
            };
            acceleration += (wanted - acceleration).clamp(-jerk * fine, jerk * fine);
            distance += fine * (speed + 0.5 * fine * acceleration);
            speed += fine * acceleration;
            if moment % 10 == 9 {
                let now = phases.map(|phase| (distance / pitch + phase + draw.within(-0.05, 0.05)).floor());
                let [[first, second], [first_before, second_before]] = [now, counted];
                let pulses = [first - first_before, second - second_before];
                counts.push(pulses.map(|pulses| pulses * pitch / PERIOD));
                truth.push([speed, acceleration]);
                counted = now;
            }
        }
        Self { truth, counts, quantum: pitch / PERIOD }
    }
}

#[derive(Debug)]
pub(crate) struct Score {
    /// Root mean square error of the speed.
    pub(crate) rms: f64,
    /// Largest error at the start of the acceleration, from 200 to 205 s.
    pub(crate) onset: f64,
    /// Largest error at the start of the braking, from 575 to 580 s.
    pub(crate) braking: f64,
    /// Mean normalised estimation error squared, per component: 1 if the covariance matches the errors.
    pub(crate) nees: f64,
    /// Part of the time for which the true speed is within two standard deviations.
    pub(crate) inside: f64,
}

/// Scores an estimator of speed, acceleration and their filter, from each period and its counts.
pub(crate) fn score(
    run: &Run,
    mut estimate: impl FnMut(usize, [f64; 2]) -> ([f64; 2], Option<LocalFilter>),
) -> Score {
    let mut score = Score { rms: 0.0, onset: 0.0, braking: 0.0, nees: 0.0, inside: 0.0 };
    let periods = run.truth.len() as f64;
    for (period, (truth, counts)) in run.truth.iter().zip(&run.counts).enumerate() {
        let ([speed, acceleration], filter) = estimate(period, *counts);
        let errors = [speed - truth[0], acceleration - truth[1]];
        score.rms += errors[0] * errors[0] / periods;
        match period as f64 * PERIOD {
            200.0..205.0 => score.onset = score.onset.max(errors[0].abs()),
            575.0..580.0 => score.braking = score.braking.max(errors[0].abs()),
            _ => {}
        }
        if let Some(filter) = filter {
            let [speed, acceleration] = filter.covariance.inverse().applied(errors);
            score.nees += 0.5 * (errors[0] * speed + errors[1] * acceleration) / periods;
            let inside = errors[0].abs() <= 2.0 * filter.covariance.speed.sqrt();
            score.inside += f64::from(u8::from(inside)) / periods;
        }
    }
    score.rms = score.rms.sqrt();
    score
}
