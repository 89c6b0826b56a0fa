//! Changes of speed between two sensors, found in the runs of a train: the acceleration of each by the two-sensor method,
//! and the mean of those that are alike.
//!
//! The first sensor is the last one that the train passed before the command, at a steady speed. Each of the next ones may
//! serve as the second. Speeds are those of the run itself as far as its sensors show them. Lengths and the delay are those
//! of the motion model; the lag with which a train follows its decoder counts as delay, or an even change would seem slower. Starts are left out: no report says from where a train started.
//!
//! Means are of `1/a`, not of `a` (average times, then divide): the time that a change takes is what was measured.

use alloc::vec::Vec;

use super::run::RunPassages;
use super::settled::{SettledRunning, settles_within};
use crate::estimate::Estimate;
use crate::ids::{SensorId, SpeedStep};
use crate::kinematics::{TwoSensorError, TwoSensorRun, TwoSensorVerdict};
use crate::model::MotionModel;
use crate::model::passage::{Drive, Passage};
use crate::model::survey::SectionIndex;
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Layout, Reach};
use crate::units::{Acceleration, Length, Speed};

/// Sensors after the command that may serve as the second. Beyond the fourth, some 1.5 m on, the uncertainty of the
/// speed has grown over any change (chosen).
const SECOND_SENSORS: usize = 4;

/// One change of speed between two sensors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoSensorChange {
    /// The run's place among those given.
    pub run: usize,
    /// When the change was commanded, on the clock of the run: the same for all pairs of sensors of one change.
    pub commanded: Timestamp,
    /// The steps before and after.
    pub steps: [SpeedStep; 2],
    /// The first sensor and the second.
    pub sensors: [SensorId; 2],
    /// The entry of the run that reported the second.
    pub entry: usize,
    /// What was measured.
    pub measured: TwoSensorRun,
    /// What it says.
    pub verdict: Result<TwoSensorVerdict, TwoSensorError>,
}

/// The mean acceleration of all changes between the same two steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoSensorMean {
    /// The steps before and after.
    pub steps: [SpeedStep; 2],
    /// The acceleration, negative for slowing down; the count is of changes.
    pub acceleration: Estimate<Acceleration>,
}

impl TwoSensorChange {
    /// All changes of the train of a model in its runs; those of other trains are passed over.
    pub fn find(
        layout: &Layout,
        sections: &SectionIndex,
        model: &MotionModel,
        running: &SettledRunning,
        runs: &[RunPassages],
    ) -> Vec<Self> {
        let [slower, faster] = [false, true].map(|is_faster| model.change_delay(is_faster));
        let finder = Finder { layout, sections, model, running, slower, faster };
        let own = runs.iter().filter(|run| run.train == model.train());
        own.flat_map(|run| {
            let begins = run.passages.windows(2).enumerate();
            begins
                .filter_map(|(place, pair)| match pair {
                    [last, first] => finder.changes(run, last, first, run.passages.get(place + 1..)?),
                    _ => None,
                })
                .flatten()
                .collect::<Vec<_>>()
        })
        .collect()
    }

    /// Its acceleration, if the data decide on one.
    pub const fn acceleration(&self) -> Option<Estimate<Acceleration>> {
        match self.verdict {
            Ok(
                TwoSensorVerdict::Completed { acceleration, .. }
                | TwoSensorVerdict::Unfinished { acceleration, .. },
            ) => Some(acceleration),
            _ => None,
        }
    }

    /// `1/a` and one standard deviation of it (s²/m).
    fn slowness(&self) -> Option<[f64; 2]> {
        let acceleration = self.acceleration()?;
        let value = acceleration.value.as_m_per_s2();
        Some([1.0 / value, acceleration.uncertainty.as_m_per_s2() / (value * value)])
    }

    /// Of each change the pair of sensors that tells its acceleration best; none of changes of which no pair does.
    pub fn best(changes: &[Self]) -> Vec<Self> {
        let of_one = changes.chunk_by(|one, next| (one.run, one.commanded) == (next.run, next.commanded));
        of_one
            .filter_map(|pairs| {
                let decided = pairs.iter().filter_map(|pair| Some((pair, pair.slowness()?[1])));
                decided.min_by(|one, other| one.1.total_cmp(&other.1)).map(|(pair, _)| *pair)
            })
            .collect()
    }
}

impl TwoSensorMean {
    /// The means of changes, one of each pair of steps, in the order of the steps.
    ///
    /// Changes share the uncertainty of speeds and of the delay, so that many of them are taken to be no better
    /// known than one; they are known less well where they differ by more than they say.
    pub fn of(changes: &[TwoSensorChange]) -> Vec<Self> {
        let mut best = TwoSensorChange::best(changes);
        best.sort_by_key(|change| change.steps);
        let alike = best.chunk_by(|one, next| one.steps == next.steps);
        alike.filter_map(Self::of_alike).collect()
    }

    fn of_alike(changes: &[TwoSensorChange]) -> Option<Self> {
        let steps = changes.first()?.steps;
        let slowness: Vec<[f64; 2]> = changes.iter().filter_map(TwoSensorChange::slowness).collect();
        let weighted = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
            slowness.iter().map(|[value, deviation]| of(*value, *deviation) / (deviation * deviation)).sum()
        };
        let weight = weighted(&|_, _| 1.0);
        let mean = weighted(&|value, _| value) / weight;
        let stated = weighted(&|_, deviation| deviation) / weight;
        let degrees = slowness.len().saturating_sub(1).max(1) as f64;
        let seen = weighted(&|value, _| (value - mean) * (value - mean)) / (weight * degrees);
        let deviation = stated.max(libm::sqrt(seen));
        let newest = changes.iter().filter_map(|change| Some(change.acceleration()?.date)).max()?;
        (weight.is_finite() && mean != 0.0).then(|| Self {
            steps,
            acceleration: Estimate {
                value: Acceleration::from_m_per_s2(1.0 / mean),
                uncertainty: Acceleration::from_m_per_s2(deviation / (mean * mean)),
                count: u32::try_from(changes.len()).unwrap_or(u32::MAX),
                date: newest,
            },
        })
    }
}

/// What changes are found with.
struct Finder<'f> {
    layout: &'f Layout,
    sections: &'f SectionIndex,
    model: &'f MotionModel,
    running: &'f SettledRunning,
    /// Of commands to run slower.
    slower: Estimate<TimeSpan>,
    /// Of commands to run faster.
    faster: Estimate<TimeSpan>,
}

impl Finder<'_> {
    /// The change between two passages in a row, with each of the sensors from the second passage on; `None` if there is none
    /// or the train was not steady before.
    fn changes(
        &self,
        run: &RunPassages,
        last: &Passage,
        first: &Passage,
        from_first: &[Passage],
    ) -> Option<Vec<TwoSensorChange>> {
        let (before, after) = (last.drive, first.drive);
        let commanded = after.commanded.filter(|_| before != after && first.path.is_some())?;
        let is_steady = before.step != SpeedStep::STAND
            && before.step == after.from
            && before
                .commanded
                .is_none_or(|changed| commanded - changed > settles_within(self.model, before));
        if !is_steady {
            return None;
        }
        let from = self.speed(run, before);
        let to = self.speed(run, after);
        let command_delay = if after.step > before.step { self.faster } else { self.slower };
        let before_command =
            self.estimate(commanded - last.window.middle(), deviation(last.window.variance_s2()));
        let scatter = self.running.sensor_scatter.as_m();
        let (mut distance, mut variance) = (0.0, 2.0 * scatter * scatter);
        let seconds =
            from_first.iter().take_while(|passage| passage.drive == after && passage.path.is_some());
        let mut changes = Vec::new();
        for second in seconds.take(SECOND_SENSORS) {
            let (length, of_length) = self.length(second.path.as_ref()?);
            distance += length;
            variance += of_length;
            // It may have closed before the command, and says nothing of the change.
            if second.window.after <= commanded {
                continue;
            }
            let measured = TwoSensorRun {
                distance: self.estimate(Length::from_m(distance), Length::from_m(libm::sqrt(variance))),
                before_command,
                time: self
                    .estimate(second.window.middle() - commanded, deviation(second.window.variance_s2())),
                from,
                to,
                command_delay,
            };
            changes.push(TwoSensorChange {
                run: run.run,
                commanded,
                steps: [before.step, after.step],
                sensors: [last.sensor, second.sensor],
                entry: second.entry,
                measured,
                verdict: measured.verdict(),
            });
        }
        Some(changes)
    }

    fn speed(&self, run: &RunPassages, drive: Drive) -> Estimate<Speed> {
        if drive.step == SpeedStep::STAND {
            return self.estimate(Speed::ZERO, Speed::ZERO);
        }
        let [value, uncertainty] = self.running.speed_in_run(self.model, run.run, drive);
        self.estimate(value, uncertainty)
    }

    /// Length (m) of the path as the train runs it, with the variance.
    fn length(&self, reach: &Reach) -> (f64, f64) {
        let hops = reach.hops().iter().filter_map(|hop| self.layout.hop(*hop));
        hops.fold((0.0, 0.0), |(sum, variance), hop| {
            let [length, deviation] = self.model.length(self.sections, &hop).map(Length::as_m);
            (sum + length, variance + deviation * deviation)
        })
    }

    /// One measurement, as new as the model.
    fn estimate<Q>(&self, value: Q, uncertainty: Q) -> Estimate<Q> {
        Estimate { value, uncertainty, count: 1, date: self.slower.date }
    }
}

fn deviation(variance_s2: f64) -> TimeSpan {
    TimeSpan::from_s(libm::sqrt(variance_s2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A change in a run with an acceleration and its standard deviation (m/s²), known since a date (s).
    fn change(run: usize, steps: [u8; 2], acceleration: f64, deviation: f64, date: f64) -> TwoSensorChange {
        let one = |value: f64, uncertainty: f64| Estimate {
            value: Acceleration::from_m_per_s2(value),
            uncertainty: Acceleration::from_m_per_s2(uncertainty),
            count: 1,
            date: Timestamp::from_s(date),
        };
        fn nothing<Q>(value: Q, uncertainty: Q) -> Estimate<Q> {
            Estimate { value, uncertainty, count: 1, date: Timestamp::ZERO }
        }
        let time = nothing(TimeSpan::ZERO, TimeSpan::ZERO);
        let speed = nothing(Speed::ZERO, Speed::ZERO);
        TwoSensorChange {
            run,
            commanded: Timestamp::ZERO,
            steps: steps.map(|step| SpeedStep::new(step).expect("a step")),
            sensors: [SensorId(0), SensorId(2)],
            entry: 0,
            measured: TwoSensorRun {
                distance: nothing(Length::ZERO, Length::ZERO),
                before_command: time,
                time,
                from: speed,
                to: speed,
                command_delay: time,
            },
            verdict: Ok(TwoSensorVerdict::Completed {
                acceleration: one(acceleration, deviation),
                duration: TimeSpan::ZERO,
            }),
        }
    }

    #[test]
    fn means_are_of_times_and_never_better_known_than_one_change() {
        let means = TwoSensorMean::of(&[
            change(0, [8, 12], 0.1, 0.01, 5.0),
            change(1, [4, 8], 0.1, 0.001, 1.0),
            change(2, [8, 12], 0.125, 0.03125, 3.0),
            change(3, [4, 8], 0.25, 0.00625, 2.0),
            change(4, [4, 8], 0.1, 0.001, 3.0),
        ]);
        let found: Vec<_> = means
            .iter()
            .map(|mean| {
                let Estimate { value, uncertainty, count, date } = mean.acceleration;
                (
                    mean.steps.map(SpeedStep::get),
                    1.0 / value.as_m_per_s2(),
                    uncertainty.as_m_per_s2(),
                    count,
                    date,
                )
            })
            .collect();
        let [differ, agree] = &found[..] else { panic!("{found:?}") };
        // 10, 10 and 4 s²/m, each known to 0.1: 8 in the mean, off by 2, 2 and 4, which is √(24 / (3 · 2)) = 2.
        assert_eq!((differ.0, differ.3, differ.4), ([4, 8], 3, Timestamp::from_s(3.0)));
        assert!((differ.1 - 8.0).abs() < 1e-9 && (differ.2 - 2.0 / 64.0).abs() < 1e-9, "{differ:?}");
        // 10 ± 1 and 8 ± 2 s²/m weigh 1 and 1/4: 9.6 in the mean and 1.2 by what they say of themselves, more than √0.64.
        assert_eq!((agree.0, agree.3, agree.4), ([8, 12], 2, Timestamp::from_s(5.0)));
        assert!((agree.1 - 9.6).abs() < 1e-9 && (agree.2 - 1.2 / 92.16).abs() < 1e-9, "{agree:?}");
    }

    #[test]
    fn of_one_change_the_pair_of_sensors_counts_that_tells_most_of_its_time() {
        // 0.004 / 0.2² = 0.1 s²/m is better known than 0.002 / 0.1² = 0.2 s²/m.
        let undecided =
            TwoSensorChange { verdict: Ok(TwoSensorVerdict::NotNoticed), ..change(0, [4, 8], 0.1, 0.0, 0.0) };
        let worse = change(0, [4, 8], 0.1, 0.002, 0.0);
        let better = change(0, [4, 8], 0.2, 0.004, 0.0);
        let of_next_run = change(1, [4, 8], 0.3, 0.3, 0.0);
        let best = TwoSensorChange::best(&[worse, undecided, better, of_next_run]);
        assert_eq!(best, [better, of_next_run]);
        assert!(TwoSensorChange::best(&[undecided]).is_empty() && TwoSensorMean::of(&[undecided]).is_empty());
    }
}
