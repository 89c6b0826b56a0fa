//! What a calibration says is true of the simulated train behind the reports.

use footplate_core::Approach;
use footplate_core::kinematics::SpeedLaw;
use footplate_core::model::report::{Constant, Direction, LawKind};
use footplate_core::{SpeedStep, TimeSpan};
use footplate_sim::{LawFamily, SimulatedRecording};
use footplate_store::layout_named;

use crate::simulated::{batch_of, for_each};

/// Half of a 95 % interval in standard deviations.
const HALF_95: f64 = 1.96;

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

fn inside_95(standardised: &[f64]) -> f64 {
    let inside = standardised.iter().filter(|value| value.abs() <= HALF_95).count();
    inside as f64 / standardised.len() as f64
}

/// By how much later than the host believes a command is heard, and than a contact is read a report is stamped, on average:
/// with what the host wrote down a train stops so much later.
fn link_lag(recording: &SimulatedRecording) -> TimeSpan {
    let runs = || recording.runs.iter();
    let commands = runs().flat_map(|run| {
        run.truth.commands.iter().map(|command| (command.heard - run.events[command.event].time).as_s())
    });
    let reports = runs().flat_map(|run| {
        run.truth.reports.iter().map(|report| (run.events[report.event].time - report.reading).as_s())
    });
    let mean = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
        sum / f64::max(count, 1.0)
    };
    TimeSpan::from_s(mean(&mut commands.into_iter()) + mean(&mut reports.into_iter()))
}

#[test]
fn speeds_and_stops_are_true_within_their_uncertainty() {
    let layout = layout_named("track-a").expect("built in").layout;
    let (mut speeds, mut stops) = (Vec::new(), Vec::new());
    for_each(&layout, "calibration", 4, |railway, recording| {
        let batch = batch_of(&layout, recording);
        let model = batch.trains[0].replay.fit.model();
        let lag = link_lag(recording);
        for step in (1..=model.highest().get()).filter_map(SpeedStep::new) {
            for approach in [Approach::Below, Approach::Above] {
                let (speed, stop) = (model.speed(step, approach), model.stop(step, approach));
                let true_speed = railway.lap_speed(&recording.train, step, approach);
                if speed.count > 1 {
                    speeds.push((speed.value - true_speed) / speed.uncertainty);
                }
                if stop.count > 0 {
                    let true_stop = recording.train.stopping_distance(step, approach) + true_speed * lag;
                    stops.push((stop.distance - true_stop) / stop.doubt);
                }
            }
        }
    });
    assert!(speeds.len() > 100 && stops.len() > 40, "{} speeds, {} stops", speeds.len(), stops.len());
    assert!(inside_95(&speeds) > 0.9, "speeds: {:.3}, rms {:.2}", inside_95(&speeds), rms(&speeds));
    assert!(inside_95(&stops) > 0.9, "stops: {:.3}, rms {:.2}", inside_95(&stops), rms(&stops));
}

#[test]
fn short_moves_end_within_their_uncertainty() {
    let layout = layout_named("track-a").expect("built in").layout;
    let mut errors = Vec::new();
    for_each(&layout, "calibration", 2, |_, recording| {
        let batch = batch_of(&layout, recording);
        let model = batch.trains[0].replay.fit.model();
        for step in (4..=10).step_by(2).filter_map(SpeedStep::new) {
            for run in (2..=10).map(|quarters| TimeSpan::from_ms(250 * quarters)) {
                let forecast = model.short_move(step, run);
                let missed = forecast.distance - recording.train.short_move(step, run);
                errors.push(missed / forecast.uncertainty);
                if let Some(again) = model.short_move_time(step, forecast.distance) {
                    assert!((again - run).as_s().abs() < 1e-6, "{again:?} is not {run:?}");
                }
            }
        }
    });
    println!("short moves: {:.3} inside, rms {:.2}", inside_95(&errors), rms(&errors));
    assert!(inside_95(&errors) > 0.9, "{:.3}, rms {:.2}", inside_95(&errors), rms(&errors));
}

#[test]
fn a_lag_and_a_constant_rate_are_recognised() {
    let layout = layout_named("track-a").expect("built in").layout;
    for_each(&layout, "changes", 2, |_, recording| {
        let lags = recording.train.law.family() == LawFamily::Lag;
        let rated = recording.train.law.family() == LawFamily::Constant;
        if !(lags || rated) {
            return;
        }
        let batch = batch_of(&layout, recording);
        let comparison = &batch.trains[0].review.laws[&Direction::Down];
        let best = &comparison.laws[0];
        assert!(comparison.fits, "{best:?}");
        let LawKind::Family(family) = best.kind else { panic!("{best:?}") };
        if lags {
            assert_eq!(family.law, SpeedLaw::Lag, "{best:?}");
        } else {
            assert_eq!(family.constant, Constant::Acceleration, "{best:?}");
        }
    });
}
