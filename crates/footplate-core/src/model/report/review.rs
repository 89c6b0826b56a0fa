//! What the runs of one train show beside its motion model: residuals, changes of speed and the laws that describe
//! them, stops measured with a tape.
//!
//! Nothing here estimates the model. It is read by people who want to know what is behind a number, and whether the train
//! behaves as the model says.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use super::law_fit::{LawComparison, compare_laws};
use super::run::RunPassages;
use super::settled::SettledRunning;
use super::taped_stop::TapedStop;
use super::transient::{ChangeReader, Direction, Transient};
use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::kinematics::StepTable;
use crate::model::MotionModel;
use crate::model::survey::SectionIndex;
use crate::track::Layout;
use crate::units::Speed;

/// The runs of one train beside its motion model.
#[derive(Debug, Clone, PartialEq)]
pub struct Review {
    /// Sensors passed at a settled speed.
    pub running: SettledRunning,
    /// Changes of speed of which enough was seen.
    pub changes: Vec<Transient>,
    /// The laws that may describe them, by direction, where enough changes were seen.
    pub laws: BTreeMap<Direction, LawComparison>,
    /// Stops measured with a tape.
    pub stops: Vec<TapedStop>,
}

impl Review {
    /// Reads the runs of the train of a model; those of other trains are passed over.
    pub fn of(layout: &Layout, sections: &SectionIndex, model: &MotionModel, runs: &[RunPassages]) -> Self {
        let own: Vec<&RunPassages> = runs.iter().filter(|run| run.train == model.train()).collect();
        let running = SettledRunning::of(layout, sections, model, &own);
        let reader = ChangeReader { layout, sections, model, running: &running };
        let changes: Vec<Transient> = own.iter().flat_map(|run| reader.changes(run)).collect();
        let table = step_table(model);
        let mut by_direction: BTreeMap<Direction, Vec<Transient>> = BTreeMap::new();
        for change in &changes {
            by_direction.entry(change.direction()).or_default().push(change.clone());
        }
        let compared = by_direction
            .into_iter()
            .filter_map(|(direction, changes)| Some((direction, compare_laws(&changes, table.as_ref())?)));
        let laws = compared.collect();
        let stops = own.iter().flat_map(|run| {
            let stop = |stop| TapedStop::of(layout, sections, model, &running, run, stop);
            run.stops.iter().filter_map(stop).collect::<Vec<_>>()
        });
        let stops = stops.collect();
        Self { running, changes, laws, stops }
    }
}

/// The speeds of all steps for a ramp through them. `None` where a lower step is as fast as a higher one.
pub(super) fn step_table(model: &MotionModel) -> Option<StepTable> {
    let steps = (1..=model.highest().get()).filter_map(SpeedStep::new);
    let speeds = steps.map(|step| model.steady_speed(step, Approach::Below));
    let all: Vec<Speed> = core::iter::once(Speed::ZERO).chain(speeds).collect();
    StepTable::new(&all).ok()
}
