//! What a calibration says is true of the simulated train behind the reports, and the walk event by event ends
//! where the batch fit does.

use footplate_core::Approach;
use footplate_core::calibration::{Constant, Direction, LawKind, SectionIndex};
use footplate_core::kinematics::SpeedLaw;
use footplate_sim::LawFamily;
use footplate_store::layout_named;

use crate::simulated::{TRAIN, fitted, for_each, walked};

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn speeds_are_true_within_their_uncertainty_and_both_ways_agree() {
    let layout = layout_named("track-a").expect("built in").layout;
    let sections = SectionIndex::of(&layout);
    let (mut batch, mut online, mut between) = (Vec::new(), Vec::new(), Vec::new());
    for_each(&layout, "changes", 3, |railway, recording| {
        let predictor = walked(&layout, recording);
        let calibration = fitted(&layout, &sections, recording, &predictor);
        let model = predictor.train(TRAIN).expect("the train has run");
        let walked: Vec<_> = model.calibrated_speeds(&sections).collect();
        // A recording that begins under way does not say from which side the step was reached, so its truth
        // is not one number.
        let told = calibration.fit.speeds.iter().filter(|(key, _)| key.approach != Approach::Unknown);
        for (key, speed) in told {
            let truth = railway.lap_speed(&recording.train, key.step, key.approach);
            batch.push((speed.value - truth) / speed.uncertainty);
            let found = walked.iter().find(|(step, side, _)| *step == key.step && *side == key.approach);
            if let Some((_, _, own)) = found {
                online.push((own.value - truth) / own.uncertainty);
                let doubt = own.uncertainty.as_mm_per_s().hypot(speed.uncertainty.as_mm_per_s());
                between.push((own.value - speed.value).as_mm_per_s() / doubt);
            }
        }
    });
    assert!(batch.len() > 200 && between.len() > 200, "{} and {} speeds", batch.len(), between.len());
    // One standard deviation is one standard deviation, give or take what three draws of the track allow: all
    // speeds of a track share the error of its survey.
    assert!((0.5..1.7).contains(&rms(&batch)), "batch: {}", rms(&batch));
    assert!((0.4..1.7).contains(&rms(&online)), "online: {}", rms(&online));
    let apart = between.iter().filter(|apart| apart.abs() > 2.0).count();
    assert!(apart * 20 < between.len(), "{apart} of {} speeds differ by over two deviations", between.len());
    assert!(rms(&between) < 1.0, "between: {}", rms(&between));
}

#[test]
fn a_lag_and_a_constant_rate_are_recognised() {
    let layout = layout_named("track-a").expect("built in").layout;
    let sections = SectionIndex::of(&layout);
    for_each(&layout, "changes", 2, |_, recording| {
        let lags = recording.train.law.family() == LawFamily::Lag;
        let rated = recording.train.law.family() == LawFamily::Constant;
        if !(lags || rated) {
            return;
        }
        let predictor = walked(&layout, recording);
        let calibration = fitted(&layout, &sections, recording, &predictor);
        let comparison = &calibration.laws[&(TRAIN, Direction::Down)];
        let best = &comparison.laws[comparison.best];
        assert!(comparison.fits, "{best:?}");
        let LawKind::Family(family) = best.kind else { panic!("{best:?}") };
        if lags {
            assert_eq!(family.law, SpeedLaw::Lag, "{best:?}");
        } else {
            assert_eq!(family.constant, Constant::Acceleration, "{best:?}");
        }
    });
}
