//! A bad log is refused at the place where it is bad, with what would be right, and in constant memory.

use std::cell::Cell;
use std::io::{self, BufReader, Read};
use std::path::Path;

use footplate_core::{SpeedStep, TrainId};
use footplate_store::{LONGEST_LINE, LogContext, ModuleLetters, Oddity, parse_sensor_log, read_sensor_log};
use proptest::prelude::{Just, Strategy, any, prop_oneof, proptest};
use proptest::sample::Index;

use crate::recordings::{ALL, bytes_of, parse, parse_of_train};

fn complaint(text: &str) -> String {
    parse(text.as_bytes()).unwrap_err().to_string()
}

const OWN: &str = "t_s,kind,name,train,step,run\n";
const SINCE: &str = "run,event,speed_level,sensor,distance_mm,t_ticks,t_since_command_s\n";
const GATE: &str = "run,train,speed_level,kind,name,t_ms,clock\n";

#[test]
fn nothing_to_read_is_said() {
    assert_eq!(complaint(""), "log_train24.csv: the file is empty; its first line should name the columns");
    assert_eq!(complaint("\n\r\n  \n"), complaint(""));
    assert_eq!(complaint(OWN), "log_train24.csv: no rows below the header; a recording has at least one");
    let missing =
        read_sensor_log(Path::new("no such log.csv"), LogContext { sensors: &ModuleLetters, train: None });
    assert!(missing.unwrap_err().to_string().starts_with("no such log.csv: cannot be read: "));
}

#[test]
fn missing_columns_are_listed_for_the_nearest_form() {
    assert_eq!(
        complaint("a,b\n1,2\n"),
        "log_train24.csv, line 1: missing columns: t_s, kind; the header names a, b, which comes nearest to the \
         form sensor-log (docs/formats/sensor-log.md)"
    );
    assert!(complaint("run,event,speed_level,t_s\n").contains("missing columns: sensor, t_since_command_s"));
    assert!(complaint("run,train,kind,name,t_ms\n").contains("missing columns: speed_level, clock"));
}

#[test]
fn unknown_columns_are_ignored_with_one_note() {
    let recording =
        parse(b"t_s,kind,name,weather,moon\n1,sensor,A1,wet,full\n2,sensor,A2,dry,new\n").unwrap();
    assert_eq!(recording.runs[0].events.len(), 2);
    assert_eq!(recording.notes.len(), 1);
    assert_eq!(recording.notes[0].to_string(), "line 1: unknown columns are ignored: weather, moon");
}

#[test]
fn a_wrong_field_is_named_with_its_place_and_what_is_right() {
    let cases = [
        (
            format!("{OWN}0.5,speed,,24,14,1\n1.5,sensor,X9,,,1\n"),
            "line 3, column 3 (name): `X9` should be a sensor from A1 to E16",
        ),
        (
            format!("{OWN}0.5,whistle,,24,,1\n"),
            "line 2, column 2 (kind): `whistle` should be `sensor`, `freed`, `speed`, `reverse`, `turnout`, `stopped`, \
             `running` or `gate`",
        ),
        (
            format!("{OWN}NaN,sensor,A1,,,1\n"),
            "column 1 (t_s): `NaN` should be a time in seconds such as 12.345",
        ),
        (
            format!("{OWN}inf,sensor,A1,,,1\n"),
            "column 1 (t_s): `inf` should be a time in seconds such as 12.345",
        ),
        (
            format!("{OWN}99999999,sensor,A1,,,1\n"),
            "column 1 (t_s): `99999999` should be within 30 days of the beginning of its run",
        ),
        (
            format!("{OWN}2,sensor,A1,,,1\n\n1,sensor,A2,,,1\n"),
            "line 4, column 1 (t_s): `1` should be no earlier than the time in line 2: time does not run backwards \
             within a run; where the clock restarts, a new run begins",
        ),
        (
            format!("{OWN}2,sensor,A1,,,1\n1,sensor,A2,,,2\n3,sensor,A2,,,1\n"),
            "line 4, column 6 (run): `1` should be a new run: the rows of a run stand together, and this one has \
             ended",
        ),
        (format!("{OWN}2,speed,,24,127,1\n"), "column 5 (step): `127` should be a throttle step, 0 to 126"),
        (format!("{OWN}2,speed,,,12,1\n"), "column 4 (train): `` should be the number of a train"),
        (format!("{OWN}2,stopped,,24,,1\n"), "a `stopped` row needs the column `landmark`"),
        (format!("{OWN}2,sensor,A1\n"), "line 2: 3 fields where the header names 6 columns"),
        (format!("{OWN}2,\"sensor,A1,,,1\n"), "line 2: a quote is opened and not closed on the same line"),
        (
            "t_s,kind,t_s\n1,sensor,2\n".to_owned(),
            "line 1: two columns are called `t_s`; give each its own name",
        ),
        (
            format!("{SINCE}1,sensor,14,A3,,,0.3\n"),
            "column 2 (event): `sensor` should be `speed`: a run of this form begins with its command",
        ),
        (
            format!("{SINCE}1,speed,14,,,1000,0.0\n1,sensor,14,A3,,509009,1.0\n"),
            "column 6 (t_ticks): `509009` should be 509000, if the seconds since the command are right",
        ),
        (
            format!("{SINCE}1,speed,14,,,0,0.0\n1,sensor,14,A3,,1,9000000000\n"),
            "column 7 (t_since_command_s): `9000000000` should be seconds since the command, 0 to 2592000 (30 days)",
        ),
        (
            format!("{SINCE}1,speed,14,,,,0.0\n1,sensor,13,A3,,,1.0\n"),
            "column 3 (speed_level): `13` should be 14, the step commanded in this run",
        ),
        (
            format!("{SINCE}1,speed,14,,,,0.0\n1,stop,14,,,,1.0\n1,stopped,14,,500,,2.0\n"),
            "column 2 (event): `stopped` should be after a `sensor` row: the tape is laid from the sensor reported \
             last",
        ),
        (
            format!("{GATE}1,74,14,sensor,C14,1583740245914,gate_clock_ms\n"),
            "column 7 (clock): `gate_clock_ms` should be `host_epoch_ms`, the clock of this kind of row",
        ),
        (
            format!("{GATE}1,74,14,sensor,C14,15837402,host_epoch_ms\n"),
            "column 6 (t_ms): `15837402` should be milliseconds since the Unix epoch, 1000000000000 or more",
        ),
        (
            format!(
                "{GATE}1,74,14,sensor,C14,1583740245914,host_epoch_ms\n1,78,14,sensor,A4,1583740245915,host_epoch_ms\n"
            ),
            "line 3, column 2 (train): `78` should be 74, the train of this run",
        ),
    ];
    for (text, expected) in cases {
        let found = complaint(&text);
        assert!(found.starts_with("log_train24.csv, line ") && found.contains(expected), "{found}");
    }
}

#[test]
fn a_log_without_its_train_asks_for_it() {
    let log = format!("{SINCE}1,speed,14,,,,0.0\n");
    let nameless = parse_sensor_log(
        Path::new("log.csv"),
        log.as_bytes(),
        LogContext { sensors: &ModuleLetters, train: None },
    );
    assert!(nameless.unwrap_err().to_string().starts_with("log.csv: which train ran?"));
    let given = parse_of_train(log.as_bytes(), 58).unwrap();
    assert_eq!(given.runs[0].only_train().map(|at_start| at_start.train), Some(TrainId(58)));
    // A log whose name says its train does not become one of the train that is asked for.
    let context = LogContext { sensors: &ModuleLetters, train: Some(TrainId(58)) };
    let named = parse_sensor_log(Path::new("log_train24.csv"), log.as_bytes(), context).unwrap();
    assert_eq!(named.runs[0].only_train().map(|at_start| at_start.train), Some(TrainId(24)));
    let own = b"t_s,kind,step\n0.5,speed,14\n";
    let named = parse_sensor_log(Path::new("log_train24.csv"), &own[..], context).unwrap();
    assert_eq!(named.runs[0].only_train().map(|at_start| at_start.train), Some(TrainId(24)));
}

#[test]
fn a_run_without_reports_is_valid() {
    let recording =
        parse(format!("{SINCE}1,speed,1,,,,0.0\n2,speed,2,,,,0.0\n2,sensor,2,A3,,,3.0\n").as_bytes());
    let recording = recording.unwrap();
    assert_eq!(recording.runs.len(), 2);
    assert_eq!(recording.runs[0].reports().count(), 0);
    assert_eq!(recording.notes.len(), 1);
    assert_eq!(
        recording.notes[0].to_string(),
        "line 2: run 1 has no report; kept, it tells that the train stood"
    );
}

#[test]
fn windows_line_ends_marks_quotes_and_spaces_are_passed_over() {
    let plain = parse(b"t_s,kind,name,train,step\n0,speed,,1,14\n1.5,sensor,C13,,\n").unwrap();
    let dressed =
        b"\xEF\xBB\xBFt_s,kind,\"name\",train,step\r\n\r\n0, speed ,,1,14\r\n1.5,\"sensor\",\"C13\",,\r\n";
    let dressed = parse(dressed).unwrap();
    assert!(dressed.notes.is_empty());
    let events = |recording: &footplate_store::Recording| -> Vec<_> {
        recording.runs[0].events.iter().map(|raw| raw.event).collect()
    };
    assert_eq!(events(&dressed), events(&plain));
    assert_eq!(dressed.runs[0].events[1].line, 4, "empty lines count");
}

#[test]
fn a_last_line_without_its_end_is_kept_if_whole_and_left_out_if_cut() {
    let whole = parse(b"t_s,kind,name\n0,sensor,A1\n1.5,sensor,C13").unwrap();
    assert_eq!(whole.runs[0].events.len(), 2);
    assert_eq!(whole.notes[0].oddity, Oddity::LineNotEnded);
    for cut in [
        "1.5",
        "1.5,sens",
        "1.5,sensor",
        "1.5,sensor,",
        "1.5,sensor,C",
        "1.5,sensor,\"C1",
        "1.5,sensor,\u{e9}",
    ] {
        let recording = parse(format!("t_s,kind,name\n0,sensor,A1\n{cut}").as_bytes()).unwrap();
        assert_eq!(recording.runs[0].events.len(), 1, "{cut}");
        assert_eq!(recording.notes[0].oddity, Oddity::LineCutOff, "{cut}");
        assert_eq!(recording.notes[0].line, 3, "{cut}");
    }
}

#[test]
fn a_run_that_only_a_cut_line_would_begin_is_no_run() {
    let recording = parse(b"run,t_s,kind,name\n1,0,sensor,A1\n2,99999999,sensor,A1").unwrap();
    assert_eq!(recording.runs.len(), 1);
    assert!(parse(b"run,t_s,kind,name\n2,99999999,sensor,A1").is_err());
}

#[test]
fn bytes_that_are_no_text_are_named() {
    let mut log = b"t_s,kind,name\n0,sensor,".to_vec();
    log.extend_from_slice(b"\xff\xfe\n");
    assert_eq!(
        parse(&log).unwrap_err().to_string(),
        "log_train24.csv, line 2: byte 10 of the line is not UTF-8; save the file as UTF-8"
    );
}

/// A file that is one endless line.
struct EndlessLine<'a> {
    header: &'a [u8],
    taken: &'a Cell<usize>,
}

impl Read for EndlessLine<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.header.is_empty() {
            buffer.fill(b'9');
            self.taken.set(self.taken.get() + buffer.len());
            return Ok(buffer.len());
        }
        self.header.read(buffer)
    }
}

#[test]
fn an_endless_line_is_refused_before_it_is_read() {
    for header in [&b""[..], b"t_s,kind,name\n1,sensor,"] {
        let taken = Cell::new(0);
        let input = BufReader::new(EndlessLine { header, taken: &taken });
        let context = LogContext { sensors: &ModuleLetters, train: None };
        let error = parse_sensor_log(Path::new("endless.csv"), input, context).unwrap_err().to_string();
        assert!(error.contains("the line is longer than 65536 bytes"), "{error}");
        assert!(taken.get() <= 2 * LONGEST_LINE, "{} bytes were read", taken.get());
    }
}

#[test]
fn a_value_in_a_message_is_short_and_on_one_line() {
    let long = "z".repeat(50_000);
    let error = complaint(&format!("t_s,kind,name\n1,sensor,{long}\n"));
    assert!(error.len() < 300, "{} bytes", error.len());
    assert!(!complaint("t_s,kind,name\n1,sensor,\u{7}\u{1b}[31m\n").contains('\u{1b}'));
}

#[derive(Debug, Clone)]
enum Mutation {
    Flip(Index, u8),
    Remove(Index, Index),
    Insert(Index, Vec<u8>),
    Double(Index, Index),
    Cut(Index),
}

fn mutation() -> impl Strategy<Value = Mutation> {
    let texts = prop_oneof![
        Just(b"\n".to_vec()),
        Just(b",".to_vec()),
        Just(b"\"".to_vec()),
        Just(b"-".to_vec()),
        Just(b"e308".to_vec()),
        Just(b"99999999999999999999".to_vec()),
        Just(b"NaN".to_vec()),
        Just(b"\xff".to_vec()),
        proptest::collection::vec(any::<u8>(), 0..20),
    ];
    prop_oneof![
        (any::<Index>(), any::<u8>()).prop_map(|(at, byte)| Mutation::Flip(at, byte)),
        (any::<Index>(), any::<Index>()).prop_map(|(from, to)| Mutation::Remove(from, to)),
        (any::<Index>(), texts).prop_map(|(at, text)| Mutation::Insert(at, text)),
        (any::<Index>(), any::<Index>()).prop_map(|(from, to)| Mutation::Double(from, to)),
        any::<Index>().prop_map(Mutation::Cut),
    ]
}

fn mutated(mut bytes: Vec<u8>, mutations: &[Mutation]) -> Vec<u8> {
    let between = |bytes: &[u8], a: &Index, b: &Index| {
        let (a, b) = (a.index(bytes.len()), b.index(bytes.len()));
        a.min(b)..a.max(b)
    };
    for mutation in mutations {
        if bytes.is_empty() {
            break;
        }
        match mutation {
            Mutation::Flip(at, byte) => {
                let at = at.index(bytes.len());
                bytes[at] ^= byte;
            }
            Mutation::Remove(from, to) => drop(bytes.drain(between(&bytes, from, to))),
            Mutation::Insert(at, text) => {
                let at = at.index(bytes.len());
                bytes.splice(at..at, text.iter().copied());
            }
            Mutation::Double(from, to) => {
                let part = bytes[between(&bytes, from, to)].to_vec();
                bytes.extend_from_slice(&part);
            }
            Mutation::Cut(at) => bytes.truncate(at.index(bytes.len())),
        }
    }
    bytes
}

proptest! {
    #[test]
    fn no_mutated_log_panics_or_breaks_a_promise(
        file in 0..ALL.len(),
        mutations in proptest::collection::vec(mutation(), 1..5),
    ) {
        let bytes = mutated(bytes_of(ALL[file]), &mutations);
        match parse(&bytes) {
            Ok(recording) => {
                for run in &recording.runs {
                    assert!(run.events.windows(2).all(|pair| pair[0].event.time <= pair[1].event.time));
                    assert!(run.trains.iter().all(|at_start| at_start.step.get() <= SpeedStep::HIGHEST));
                }
            }
            Err(error) => assert!(error.to_string().starts_with("log_train24.csv")),
        }
    }

    #[test]
    fn no_bytes_panic(bytes in proptest::collection::vec(any::<u8>(), 0..2000)) {
        let _ = parse(&bytes);
    }
}
