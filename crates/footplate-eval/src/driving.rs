//! Random trains, calibrated and then driven to exact stops: by Footplate, by an oracle that knows the train, and by
//! the method of course projects.

mod course_project;
mod figures;
mod known_train;
mod page;
mod trial;

use footplate_core::TimeSpan;
use footplate_core::model::survey::SectionIndex;
use footplate_core::track::Layout;
use footplate_core::tracking::TrackContext;
use footplate_sim::LawFamily;

use self::course_project::CourseProject;
pub use self::figures::ScoredTrain;
pub(crate) use self::known_train::known;
pub use self::page::Page;
use self::trial::{Counts, Trial, ahead, world};
pub use self::trial::{Plan, TRAIN};
use crate::testbed::{Calibrated, calibrate};

/// The number of each kind of task per train.
const COUNTS: Counts = Counts { mid_stops: 16, top_stops: 8, not_beyond: 12, moves: 12 };

/// Calibrates one train and then has each driver carry out the same tasks in copies of the same world.
///
/// # Errors
/// No train can run on the layout.
pub fn score(layout: &Layout, seed: u64, law: LawFamily, budget: TimeSpan) -> anyhow::Result<ScoredTrain> {
    let sections = SectionIndex::of(layout);
    let mut line = world(layout, seed, law)?;
    let calibrated = calibrate(layout, &mut line, TRAIN, budget);
    // The tasks differ from train to train, and are the same for all drivers.
    let ordered = seed.wrapping_mul(LawFamily::ALL.len() as u64).wrapping_add(law as u64);
    let sensors: Vec<_> =
        ahead(layout, &line, &calibrated.turnouts).into_iter().map(|(node, _)| node).collect();
    let context = TrackContext { layout, sections: &sections, turnouts: &calibrated.turnouts };
    let oracle = known(context, line.station.world.truth(), TRAIN, &sensors)?;
    let mut by = Vec::new();
    for model in [calibrated.model.clone(), oracle] {
        let mut world = line.clone();
        let known = Calibrated { model, ..calibrated.clone() };
        let mut trial = Trial::new(layout, &mut world, known, ordered);
        trial.run(COUNTS);
        by.push(trial.results);
    }
    let mut world = line.clone();
    let plan = Plan::new(&world, ordered);
    by.push(CourseProject::new(layout, &mut world, calibrated.turnouts).run(plan, COUNTS));
    let (calibration_s, ending) = (calibrated.seconds, calibrated.ending);
    let found = calibrated.model.train_length();
    let truth = line.station.world.truth().sensed_length(TRAIN);
    let length_error_mm = truth.filter(|_| !found.is_unknown()).map(|truth| {
        let found = found.length();
        [(found.value - truth).as_mm(), found.uncertainty.as_mm()]
    });
    Ok(ScoredTrain { law, seed, calibration_s, ending, length_error_mm, by })
}
