//! The loop over a simulated station: what a machine asks for happens, is written down first, and ends with trains that
//! stand.

use footplate_core::control::{Machine, Output};
use footplate_core::track::{Layout, LayoutPlan, Place, RailEnd, Stretch, Survey};
use footplate_core::{Command, Event, EventKind, Length, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_sim::living::{LivingSwitches, VirtualStation};
use footplate_store::layout_named;
use footplate_wire::marklin_serial::{Interface, Settings};
use footplate_wire::{CommandError, LinkNotice};

use super::{Attendant, Ended, Recorder, Runtime, Wish};
use crate::clock::Stopwatch;
use crate::link::{Address, Link, SimulatedLink, Speed, open_session, open_simulated};

const T24: TrainId = TrainId(24);
const T58: TrainId = TrainId(58);

/// Starts two trains and lets them run.
pub(super) struct Runs {
    commands: Vec<Command>,
    pub(super) heard: Vec<Event>,
}

impl Runs {
    pub(super) fn none() -> Self {
        Self { commands: Vec::new(), heard: Vec::new() }
    }

    pub(super) fn two() -> Self {
        let step = |step| SpeedStep::new(step).expect("a step");
        let commands =
            vec![Command::Speed { train: T24, step: step(8) }, Command::Speed { train: T58, step: step(9) }];
        Self { commands, heard: Vec::new() }
    }
}

impl Machine for Runs {
    type Notice = ();

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        assert!(event.time <= now, "nothing is heard before it happens");
        self.heard.push(*event);
    }

    fn handle_timeout(&mut self, _: Timestamp) {}

    fn poll_output(&mut self) -> Option<Output<()>> {
        self.commands.pop().map(Output::Command)
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        None
    }
}

/// Lets it run until a time.
pub(super) struct Until(pub(super) Timestamp, pub(super) Vec<LinkNotice>);

impl<M: Machine> Attendant<M> for Until {
    fn hear(&mut self, _: Timestamp, _: M::Notice) {}

    fn hear_of_line(&mut self, _: Timestamp, notice: &LinkNotice) {
        self.1.push(notice.clone());
    }

    fn hear_of_refusal(&mut self, _: Timestamp, command: Command, error: CommandError) {
        panic!("{command:?}: {error}");
    }

    fn attend(&mut self, now: Timestamp, _: &mut M) -> Wish {
        if now >= self.0 { Wish::Finish } else { Wish::GoOn }
    }
}

#[derive(Default)]
struct Written(Vec<Event>);

impl Recorder for Written {
    fn record(&mut self, events: &[Event]) -> anyhow::Result<()> {
        self.0.extend(events);
        Ok(())
    }
}

struct FullDisk;

impl Recorder for FullDisk {
    fn record(&mut self, _: &[Event]) -> anyhow::Result<()> {
        anyhow::bail!("no space is left")
    }
}

fn with_runtime<R>(
    recorder: Option<&mut dyn Recorder>,
    with: impl FnOnce(Runtime<'_, SimulatedLink<'_>>) -> R,
) -> R {
    let address: Address = "sim:track-a?seed=7&faults=none&speed=max".parse().expect("an address");
    let Address::Simulated(simulated) = &address else { panic!("a simulated one") };
    let layout = layout_named(&simulated.layout).expect("a layout").layout;
    let link = open_simulated(simulated, &layout, Speed::Unpaced).expect("a world");
    let session = open_session(&address, &link, &layout).expect("modules");
    with(Runtime::new(link, session, recorder, None))
}

#[test]
fn trains_run_are_written_down_and_stand_in_the_end() {
    let mut written = Written::default();
    let mut machine = Runs::two();
    let mut until = Until(Timestamp::from_s(60.0), Vec::new());
    let distances = with_runtime(Some(&mut written), |mut runtime| {
        let ended = runtime.run(&mut machine, &mut until).expect("no disk is full");
        assert!(matches!(ended, Ended::Finished));
        let closing = runtime.close();
        assert!(closing.is_complete(), "{closing}");
        assert_eq!(closing.commanded_to_stop.len(), 2);
        let station = runtime.link_mut().station_mut();
        let _ = station.advance(Timestamp::from_s(70.0));
        assert!(!station.world().is_powered());
        assert_eq!(station.alarms(), []);
        [T24, T58].map(|train| station.world().truth().train(train).expect("it is there").odometer)
    });
    assert!(distances.iter().all(|ran| ran.as_m() > 1.0), "{distances:?}");
    let reports = machine.heard.iter().filter(|event| matches!(event.kind, EventKind::Sensor(_)));
    assert!(reports.count() > 10);
    // The machine heard what is written down, in this order, and the end is written down as well.
    assert!(written.0.starts_with(&machine.heard));
    let stops = written.0[machine.heard.len()..]
        .iter()
        .filter(|event| matches!(event.kind, EventKind::Speed { step, .. } if step == SpeedStep::STAND));
    assert_eq!(stops.count(), 2);
    assert!(written.0.is_sorted_by_key(|event| event.time));
    assert_eq!(until.1, [LinkNotice::Answers]);
}

#[test]
fn a_disk_that_is_full_ends_the_run_and_stops_the_trains() {
    with_runtime(Some(&mut FullDisk), |mut runtime| {
        let mut until = Until(Timestamp::from_s(60.0), Vec::new());
        let error = runtime.run(&mut Runs::two(), &mut until).expect_err("nothing can be written");
        assert_eq!(error.to_string(), "no space is left");
        assert!(runtime.close().is_complete());
        assert!(!runtime.link().station().world().is_powered());
    });
}

/// Two ovals of six sensors, 60 cm apart, so that two trains run for ever and never meet.
fn two_ovals() -> Layout {
    let end = |number: u16| RailEnd { node: format!("S{number}"), leg: None };
    let sensor = |number: u16| Place::Sensor {
        names: [format!("S{number}"), format!("R{number}")],
        sensors: [SensorId(2 * number), SensorId(2 * number + 1)],
    };
    let stretch = |number: u16| {
        let next = if number % 6 == 5 { number - 5 } else { number + 1 };
        Stretch { from: end(number), to: end(next), length: Length::from_mm(600.0).into() }
    };
    let plan = LayoutPlan {
        name: "two ovals".to_owned(),
        survey: Survey::taped(Length::from_mm(10.0), "chosen".to_owned()),
        places: (0..12).map(sensor).collect(),
        stretches: (0..12).map(stretch).collect(),
        never_both_curved: Vec::new(),
        zones: Vec::new(),
        blocks: Vec::new(),
    };
    Layout::build(&plan).expect("two ovals are a layout")
}

#[test]
fn two_trains_run_many_times_faster_than_real_time() {
    let layout = two_ovals();
    let station =
        VirtualStation::draw(&layout, 1, &[T24, T58], &LivingSwitches::faultless()).expect("a world");
    let link = SimulatedLink::new(station, Speed::Unpaced);
    // As many modules as the course's track has.
    let session = Interface::new(link.now(), Settings::with_cts(5)).expect("modules");
    let mut runtime = Runtime::new(link, session, None, None);

    let stopwatch = Stopwatch::start();
    let simulated = TimeSpan::from_s(600.0);
    let (mut machine, mut until) = (Runs::two(), Until(Timestamp::ZERO + simulated, Vec::new()));
    runtime.run(&mut machine, &mut until).expect("nothing is written");
    let times = simulated.as_s() / stopwatch.elapsed().as_secs_f64();

    println!("{times:.0} times real time, {} entries", machine.heard.len());
    let truth = runtime.link().station().world().truth();
    for train in [T24, T58] {
        let ran = truth.train(train).expect("it is there").odometer;
        assert!(ran.as_m() > 60.0, "train {train} ran {ran:?}: the figure is of trains that run");
    }
    // The figure is the release build's; this only notices when something is badly wrong.
    assert!(times > 200.0, "{times:.0} times real time");
}

/// Asks for a time that has long passed, again and again.
#[derive(Default)]
struct Impatient {
    woken: usize,
}

impl Machine for Impatient {
    type Notice = ();

    fn handle_event(&mut self, _: Timestamp, _: &Event) {}

    fn handle_timeout(&mut self, _: Timestamp) {
        self.woken += 1;
    }

    fn poll_output(&mut self) -> Option<Output<()>> {
        None
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        Some(Timestamp::ZERO)
    }
}

#[test]
fn a_machine_that_asks_for_a_time_that_has_passed_does_not_stop_the_clock() {
    let mut machine = Impatient::default();
    with_runtime(None, |mut runtime| {
        let end = runtime.link().now() + TimeSpan::from_s(10.0);
        let ended = runtime.run(&mut machine, &mut Until(end, Vec::new())).expect("nothing is recorded");
        assert!(matches!(ended, Ended::Finished));
    });
    assert!((1_000..=4_000).contains(&machine.woken), "{}", machine.woken);
}
