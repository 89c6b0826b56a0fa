//! Turnouts behind a DCC-EX board: the session defines them for itself, and counts on none before the board has confirmed it.

use footplate_core::{Command, EventKind, TurnoutId};
use footplate_wire::LinkNotice;
use footplate_wire::dcc_ex::{Settings, TurnoutRequests};

use crate::dcc_ex_desk::Desk;
use crate::desk::{T24, ms, speed};

/// Turnout 9 has the number 1009 and a digit that makes the sum of all a multiple of 10.
const EXAMINE: &str = "<T 10090 X>";
const DEFINE: &str = "<T 10090 DCC 9><T 10090 X>";
const CURVE: &str = "<T 10090 1><T 10090 X>";
const STRAIGHTEN: &str = "<T 10090 0><T 10090 X>";
/// Decoder 3 has the linear addresses 9 to 12. As the firmware writes it, a new definition counts as thrown.
const DEFINED: &str = "<O>\n<H 10090 DCC 3 0 1>\n<H 10090 3 0 1>\n";
const LIES_CURVED: &str = "<H 10090 DCC 3 0 1>\n<H 10090 3 0 1>\n";
const LIES_STRAIGHT: &str = "<H 10090 0>\n<H 10090 DCC 3 0 0>\n<H 10090 3 0 0>\n";

fn throws(curved: bool) -> Command {
    Command::Turnout { turnout: TurnoutId(9), curved }
}

/// The requests that concern turnouts, and the commands to them that were recorded, since the last call.
fn thrown(desk: &mut Desk) -> (Vec<String>, Vec<bool>) {
    let written = std::mem::take(&mut desk.written).into_iter().map(|(_, text)| text);
    let events = std::mem::take(&mut desk.events).into_iter().filter_map(|event| match event.kind {
        EventKind::Turnout { turnout: TurnoutId(9), curved } => Some(curved),
        _ => None,
    });
    (written.filter(|text| text.starts_with("<T") || text.starts_with("<a")).collect(), events.collect())
}

fn answers(desk: &mut Desk, table: &[(&'static str, &'static str)]) {
    desk.station.answers.retain(|(request, _)| !table.iter().any(|(other, _)| other == request));
    desk.station.answers.extend(table);
}

/// A board that knows definitions and has none.
fn desk() -> Desk {
    let mut desk = Desk::opened();
    answers(
        &mut desk,
        &[(EXAMINE, "<X>\n"), (DEFINE, DEFINED), (CURVE, LIES_CURVED), (STRAIGHTEN, LIES_STRAIGHT)],
    );
    desk
}

/// The same with a turnout that was defined and thrown.
fn curved() -> Desk {
    let mut desk = desk();
    desk.command(throws(true));
    desk.run_for(300);
    thrown(&mut desk);
    desk
}

#[test]
fn a_turnout_is_defined_once_and_thrown_by_its_definition() {
    let mut desk = desk();
    desk.command(throws(true));
    desk.run_for(300);
    assert_eq!(thrown(&mut desk), ([EXAMINE, DEFINE, CURVE].map(String::from).to_vec(), vec![true]));
    // Again, which changes nothing on the board, and the other leg.
    for curved in [true, false] {
        desk.command(throws(curved));
        desk.run_for(100);
    }
    assert_eq!(thrown(&mut desk), ([CURVE, STRAIGHTEN].map(String::from).to_vec(), vec![true, false]));
    assert_eq!(desk.notices.last(), Some(&LinkNotice::Answers));
}

#[test]
fn a_turnout_counts_as_thrown_once_the_board_confirms_it() {
    let mut desk = curved();
    // What the board writes is lost, then comes from another decoder, then says the other leg.
    answers(&mut desk, &[(STRAIGHTEN, "")]);
    desk.command(throws(false));
    desk.run_for(125);
    for answer in ["", "<H 10090 DCC 4 0 0>\n", LIES_CURVED] {
        assert_eq!(thrown(&mut desk), (vec![STRAIGHTEN.to_owned()], vec![]), "{answer}");
        answers(&mut desk, &[(STRAIGHTEN, answer)]);
        desk.run_for(250);
    }
    assert_eq!(thrown(&mut desk), (vec![STRAIGHTEN.to_owned()], vec![]));
    // Noise on the line does not matter, because an answer shows what was received.
    desk.hear("<l 24 x 0>\n");
    answers(&mut desk, &[(STRAIGHTEN, LIES_STRAIGHT)]);
    desk.run_for(250);
    assert_eq!(thrown(&mut desk), (vec![STRAIGHTEN.to_owned()], vec![false]));
    // Eight times in vain: it is given up, and reported.
    answers(&mut desk, &[(CURVE, "")]);
    desk.command(throws(true));
    desk.run_for(3_000);
    let (requests, events) = thrown(&mut desk);
    assert_eq!((requests.len(), events.len()), (8, 0), "{requests:?}");
    assert!(desk.notices.contains(&LinkNotice::Unconfirmed(throws(true))));
}

#[test]
fn a_definition_that_the_board_has_lost_is_made_again() {
    let mut desk = curved();
    answers(&mut desk, &[(STRAIGHTEN, "<X>\n<X>\n")]);
    desk.command(throws(false));
    desk.run_for(20);
    answers(&mut desk, &[(STRAIGHTEN, LIES_STRAIGHT)]);
    desk.run_for(300);
    let (requests, events) = thrown(&mut desk);
    assert_eq!(
        (requests, events),
        ([STRAIGHTEN, EXAMINE, DEFINE, STRAIGHTEN].map(String::from).to_vec(), vec![false])
    );
    // A board that was reset has none.
    desk.run_for(2_000);
    desk.hear("<iDCC-EX V-5.6.0 / MEGA / X G-x>\n");
    desk.run_for(4_000);
    thrown(&mut desk);
    desk.command(throws(true));
    desk.run_for(300);
    assert_eq!(thrown(&mut desk).0, [EXAMINE, DEFINE, CURVE]);
}

#[test]
fn a_garbled_definition_is_corrected_before_anything_is_thrown_by_it() {
    let mut desk = desk();
    // `<T 10090 DCC 9>` became `<T 10090 DCC 8>`.
    answers(&mut desk, &[(DEFINE, "<O>\n<H 10090 DCC 2 3 1>\n<H 10090 2 3 1>\n")]);
    desk.command(throws(true));
    desk.run_for(70);
    let (requests, events) = thrown(&mut desk);
    assert_eq!((&requests[..2], events), (&[EXAMINE, DEFINE].map(String::from)[..], vec![]));
    answers(&mut desk, &[(DEFINE, DEFINED)]);
    desk.run_for(300);
    let (requests, events) = thrown(&mut desk);
    let [defined @ .., last] = &requests[..] else { panic!("{requests:?}") };
    assert!(!defined.is_empty() && defined.iter().all(|request| request == DEFINE), "{requests:?}");
    assert_eq!((last.as_str(), events), (CURVE, vec![true]));
}

#[test]
fn a_board_that_knows_no_definitions_is_written_to_by_address() {
    let mut desk = Desk::opened();
    answers(&mut desk, &[(EXAMINE, "<X>\n"), (DEFINE, "<X>\n<X>\n")]);
    for _ in 0..2 {
        desk.command(throws(true));
        desk.command(speed(T24, 8));
        desk.run_for(500);
    }
    let (requests, events) = thrown(&mut desk);
    assert_eq!(requests, [EXAMINE, DEFINE, DEFINE, DEFINE, DEFINE, "<a 9 1>", "<a 9 1>"]);
    assert_eq!(events, [true, true]);
}

#[test]
fn a_definition_of_the_boards_owner_under_the_same_number_is_left_alone() {
    let mut desk = Desk::opened();
    answers(&mut desk, &[(EXAMINE, "<H 10090 SERVO 101 400 200 0 1>\n")]);
    desk.command(throws(true));
    desk.run_for(500);
    let (requests, events) = thrown(&mut desk);
    assert_eq!(requests, [EXAMINE, EXAMINE, EXAMINE, "<a 9 1>"]);
    assert_eq!(events, [true]);
}

#[test]
fn by_address_no_turnout_is_thrown_while_the_line_is_noisy() {
    let mut desk = Desk::new(Settings { turnouts: TurnoutRequests::Accessory, ..Settings::default() });
    desk.run_until(ms(1_000));
    desk.command(throws(true));
    desk.run_for(100);
    desk.hear("<l 24 x 0>\n");
    desk.command(throws(true));
    desk.run_for(6_000);
    desk.command(throws(true));
    desk.run_for(100);
    // A line counts as noisy for five seconds.
    let written: Vec<(i64, &str)> = desk.written.iter().map(|(at, text)| (*at, text.as_str())).collect();
    let times: Vec<i64> = written.iter().filter(|(_, text)| *text == "<a 9 1>").map(|(at, _)| *at).collect();
    let [first, second, third] = times[..] else { panic!("{written:?}") };
    assert!((5_090..5_600).contains(&(second - first)) && third > second, "{written:?}");
    assert_eq!(thrown(&mut desk).1, [true; 3]);
}
