//! `footplate drive` does what a script says, says what came of it, and refuses what cannot be before a train moves.

use std::io::Write;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::program::{Run, folder, footplate};

const LINK: &str = "sim:track-a?seed=7&faults=none&trains=24";

fn drive(name: &str, link: &str, script: &str, more: &[&str]) -> Run {
    let path = folder(&format!("drive/{name}")).join("script.txt");
    std::fs::write(&path, script).expect("a test file");
    let path = path.display().to_string();
    footplate(&[&["drive", "--link", link, "--script", &path], more].concat())
}

fn lines(run: &Run) -> Vec<Value> {
    run.output.lines().map(|line| serde_json::from_str(line).expect(line)).collect()
}

const EVENING: &str = "\
# an evening with a train that nobody knows
turnout all straight
speed 24 9
wait 24 located
stop 24                      # anywhere
wait 24 at rest
where
stop 24 at C13+120mm
stop 24 at E7+200mm at step 9
move 24 60mm
stop 24 at C13+400mm not-beyond 5%     # off the points before C13
reverse 24
stop 24 at C14+100mm
";

#[test]
fn every_order_ends_with_a_line_that_says_what_was_promised_and_what_came_of_it() {
    let run = drive("evening", LINK, EVENING, &["--json"]);
    assert_eq!(run.status, 0, "{}{}", run.output, run.errors);
    let lines = lines(&run);
    let commands: Vec<_> = lines.iter().map(|line| line["command"].as_str().expect("a verb")).collect();
    assert_eq!(
        commands,
        ["turnout", "speed", "speed", "stop", "stop", "move", "stop", "reverse", "stop"],
        "{}",
        run.output
    );
    for line in lines.iter().filter(|line| !line["target"].is_null()) {
        let number = |field: &str| line[field].as_f64().expect(field);
        let (low, high) = (number("promised_low_mm"), number("promised_high_mm"));
        let truth = number("true_error_mm");
        assert!(low < high && line["achieved"].is_string() && number("t_s") > 0.0, "{line}");
        // One in twenty may end outside, and none far outside.
        let slack = 0.5 * (high - low);
        assert!((low - slack..=high + slack).contains(&truth), "{line}");
        assert!(number("error_mm").abs() < high - low, "{line}");
    }
    // What trains do is learnt while they do it: the stop after a whole round is promised more narrowly than the first.
    let width = |line: &Value| {
        line["promised_high_mm"].as_f64().unwrap_or(0.0) - line["promised_low_mm"].as_f64().unwrap_or(0.0)
    };
    assert!(width(&lines[6]) < width(&lines[3]), "{} {}", lines[6], lines[3]);
    // People see each contact with what had been predicted, and where the train is.
    for says in
        [" late (", "predicted ", "; next ", "will be commanded to stop", "(95 %), at rest", "(predicted "]
    {
        assert!(run.errors.contains(says), "{says}: {}", run.errors);
    }
}

#[test]
fn the_same_seed_and_script_print_the_same_bytes() {
    let run = || drive("again", LINK, EVENING, &["--json"]).output;
    assert_eq!(run(), run());
}

#[test]
fn what_was_learnt_is_kept_in_the_store_and_known_the_next_time() {
    let store = folder("drive/store").join("railway.db").display().to_string();
    let first = drive("first", LINK, EVENING, &["--json", "--store", &store]);
    assert_eq!(first.status, 0, "{}", first.errors);
    assert!(first.errors.contains("train 24 is not calibrated"));
    let again = drive("second", LINK, EVENING, &["--json", "--store", &store]);
    assert_eq!(again.status, 0, "{}", again.errors);
    assert!(!again.errors.contains("nothing is known"), "{}", again.errors);
    let width = |run: &Run| {
        let line = &lines(run)[3];
        line["promised_high_mm"].as_f64().expect("a number")
            - line["promised_low_mm"].as_f64().expect("a number")
    };
    assert!(width(&again) < width(&first), "{} against {}", width(&again), width(&first));
}

#[test]
fn a_speed_may_meet_an_unlocated_train_and_an_order_locates_it_first() {
    let drive = |name: &str, order: &str| {
        let script = format!("turnout all straight\n{order}\nwait 40s\nstop 24\nwait 24 at rest\n");
        drive(name, "sim:track-a?seed=4", &script, &["--train", "24", "--train", "58"])
    };
    let accident = "an accident on the simulated railway, at 18.5 s: train 24 ran into train 58";
    let warning = "train 24 cannot be kept clear of train 58, whose position is unknown";
    let ran = drive("at-a-speed", "speed 24 9");
    let said = ran.output.clone() + &ran.errors;
    assert_eq!(ran.status, 1, "{said}");
    assert!(said.contains(warning) && said.contains(accident), "{said}");
    let ran = drive("held", "hold 24 250mm/s");
    let said = ran.output.clone() + &ran.errors;
    assert!(said.contains("train 58 is located first"), "{said}");
    assert!(!said.contains("accident") && !said.contains(warning), "{said}");
}

#[test]
fn a_script_is_checked_whole_before_anything_moves() {
    let script = "speed 24 8\nsped 24 8\nstop 24 at C133\nstop 25 at C13\nstop 24 at EX1+50mm\nspeed 24 99\n";
    let run = drive("mistakes", LINK, script, &[]);
    assert_eq!((run.status, run.output.as_str()), (2, ""));
    for says in [
        "line 2, column 1: `sped` is not a command: did you mean `speed`?",
        "line 3, column 12: track-a has no place `C133`",
        "did you mean `C13`?",
        "line 4, column 6: `25` is not a train of this session: 24",
        "line 5, column 12: `EX1+50mm` is off the track: the track ends at `EX1`",
        "line 6, column 10: `99` should be a step from 0 to 14",
    ] {
        assert!(run.errors.contains(says), "{says}: {}", run.errors);
    }
}

#[test]
fn what_cannot_be_done_is_said_with_what_could_be_and_ends_with_status_1() {
    let script = "turnout all straight\nspeed 24 10\nwait 24 at E7\nstop 24 at E7+60mm\nstop 24\n";
    let run = drive("too-near", LINK, script, &["--json"]);
    assert_eq!(run.status, 1, "{}{}", run.output, run.errors);
    let refused = lines(&run).into_iter().find(|line| line["refused"].is_string()).expect("one is refused");
    let why = refused["refused"].as_str().expect("a reason");
    assert!(why.starts_with("`E7+60mm` is too close to stop at: the nearest possible place is `"), "{why}");
    assert!(why.contains("mm beyond it"), "{why}");
    let unknown = drive("unknown-turnout", LINK, "speed 24 8\nwait 24 located\nstop 24 at A1\n", &[]);
    assert_eq!(unknown.status, 1);
    assert!(unknown.output.contains("refused `stop 24 at A1`: no known path"), "{}", unknown.output);
}

#[test]
fn wrong_usage_is_named_and_ends_with_status_2() {
    let wrong = |arguments: &[&str], says: &str| {
        let run = footplate(&[&["drive"], arguments].concat());
        assert_eq!((run.status, run.output.as_str()), (2, ""), "{arguments:?}");
        assert!(run.errors.contains(says), "{says}: {}", run.errors);
    };
    wrong(&["--link", "cable:1"], "marklin-serial:");
    wrong(&["--link", "sim:nowhere"], "nowhere");
    wrong(&["--link", LINK, "--script", "no-such.txt"], "no-such.txt");
    wrong(&["--link", LINK, "--turnout", "99=curved"], "--turnout: track-a has no turnout 99");
    wrong(&["--link", "marklin-serial:/dev/ttyUSB0"], "layout missing");
    let nobody = ["--link", "marklin-serial:/dev/ttyUSB0", "--layout", "track-a"];
    wrong(&nobody, "there is no train to drive: name one with `--train 24`");
}

#[test]
fn lines_from_standard_input_are_carried_out_and_trains_stand_in_the_end() {
    let mut program = Command::new(env!("CARGO_BIN_EXE_footplate"))
        .args(["drive", "--link", &format!("{LINK}&speed=200")])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut input = program.stdin.take().expect("it listens");
    input
        .write_all(b"help\nspeed 24\nturnout 14 straight\nspeed 24 9\nwait 24 located\nquit\n")
        .expect("it listens");
    let done = program.wait_with_output().expect("it ends");
    let output = String::from_utf8(done.stdout).expect("text");
    assert!(done.status.success(), "{output}{}", String::from_utf8_lossy(&done.stderr));
    assert!(output.contains("column 10: a step from 0 to 14 is missing after `24`"), "{output}");
    assert!(output.contains("found"), "{output}");
}

#[test]
fn a_train_goes_where_it_is_sent_by_turnouts_and_reversals_and_is_told_by_hand_again() {
    let learns =
        "turnout all straight\nspeed 24 9\nwait 24 located\nwait 40s\nstop 24 at C13+120mm\nstop 24 at E7\n";
    let script = format!("{learns}go 24 to A4+100mm\ngo 24 to C6+200mm\nmove 24 60mm\ngo 24 to EX1+0mm\n");
    let run = drive("go", "sim:track-a?seed=3&faults=none&trains=24", &script, &["--json"]);
    let lines = lines(&run);
    let went: Vec<_> = lines.iter().filter(|line| line["command"] == "go").collect();
    assert_eq!(went.len(), 3, "{}{}", run.output, run.errors);
    for line in &went[..2] {
        let number = |field: &str| line[field].as_f64().unwrap_or_else(|| panic!("{field}: {line}"));
        let width = number("promised_high_mm") - number("promised_low_mm");
        assert!(number("true_error_mm").abs() < width && width < 400.0, "{line}");
    }
    assert!(run.errors.contains("route set for train 24: about "), "{}", run.errors);
    // With its front at the very end of the track there is no room to stop.
    assert!(
        went[2]["refused"].as_str().is_some_and(|why| why.starts_with("no path takes train 24 to `EX1`"))
            && run.status == 1,
        "{}",
        went[2]
    );
}

/// A store that knows both trains of a simulated railway.
fn store_that_knows(name: &str, link: &str, trains: &[&str]) -> String {
    let store = folder(&format!("drive/{name}")).join("railway.db").display().to_string();
    for train in trains {
        let knows = ["calibrate", "--layout", "track-a", "--link", link, "--train", train, "--store", &store];
        let run = footplate(&[&knows[..], &["--budget", "150s"]].concat());
        assert_eq!(run.status, 0, "{}{}", run.output, run.errors);
    }
    store
}

#[test]
fn two_trains_whose_ways_cross_are_sent_at_once_and_both_arrive() {
    let link = "sim:track-a?seed=7&faults=none&trains=24,58";
    let store = store_that_knows("crossing-store", link, &["24", "58"]);
    // While it learns, train 24 gets stuck once; that it was pushed says nothing of how it starts.
    // Each is found, one after the other; then both are sent over the same necks at once, and again: the
    // one to where the other comes by.
    let finds = |train: u16| {
        format!("speed {train} 9\nwait {train} located\nwait 15s\nstop {train}\nwait {train} at rest\n")
    };
    let script = format!(
        "turnout all straight\nlength 24 pickup 45mm overhang 110mm\nlength 58 pickup 45mm overhang 110mm\n{}{}\
         go 24 to E7+200mm\ngo 58 to B5+100mm\nwait 24 at rest\nwait 58 at rest\ngo 24 to A4+100mm\ngo 58 to C14+100mm\n",
        finds(24),
        finds(58)
    );
    let run = drive("crossing", link, &script, &["--json", "--store", &store]);
    assert_eq!(run.status, 0, "{}{}", run.output, run.errors);
    let lines = lines(&run);
    let went: Vec<_> = lines.iter().filter(|line| line["command"] == "go").collect();
    assert_eq!(went.len(), 4, "{}", run.output);
    for line in went {
        let truth = line["true_error_mm"].as_f64().expect("it arrived");
        // Calibrated for two and a half minutes; a train that was stopped for its limit near its place has arrived, too.
        assert!(truth.abs() < 120.0, "{line}");
    }
    assert!(run.errors.contains("waits for track that is reserved for train"), "{}", run.errors);
    assert!(run.errors.contains("train 24 extends 110 mm ahead"), "{}", run.errors);
}

#[test]
fn a_train_stopped_at_the_reservation_of_another_names_that_train() {
    let link = "sim:track-a?seed=7&faults=none&trains=24,58";
    let store = store_that_knows("holder-store", link, &["24", "58"]);
    let script = "turnout all straight\nspeed 24 8\nwait 24 located\nwait 5s\nstop 24\nwait 24 at rest\n\
                  speed 58 8\nwait 58 located\nwait 20s\nstop 58\n";
    let run = drive("holder", link, script, &["--store", &store]);
    let told = run.output.lines().find(|line| line.contains("the track ahead is reserved for"));
    let told = told.unwrap_or_else(|| panic!("{}{}", run.output, run.errors));
    assert!(told.ends_with("train 58 stopped: the track ahead is reserved for train 24"), "{told}");
}

/// The stops of a script, each of which says how far off it truly was and what had been promised.
fn stops(run: &Run, verb: &str) -> Vec<[f64; 3]> {
    let number =
        |line: &Value, field: &str| line[field].as_f64().unwrap_or_else(|| panic!("{field}: {line}"));
    let of = |line: &Value| {
        ["true_error_mm", "promised_low_mm", "promised_high_mm"].map(|field| number(line, field))
    };
    lines(run).iter().filter(|line| line["command"] == verb).map(of).collect()
}

#[test]
fn a_script_waits_for_a_train_that_is_lost_and_found_again() {
    // Given slow stops, on the way to one of which the train is lost (a seed that was looked at),
    let places = ["A3+86", "C13+69", "C6+21", "C16+85", "B15+65", "B15+38", "C13+47", "B15+128"];
    let steps = [4, 3, 5, 5, 3, 4, 4, 3];
    let orders = places.iter().zip(steps);
    let orders: String =
        orders.map(|(place, step)| format!("stop 24 at {place}mm at step {step} next round\n")).collect();
    let script =
        format!("turnout all straight\nspeed 24 8\nwait 24 located\nspeed 24 0\nwait 24 at rest\n{orders}");
    let run = drive("lost", "sim:track-a?seed=56&trains=24", &script, &["--json"]);
    // then that stop and those after it are made once it has been found, where they were promised.
    assert_eq!(run.status, 0, "{}{}", run.output, run.errors);
    assert!(run.errors.contains("position of train 24 lost"), "{}", run.errors);
    assert!(run.errors.contains("`stop 24 at A3+86mm at step 4 next round` waits"), "{}", run.errors);
    let stops = stops(&run, "stop");
    assert_eq!(stops.len(), places.len(), "{}", run.output);
    assert!(stops.iter().all(|[error, low, high]| (low..=high).contains(&error)), "{stops:?}");
}

#[test]
fn every_journey_of_a_script_is_carried_out_and_ends_where_it_was_promised_to() {
    // Given a train that has been calibrated, and nobody says where it is,
    let link = "sim:track-a?seed=9804&trains=24";
    let store = folder("drive/journeys").join("railway.db").display().to_string();
    let calibrated =
        footplate(&["calibrate", "--link", link, "--layout", "track-a", "--train", "24", "--store", &store]);
    assert_eq!(calibrated.status, 0, "{}", calibrated.errors);
    // when it is sent here and there,
    let places =
        ["D5+40", "A3+60", "C13+120", "E8+50", "B15+80", "C6+100", "D7+30", "E7+60", "C16+90", "A4+50"];
    let journeys: String = places.iter().map(|place| format!("go 24 to {place}mm\n")).collect();
    let script = format!("turnout all straight\n{journeys}");
    let run = drive("twelve", link, &script, &["--json", "--store", &store]);
    // then it is looked for first, and comes everywhere, turning around and backing away from turnouts as needed.
    assert_eq!(run.status, 0, "{}{}", run.output, run.errors);
    assert!(run.errors.contains("train 24 is located first"), "{}", run.errors);
    let stops = stops(&run, "go");
    assert_eq!(stops.len(), places.len(), "{}", run.output);
    let kept = stops.iter().filter(|[error, low, high]| (low..=high).contains(&error)).count();
    assert!(kept + 1 >= stops.len(), "{stops:?}");
}

#[test]
fn a_limit_of_waiting_is_a_number_of_seconds() {
    let run = drive("limit", LINK, "where\n", &["--wait-limit", "0"]);
    assert_eq!(run.status, 2);
    assert!(run.errors.contains("not a number of seconds above 0 and up to 86400"), "{}", run.errors);
}

#[test]
fn a_script_of_any_editor_is_read_and_one_that_is_no_text_is_placed() {
    let run = drive("mark", LINK, "\u{feff}turnout all straight\n", &[]);
    assert_eq!(run.status, 0, "{}", run.errors);
    let path = folder("drive/no-text").join("script.txt");
    std::fs::write(&path, b"turnout all straight\n# \xff\n").expect("a test file");
    let run = footplate(&["drive", "--link", LINK, "--script", &path.display().to_string()]);
    assert_eq!(run.status, 2, "{}", run.output);
    assert!(run.errors.contains("script.txt: line 2, byte 3: not UTF-8"), "{}", run.errors);
}
