//! How far and how long a train runs on after the command to stand, from stops measured by hand.
//!
//! All distances here are counted from where the train was when the command was sent
//! ([`FromCommand`](crate::kinematics::FromCommand)): from the last contact before it, the way run on at the
//! steady speed until the command is taken off what the tape says. Letters: `d` stopping distance, `v` speed,
//! `τ` delay, `a` deceleration, `d = τ v + v²/2a` (the best simple law on published stops).

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use super::joint_fit::{JointFit, SpeedKey};
use super::length_table::SectionIndex;
use super::passage::Passage;
use super::run::{MeasuredStop, RunPassages};
use crate::estimate::Estimate;
use crate::event::Approach;
use crate::ids::{SpeedStep, TrainId};
use crate::kinematics::{FromCommand, StoppingDistance};
use crate::linalg::NormalEquations;
use crate::time::{TimeSpan, Timestamp};
use crate::track::Layout;
use crate::units::{Acceleration, Length, Speed};

/// A tape read to the centimetre beside a train: one standard deviation (m).
const TAPE_M: f64 = 0.005;
/// A person presses the key this long after the train stands (0.2 to 0.5 s), and how that varies (s).
const HUMAN_DELAY_S: f64 = 0.35;
const HUMAN_SPREAD_S: f64 = 0.1;
/// Who says later than this after the command where a train stands has read a tape and not a watch: no published
/// model train takes half as long to stop.
const WATCHED: TimeSpan = TimeSpan::from_ms(15_000);
/// Stops of one train from one speed scatter by 4 mm at mid speed and 21 mm at top speed (published): by this
/// part of the distance, until a train has shown its own.
const STOP_SCATTER: f64 = 0.015;
/// What the two terms miss at a single step (m): 20 mm rms over 49 published series.
const LAW_ERROR_M: f64 = 0.020;
/// Priors of the two unknowns of the law: delay 0.7 ± 0.5 s, 1/2a for 180 to 980 mm/s².
const DELAY_PRIOR: (f64, f64) = (0.7, 0.5);
const HALF_INVERSE_PRIOR: (f64, f64) = (1.3, 1.0);

/// One stop as measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StopMeasurement {
    /// The train.
    pub train: TrainId,
    /// The step from which it stopped.
    pub step: SpeedStep,
    /// The run, and the entry that tells where it stood.
    pub run: usize,
    /// See `run`.
    pub entry: usize,
    /// Speed when the command was sent, with one standard deviation.
    pub speed: [Speed; 2],
    /// Distance from the command to standing.
    pub distance: StoppingDistance<FromCommand>,
    /// One standard deviation of it.
    pub uncertainty: Length,
    /// Time from the command until the train stood, the delay of the person who saw it taken off; `None` where only a
    /// tape was read, some time later.
    pub time: Option<TimeSpan>,
}

/// The stops of one train.
#[derive(Debug, Clone, PartialEq)]
pub struct StopTable {
    /// Every stop.
    pub measurements: Vec<StopMeasurement>,
    /// By step: distance and time from the command, with the speed they belong to.
    pub steps: BTreeMap<SpeedStep, StopEntry>,
    /// The law through all steps; `None` with fewer than two different steps.
    pub law: Option<TwoTermLaw>,
}

/// Stops from one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StopEntry {
    /// Mean speed before the stops.
    pub speed: Speed,
    /// Mean distance from the command; the uncertainty is of the mean.
    pub distance: Estimate<Length>,
    /// Mean time from the command; the uncertainty is of the mean. `None` where nobody watched.
    pub time: Option<Estimate<TimeSpan>>,
    /// Scatter of single stops, measured where there are several.
    pub scatter: Option<Length>,
    /// What the two-term law says too little (positive) or too much here.
    pub residual: Option<Length>,
}

/// d = τ v + v²/2a, counted from the command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoTermLaw {
    /// τ.
    pub delay: Estimate<TimeSpan>,
    /// a.
    pub deceleration: Estimate<Acceleration>,
    /// Root mean square of the residuals by step.
    pub rms: Length,
}

/// The stops of each train among the runs.
#[must_use]
pub(super) fn stop_tables(
    layout: &Layout,
    sections: &SectionIndex,
    runs: &[RunPassages],
    fit: &JointFit,
) -> BTreeMap<TrainId, StopTable> {
    let mut by_train: BTreeMap<TrainId, Vec<StopMeasurement>> = BTreeMap::new();
    for run in runs {
        let measured = run.stops.iter().filter_map(|stop| measurement(layout, sections, run, stop, fit));
        by_train.entry(run.train).or_default().extend(measured);
    }
    let measured = by_train.into_iter().filter(|(_, measurements)| !measurements.is_empty());
    measured.map(|(train, measurements)| (train, table(measurements))).collect()
}

fn measurement(
    layout: &Layout,
    sections: &SectionIndex,
    run: &RunPassages,
    stop: &MeasuredStop,
    fit: &JointFit,
) -> Option<StopMeasurement> {
    let landmark = layout.sensor_node(stop.landmark)?;
    let before = run.passages.iter().rposition(|passage| passage.window.until <= stop.commanded)?;
    let last = run.passages.get(before)?;
    // From the last contact before the command to the landmark, over the contacts passed while braking.
    let mut way = 0.0;
    let mut reached = last.node == landmark;
    for passage in run.passages.get(before + 1..).unwrap_or_default() {
        if reached {
            break;
        }
        let correction = fit.correction(sections, run.train, passage)?;
        way += (passage.way?.length + correction).as_m();
        reached = passage.node == landmark;
    }
    if !reached {
        return None;
    }
    let (speed, part) = speed_before(run, last, fit)?;
    let run_on = (stop.commanded - last.window.middle()).as_s();
    let distance = way + stop.offset.as_m() - speed * run_on;
    if distance <= 0.0 {
        return None;
    }
    let variance = TAPE_M * TAPE_M
        + speed * speed * last.window.variance_s2()
        + (run_on * speed * part) * (run_on * speed * part);
    Some(StopMeasurement {
        train: run.train,
        step: stop.from,
        run: run.run,
        entry: stop.entry,
        speed: [Speed::from_m_per_s(speed), Speed::from_m_per_s(speed * part)],
        distance: StoppingDistance::new(Length::from_m(distance)),
        uncertainty: Length::from_m(libm::sqrt(variance)),
        time: (stop.seen - stop.commanded <= WATCHED)
            .then(|| stop.seen - stop.commanded - TimeSpan::from_s(HUMAN_DELAY_S)),
    })
}

/// Speed of the run when it passed `last`, and its uncertainty as a part of it.
fn speed_before(run: &RunPassages, last: &Passage, fit: &JointFit) -> Option<(f64, f64)> {
    let key = SpeedKey { train: run.train, step: last.drive.step, approach: last.drive.approach() };
    let table =
        fit.speeds.get(&key).copied().or_else(|| fit.speed(run.train, last.drive.step, Approach::Below))?;
    let part = table.uncertainty / table.value;
    let own = fit.passages.iter().rev().find(|passage| passage.run == run.run && passage.key == key);
    Some((own.map_or(table.value, |passage| passage.stretch_speed).as_m_per_s(), part))
}

fn table(measurements: Vec<StopMeasurement>) -> StopTable {
    let mut by_step: BTreeMap<SpeedStep, Vec<StopMeasurement>> = BTreeMap::new();
    for measured in &measurements {
        by_step.entry(measured.step).or_default().push(*measured);
    }
    let mut steps: BTreeMap<SpeedStep, StopEntry> =
        by_step.iter().map(|(step, stops)| (*step, entry(stops))).collect();
    let law = two_terms(&steps);
    if let Some(law) = &law {
        for entry in steps.values_mut() {
            let fitted = law_distance(law, entry.speed);
            entry.residual = Some(entry.distance.value - fitted);
        }
    }
    StopTable { measurements, steps, law }
}

fn entry(stops: &[StopMeasurement]) -> StopEntry {
    let n = stops.len() as f64;
    let mean = |value: &dyn Fn(&StopMeasurement) -> f64| stops.iter().map(value).sum::<f64>() / n;
    let distance = mean(&|stop| stop.distance.length().as_m());
    let squares = |value: &dyn Fn(&StopMeasurement) -> f64, middle: f64| {
        stops.iter().map(|stop| (value(stop) - middle) * (value(stop) - middle)).sum::<f64>()
    };
    let scatter = (stops.len() > 1)
        .then(|| libm::sqrt(squares(&|stop| stop.distance.length().as_m(), distance) / (n - 1.0)));
    // Two or three stops say little of their scatter: it is never believed below what the reading allows, nor
    // below what published trains scatter.
    let reading = mean(&|stop| stop.uncertainty.as_m() * stop.uncertainty.as_m());
    let expected = STOP_SCATTER * distance;
    let single = libm::sqrt(reading + expected * expected).max(scatter.unwrap_or(0.0));
    let count = stops.len() as u32;
    // Stops are dated by their run's clock, as everything of a recording is.
    let date = Timestamp::ZERO;
    StopEntry {
        speed: Speed::from_m_per_s(mean(&|stop| stop.speed[0].as_m_per_s())),
        distance: Estimate {
            value: Length::from_m(distance),
            uncertainty: Length::from_m(single / libm::sqrt(n)),
            count,
            date,
        },
        time: mean_time(stops),
        scatter: scatter.map(Length::from_m),
        residual: None,
    }
}

/// Mean time to rest of the stops that somebody watched.
fn mean_time(stops: &[StopMeasurement]) -> Option<Estimate<TimeSpan>> {
    let times: Vec<f64> = stops.iter().filter_map(|stop| Some(stop.time?.as_s())).collect();
    if times.is_empty() {
        return None;
    }
    let n = times.len() as f64;
    let mean = times.iter().sum::<f64>() / n;
    let squares: f64 = times.iter().map(|time| (time - mean) * (time - mean)).sum();
    let spread = if times.len() > 1 { squares / (n - 1.0) } else { 0.0 };
    let single = libm::sqrt(spread.max(HUMAN_SPREAD_S * HUMAN_SPREAD_S));
    Some(Estimate {
        value: TimeSpan::from_s(mean),
        uncertainty: TimeSpan::from_s(single / libm::sqrt(n)),
        count: times.len() as u32,
        date: Timestamp::ZERO,
    })
}

fn two_terms(steps: &BTreeMap<SpeedStep, StopEntry>) -> Option<TwoTermLaw> {
    if steps.len() < 2 {
        return None;
    }
    let mut system = NormalEquations::new(2);
    system.add(&[(0, 1.0)], DELAY_PRIOR.0, DELAY_PRIOR.1 * DELAY_PRIOR.1);
    system.add(&[(1, 1.0)], HALF_INVERSE_PRIOR.0, HALF_INVERSE_PRIOR.1 * HALF_INVERSE_PRIOR.1);
    let mut count = 0;
    for entry in steps.values() {
        let (v, u) = (entry.speed.as_m_per_s(), entry.distance.uncertainty.as_m());
        system.add(&[(0, v), (1, v * v)], entry.distance.value.as_m(), u * u + LAW_ERROR_M * LAW_ERROR_M);
        count += entry.distance.count;
    }
    let solved = system.solve()?;
    let [delay, half_inverse] = solved.values.first_chunk().copied()?;
    if half_inverse <= 0.0 {
        return None;
    }
    let deceleration = 1.0 / (2.0 * half_inverse);
    let date = Timestamp::ZERO;
    let mut law = TwoTermLaw {
        delay: Estimate {
            value: TimeSpan::from_s(delay),
            uncertainty: TimeSpan::from_s(libm::sqrt(solved.variance(0))),
            count,
            date,
        },
        deceleration: Estimate {
            value: Acceleration::from_m_per_s2(deceleration),
            uncertainty: Acceleration::from_m_per_s2(
                deceleration * libm::sqrt(solved.variance(1)) / half_inverse,
            ),
            count,
            date,
        },
        rms: Length::ZERO,
    };
    let squares: f64 = steps
        .values()
        .map(|entry| (entry.distance.value - law_distance(&law, entry.speed)).as_m())
        .map(|off| off * off)
        .sum();
    law.rms = Length::from_m(libm::sqrt(squares / steps.len() as f64));
    Some(law)
}

fn law_distance(law: &TwoTermLaw, speed: Speed) -> Length {
    let v = speed.as_m_per_s();
    speed * law.delay.value + Length::from_m(v * v / (2.0 * law.deceleration.value.as_m_per_s2()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_terms_are_found_behind_five_steps() {
        // Given stops that follow τ = 0.9 s, a = 400 mm/s² exactly, at five speeds,
        let stops = [0.15, 0.25, 0.35, 0.45, 0.55].iter().zip(1_u8..).map(|(v, step)| {
            let d = 0.9 * v + v * v / 0.8;
            StopMeasurement {
                train: TrainId(1),
                step: SpeedStep::new(step).unwrap(),
                run: 0,
                entry: 0,
                speed: [Speed::from_m_per_s(*v), Speed::ZERO],
                distance: StoppingDistance::new(Length::from_m(d)),
                uncertainty: Length::from_mm(3.0),
                time: Some(TimeSpan::from_s(2.0)),
            }
        });
        let table = table(stops.collect());
        // then both terms come back, and the residuals are within the doubt of the law.
        let law = table.law.unwrap();
        assert!((law.delay.value.as_s() - 0.9).abs() < 2.0 * law.delay.uncertainty.as_s());
        assert!((law.deceleration.value.as_mm_per_s2() - 400.0).abs() < 60.0, "{law:?}");
        assert!(law.rms < Length::from_mm(5.0));
    }
}
