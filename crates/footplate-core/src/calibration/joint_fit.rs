//! Speeds, lengths and deviations of all trains in one fit.
//!
//! Unknowns, all as increments about the current best: `u` ln speed of each train, step and approach; `g` the
//! correction of each section that all trains share (m, prior: the survey); `f` what a train adds to it (m);
//! and for each stretch of a run, taken out of the system at once, `t0` its time offset (s) and `e` its
//! deviation in ln speed. The time of contact `i` of a stretch is
//! `z_i = t0 + Σ (L + g + f) / v · exp(−e)`, with v = exp(u): times are fitted, never speeds, so that times
//! are averaged before anything is divided. Gauss and Newton's iteration; the spread of `e` and the scatter
//! of contacts are estimated alongside (expectation and maximisation).
#![expect(clippy::indexing_slicing, reason = "places come from the lists they index, made once at the top")]

use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;

use super::length_table::SectionIndex;
use super::passage::{Drive, Passage};
use super::run::RunPassages;
use crate::estimate::Estimate;
use crate::event::Approach;
use crate::ids::{SpeedStep, TrainId};
use crate::latency::UniformNormal;
use crate::linalg::{Group, NormalEquations, Solution};
use crate::time::{TimeSpan, Timestamp};
use crate::units::{Length, Speed};

/// What a train adds to the correction of a section: see `LengthTable`.
const OWN_DEVIATION_M: f64 = 0.008;
/// Prior of ln speed: 40 mm/s a step give or take a factor of 1.8, as in `SpeedTable`.
const SPEED_A_STEP: f64 = 0.040;
const SPEED_SPREAD: f64 = 0.6;
/// First figures of what is estimated alongside: see `SpeedTable` and `ContactScatter`.
const RUN_DEVIATION: f64 = 0.005;
const SCATTER_M: f64 = 0.003;
/// Contacts are never believed to close more exactly than this (m).
const LEAST_SCATTER_M: f64 = 0.001;
/// Doubt of the fitted way at a single contact (m), before a contact is called improbable.
const WAY_DOUBT_M: f64 = 0.004;
const WEIGHT_OF_FIRST_FIGURES: f64 = 5.0;
/// The time offset of a stretch is free: ± 1000 s.
const OFFSET_VARIANCE: f64 = 1e6;
const ITERATIONS: usize = 12;
/// Outliers are looked for in this many of the last iterations.
const ROUNDS_OF_DOUBT: usize = 8;
/// A contact this improbable (both sides) is taken out and named suspicious.
const SUSPICIOUS: f64 = 1e-4;

/// Which speed: of which train, at which step, reached from which side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SpeedKey {
    /// The train.
    pub train: TrainId,
    /// The step.
    pub step: SpeedStep,
    /// From which side it was reached.
    pub approach: Approach,
}

/// The time of one contact beside what the fit makes of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedPassage {
    /// Which speed it tells of.
    pub key: SpeedKey,
    /// The run, as numbered in what was given.
    pub run: usize,
    /// The passage.
    pub passage: Passage,
    /// How much later the report was than fitted.
    pub late: TimeSpan,
    /// How far that is in mm of way.
    pub late_way: Length,
    /// How likely a report is at least this far off.
    pub probability: f64,
    /// Taken out of the fit because it is too improbable.
    pub suspicious: bool,
    /// The first of its stretch, from which the others are counted.
    pub first: bool,
    /// Speed of the stretch it belongs to.
    pub stretch_speed: Speed,
}

/// What the fit found.
#[derive(Debug, Clone)]
pub struct JointFit {
    /// Speed of each step; the count is of hops.
    pub speeds: BTreeMap<SpeedKey, Estimate<Speed>>,
    /// Stretches behind each speed.
    pub stretches: BTreeMap<SpeedKey, u32>,
    /// Spread of the stretches of a train about its table, in ln speed.
    pub run_deviation: BTreeMap<TrainId, f64>,
    /// Scatter of a train's contacts.
    pub contact_scatter: BTreeMap<TrainId, Length>,
    /// Correction of each section for each train, the shared part included; the count is of passes.
    pub sections: BTreeMap<(TrainId, usize), Estimate<Length>>,
    /// The shared part alone.
    pub shared_sections: BTreeMap<usize, Estimate<Length>>,
    /// Every contact used or refused.
    pub passages: Vec<FittedPassage>,
}

/// One contact of a stretch as the equations see it.
struct Row {
    /// Middle of the window since the first of the stretch (s).
    z: f64,
    /// Variance of the window (s²), and its width (s).
    window: f64,
    width: f64,
    /// Sections passed since the first, with how often.
    sections: Vec<(usize, f64)>,
    /// Surveyed length since the first (m).
    length: f64,
    passage: Passage,
    out: bool,
}

struct Stretch {
    key: SpeedKey,
    run: usize,
    rows: Vec<Row>,
    offset: f64,
    deviation: f64,
    deviation_variance: f64,
}

/// Places of the unknowns in the system.
struct Unknowns {
    speeds: BTreeMap<SpeedKey, usize>,
    shared: BTreeMap<usize, usize>,
    own: BTreeMap<(TrainId, usize), usize>,
    count: usize,
}

impl JointFit {
    /// Fits all runs together. `settle` says how long after a command the speed is settled.
    /// `None` when no run has two linked contacts at a settled speed.
    #[must_use]
    pub fn of(
        sections: &SectionIndex,
        runs: &[RunPassages],
        settle: &dyn Fn(TrainId, Drive) -> TimeSpan,
    ) -> Option<Self> {
        let mut stretches = collect(sections, runs, settle);
        let unknowns = Unknowns::of(&stretches)?;
        let mut x = unknowns.start(&stretches);
        let mut run_deviation: BTreeMap<TrainId, f64> = BTreeMap::new();
        let mut scatter: BTreeMap<TrainId, f64> = BTreeMap::new();
        for stretch in &stretches {
            run_deviation.insert(stretch.key.train, RUN_DEVIATION);
            scatter.insert(stretch.key.train, SCATTER_M);
        }
        let mut solution = None;
        for iteration in 0..ITERATIONS {
            let mut system = NormalEquations::new(unknowns.count);
            unknowns.add_priors(&mut system, &x, sections);
            let groups: Vec<Group<2>> = stretches
                .iter()
                .map(|stretch| {
                    let train = stretch.key.train;
                    stretch.equations(&unknowns, &x, run_deviation[&train], scatter[&train])
                })
                .collect();
            for group in &groups {
                system.add_group(group);
            }
            let step = system.solve()?;
            for (value, change) in x.iter_mut().zip(&step.values) {
                *value += change;
            }
            for (stretch, group) in stretches.iter_mut().zip(&groups) {
                let ([offset, deviation], covariance) = group.own(&step)?;
                stretch.offset = offset;
                stretch.deviation = deviation;
                stretch.deviation_variance = covariance[1][1];
            }
            maximise(&stretches, &unknowns, &x, &mut run_deviation, &mut scatter);
            if iteration + ROUNDS_OF_DOUBT >= ITERATIONS {
                for stretch in &mut stretches {
                    let scatter = scatter[&stretch.key.train];
                    stretch.doubt(&unknowns, &x, scatter);
                }
            }
            solution = Some(step);
        }
        Some(report(&stretches, &unknowns, &x, &solution?, run_deviation, &scatter))
    }

    /// What to add to the surveyed length of the way that led to a passage.
    #[must_use]
    pub fn correction(&self, sections: &SectionIndex, train: TrainId, passage: &Passage) -> Option<Length> {
        let own =
            |hop: &crate::track::HopId| Some(self.sections.get(&(train, sections.section(*hop)?))?.value);
        Some(passage.way.as_ref()?.hops().iter().filter_map(own).sum())
    }

    /// The speed expected of a train at a step, from the side given or else any.
    #[must_use]
    pub fn speed(&self, train: TrainId, step: SpeedStep, approach: Approach) -> Option<Estimate<Speed>> {
        [approach, Approach::Below, Approach::Unknown, Approach::Above]
            .into_iter()
            .find_map(|approach| self.speeds.get(&SpeedKey { train, step, approach }).copied())
    }
}

fn collect(
    sections: &SectionIndex,
    runs: &[RunPassages],
    settle: &dyn Fn(TrainId, Drive) -> TimeSpan,
) -> Vec<Stretch> {
    let mut stretches = Vec::new();
    for run in runs {
        let settle = |drive: Drive| settle(run.train, drive);
        for chain in run.settled_stretches(&settle) {
            let Some(first) = chain.first() else { continue };
            let key = SpeedKey { train: run.train, step: first.drive.step, approach: first.drive.approach() };
            let start = first.window.middle();
            let (mut passed, mut length) = (Vec::new(), 0.0);
            let rows = chain
                .iter()
                .enumerate()
                .map(|(place, passage)| {
                    if let (true, Some(way)) = (place > 0, &passage.way) {
                        length += way.length.as_m();
                        for section in way.hops().iter().filter_map(|hop| sections.section(*hop)) {
                            match passed.iter_mut().find(|(known, _)| *known == section) {
                                Some((_, times)) => *times += 1.0,
                                None => passed.push((section, 1.0)),
                            }
                        }
                    }
                    Row {
                        z: (passage.window.middle() - start).as_s(),
                        window: passage.window.variance_s2(),
                        width: passage.window.width().as_s(),
                        sections: passed.clone(),
                        length,
                        passage: *passage,
                        out: false,
                    }
                })
                .collect();
            stretches.push(Stretch {
                key,
                run: run.run,
                rows,
                offset: 0.0,
                deviation: 0.0,
                deviation_variance: 0.0,
            });
        }
    }
    stretches
}

impl Unknowns {
    fn of(stretches: &[Stretch]) -> Option<Self> {
        let mut unknowns =
            Self { speeds: BTreeMap::new(), shared: BTreeMap::new(), own: BTreeMap::new(), count: 0 };
        for stretch in stretches {
            unknowns.speeds.entry(stretch.key).or_insert(0);
            for (section, _) in stretch.rows.last().map_or(&[][..], |row| &row.sections) {
                unknowns.shared.entry(*section).or_insert(0);
                unknowns.own.entry((stretch.key.train, *section)).or_insert(0);
            }
        }
        let places =
            unknowns.speeds.values_mut().chain(unknowns.shared.values_mut()).chain(unknowns.own.values_mut());
        for (place, slot) in places.enumerate() {
            *slot = place;
            unknowns.count = place + 1;
        }
        (unknowns.count > 0).then_some(unknowns)
    }

    /// A first guess: each speed from all its stretches, lengths as surveyed.
    fn start(&self, stretches: &[Stretch]) -> Vec<f64> {
        let mut x = vec![0.0; self.count];
        for (key, place) in &self.speeds {
            let ends = stretches
                .iter()
                .filter(|stretch| stretch.key == *key)
                .filter_map(|stretch| stretch.rows.last());
            let (length, time) =
                ends.fold((0.0, 0.0), |(length, time), row| (length + row.length, time + row.z));
            x[*place] =
                if length > 0.0 && time > 0.0 { libm::log(length / time) } else { prior_ln_speed(*key) };
        }
        x
    }

    fn add_priors(&self, system: &mut NormalEquations, x: &[f64], sections: &SectionIndex) {
        for (key, place) in &self.speeds {
            system.add(&[(*place, 1.0)], prior_ln_speed(*key) - x[*place], SPEED_SPREAD * SPEED_SPREAD);
        }
        for (section, place) in &self.shared {
            system.add(&[(*place, 1.0)], -x[*place], sections.survey_variance(*section).max(1e-12));
        }
        for place in self.own.values() {
            system.add(&[(*place, 1.0)], -x[*place], OWN_DEVIATION_M * OWN_DEVIATION_M);
        }
    }
}

fn prior_ln_speed(key: SpeedKey) -> f64 {
    libm::log(SPEED_A_STEP * f64::from(key.step.get().max(1)))
}

impl Stretch {
    fn length(&self, row: &Row, unknowns: &Unknowns, x: &[f64]) -> f64 {
        let correction: f64 = row
            .sections
            .iter()
            .map(|(section, times)| {
                times * (x[unknowns.shared[section]] + x[unknowns.own[&(self.key.train, *section)]])
            })
            .sum();
        row.length + correction
    }

    fn speed(&self, unknowns: &Unknowns, x: &[f64]) -> f64 {
        libm::exp(x[unknowns.speeds[&self.key]])
    }

    /// The rows as increments about `x`; `offset` and `deviation` are solved anew each time.
    fn equations(&self, unknowns: &Unknowns, x: &[f64], run_deviation: f64, scatter: f64) -> Group<2> {
        let mut group = Group::new([OFFSET_VARIANCE, run_deviation * run_deviation]);
        let speed = self.speed(unknowns, x);
        let mut terms: Vec<(usize, f64)> = Vec::new();
        for row in self.rows.iter().filter(|row| !row.out) {
            let fitted = self.length(row, unknowns, x) / speed;
            terms.clear();
            terms.push((unknowns.speeds[&self.key], -fitted));
            for (section, times) in &row.sections {
                terms.push((unknowns.shared[section], times / speed));
                terms.push((unknowns.own[&(self.key.train, *section)], times / speed));
            }
            let variance = row.window + scatter * scatter / (speed * speed);
            group.add(&terms, [1.0, -fitted], row.z - fitted, variance);
        }
        group
    }

    fn residual(&self, row: &Row, unknowns: &Unknowns, x: &[f64]) -> f64 {
        let speed = self.speed(unknowns, x) * libm::exp(self.deviation);
        row.z - self.offset - self.length(row, unknowns, x) / speed
    }

    fn probability(&self, row: &Row, unknowns: &Unknowns, x: &[f64], scatter: f64) -> f64 {
        let deviation = libm::hypot(scatter, WAY_DOUBT_M) / self.speed(unknowns, x);
        let spread = UniformNormal { deviation, width: row.width };
        2.0 * (1.0 - spread.cdf(self.residual(row, unknowns, x).abs()))
    }

    /// Marks what is too improbable, the worst first, and takes back what is no longer.
    fn doubt(&mut self, unknowns: &Unknowns, x: &[f64], scatter: f64) {
        let probabilities: Vec<f64> =
            self.rows.iter().map(|row| self.probability(row, unknowns, x, scatter)).collect();
        let worst = self
            .rows
            .iter()
            .zip(&probabilities)
            .filter(|(row, _)| !row.out)
            .map(|(_, probability)| *probability)
            .fold(1.0, f64::min);
        let kept = self.rows.iter().filter(|row| !row.out).count();
        for (row, probability) in self.rows.iter_mut().zip(probabilities) {
            if row.out {
                row.out = probability < SUSPICIOUS;
            } else if probability < SUSPICIOUS && probability <= worst && kept > 2 {
                row.out = true;
            }
        }
    }
}

/// Spread of the stretches about their tables and scatter of the contacts, from the residuals.
fn maximise(
    stretches: &[Stretch],
    unknowns: &Unknowns,
    x: &[f64],
    run_deviation: &mut BTreeMap<TrainId, f64>,
    scatter: &mut BTreeMap<TrainId, f64>,
) {
    for (train, value) in run_deviation.iter_mut() {
        let own = stretches.iter().filter(|stretch| stretch.key.train == *train);
        let (mut sum, mut count) =
            (RUN_DEVIATION * RUN_DEVIATION * WEIGHT_OF_FIRST_FIGURES, WEIGHT_OF_FIRST_FIGURES);
        for stretch in own {
            sum += stretch.deviation * stretch.deviation + stretch.deviation_variance;
            count += 1.0;
        }
        *value = libm::sqrt(sum / count);
    }
    for (train, value) in scatter.iter_mut() {
        let (mut sum, mut count) = (SCATTER_M * SCATTER_M * WEIGHT_OF_FIRST_FIGURES, WEIGHT_OF_FIRST_FIGURES);
        for stretch in stretches.iter().filter(|stretch| stretch.key.train == *train) {
            let speed = stretch.speed(unknowns, x);
            let kept = stretch.rows.iter().filter(|row| !row.out).count() as f64;
            // Two unknowns of the stretch's own are fitted away.
            let free = (kept - 2.0).max(0.0) / kept.max(1.0);
            for row in stretch.rows.iter().filter(|row| !row.out) {
                let residual = stretch.residual(row, unknowns, x);
                sum += (residual * residual - row.window * free) * speed * speed;
                count += free;
            }
        }
        *value = libm::sqrt((sum / count).max(LEAST_SCATTER_M * LEAST_SCATTER_M));
    }
}

fn report(
    stretches: &[Stretch],
    unknowns: &Unknowns,
    x: &[f64],
    solution: &Solution,
    run_deviation: BTreeMap<TrainId, f64>,
    scatter: &BTreeMap<TrainId, f64>,
) -> JointFit {
    let mut fit = JointFit {
        speeds: BTreeMap::new(),
        stretches: BTreeMap::new(),
        run_deviation,
        contact_scatter: scatter.iter().map(|(train, value)| (*train, Length::from_m(*value))).collect(),
        sections: BTreeMap::new(),
        shared_sections: BTreeMap::new(),
        passages: Vec::new(),
    };
    for (key, place) in &unknowns.speeds {
        let own: Vec<&Stretch> = stretches.iter().filter(|stretch| stretch.key == *key).collect();
        let hops: usize = own
            .iter()
            .map(|stretch| stretch.rows.iter().filter(|row| !row.out).count().saturating_sub(1))
            .sum();
        let date =
            own.iter().filter_map(|stretch| stretch.rows.last()).map(|row| row.passage.window.until).max();
        let value = libm::exp(x[*place]);
        let part = libm::sqrt(solution.variance(*place));
        fit.stretches.insert(*key, own.len() as u32);
        fit.speeds.insert(
            *key,
            Estimate {
                value: Speed::from_m_per_s(value),
                uncertainty: Speed::from_m_per_s(value * part),
                count: hops as u32,
                date: date.unwrap_or(Timestamp::ZERO),
            },
        );
    }
    let passes = |train: Option<TrainId>, section: usize| -> u32 {
        let own = stretches.iter().filter(|stretch| train.is_none_or(|train| train == stretch.key.train));
        own.filter_map(|stretch| stretch.rows.last())
            .flat_map(|row| &row.sections)
            .filter(|(passed, _)| *passed == section)
            .map(|(_, times)| *times as u32)
            .sum()
    };
    let date =
        stretches.iter().filter_map(|stretch| stretch.rows.last()).map(|row| row.passage.window.until).max();
    let length = |value: f64, variance: f64, count: u32| Estimate {
        value: Length::from_m(value),
        uncertainty: Length::from_m(libm::sqrt(variance)),
        count,
        date: date.unwrap_or(Timestamp::ZERO),
    };
    for (section, place) in &unknowns.shared {
        let correction = length(x[*place], solution.variance(*place), passes(None, *section));
        fit.shared_sections.insert(*section, correction);
    }
    for ((train, section), place) in &unknowns.own {
        let shared = unknowns.shared[section];
        let variance = solution.variance_of(&[(*place, 1.0), (shared, 1.0)]);
        let correction = length(x[*place] + x[shared], variance, passes(Some(*train), *section));
        fit.sections.insert((*train, *section), correction);
    }
    for stretch in stretches {
        let speed = stretch.speed(unknowns, x) * libm::exp(stretch.deviation);
        for (place, row) in stretch.rows.iter().enumerate() {
            let late = stretch.residual(row, unknowns, x);
            fit.passages.push(FittedPassage {
                key: stretch.key,
                run: stretch.run,
                passage: row.passage,
                late: TimeSpan::from_s(late),
                late_way: Length::from_m(late * speed),
                probability: stretch.probability(row, unknowns, x, scatter[&stretch.key.train]),
                suspicious: row.out,
                first: place == 0,
                stretch_speed: Speed::from_m_per_s(speed),
            });
        }
    }
    fit
}
