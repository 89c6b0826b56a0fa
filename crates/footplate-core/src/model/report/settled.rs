//! Contacts passed at a settled speed, and how well each agrees with its neighbours.
//!
//! Nothing is fitted here. Between the passages before and after it, a contact should close in proportion to the path as
//! the train feels it: `late = t − (t₀ + s (t₁ − t₀))` with `s` the share of the path. A run that is faster or slower as a
//! whole, or wanders over a lap, does not show in it; a single wrong report does.

use alloc::vec::Vec;

use super::run::RunPassages;
use crate::event::Approach;
use crate::model::passage::{Drive, Passage};
use crate::model::survey::SectionIndex;
use crate::model::{MotionModel, TRIP_DEVIATION};
use crate::time::TimeSpan;
use crate::track::{Layout, Reach};
use crate::units::{Length, Speed};

/// Contacts close a little earlier or later from one passage to the next: beginning of the iteration, and the least (m).
const SCATTER_M: f64 = 0.003;
const LEAST_SCATTER_M: f64 = 0.001;
/// A report that chance makes this rarely, both sides, is pointed out.
const SUSPICIOUS: f64 = 1e-4;
/// What the scatter found so far is worth against what trains usually do (passages).
const USUAL: f64 = 5.0;
/// A change counts as over this much after the model says so: it is not quite true at its end.
const MARGIN: f64 = 1.15;
/// Contacts from which a run is compared with the speed of its step.
const FEWEST_OF_A_RUN: usize = 4;

/// A contact passed at a settled speed.
#[derive(Debug, Clone, PartialEq)]
pub struct SettledPassage {
    /// The run's place among those given.
    pub run: usize,
    /// The passage.
    pub passage: Passage,
    /// The path from the passage before as the train feels it; zero for the first of a stretch.
    pub length: Length,
    /// How much later it was reported than its neighbours say; zero for the ends of a stretch, which have only one.
    pub late: TimeSpan,
    /// The same as a distance at the speed of the train.
    pub late_length: Length,
    /// How often chance makes a report at least as late or early.
    pub probability: f64,
    /// Whether that is too rare to be chance.
    pub suspicious: bool,
}

/// How the settled running of one train scatters.
#[derive(Debug, Clone, PartialEq)]
pub struct SettledRunning {
    /// Stretches of a run at one step whose contacts are linked by known paths, in order.
    pub stretches: Vec<Vec<SettledPassage>>,
    /// One standard deviation of contacts about the place where they usually close.
    pub sensor_scatter: Length,
    /// One standard deviation of the speed of a run about that of its step, as a part of it.
    pub run_deviation: f64,
}

/// The path of a reach as a train feels it, with the corrections of its model.
#[must_use]
pub fn path_length(layout: &Layout, sections: &SectionIndex, model: &MotionModel, reach: &Reach) -> Length {
    let hops = reach.hops().iter().filter_map(|hop| layout.hop(*hop));
    hops.fold(Length::ZERO, |sum, hop| sum + model.length(sections, &hop)[0])
}

/// How long after a command the speed is settled, by the model.
pub(super) fn settles_within(model: &MotionModel, drive: Drive) -> TimeSpan {
    TimeSpan::from_s(MARGIN * model.settles_within(drive.from, drive.step).as_s())
}

impl SettledRunning {
    /// Finds the settled running in the runs of the train of a model.
    #[must_use]
    pub fn of(layout: &Layout, sections: &SectionIndex, model: &MotionModel, runs: &[&RunPassages]) -> Self {
        let mut stretches: Vec<Vec<SettledPassage>> = Vec::new();
        let settle = |drive: Drive| settles_within(model, drive);
        for run in runs {
            for stretch in run.settled_stretches(&settle) {
                stretches.push(
                    stretch
                        .iter()
                        .enumerate()
                        .map(|(place, passage)| {
                            let reach = passage.path.as_ref().filter(|_| place > 0);
                            SettledPassage {
                                run: run.run,
                                passage: *passage,
                                length: reach.map_or(Length::ZERO, |reach| {
                                    path_length(layout, sections, model, reach)
                                }),
                                late: TimeSpan::ZERO,
                                late_length: Length::ZERO,
                                probability: 1.0,
                                suspicious: false,
                            }
                        })
                        .collect(),
                );
            }
        }
        let mut scatter = SCATTER_M;
        for _ in 0..2 {
            for stretch in &mut stretches {
                judge(stretch, scatter);
            }
            scatter = scatter_of(&stretches);
        }
        let run_deviation = run_deviation(model, &stretches, scatter);
        Self { stretches, sensor_scatter: Length::from_m(scatter), run_deviation }
    }

    /// Reports that chance hardly makes.
    pub fn suspicious(&self) -> impl Iterator<Item = &SettledPassage> {
        self.stretches.iter().flatten().filter(|passage| passage.suspicious)
    }

    /// The speed of a run at the step of a drive, with one standard deviation: as the model has it, and as the contacts of
    /// the run itself show it as far as they can.
    pub(super) fn speed_in_run(&self, model: &MotionModel, run: usize, drive: Drive) -> [Speed; 2] {
        let usual = model.steady_speed(drive.step, drive.approach());
        let is_above = drive.approach() == Approach::Above;
        let usual_variance =
            model.ln_speed_variance(drive.step.get(), is_above) + TRIP_DEVIATION * TRIP_DEVIATION;
        let is_of_drive = |stretch: &&Vec<SettledPassage>| {
            stretch.first().is_some_and(|first| first.run == run && first.passage.drive == drive)
        };
        let longest = self.stretches.iter().filter(is_of_drive).max_by_key(|stretch| stretch.len());
        let Some((shown, variance)) =
            longest.and_then(|stretch| speed_of(stretch, self.sensor_scatter.as_m()))
        else {
            return [usual, usual * libm::sqrt(usual_variance)];
        };
        let gain = usual_variance / (usual_variance + variance);
        let speed = usual * libm::exp(gain * libm::log(shown / usual));
        [speed, speed * libm::sqrt(gain * variance)]
    }
}

/// The passage against its neighbours that are not suspicious: late (s), variance of that from polls (s²), what the
/// scatter of contacts is multiplied with, and speed (m/s).
fn against_neighbours(stretch: &[SettledPassage], place: usize) -> Option<(f64, f64, f64, f64)> {
    let before = stretch.get(..place)?.iter().rposition(|passage| !passage.suspicious)?;
    let after = place + 1 + stretch.get(place + 1..)?.iter().position(|passage| !passage.suspicious)?;
    let length = |from: usize, to: usize| -> f64 {
        stretch.get(from + 1..=to).unwrap_or_default().iter().map(|passage| passage.length.as_m()).sum()
    };
    let window = |place: usize| stretch.get(place).map(|passage| passage.passage.window);
    let (first, this, last) = (window(before)?, window(place)?, window(after)?);
    let all = length(before, after);
    let took = (last.middle() - first.middle()).as_s();
    if all <= 0.0 || took <= 0.0 {
        return None;
    }
    let share = length(before, place) / all;
    let late = (this.middle() - first.middle()).as_s() - share * took;
    let [left, right] = [(1.0 - share) * (1.0 - share), share * share];
    let polls = this.variance_s2() + left * first.variance_s2() + right * last.variance_s2();
    Some((late, polls, 1.0 + left + right, all / took))
}

/// Judges every passage of a stretch, the worst first: one that is wrong makes its neighbours look wrong, too.
fn judge(stretch: &mut [SettledPassage], scatter: f64) {
    for passage in stretch.iter_mut() {
        passage.suspicious = false;
    }
    loop {
        let mut worst: Option<(usize, f64)> = None;
        for place in 0..stretch.len() {
            let Some((late, polls, times, speed)) = against_neighbours(stretch, place) else { continue };
            let deviation = libm::sqrt(polls + times * scatter * scatter / (speed * speed));
            let probability = libm::erfc(late.abs() / deviation * core::f64::consts::FRAC_1_SQRT_2);
            let Some(passage) = stretch.get_mut(place) else { continue };
            passage.late = TimeSpan::from_s(late);
            passage.late_length = Length::from_m(late * speed);
            passage.probability = probability;
            if !passage.suspicious && worst.is_none_or(|(_, least)| probability < least) {
                worst = Some((place, probability));
            }
        }
        match worst.filter(|(_, probability)| *probability < SUSPICIOUS) {
            Some((place, _)) => {
                if let Some(passage) = stretch.get_mut(place) {
                    passage.suspicious = true;
                }
            }
            None => return,
        }
    }
}

/// What is left of the residuals once polls are taken off.
fn scatter_of(stretches: &[Vec<SettledPassage>]) -> f64 {
    let (mut sum, mut count) = (USUAL * SCATTER_M * SCATTER_M, USUAL);
    for stretch in stretches {
        for (place, passage) in stretch.iter().enumerate() {
            let Some((late, polls, times, speed)) =
                against_neighbours(stretch, place).filter(|_| !passage.suspicious)
            else {
                continue;
            };
            sum += (late * late - polls) * speed * speed / times;
            count += 1.0;
        }
    }
    libm::sqrt((sum / count).max(LEAST_SCATTER_M * LEAST_SCATTER_M))
}

fn run_deviation(model: &MotionModel, stretches: &[Vec<SettledPassage>], scatter: f64) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for stretch in stretches.iter().filter(|stretch| stretch.len() >= FEWEST_OF_A_RUN) {
        let Some((speed, variance)) = speed_of(stretch, scatter) else { continue };
        let drive = stretch.first().map(|first| first.passage.drive);
        let Some(drive) = drive else { continue };
        let known = model.steady_speed(drive.step, drive.approach()).as_m_per_s();
        let off = libm::log(speed.as_m_per_s() / known);
        sum += off * off - variance;
        count += 1.0;
    }
    if count > 0.0 { libm::sqrt((sum / count).max(0.0)) } else { 0.0 }
}

/// The speed of a stretch, and the variance of its logarithm: a straight line through its contacts, each of which counts by
/// how well it is dated. The first report of a recording may have closed long before.
fn speed_of(stretch: &[SettledPassage], scatter: f64) -> Option<(Speed, f64)> {
    let (first, last) = (stretch.first()?.passage.window, stretch.last()?.passage.window);
    let length: f64 = stretch.iter().skip(1).map(|passage| passage.length.as_m()).sum();
    let took = (last.middle() - first.middle()).as_s();
    if took <= 0.0 || length <= 0.0 {
        return None;
    }
    let by_scatter = scatter * took / length;
    let mut place = 0.0;
    let contacts = stretch.iter().filter_map(|passage| {
        place += passage.length.as_m();
        let window = passage.passage.window;
        let weight = 1.0 / (window.variance_s2() + by_scatter * by_scatter);
        (!passage.suspicious).then_some((weight, place, (window.middle() - first.middle()).as_s()))
    });
    let contacts: Vec<(f64, f64, f64)> = contacts.collect();
    let sum = |of: fn(f64, f64) -> f64| -> f64 {
        contacts.iter().map(|(weight, place, time)| weight * of(*place, *time)).sum()
    };
    let all = sum(|_, _| 1.0);
    let (place, time) = (sum(|place, _| place), sum(|_, time| time));
    let squares = sum(|place, _| place * place) - place * place / all;
    let slowness = (sum(|place, time| place * time) - place * time / all) / squares;
    let speed = 1.0 / slowness;
    (squares > 0.0 && slowness > 0.0).then(|| (Speed::from_m_per_s(speed), speed * speed / squares))
}
