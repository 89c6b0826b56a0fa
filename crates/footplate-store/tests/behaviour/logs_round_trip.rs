//! A recording written as a sensor log reads back as the same recording.

use footplate_core::{
    Event, EventKind, Length, Report, RunId, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId,
};
use footplate_store::{
    Form, GatePass, ModuleLetters, RawEvent, Recording, Run, SensorNames, TrainAtStart, WriteLogError,
    write_sensor_log,
};
use proptest::prelude::{Just, Strategy, any, prop_assert_eq, prop_oneof, proptest};

use crate::recordings::{ALL, parse, real};

/// What a sensor log keeps of a recording: everything but where it was read.
fn kept(recording: &Recording) -> Vec<Run> {
    let mut runs = recording.runs.clone();
    for run in &mut runs {
        run.events.iter_mut().for_each(|raw| raw.line = 0);
        run.gates.iter_mut().for_each(|pass| pass.line = 0);
    }
    runs
}

fn written(recording: &Recording) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_sensor_log(recording, &ModuleLetters, &mut bytes).unwrap();
    bytes
}

#[test]
fn every_real_log_survives_conversion() {
    for file in ALL {
        let recording = real(file);
        let converted = parse(&written(&recording)).unwrap();
        assert_eq!(converted.form, Form::SensorLog);
        assert_eq!(kept(&converted), kept(&recording), "{file}");
        // And a second conversion changes no byte.
        assert_eq!(written(&converted), written(&recording), "{file}");
    }
}

#[test]
fn a_written_log_has_a_row_an_event() {
    let text = String::from_utf8(written(&real(ALL[1]))).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(
        lines[..4],
        [
            "run,t_s,kind,name,train,step,leg,landmark,offset_mm,poll_interval_ms",
            "1,0,running,,1,0,,,,",
            "1,0,speed,,1,14,,,,",
            "1,1.046268,sensor,C16,,,,,,",
        ]
    );
    assert_eq!(lines[22], "1,13.630309,stopped,,1,,,E12,1310,");
}

#[test]
fn the_example_of_the_documentation_is_a_log() {
    let documentation = include_str!("../../../../docs/formats/sensor-log.md");
    let example = documentation.split("```csv\n").nth(1).and_then(|text| text.split("```").next()).unwrap();
    let recording = parse(example.as_bytes()).unwrap();
    assert_eq!((recording.runs.len(), recording.runs[0].events.len()), (1, 5));
    assert_eq!(recording.notes, []);
    let poll = recording.runs[0].reports().next().unwrap().1.poll_interval;
    assert_eq!(poll, Some(TimeSpan::from_us(65_350)));
}

#[test]
fn a_sensor_that_the_railway_lacks_is_not_written() {
    let mut recording = real(ALL[0]);
    let report = Report { sensor: SensorId(80), poll_interval: None };
    recording.runs[0].events[1].event.kind = EventKind::Sensor(report);
    let error = write_sensor_log(&recording, &ModuleLetters, Vec::new()).unwrap_err();
    assert!(matches!(error, WriteLogError::NamelessSensor { sensor: SensorId(80), run: RunId(1) }));
}

/// Sensors whose names need quotes.
struct Streets;

impl SensorNames for Streets {
    fn sensor_named(&self, name: &str) -> Option<SensorId> {
        name.strip_prefix("the \"Old\" yard, track ")?.parse().ok().map(SensorId)
    }

    fn name_of(&self, sensor: SensorId) -> Option<String> {
        Some(format!("the \"Old\" yard, track {sensor}"))
    }
}

#[test]
fn names_with_commas_and_quotes_survive() {
    let recording = real(ALL[3]);
    let mut bytes = Vec::new();
    write_sensor_log(&recording, &Streets, &mut bytes).unwrap();
    let context = footplate_store::LogContext { sensors: &Streets, train: None };
    let path = std::path::Path::new("yard.csv");
    let converted = footplate_store::parse_sensor_log(path, bytes.as_slice(), context).unwrap();
    assert_eq!(kept(&converted), kept(&recording));
}

const TRAINS: [TrainId; 2] = [TrainId(24), TrainId(58)];

fn kind() -> impl Strategy<Value = EventKind> {
    let train = (0..TRAINS.len()).prop_map(|index| TRAINS[index]);
    let step = (0..=SpeedStep::HIGHEST).prop_map(|step| SpeedStep::new(step).unwrap());
    let sensor = (0_u16..80).prop_map(SensorId);
    let poll = prop_oneof![Just(None), (1_i64..10_000_000_000).prop_map(|ns| Some(TimeSpan::from_ns(ns)))];
    prop_oneof![
        (sensor.clone(), poll)
            .prop_map(|(sensor, poll_interval)| { EventKind::Sensor(Report { sensor, poll_interval }) }),
        (train.clone(), step).prop_map(|(train, step)| EventKind::Speed { train, step }),
        train.clone().prop_map(|train| EventKind::Reverse { train }),
        (any::<u16>(), any::<bool>())
            .prop_map(|(turnout, curved)| EventKind::Turnout { turnout: TurnoutId(turnout), curved }),
        // A tape is read to the millimetre at best; tenths are more than enough.
        (train, sensor, -10_000..10_000_i32).prop_map(|(train, landmark, tenths)| EventKind::Stopped {
            train,
            landmark,
            offset: Length::from_mm(f64::from(tenths) / 10.0),
        }),
    ]
}

fn run(number: u32) -> impl Strategy<Value = Run> {
    // A day in nanoseconds; epochs between 2001 and 2100.
    let times = proptest::collection::vec((0_i64..86_400_000_000_000, kind()), 0..20);
    let began = prop_oneof![
        Just(None),
        (1_000_000_000_000_000_000_i64..4_102_444_800_000_000_000)
            .prop_map(|ns| Some(Timestamp::from_ns(ns))),
    ];
    let gates = proptest::collection::vec((any::<u8>(), 0_i64..1_000_000_000_000), 0..4);
    (times, began, gates, 0..=SpeedStep::HIGHEST).prop_map(move |(mut times, began_at, mut gates, step)| {
        times.sort_by_key(|(time, _)| *time);
        gates.sort_by_key(|(_, time)| *time);
        let step = SpeedStep::new(step).unwrap();
        Run {
            id: RunId(number),
            began_at,
            trains: TRAINS.map(|train| TrainAtStart { train, step }).to_vec(),
            events: times
                .into_iter()
                .map(|(ns, kind)| RawEvent { line: 0, event: Event { time: Timestamp::from_ns(ns), kind } })
                .collect(),
            gates: gates
                .into_iter()
                .map(|(gate, ns)| GatePass { line: 0, gate, time: Timestamp::from_ns(ns) })
                .collect(),
        }
    })
}

proptest! {
    #[test]
    fn every_recording_survives(first in run(1), second in run(7)) {
        let recording =
            Recording { name: "any".to_owned(), form: Form::SensorLog, runs: vec![first, second], notes: Vec::new() };
        let read = parse(&written(&recording)).unwrap();
        prop_assert_eq!(kept(&read), recording.runs);
    }
}
