//! Sensors passed at a settled speed, and how well each detection agrees with its neighbours.
//!
//! Nothing is fitted here. Between the passages before and after it, a sensor should close in proportion to the path length
//! as the train runs it: `late = t − (t₀ + s (t₁ − t₀))` with `s` the share of the path. A run that is faster or slower as a
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

/// Sensors close a little earlier or later from one passage to the next: beginning of the iteration, and the least (m).
const SCATTER_M: f64 = 0.003;
const LEAST_SCATTER_M: f64 = 0.001;
/// A report that chance makes this rarely, both sides, is pointed out.
const SUSPICIOUS: f64 = 1e-4;
/// What the scatter found so far is worth against what trains usually do (passages).
const USUAL: f64 = 5.0;
/// A change counts as over this much after the model says so: it is not quite true at its end.
const MARGIN: f64 = 1.15;
/// Detections from which on a run is compared with the speed of its step.
const FEWEST_OF_A_RUN: usize = 4;

/// A sensor passed at a settled speed.
#[derive(Debug, Clone, PartialEq)]
pub struct SettledPassage {
    /// The run's place among those given.
    pub run: usize,
    /// The passage.
    pub passage: Passage,
    /// The path length from the passage before, as the train runs it; zero for the first of a stretch.
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
    /// Stretches of a run at one step whose sensors are linked by known paths, in order.
    pub stretches: Vec<Vec<SettledPassage>>,
    /// One standard deviation of the places where sensors close about the usual ones.
    pub sensor_scatter: Length,
    /// One standard deviation of the speed of a run about that of its step, as a part of it.
    pub run_deviation: f64,
}

/// The path of a reach as a train feels it, with the corrections of its model.
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

    /// The speed of a run at the step of a drive, with one standard deviation: as the model has it, and as the detections of
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
/// scatter of sensors is multiplied with, and speed (m/s).
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

/// The speed of a stretch, and the variance of its logarithm: a straight line through its detections, each of which counts by
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
    let detections = stretch.iter().filter_map(|passage| {
        place += passage.length.as_m();
        let window = passage.passage.window;
        let weight = 1.0 / (window.variance_s2() + by_scatter * by_scatter);
        (!passage.suspicious).then_some((weight, place, (window.middle() - first.middle()).as_s()))
    });
    let detections: Vec<(f64, f64, f64)> = detections.collect();
    let sum = |of: fn(f64, f64) -> f64| -> f64 {
        detections.iter().map(|(weight, place, time)| weight * of(*place, *time)).sum()
    };
    let all = sum(|_, _| 1.0);
    let (place, time) = (sum(|place, _| place), sum(|_, time| time));
    let squares = sum(|place, _| place * place) - place * place / all;
    let slowness = (sum(|place, time| place * time) - place * time / all) / squares;
    let speed = 1.0 / slowness;
    (squares > 0.0 && slowness > 0.0).then(|| (Speed::from_m_per_s(speed), speed * speed / squares))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{NodeId, SensorId, SpeedStep};
    use crate::link::DetectionWindow;
    use crate::time::Timestamp;

    /// A stretch of passages, each so far (m) behind the one before, with the middle and the width of its window (s).
    fn stretch(passages: &[(f64, f64, f64)]) -> Vec<SettledPassage> {
        let step = SpeedStep::new(8).expect("a step");
        let passages = passages.iter().map(|(length, middle, width)| SettledPassage {
            run: 0,
            passage: Passage {
                sensor: SensorId(1),
                node: NodeId(1),
                window: DetectionWindow {
                    after: Timestamp::from_s(middle - 0.5 * width),
                    until: Timestamp::from_s(middle + 0.5 * width),
                },
                path: None,
                drive: Drive { step, from: step, commanded: None },
                entry: 0,
            },
            length: Length::from_m(*length),
            late: TimeSpan::ZERO,
            late_length: Length::ZERO,
            probability: 1.0,
            suspicious: false,
        });
        passages.collect()
    }

    /// A metre in two seconds, of which 0.4 m should take 0.8 s and took 1.1 s.
    fn late() -> Vec<SettledPassage> {
        stretch(&[(0.0, 0.0, 0.12), (0.4, 1.1, 0.24), (0.6, 2.0, 0.36)])
    }

    fn assert_near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-8, "{found} {expected}");
    }

    #[test]
    fn a_passage_closes_in_proportion_to_the_path() {
        let (off, polls, times, speed) = against_neighbours(&late(), 1).expect("it has neighbours");
        assert_near(off, 0.3);
        // Widths over √12; neighbours count by the squares of 0.6 and 0.4.
        assert_near(polls, 0.0048 + 0.36 * 0.0012 + 0.16 * 0.0108);
        assert_near(times, 1.0 + 0.36 + 0.16);
        assert_near(speed, 0.5);
        assert!([0, 2, 3].into_iter().all(|end| against_neighbours(&late(), end).is_none()));
        // What is suspicious is no neighbour: the one before and after it is.
        let mut with_wrong = stretch(&[
            (0.0, 0.0, 0.12),
            (0.1, 7.0, 0.1),
            (0.3, 1.1, 0.24),
            (0.2, 9.0, 0.1),
            (0.4, 2.0, 0.36),
        ]);
        (with_wrong[1].suspicious, with_wrong[3].suspicious) = (true, true);
        let (off_again, polls_again, times_again, speed_again) =
            against_neighbours(&with_wrong, 2).expect("two are left");
        for (found, expected) in
            [(off_again, off), (polls_again, polls), (times_again, times), (speed_again, speed)]
        {
            assert_near(found, expected);
        }
        // Neither a path nor a time is nothing.
        assert!(
            against_neighbours(&stretch(&[(0.0, 0.0, 0.1), (0.0, 1.0, 0.1), (0.0, 2.0, 0.1)]), 1).is_none()
        );
        assert!(
            against_neighbours(&stretch(&[(0.0, 2.0, 0.1), (0.5, 2.0, 0.1), (0.5, 2.0, 0.1)]), 1).is_none()
        );
    }

    #[test]
    fn a_passage_is_judged_by_chance() {
        let mut stretch = late();
        judge(&mut stretch, 0.003);
        let variance: f64 = 0.00696 + 1.52 * 0.003 * 0.003 / 0.25;
        assert_near(stretch[1].late.as_s(), 0.3);
        assert_near(stretch[1].late_length.as_m(), 0.15);
        // 3.58 standard deviations: 3.4 in ten thousand, which is chance still.
        assert_near(stretch[1].probability, libm::erfc(0.3 / (2.0 * variance).sqrt()));
        assert!(!stretch[1].suspicious && stretch[1].probability > 3e-4 && stretch[1].probability < 4e-4);
        // Given one of seven that is 0.9 s late, it alone is pointed out.
        let even = |nth: u32| (0.5, f64::from(nth) + if nth == 3 { 0.9 } else { 0.0 }, 0.1);
        let mut wrong = super::tests::stretch(&(0..7).map(even).collect::<Vec<_>>());
        wrong[2].suspicious = true;
        judge(&mut wrong, 0.003);
        let suspicious: Vec<usize> = (0..7).filter(|place| wrong[*place].suspicious).collect();
        assert_eq!(suspicious, [3]);
        assert_near(wrong[3].late.as_s(), 0.9);
        assert_near(wrong[2].late.as_s(), 0.0);
    }

    #[test]
    fn the_scatter_is_what_polls_leave_over() {
        // Five passages of 3 mm, and one of 0.3² s² less 0.00696 s² of polls at 0.5 m/s over 1.52.
        let one = (0.09 - 0.00696) * 0.25 / 1.52;
        assert_near(scatter_of(&[late()]), ((5.0 * 9e-6 + one) / 6.0_f64).sqrt());
        assert_near(scatter_of(&[late(), late()]), ((5.0 * 9e-6 + 2.0 * one) / 7.0_f64).sqrt());
        assert_near(scatter_of(&[]), 0.003);
        let mut wrong = late();
        wrong[1].suspicious = true;
        assert_near(scatter_of(&[wrong]), 0.003);
        // Polls alone, without any residual, leave no less than a millimetre.
        let polls = stretch(&[(0.0, 0.0, 0.3), (0.5, 1.0, 0.3), (0.5, 2.0, 0.3)]);
        assert_near(scatter_of(&[polls]), 0.001);
    }

    #[test]
    fn the_speed_of_a_stretch_is_the_slope_of_a_line() {
        let even = stretch(&[(0.0, 0.0, 0.12), (0.5, 1.0, 0.12), (0.5, 2.0, 0.12)]);
        // Each passage has 0.12²/12 s² and 3 mm at 0.5 m/s; places are 0.5 m about their mean.
        let each = 0.0012 + 0.006 * 0.006;
        let (speed, variance) = speed_of(&even, 0.003).expect("a speed");
        assert_near(speed.as_m_per_s(), 0.5);
        assert_near(variance, 0.25 * each / 0.5);
        // A passage in the middle that is late changes nothing but the beginning of the line; one at the end does: the slope
        // of (−0.5, 0, 0.5) and (0, 1, 2.4) is 2.4 s/m.
        let slower = stretch(&[(0.0, 0.0, 0.12), (0.5, 1.0, 0.12), (0.5, 2.4, 0.12)]);
        let (speed, _) = speed_of(&slower, 0.0).expect("a speed");
        assert_near(speed.as_m_per_s(), 1.0 / 2.4);
        // A passage known half as well counts a quarter: weights 1, 1, ¼ at (0, 0), (1, 1), (2, 2.4) have the means 2/3 and
        // 0.711; Σ w x t − Σ w x Σ w t / Σ w = 2.2 − 1.5 · 1.6 / 2.25 over 2 − 1.5² / 2.25.
        let uneven = stretch(&[(0.0, 0.0, 0.12), (1.0, 1.0, 0.12), (1.0, 2.4, 0.24)]);
        let (speed, variance) = speed_of(&uneven, 0.0).expect("a speed");
        assert_near(speed.as_m_per_s(), 1.0 / (2.2 - 1.5 * 1.6 / 2.25));
        assert_near(variance, speed.as_m_per_s() * speed.as_m_per_s() * 0.0012);
        // What is suspicious does not count, but its path does.
        let mut wrong = stretch(&[(0.0, 0.0, 0.12), (0.25, 7.0, 0.12), (0.25, 1.0, 0.12), (0.5, 2.0, 0.12)]);
        wrong[1].suspicious = true;
        assert_near(speed_of(&wrong, 0.003).expect("a speed").0.as_m_per_s(), 0.5);
        assert!(speed_of(&stretch(&[(0.0, 1.0, 0.1), (0.5, 1.0, 0.1)]), 0.003).is_none());
        assert!(speed_of(&stretch(&[(0.0, 1.0, 0.1), (0.0, 2.0, 0.1)]), 0.003).is_none());
    }
}
