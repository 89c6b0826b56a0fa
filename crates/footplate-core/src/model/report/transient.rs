//! Changes of speed as they were observed: sensors passed while a train got faster or slower.

use alloc::vec::Vec;

use super::run::RunPassages;
use super::settled::{SettledRunning, path_length, settles_within};
use crate::ids::{SpeedStep, TrainId};
use crate::model::MotionModel;
use crate::model::passage::{Drive, Passage};
use crate::model::survey::SectionIndex;
use crate::track::Layout;
use crate::units::Speed;

/// Detections after the change was over that are kept with it: they determine where the train was.
const SETTLED_KEPT: usize = 3;
/// Fewest detections of a change that say anything about its law beyond where the train started.
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

/// One detection during a change of speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransientPoint {
    /// Seconds since the command.
    pub since_command: f64,
    /// Variance of that, from the poll (s²).
    pub variance: f64,
    /// Path since the first detection of the change (m), with the lengths of the motion model.
    pub distance: f64,
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
    /// Its detections in order.
    pub points: Vec<TransientPoint>,
    /// Scatter of the train's detections and uncertainty of the path between them (m).
    pub distance_deviation: f64,
}

impl Transient {
    /// The direction of the change.
    pub fn direction(&self) -> Direction {
        let [from, to] = self.steps;
        if to < from { Direction::Down } else { Direction::Up }
    }
}

/// Uncertainty of the path between two sensors beyond their scatter (m): what is left of ten millimetres of survey
/// once a section was passed a few times.
const PATH_UNCERTAINTY_M: f64 = 0.005;

/// What a change is read with: the model of its train, and its settled running.
#[derive(Debug, Clone, Copy)]
pub(super) struct ChangeReader<'r> {
    pub(super) layout: &'r Layout,
    pub(super) sections: &'r SectionIndex,
    pub(super) model: &'r MotionModel,
    pub(super) running: &'r SettledRunning,
}

impl ChangeReader<'_> {
    /// All changes of speed in a run of which enough was seen.
    pub(super) fn changes(&self, run: &RunPassages) -> Vec<Transient> {
        let chains = run.passages.chunk_by(|one, next| one.drive == next.drive && next.path.is_some());
        let mut before: Option<Drive> = None;
        chains
            .filter_map(|chain| {
                let drive = chain.first()?.drive;
                let change = self.change(run, chain, before);
                before = Some(drive);
                change
            })
            .collect()
    }

    fn change(&self, run: &RunPassages, chain: &[Passage], before: Option<Drive>) -> Option<Transient> {
        let drive = chain.first()?.drive;
        let commanded = drive.commanded?;
        let ends = settles_within(self.model, drive);
        let from = match before.filter(|before| before.step == drive.from) {
            _ if drive.from == SpeedStep::STAND => Speed::ZERO,
            Some(before) => self.running.speed_in_run(self.model, run.run, before)[0],
            None => self.model.steady_speed(drive.from, crate::event::Approach::Below),
        };
        let to = if drive.step == SpeedStep::STAND {
            Speed::ZERO
        } else {
            self.running.speed_in_run(self.model, run.run, drive)[0]
        };
        let mut distance = 0.0;
        let mut settled = 0;
        let mut points = Vec::new();
        for (place, passage) in chain.iter().enumerate() {
            if let (true, Some(reach)) = (place > 0, &passage.path) {
                distance += path_length(self.layout, self.sections, self.model, reach).as_m();
            }
            let since = passage.window.middle() - commanded;
            settled += usize::from(since > ends);
            if settled > SETTLED_KEPT {
                break;
            }
            points.push(TransientPoint {
                since_command: since.as_s(),
                variance: passage.window.variance_s2(),
                distance,
                entry: passage.entry,
            });
        }
        let changing = points.iter().any(|point| point.since_command < ends.as_s());
        if points.len() < FEWEST || !changing {
            return None;
        }
        Some(Transient {
            train: run.train,
            run: run.run,
            steps: [drive.from, drive.step],
            speeds: [from, to],
            points,
            distance_deviation: libm::hypot(self.running.sensor_scatter.as_m(), PATH_UNCERTAINTY_M),
        })
    }
}
