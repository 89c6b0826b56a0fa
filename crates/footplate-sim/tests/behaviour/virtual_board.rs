//! The virtual DCC-EX board answers as the real firmware was seen to, and its world does what it is asked.

use footplate_core::{Ratio, TimeSpan, Timestamp, TrainId};
use footplate_sim::{BoardSwitches, Delivery, End, VirtualBoard};

use crate::yard::{TRAIN, odometer, one_train, two_loops};

/// A board in front of the two loops, with one train 100 mm behind S0 that leads with an end.
fn board(layout: &footplate_core::track::Layout, leads: End, switches: BoardSwitches) -> VirtualBoard<'_> {
    VirtualBoard::new(one_train(layout, leads), 7, switches)
}

/// Writes something and returns what comes back within a time, portion by portion with the time of each.
fn ask(board: &mut VirtualBoard<'_>, text: &str, within_ms: i64) -> Vec<(Timestamp, String)> {
    board.write(text.as_bytes());
    let until = board.now() + TimeSpan::from_ms(within_ms);
    let mut portions = Vec::new();
    while let Some(bytes) = board.advance(until) {
        portions.push((board.now(), String::from_utf8(bytes).unwrap()));
    }
    portions
}

fn answer(board: &mut VirtualBoard<'_>, text: &str) -> String {
    ask(board, text, 50).into_iter().map(|(_, text)| text).collect()
}

#[test]
fn requests_are_answered_as_the_firmware_answers_them() {
    let layout = two_loops();
    let mut board = board(&layout, End::Nose, BoardSwitches::default());
    let conversation = [
        ("<s>", "<iDCC-EX V-5.6.0 / SIMULATED / FOOTPLATE G-virtual>\n<p0 A>\n<p0 MAIN>\n"),
        ("<1 MAIN>", "<p1 A>\n<p0 B>\n<p1 MAIN>\n"),
        ("<#>", "<# 50>\n"),
        ("<t 24>", "<l 24 0 128 0>\n"),
        ("<t 24 62 1>", "<l 24 0 191 0>\n"),
        ("<t 24 30 0>", "<l 24 0 31 0>\n"),
        ("<t 24 -1 1>", "<l 24 0 129 0>\n"),
        ("<t 1 24 0 1>", "<l 24 0 128 0>\n<T 1 0 1>\n"),
        ("<F 24 0 1>", "<l 24 0 128 1>\n"),
        ("<t 99>", "<l 99 -1 128 0>\n"),
        ("<T 1 1>", "<H 1 1>\n"),
        ("<T 1 1>", ""),
        ("<T 77 1>", "<X>\n"),
        // A turnout that is defined counts as thrown, and keeps its position when it is defined again.
        ("<T 77 X>", "<X>\n"),
        ("<T 77 DCC 2>", "<O>\n"),
        ("<T 77 X>", "<H 77 DCC 1 1 1>\n<H 77 1 1 1>\n"),
        ("<T 77 1>", ""),
        ("<T 77 0>", "<H 77 0>\n"),
        ("<T 77 DCC 1>", "<O>\n"),
        ("<T 77 X>", "<H 77 DCC 1 0 0>\n<H 77 1 0 0>\n"),
        ("<T 77>", "<O>\n"),
        ("<T 77>", "<X>\n"),
        ("<a 1 0>", ""),
        ("<nonsense>", "<X>\n"),
        ("<- 24>", "<- 24>\n"),
        ("<t 24>", "<l 24 -1 128 0>\n"),
        ("<0>", "<p0 A>\n<p0 B>\n<p0>\n"),
    ];
    for (request, expected) in conversation {
        assert_eq!(answer(&mut board, request), expected, "{request}");
    }
    assert_eq!(answer(&mut board, "<Q>").lines().count(), 18, "every sensor of the layout");
}

#[test]
fn answers_come_as_soon_as_was_measured() {
    let layout = two_loops();
    let mut board = board(&layout, End::Nose, BoardSwitches::default());
    let mut taken: Vec<f64> = (0..400)
        .map(|count| {
            let written = board.now();
            let portions = ask(&mut board, &format!("<t 24 {} 1>", count % 2), 50);
            (portions[0].0 - written).as_ms()
        })
        .collect();
    taken.sort_by(f64::total_cmp);
    // 0.6, 3.4 and 9.1 ms on the firmware, behind 10 bytes that take 0.9 ms on the line.
    assert!((1.4..2.0).contains(&taken[0]), "{}", taken[0]);
    assert!((3.9..4.9).contains(&taken[200]), "{}", taken[200]);
    assert!((9.0..10.2).contains(&taken[399]), "{}", taken[399]);
}

#[test]
fn about_half_of_a_hundred_requests_without_a_pause_are_lost() {
    let layout = two_loops();
    let answered = |overruns| {
        let mut board = board(&layout, End::Nose, BoardSwitches { overruns, ..BoardSwitches::default() });
        let all: String = (1..=100).map(|speed| format!("<t 24 {speed} 1>\n")).collect();
        let heard: String = ask(&mut board, &all, 2_000).into_iter().map(|(_, text)| text).collect();
        heard.matches("<l 24 ").count()
    };
    // 54 of 100 on the firmware.
    assert!((40..=68).contains(&answered(true)), "{}", answered(true));
    assert_eq!(answered(false), 100);
}

#[test]
fn a_sensor_is_reported_within_the_delays_that_were_measured() {
    let layout = two_loops();
    let mut board = board(&layout, End::Nose, BoardSwitches::default());
    answer(&mut board, "<1>");
    let heard = ask(&mut board, "<t 24 99 1>", 60_000);
    let reports = heard.iter().filter_map(|(at, text)| {
        let id = text.strip_prefix("<Q ")?.trim_end().strip_suffix('>')?.parse::<u16>().ok()?;
        Some((*at, id))
    });
    let mut passes = board.world.truth().passes().iter();
    let mut count = 0;
    for (at, id) in reports {
        let pass = passes.next().expect("a pass for each report");
        assert_eq!(pass.sensor.0, id);
        let delay = (at - pass.at).as_ms();
        assert!((3.5..26.0).contains(&delay), "sensor {id}: {delay} ms");
        count += 1;
    }
    assert!(count > 20, "{count} reports");
}

#[test]
fn directions_are_absolute() {
    let layout = two_loops();
    for leads in [End::Nose, End::Tail] {
        let mut board = board(&layout, leads, BoardSwitches::default());
        answer(&mut board, "<1>");
        // Whichever end leads, forward is the front end.
        ask(&mut board, "<t 24 72 1>", 2_000);
        ask(&mut board, "<t 24 72 1>", 2_000);
        assert_eq!(board.world.truth().train(TRAIN).unwrap().leads, End::Nose);
        ask(&mut board, "<t 24 0 1>", 8_000);
        ask(&mut board, "<t 24 72 0>", 3_000);
        assert_eq!(board.world.truth().train(TRAIN).unwrap().leads, End::Tail);
    }
}

#[test]
fn trains_run_on_without_commands_and_stop_when_the_board_is_reset() {
    let layout = two_loops();
    let mut board = board(&layout, End::Nose, BoardSwitches::default());
    answer(&mut board, "<1>");
    ask(&mut board, "<t 24 72 1>", 10_000);
    let before = odometer(&board.world);
    let later = board.now() + TimeSpan::from_s(5.0);
    while board.advance(later).is_some() {}
    assert!(odometer(&board.world) > before + 500.0);
    board.restart();
    assert!(!board.world.is_powered());
    let began = board.now();
    let heard = ask(&mut board, "<s>", 6_000);
    let banner = heard.iter().find(|(_, text)| text.starts_with("<iDCC-EX")).expect("a banner");
    assert!(banner.0 - began >= TimeSpan::from_ms(2_000));
    assert!(board.world.truth().train(TRAIN).unwrap().at_rest_since.is_some());
    assert_eq!(answer(&mut board, "<t 24>"), "<l 24 -1 128 0>\n", "it has forgotten the locomotive");
}

#[test]
fn messages_arrive_whole_together_or_in_parts() {
    let layout = two_loops();
    let portions = |delivery| {
        let mut board = board(&layout, End::Nose, BoardSwitches { delivery, ..BoardSwitches::default() });
        ask(&mut board, "<s><#><t 24>", 100).into_iter().map(|(_, text)| text).collect::<Vec<String>>()
    };
    let [each, merged, split] = [Delivery::Each, Delivery::Merged, Delivery::Split].map(portions);
    assert_eq!((each.len(), merged.len()), (5, 1));
    assert!(split.len() > 3, "{split:?}");
    assert_eq!(each.concat(), split.concat());
    assert_eq!(each.concat(), merged.concat());
}

#[test]
fn it_may_chatter_between_messages() {
    let layout = two_loops();
    let switches = BoardSwitches { chatter: Ratio::from_percent(100.0), ..BoardSwitches::default() };
    let mut board = board(&layout, End::Nose, switches);
    let heard = answer(&mut board, "<#>");
    assert!(heard.ends_with("<# 50>\n") && heard.len() > 12, "{heard}");
    let unknown = TrainId(99);
    assert!(board.world.truth().train(unknown).is_none());
}

#[test]
fn a_reset_deletes_what_was_not_stored_and_an_old_board_defines_nothing() {
    let layout = two_loops();
    let mut board = board(&layout, End::Nose, BoardSwitches::default());
    assert_eq!(answer(&mut board, "<T 77 DCC 1>"), "<O>\n");
    board.restart();
    ask(&mut board, "", 3_000);
    assert_eq!(answer(&mut board, "<T 77 X>"), "<X>\n");
    assert_eq!(answer(&mut board, "<T 1 X>").lines().count(), 2);
    let mut old =
        self::board(&layout, End::Nose, BoardSwitches { defines: false, ..BoardSwitches::default() });
    assert_eq!(answer(&mut old, "<T 77 DCC 1><T 77 X>"), "<X>\n<X>\n");
}
