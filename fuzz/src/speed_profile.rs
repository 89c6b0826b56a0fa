//! Any bytes as a speed profile: refused with the file's name, or read; a roster entry that takes our numbers gives them back.

use footplate_core::model::{MotionModel, StepUse};
use footplate_core::{SpeedStep, TrainId};
use footplate_store::{ModelRow, ProfileContext, parse_profile, write_roster_entry};

pub(crate) fn fuzz(bytes: &[u8]) {
    let highest = SpeedStep::new(14).unwrap_or_default();
    let context = ProfileContext { highest, scale: Some(87.0), loco: None, full_velocity: None };
    match parse_profile("any.xml", bytes, &context) {
        Ok(profile) => {
            let model = profile.beginning(TrainId(24), highest);
            let numbers = model.numbers();
            assert!(numbers.values.iter().chain(&numbers.covariance).all(|number| number.is_finite()));
        }
        Err(error) => assert!(error.to_string().starts_with("any.xml"), "{error}"),
    }
    let mut model = MotionModel::unknown(TrainId(24), highest);
    for step in [5, 14].into_iter().filter_map(SpeedStep::new) {
        model.note_use(step, StepUse::Moves);
    }
    let rows = ModelRow::of_model(&model);
    if let Ok(written) = write_roster_entry("any.xml", bytes, &rows) {
        let again = write_roster_entry("any.xml", &written, &rows);
        assert_eq!(again.ok(), Some(written.clone()), "an export changes its own output");
        let read = parse_profile("any.xml", &written, &context);
        assert!(read.is_ok_and(|read| read.speeds.len() == rows.len()), "an export is not read back");
    }
}
