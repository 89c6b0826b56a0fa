//! Changes of speed as they were seen: contacts passed while a train got faster or slower.

use alloc::vec::Vec;

use super::joint_fit::{JointFit, SpeedKey};
use super::length_table::SectionIndex;
use super::passage::{Drive, Passage};
use super::run::RunPassages;
use crate::ids::{SpeedStep, TrainId};
use crate::time::TimeSpan;
use crate::units::{Length, Speed};

/// Contacts after the change was over that are kept with it: they pin down where the train was.
const SETTLED_KEPT: usize = 3;
/// Fewest contacts of a change that tell anything of its law beyond where the train started.
const FEWEST: usize = 3;

/// Whether the train gets faster or slower.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum Direction {
    /// Faster, starts from rest included.
    Up,
    /// Slower, stops included.
    Down,
}

impl Direction {
    /// The direction of a command.
    #[must_use]
    pub fn of(drive: Drive) -> Self {
        if drive.step < drive.from { Self::Down } else { Self::Up }
    }
}

/// One contact of a change of speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransientPoint {
    /// Seconds since the command.
    pub since_command: f64,
    /// Variance of that, from the poll (s²).
    pub variance: f64,
    /// Way since the first contact of the change (m), as the fit has the lengths.
    pub way: f64,
    /// The entry of the run that reported it.
    pub entry: usize,
}

/// One change of speed.
#[derive(Debug, Clone, PartialEq)]
pub struct Transient {
    /// The train.
    pub train: TrainId,
    /// The run, as numbered in what was given.
    pub run: usize,
    /// The steps before and after.
    pub steps: [SpeedStep; 2],
    /// The speeds before and after.
    pub speeds: [Speed; 2],
    /// Its contacts in order.
    pub points: Vec<TransientPoint>,
    /// Scatter of the train's contacts and doubt of the way between them (m).
    pub way_doubt: f64,
}

impl Transient {
    /// The direction of the change.
    #[must_use]
    pub fn direction(&self) -> Direction {
        let [from, to] = self.steps;
        if to < from { Direction::Down } else { Direction::Up }
    }
}

/// Doubt of the way between two contacts beyond their scatter (m): what is left of ten millimetres of survey
/// once a section was passed a few times.
const WAY_DOUBT_M: f64 = 0.005;

/// All changes of speed in some runs of which enough was seen. `settle` says how long after a command the
/// speed is settled.
#[must_use]
pub fn transients(
    sections: &SectionIndex,
    runs: &[RunPassages],
    fit: &JointFit,
    settle: &dyn Fn(TrainId, Drive) -> TimeSpan,
) -> Vec<Transient> {
    runs.iter().flat_map(|run| of_run(sections, run, fit, settle)).collect()
}

fn of_run(
    sections: &SectionIndex,
    run: &RunPassages,
    fit: &JointFit,
    settle: &dyn Fn(TrainId, Drive) -> TimeSpan,
) -> Vec<Transient> {
    let changes = run.passages.chunk_by(|one, next| one.drive == next.drive && next.way.is_some());
    changes.filter_map(|chain| of_change(sections, run, chain, fit, settle)).collect()
}

fn of_change(
    sections: &SectionIndex,
    run: &RunPassages,
    chain: &[Passage],
    fit: &JointFit,
    settle: &dyn Fn(TrainId, Drive) -> TimeSpan,
) -> Option<Transient> {
    let drive = chain.first()?.drive;
    let commanded = drive.commanded?;
    let ends = settle(run.train, drive);
    let speed = |step: SpeedStep, drive: Option<Drive>| {
        if step == SpeedStep::STAND {
            return Some(Speed::ZERO);
        }
        let approach = drive.map_or(crate::event::Approach::Below, Drive::approach);
        // The speed of this very run where it was seen, the table's where it was not.
        let key = SpeedKey { train: run.train, step, approach };
        let own = fit.passages.iter().find(|passage| passage.run == run.run && passage.key == key);
        own.map(|passage| passage.stretch_speed).or_else(|| Some(fit.speed(run.train, step, approach)?.value))
    };
    let speeds = [speed(drive.from, None)?, speed(drive.step, Some(drive))?];
    let mut way = 0.0;
    let mut settled = 0;
    let mut points = Vec::new();
    for (place, passage) in chain.iter().enumerate() {
        if let (true, Some(reach)) = (place > 0, &passage.way) {
            let correction = fit.correction(sections, run.train, passage).map_or(0.0, Length::as_m);
            way += reach.length.as_m() + correction;
        }
        let since = passage.window.middle() - commanded;
        settled += usize::from(since > ends);
        if settled > SETTLED_KEPT {
            break;
        }
        points.push(TransientPoint {
            since_command: since.as_s(),
            variance: passage.window.variance_s2(),
            way,
            entry: passage.entry,
        });
    }
    let changing = points.iter().any(|point| point.since_command < ends.as_s());
    if points.len() < FEWEST || !changing {
        return None;
    }
    let scatter = fit.contact_scatter.get(&run.train).map_or(0.0, |scatter| scatter.as_m());
    Some(Transient {
        train: run.train,
        run: run.run,
        steps: [drive.from, drive.step],
        speeds,
        points,
        way_doubt: libm::hypot(scatter, WAY_DOUBT_M),
    })
}
