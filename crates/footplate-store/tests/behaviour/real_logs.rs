//! Every real recording is read whole, and every trap in it is where it was.
//!
//! The figures were counted in the files with awk, not with the readers: rows by their event, and repeats as
//! `awk -F, '$2=="speed"{p=""} $2=="sensor"{n++; if($4==p)repeats++; p=$4} END{print n, repeats}'`.

use footplate_core::{EventKind, Length, RunId, SensorId, Speed, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_store::{Form, ModuleLetters, Note, Oddity, Recording, Run, SensorNames};

use crate::recordings::{ALL, real};

/// What awk counted in a log of the form since-command.
struct Counted {
    file: &'static str,
    train: u16,
    runs: usize,
    reports: usize,
    repeats: usize,
    tapes_mm: &'static [f64],
}

const COUNTED: [Counted; 8] = [
    Counted { file: ALL[0], train: 1, runs: 12, reports: 370, repeats: 270, tapes_mm: &[] },
    Counted {
        file: ALL[1],
        train: 1,
        runs: 4,
        reports: 84,
        repeats: 51,
        tapes_mm: &[1310.0, 1330.0, 240.0, 240.0],
    },
    Counted { file: ALL[2], train: 24, runs: 14, reports: 274, repeats: 171, tapes_mm: &[] },
    Counted {
        file: ALL[3],
        train: 24,
        runs: 4,
        reports: 79,
        repeats: 46,
        tapes_mm: &[1350.0, 1350.0, 260.0, 260.0],
    },
    Counted { file: ALL[4], train: 74, runs: 14, reports: 456, repeats: 310, tapes_mm: &[] },
    Counted {
        file: ALL[5],
        train: 74,
        runs: 5,
        reports: 115,
        repeats: 72,
        tapes_mm: &[860.0, 820.0, 490.0, 510.0, 500.0],
    },
    Counted { file: ALL[6], train: 78, runs: 10, reports: 154, repeats: 87, tapes_mm: &[] },
    Counted {
        file: ALL[7],
        train: 78,
        runs: 4,
        reports: 155,
        repeats: 119,
        tapes_mm: &[940.0, 960.0, 170.0, 170.0],
    },
];

fn sensor(name: &str) -> SensorId {
    ModuleLetters.sensor_named(name).unwrap()
}

fn repeats(run: &Run) -> usize {
    let reports: Vec<SensorId> = run.reports().map(|(_, report)| report.sensor).collect();
    reports.windows(2).filter(|pair| pair[0] == pair[1]).count()
}

fn tape_measures(recording: &Recording) -> Vec<(SensorId, Length)> {
    let events = recording.runs.iter().flat_map(|run| &run.events);
    events
        .filter_map(|raw| match raw.event.kind {
            EventKind::Stopped { landmark, offset, .. } => Some((landmark, offset)),
            _ => None,
        })
        .collect()
}

#[test]
fn every_row_of_the_since_command_logs_is_kept() {
    for Counted { file, train, runs, reports, repeats: repeated, tapes_mm } in COUNTED {
        let recording = real(file);
        assert_eq!(recording.form, Form::SinceCommand, "{file}");
        assert_eq!(recording.runs.len(), runs, "{file}");
        assert_eq!(recording.runs.iter().map(|run| run.reports().count()).sum::<usize>(), reports, "{file}");
        assert_eq!(recording.runs.iter().map(repeats).sum::<usize>(), repeated, "{file}");
        // The tape was laid from E12 in every run.
        let tapes: Vec<_> = tapes_mm.iter().map(|mm| (sensor("E12"), Length::from_mm(*mm))).collect();
        assert_eq!(tape_measures(&recording), tapes, "{file}");
        for run in &recording.runs {
            let at_start = run.only_train().unwrap();
            assert_eq!((at_start.train, at_start.step), (TrainId(train), SpeedStep::STAND), "{file}");
            assert!(run.gates.is_empty() && run.began_at.is_none());
            let stops = run.events.iter().filter(|raw| is_stop_command(raw.event.kind)).count();
            assert_eq!(stops, usize::from(!tapes.is_empty()), "{file} run {}", run.id);
        }
    }
}

fn is_stop_command(kind: EventKind) -> bool {
    matches!(kind, EventKind::Speed { step: SpeedStep::STAND, .. })
}

#[test]
fn every_run_begins_with_its_command_at_the_step_of_the_file() {
    let steps: Vec<u8> = real(ALL[0]).runs.iter().map(|run| commanded(run).get()).collect();
    assert_eq!(steps, [14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3]);
}

fn commanded(run: &Run) -> SpeedStep {
    let first = run.events[0].event;
    assert_eq!(first.time, Timestamp::ZERO);
    match first.kind {
        EventKind::Speed { step, .. } => step,
        other => panic!("{other:?}"),
    }
}

/// `awk -F, 'NR>1{if($1!=run && $6<ticks) print NR, $1; run=$1; ticks=$6}'` finds these three lines.
#[test]
fn a_restarted_timer_is_noted_and_touches_no_time() {
    let restarts = |file: &str| real(file).notes;
    let restart = |line: u64, run: u32| Note { line, oddity: Oddity::TimerRestarted(RunId(run)) };
    assert_eq!(restarts(ALL[2]), [restart(31, 2)]);
    assert_eq!(restarts(ALL[6]), [restart(137, 8), restart(162, 10)]);
    for file in [ALL[0], ALL[1], ALL[3], ALL[4], ALL[5], ALL[7]] {
        assert_eq!(restarts(file), [], "{file}");
    }
}

/// The station still remembers a contact from before the start: it is in the first poll of every run from
/// rest, 0.314 s after the command, wherever the train stands. Train 24 reaches E12 a quarter second after the
/// stale A3, which is five contacts back.
#[test]
fn the_stale_first_contact_stays_in_the_events() {
    for file in [ALL[0], ALL[2], ALL[4], ALL[6]] {
        for run in &real(file).runs {
            let (time, _) = run.reports().next().unwrap();
            let since = (time - Timestamp::ZERO).as_s();
            assert!((0.3137..0.3139).contains(&since), "{file} run {}: {since}", run.id);
        }
    }
    let train_24 = real(ALL[2]);
    let first: Vec<_> = train_24.runs[0].reports().take(2).map(|(_, report)| report.sensor).collect();
    assert_eq!(first, [sensor("A3"), sensor("E12")]);
}

#[test]
fn a_contact_repeats_once_a_poll_while_the_shoe_is_on_it() {
    // Mean over the 1126 repeats, by awk: 65.3 ms a poll.
    for Counted { file, .. } in COUNTED {
        for run in &real(file).runs {
            let reports: Vec<_> = run.reports().collect();
            for pair in reports.windows(2).filter(|pair| pair[0].1.sensor == pair[1].1.sensor) {
                let gap = pair[1].0 - pair[0].0;
                assert!((gap - TimeSpan::from_us(65_300)).abs() < TimeSpan::from_us(150), "{file}: {gap:?}");
            }
        }
    }
}

#[test]
fn a_missed_d12_leaves_a_hole_and_nothing_in_its_place() {
    // `C15` followed by `E11` at the lines 18, 41, 73, 91 and 156 of train 78.
    let recording = real(ALL[6]);
    let mut missed = Vec::new();
    for run in &recording.runs {
        let mut before = None;
        for raw in &run.events {
            if let EventKind::Sensor(report) = raw.event.kind {
                if before == Some(sensor("C15")) && report.sensor == sensor("E11") {
                    missed.push(raw.line);
                }
                before = Some(report.sensor);
            }
        }
    }
    assert_eq!(missed, [18, 41, 73, 91, 156]);
}

#[test]
fn lowest_steps_that_reach_a_single_contact_are_runs_like_any_other() {
    let recording = real(ALL[2]);
    let reports: Vec<usize> = recording.runs[11..].iter().map(|run| run.reports().count()).collect();
    assert_eq!(reports, [2, 2, 2]);
}

#[test]
fn times_are_the_files_to_the_nanosecond() {
    let recording = real(ALL[0]);
    let raw = recording.runs[0].events[2];
    assert_eq!(raw.line, 4);
    assert_eq!(raw.event.time, Timestamp::from_ns(1_914_390_000));
}

#[test]
fn the_light_gate_log_has_29_running_runs_of_five_trains() {
    let recording = real(ALL[8]);
    assert_eq!(recording.form, Form::LightGate);
    assert_eq!(recording.runs.len(), 29);
    assert_eq!(recording.runs.iter().map(|run| run.events.len()).sum::<usize>(), 580);
    assert_eq!(recording.runs.iter().map(repeats).sum::<usize>(), 0);
    let mut runs_of = std::collections::BTreeMap::new();
    for run in &recording.runs {
        let at_start = run.only_train().unwrap();
        assert!(at_start.step > SpeedStep::STAND, "the recording begins with the train running");
        *runs_of.entry(at_start.train.0).or_insert(0) += 1;
        assert_eq!((run.events.len(), run.gates.len()), (20, 4), "run {}", run.id);
        assert_eq!(run.events[0].event.time, Timestamp::ZERO);
    }
    assert_eq!(runs_of.into_iter().collect::<Vec<_>>(), [(1, 6), (58, 6), (74, 5), (78, 6), (79, 6)]);
    // Runs 12 to 17 are missing in the file; the numbers of the others are kept.
    assert_eq!((recording.runs[10].id, recording.runs[11].id), (RunId(11), RunId(18)));
    assert_eq!(recording.runs[0].began_at, Some(Timestamp::from_ns(1_583_740_245_914_000_000)));
    // `awk -F, '$4=="gate"{if($6<g) print NR, $1; g=$6}'`: the clock of the gates restarts four times.
    let restarts: Vec<_> = recording.notes.iter().map(|note| note.line).collect();
    assert_eq!(restarts, [142, 238, 286, 430]);
}

#[test]
fn the_gates_tell_the_true_speed_of_train_74() {
    // Two gates 20 mm apart, read to the millisecond; steady speeds from the hops over the same track are 584,
    // 379 and 535 mm/s at steps 14, 8 and 11 of the other log of this train.
    let recording = real(ALL[8]);
    for (run, expected) in recording.runs.iter().zip([584.0, 379.0, 379.0, 535.0, 535.0]) {
        for pair in run.gates.chunks(2) {
            assert_eq!((pair[0].gate, pair[1].gate), (1, 0));
            let speed: Speed = Length::from_mm(20.0) / (pair[1].time - pair[0].time);
            assert!((speed.as_mm_per_s() / expected - 1.0).abs() < 0.08, "run {}: {speed:?}", run.id);
        }
    }
}
