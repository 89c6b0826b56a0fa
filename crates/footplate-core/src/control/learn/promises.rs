//! Promises of the calibrator, whatever the train does.

use alloc::vec::Vec;

use super::calibrator::Calibrator;
use super::notice::{CalibrationNotice, Ending, Fault};
use super::scripted_train::ScriptedTrain;
use super::settings::CalibratorSettings;
use crate::event::{Approach, Command};
use crate::ids::{SpeedStep, TrainId, TurnoutId};
use crate::model::MotionFit;
use crate::time::TimeSpan;
use crate::track::example::oval_plan;
use crate::track::{Layout, Leg};
use crate::units::Length;

/// The oval of this crate's tests at a size that trains fit on.
fn large_oval() -> Layout {
    let mut plan = oval_plan();
    for stretch in &mut plan.stretches {
        stretch.length = (3.0 * stretch.length.estimate(&plan.survey).0).into();
    }
    Layout::build(&plan).unwrap()
}

fn calibrator(layout: &Layout, seconds: f64) -> Calibrator<'_> {
    let settings = CalibratorSettings {
        budget: TimeSpan::from_s(seconds),
        train_length: Length::from_mm(150.0),
        ..CalibratorSettings::default()
    };
    Calibrator::new(layout, settings, MotionFit::new(TrainId(24), SpeedStep::new(14).unwrap()))
}

fn fault(notice: &CalibrationNotice) -> Option<&Fault> {
    match notice {
        CalibrationNotice::Mishap(fault) => Some(fault),
        _ => None,
    }
}

#[test]
fn a_train_is_found_brought_to_a_circuit_and_stopped_within_the_budget() {
    let layout = large_oval();
    let mut train = ScriptedTrain::new(&layout, "D1", "A1", 200.0);
    let mut machine = calibrator(&layout, 120.0);
    train.run(&mut machine, 200.0);
    assert_eq!(machine.ending(), Some(&Ending::Budget));
    assert!(train.now.as_s() <= 121.0, "{}", train.now.as_s());
    assert!(train.is_at_rest() && !train.overran);
    assert!(train.has_notified(|notice| matches!(notice, CalibrationNotice::Found { .. })));
    assert!(train.has_notified(|notice| matches!(notice, CalibrationNotice::Done(_))));
}

#[test]
fn on_request_all_turnouts_are_set_before_the_train_moves() {
    let layout = large_oval();
    let mut train = ScriptedTrain::new(&layout, "D1", "A1", 200.0);
    let mut machine = calibrator(&layout, 120.0);
    machine.settings.sets_turnouts = true;
    train.run(&mut machine, 200.0);
    let moves =
        |command: &Command| matches!(command, Command::Speed { step, .. } if *step != SpeedStep::STAND);
    let first_move = train.commands.iter().position(|(_, command)| moves(command)).unwrap();
    let set = |turnout| {
        let straight = Command::Turnout { turnout, curved: false };
        train.commands[..first_move].iter().any(|(_, command)| *command == straight)
    };
    assert!(layout.turnouts().len() > 0 && layout.turnouts().all(|(turnout, _)| set(turnout)));
    assert_eq!(machine.ending(), Some(&Ending::Budget), "it is calibrated all the same");
    assert!(train.has_notified(|notice| matches!(notice, CalibrationNotice::Done(_))));
}

#[test]
fn a_train_that_faces_the_end_of_its_track_reverses_in_time() {
    // The separate track, with its one sensor far from both of its ends.
    let mut plan = oval_plan();
    for stretch in plan.stretches.iter_mut().rev().take(2) {
        stretch.length = Length::from_mm(2_000.0).into();
    }
    let layout = Layout::build(&plan).unwrap();
    let mut train = ScriptedTrain::new(&layout, "EN1", "E1", 1_500.0);
    let mut machine = calibrator(&layout, 300.0);
    train.run(&mut machine, 300.0);
    assert!(train.has_notified(|notice| matches!(notice, CalibrationNotice::TurnsAround { .. })));
    assert_eq!(machine.ending(), Some(&Ending::NoCircuit));
    assert!(!train.overran && train.is_at_rest());
}

#[test]
fn a_turnout_that_does_not_move_is_commanded_again_and_then_avoided() {
    let layout = large_oval();
    let mut train = ScriptedTrain::new(&layout, "B1", "MR2", 200.0);
    train.legs.set(TurnoutId(1), Leg::Curved);
    train.jammed.push(TurnoutId(1));
    let mut machine = calibrator(&layout, 90.0);
    train.run(&mut machine, 40.0);
    assert!(train.has_notified(|notice| matches!(fault(notice), Some(Fault::WrongLeg { .. }))));
    assert!(train.has_notified(|notice| matches!(notice, CalibrationNotice::Done(_))));
}

#[test]
fn a_step_at_which_the_train_stalls_is_unreliable() {
    let layout = large_oval();
    let mut train = ScriptedTrain::new(&layout, "D1", "A1", 200.0);
    let mut machine = calibrator(&layout, 200.0);
    train.run(&mut machine, 30.0);
    train.stuck_below = 4;
    train.run(&mut machine, 170.0);
    let stalled = train.notices.iter().find_map(|(_, notice)| match fault(notice) {
        Some(Fault::Stalled { step }) => Some(*step),
        _ => None,
    });
    let step = stalled.expect("it should be noticed");
    assert!(step.get() <= 4);
}

#[test]
fn a_silent_sensor_is_tolerated() {
    let layout = large_oval();
    let mut train = ScriptedTrain::new(&layout, "D1", "A1", 200.0);
    train.dead.push(layout.sensor_named("B1").unwrap());
    let mut machine = calibrator(&layout, 90.0);
    train.run(&mut machine, 100.0);
    assert_eq!(machine.ending(), Some(&Ending::Budget));
    assert!(!train.has_notified(|notice| matches!(fault(notice), Some(Fault::Lost { .. }))));
}

#[test]
fn a_lifted_train_is_stopped_and_searched_for() {
    let layout = large_oval();
    let mut train = ScriptedTrain::new(&layout, "D1", "A1", 200.0);
    let mut machine = calibrator(&layout, 150.0);
    train.run(&mut machine, 20.0);
    train.is_lifted = true;
    train.run(&mut machine, 45.0);
    assert!(train.has_notified(|notice| matches!(fault(notice), Some(Fault::Lost { .. }))));
    train.is_lifted = false;
    train.put("B1", "MR2", 50.0);
    let before = train.notices.len();
    train.run(&mut machine, 60.0);
    let found = |notice: &CalibrationNotice| matches!(notice, CalibrationNotice::Found { .. });
    assert!(train.notices[before..].iter().any(|(_, notice)| found(notice)));
}

#[test]
fn a_train_that_moves_at_no_step_is_not_found_and_commanded_to_stop() {
    let layout = large_oval();
    let mut train = ScriptedTrain::new(&layout, "D1", "A1", 200.0);
    train.stuck_below = 14;
    let mut machine = calibrator(&layout, 600.0);
    train.run(&mut machine, 600.0);
    assert_eq!(machine.ending(), Some(&Ending::NotFound));
    assert!(train.is_at_rest());
}

#[test]
fn a_train_that_runs_otherwise_than_in_earlier_sessions_is_noticed() {
    let layout = large_oval();
    let mut train = ScriptedTrain::new(&layout, "D1", "A1", 200.0);
    let mut machine = calibrator(&layout, 240.0);
    train.run(&mut machine, 250.0);
    // Every step from either side, but the highest, which is reached from below only.
    let lines: Vec<_> = machine.accuracy().iter().map(|line| (line.step, line.approach)).collect();
    let (highest, others) = lines.split_last().unwrap();
    assert_eq!(highest.1, Approach::Below);
    assert!(!others.is_empty() && others.chunks(2).all(|pair| {
        matches!(pair, [(one, Approach::Below), (other, Approach::Above)] if one == other && *one < highest.0)
    }), "{lines:?}");
    let line = machine.accuracy()[0];
    // 95 % of a normal distribution are within 1.96 deviations.
    let within = 1.96 * line.speed.uncertainty.as_mm_per_s() / line.speed.value.as_mm_per_s();
    assert!((line.speed_within().as_parts() / within - 1.0).abs() < 1e-4, "{line:?}");
    assert!((line.stop_within().as_mm() / (1.96 * line.stop.deviation().as_mm()) - 1.0).abs() < 1e-4);
    // In the next session it runs a fifth faster; polls of 62 ms leave two per cent of a hop.
    let mut train = ScriptedTrain::new(&layout, "D1", "A1", 200.0);
    train.speed_of = |step| 48.0 * f64::from(step);
    let settings = machine.settings.clone();
    let mut machine = Calibrator::new(&layout, settings, machine.into_fit());
    machine.settings.budget = TimeSpan::from_s(400.0);
    train.run(&mut machine, 410.0);
    let ratios = train.notices.iter().filter_map(|(_, notice)| match fault(notice) {
        Some(Fault::OtherSpeeds { ratio }) => Some(*ratio),
        _ => None,
    });
    let ratios: Vec<f64> = ratios.collect();
    assert!(matches!(ratios[..], [ratio] if (ratio - 1.2).abs() < 0.03), "{ratios:?}");
}
