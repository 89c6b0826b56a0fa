//! What a calibration promises over the bytes of a simulated station, whatever the train is like and whatever goes wrong.

use footplate_core::control::learn::{
    CalibrationNotice, Calibrator, CalibratorSettings, Ending, Fault, StepAccuracy,
};
use footplate_core::model::MotionFit;
use footplate_core::track::Layout;
use footplate_core::{Command, Ratio, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_sim::{LawFamily, LivingSwitches, VirtualStation};
use footplate_store::built_in;
use footplate_wire::marklin_serial::{Interface, Settings};
use footplate_wire::{CommandError, LinkNotice};

use super::watcher::Watcher;
use crate::link::{Link, SimulatedLink, Speed};
use crate::recorded::Recorded;
use crate::runtime::{Attendant, Runtime, Wish};

const TRAIN: TrainId = TrainId(24);
/// Worlds in which a train of each law is calibrated; nothing was chosen by them.
const SEEDS: [u64; 3] = [100, 101, 102];

/// Listens, and ends a run at a time or with the calibration.
struct Listener {
    until: Timestamp,
    heard: Vec<CalibrationNotice>,
}

impl<'l> Attendant<Calibrator<'l>> for Listener {
    fn hear(&mut self, _: Timestamp, notice: CalibrationNotice) {
        self.heard.push(notice);
    }

    fn hear_of_line(&mut self, _: Timestamp, _: &LinkNotice) {}

    fn hear_of_refusal(&mut self, _: Timestamp, command: Command, error: CommandError) {
        panic!("{command:?}: {error}");
    }

    fn attend(&mut self, now: Timestamp, machine: &mut Calibrator<'l>) -> Wish {
        if now >= self.until || machine.ending().is_some() { Wish::Finish } else { Wish::GoOn }
    }
}

struct Railway<'l> {
    layout: &'l Layout,
    runtime: Runtime<'static, SimulatedLink<'l>>,
    calibrator: Calibrator<'l>,
    heard: Vec<CalibrationNotice>,
}

impl<'l> Railway<'l> {
    fn new(layout: &'l Layout, seed: u64, switches: &LivingSwitches) -> Self {
        let station = VirtualStation::draw(layout, seed, &[TRAIN], switches).expect("a circuit");
        let link = SimulatedLink::new(station, Speed::Unpaced);
        let session = Interface::new(link.now(), Settings::with_cts(5)).expect("modules");
        let fit = MotionFit::new(TRAIN, SpeedStep::new(14).expect("a step"));
        let calibrator = Calibrator::new(layout, CalibratorSettings::default(), fit);
        Self { layout, runtime: Runtime::new(link, session, None, None), calibrator, heard: Vec::new() }
    }

    /// Goes on until a time (s) or the end.
    fn go_on(&mut self, until_s: f64) {
        let mut listener = Listener { until: Timestamp::from_s(until_s), heard: Vec::new() };
        self.runtime.run(&mut self.calibrator, &mut listener).expect("nothing is written down");
        self.heard.append(&mut listener.heard);
    }

    fn now(&self) -> f64 {
        self.runtime.link().now().as_s()
    }

    fn count(&self, of: impl Fn(&CalibrationNotice) -> bool) -> usize {
        self.heard.iter().filter(|notice| of(notice)).count()
    }

    /// It stands, in time, and most of its steps are known.
    fn assert_done(&mut self, what: &str) -> Vec<StepAccuracy> {
        let ending = self.calibrator.ending().cloned();
        assert!(matches!(ending, Some(Ending::Budget | Ending::NothingToGain)), "{what}: {ending:?}");
        assert!(self.now() <= 305.0, "{what}: {}", self.now());
        let station = self.runtime.link_mut().station_mut();
        let truth = station.world().truth().train(TRAIN).expect("it is there");
        assert!(truth.at_rest_since.is_some(), "{what}: it still runs");
        assert_eq!(station.world().incidents(), [], "{what}");
        assert_eq!(station.alarms(), [], "{what}");
        let _ = self.layout;
        let accuracy = self.calibrator.accuracy();
        assert!(accuracy.len() >= 12, "{what}: {} lines", accuracy.len());
        accuracy
    }
}

#[test]
fn a_train_of_any_law_is_calibrated_within_five_minutes_of_track_time() {
    let layout = built_in("track-a").expect("it is built in").layout;
    let mut within: Vec<f64> = Vec::new();
    for (law, seed) in LawFamily::ALL.into_iter().flat_map(|law| SEEDS.map(|seed| (law, seed))) {
        let what = format!("{}, seed {seed}", law.name());
        let mut railway =
            Railway::new(&layout, seed, &LivingSwitches { law: Some(law), ..LivingSwitches::faultless() });
        railway.go_on(320.0);
        let accuracy = railway.assert_done(&what);
        let stops: u32 = accuracy.iter().map(|line| line.stops).sum();
        assert!(stops >= 5, "{what}: {stops} stops");
        within.push(accuracy[accuracy.len() / 2].stop_within().as_mm());
    }
    within.sort_by(f64::total_cmp);
    // 28 mm of scatter and of the law, and what edges add until stops have been made on them. A train that has broken an early
    // promise promises less until it has kept some.
    assert!(within[within.len() * 2 / 3] < 31.0, "{within:.1?}");
    assert!(within.iter().all(|within| *within < 62.0), "{within:.1?}");
}

#[test]
fn contacts_that_are_missed_stick_and_report_by_themselves_do_not_keep_it_from_that() {
    let layout = built_in("track-b").expect("it is built in").layout;
    let mut switches = LivingSwitches::well_kept();
    switches.faults.missed = Ratio::from_percent(2.0);
    switches.faults.stuck = Ratio::from_percent(1.0);
    switches.faults.spurious_per_minute = 1.0;
    for seed in 300..303 {
        let mut railway = Railway::new(&layout, seed, &switches);
        railway.go_on(320.0);
        railway.assert_done(&format!("seed {seed}"));
    }
}

#[test]
fn a_train_that_is_lifted_and_put_back_is_found_again() {
    let layout = built_in("track-a").expect("it is built in").layout;
    let mut railway = Railway::new(&layout, 7, &LivingSwitches::faultless());
    railway.go_on(60.0);
    let place = {
        let world = railway.runtime.link_mut().station_mut().world_mut();
        let place = world.truth().train(TRAIN).and_then(|train| train.position).expect("it is on the rails");
        world.lift(TRAIN);
        place
    };
    railway.go_on(90.0);
    let lost = |notice: &CalibrationNotice| matches!(notice, CalibrationNotice::Mishap(Fault::Lost { .. }));
    assert!(railway.count(lost) > 0, "it should be missed");
    let found = |notice: &CalibrationNotice| matches!(notice, CalibrationNotice::Found { .. });
    let before = railway.count(found);
    let world = railway.runtime.link_mut().station_mut().world_mut();
    world.place(TRAIN, place, footplate_sim::End::Nose).expect("there is room where it was");
    railway.go_on(320.0);
    assert!(railway.count(found) > before);
    railway.assert_done("after it was lifted");
}

#[test]
fn another_layout_than_was_said_is_noticed_by_its_lengths() {
    let [said, real] = ["track-a", "track-b"].map(|name| built_in(name).expect("it is built in").layout);
    let station = VirtualStation::draw(&real, 7, &[TRAIN], &LivingSwitches::faultless()).expect("a circuit");
    let link = SimulatedLink::new(station, Speed::Unpaced);
    let session = Interface::new(link.now(), Settings::with_cts(5)).expect("modules");
    let fit = MotionFit::new(TRAIN, SpeedStep::new(14).expect("a step"));
    let mut calibrator = Recorded::new(Calibrator::new(&said, CalibratorSettings::default(), fit), None);
    let mut watcher = Watcher::new(&said, TRAIN, TimeSpan::from_s(300.0));
    let mut runtime = Runtime::new(link, session, None, None);
    runtime.run(&mut calibrator, &mut watcher).expect("nothing is written down");
    assert_eq!(watcher.other_layout, Some("track-b"));
    assert!(runtime.link().now().as_s() < 180.0, "{:?}", runtime.link().now());
}
