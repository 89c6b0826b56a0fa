//! In which direction a train runs next, whatever its station has forgotten.

use footplate_core::{Command, DecoderSteps};
use footplate_wire::dcc_ex::Settings;
use footplate_wire::z21::{Broadcasts, LocomotiveState, Request, Throttle};
use footplate_wire::{LinkNotice, Session};

use crate::desk::{T24, T58, speed};
use crate::z21_desk::state;
use crate::{dcc_ex_desk, loconet_session, z21_desk};

fn z21_drive(address: u16, throttle: Throttle, forward: bool) -> Request {
    Request::Drive { address, steps: DecoderSteps::All, throttle, forward }
}

#[test]
fn an_unconfirmed_reversal_is_taken_back_at_the_end() {
    let mut desk = dcc_ex_desk::Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(300);
    desk.command(speed(T24, 0));
    desk.run_for(300);
    desk.station.answers.clear();
    desk.written.clear();
    desk.command(Command::Reverse { train: T24 });
    desk.run_for(300);
    desk.client.close(desk.now);
    desk.run_for(300);
    let (reverses, stops) = ("<t 24 0 1>", "<t 24 0 0>");
    let stops_at = desk.texts().iter().position(|text| text.contains(stops)).expect("a stop");
    assert!(desk.texts()[..stops_at].contains(&reverses), "{:?}", desk.texts());
    assert!(!desk.texts()[stops_at..].contains(&reverses), "{:?}", desk.texts());
}

/// LocoNet commands the direction by a message of its own, which a stop has only if the slot was read with the other one.
#[test]
fn an_obeyed_reversal_without_an_answer_is_taken_back_in_its_slot() {
    let mut desk = loconet_session::Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(300);
    desk.command(speed(T24, 0));
    desk.run_for(600);
    desk.command(Command::Reverse { train: T24 });
    // The station obeys, and its answer is lost with the line.
    desk.run_for(8);
    assert!(!desk.station.slots[&1].forward);
    desk.coming.clear();
    desk.client.handle_reopened(desk.now);
    let closing = desk.close(4_000);
    assert!(closing.is_complete(), "{closing}");
    assert!(desk.station.slots[&1].forward);
}

#[test]
fn a_locomotive_that_the_board_forgot_goes_on_in_the_direction_of_the_session_before() {
    let mut desk = dcc_ex_desk::Desk::opened();
    for (train, forward) in [(T58, false), (T24, true)] {
        desk.client.set_direction(train, forward);
        desk.command(speed(train, if forward { 8 } else { 9 }));
        desk.run_for(300);
    }
    // The board knows train 24 (its register is not -1): another throttle may have reversed it since, and it says so twice.
    assert_eq!(desk.texts(), ["<t 58>", "<t 58 81 0>", "<t 24>", "<t 24>", "<t 24 72 0>"]);
    for command in [speed(T24, 0), Command::Reverse { train: T24 }, speed(T24, 8)] {
        desk.command(command);
        desk.run_for(300);
    }
    desk.hear("<l 24 0 73 0>\n");
    desk.run_for(1);
    // The next session has to know of every reversal: the last one is another throttle's.
    assert_eq!(desk.directions, [(T24, false), (T24, true), (T24, false)]);
}

#[test]
fn a_station_that_has_forgotten_a_direction_is_commanded_the_one_of_the_session_before() {
    let mut desk = z21_desk::Desk::opened();
    // Both ran backwards last. The station says `forward` of both, and of 24 that its light is on: somebody drives it.
    desk.station.locomotives.insert(58, state(58, Throttle::Stop, true));
    desk.station.locomotives.insert(24, LocomotiveState { functions: 1, ..state(24, Throttle::Stop, true) });
    for train in [T24, T58] {
        desk.client.set_direction(train, false);
        desk.command(speed(train, 8));
    }
    desk.run_for(300);
    let expected = [z21_drive(24, Throttle::Step(72), true), z21_drive(58, Throttle::Step(72), false)];
    assert_eq!(desk.commands(), expected);
    assert_eq!(desk.directions, [(T24, true)], "of 58 the next session knows already");
    // A reversal counts once the station has confirmed it.
    desk.station.answers = false;
    desk.command(Command::Reverse { train: T24 });
    desk.run_for(500);
    assert_eq!(desk.directions, [(T24, true)]);
    desk.station.answers = true;
    desk.run_for(2_000);
    assert_eq!(desk.directions.last(), Some(&(T24, false)));
}

#[test]
fn a_reversal_that_a_station_may_have_forgotten_leaves_the_direction_unknown() {
    let mut desk = loconet_session::Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(300);
    desk.command(speed(T24, 0));
    desk.run_for(600);
    // Given a command station that loses its power before it reverses a train,
    desk.station.is_on = false;
    desk.command(Command::Reverse { train: T24 });
    desk.run_for(300);
    // when it is back, and its slots are empty,
    desk.station.slots.clear();
    (desk.station.is_on, desk.station.power) = (true, false);
    desk.run_for(4_000);
    // then the train faces as before, and that is said.
    assert!(desk.notices.contains(&LinkNotice::Restarted), "{:?}", desk.notices);
    assert!(desk.notices.contains(&LinkNotice::ReverseInDoubt(T24)), "{:?}", desk.notices);
    assert!(desk.station.slots[&1].forward);
}

#[test]
fn a_reversal_that_is_given_up_leaves_the_direction_to_the_station() {
    let mut desk = z21_desk::Desk::opened();
    desk.station.locomotives.insert(24, state(24, Throttle::Stop, true));
    for command in [speed(T24, 8), speed(T24, 0)] {
        desk.command(command);
        desk.run_for(300);
    }
    // Given a network that is cut until the reversal is given up,
    desk.station.answers = false;
    let reverse = Command::Reverse { train: T24 };
    desk.command(reverse);
    desk.run_for(1_400);
    assert!(desk.notices.contains(&LinkNotice::Unconfirmed(reverse)), "{:?}", desk.notices);
    assert!(desk.notices.contains(&LinkNotice::ReverseInDoubt(T24)), "{:?}", desk.notices);
    // when the station, which has not heard it, answers again,
    desk.station.locomotives.insert(24, state(24, Throttle::Stop, true));
    desk.station.answers = true;
    desk.written.clear();
    for command in [speed(T24, 8), speed(T24, 0), reverse, speed(T24, 8)] {
        desk.command(command);
        desk.run_for(300);
    }
    // then the train is commanded as it faces, and the next reversal reverses it.
    let run = |forward| z21_drive(24, Throttle::Step(72), forward);
    let stand = |forward| z21_drive(24, Throttle::Stop, forward);
    assert_eq!(desk.commands(), [run(true), stand(true), stand(false), run(false)]);
    assert_eq!(desk.directions.last(), Some(&(T24, false)));
}

#[test]
fn a_direction_of_a_session_without_an_end_that_its_station_contradicts_is_unknown() {
    // Given a session that died after it had kept that both trains run backward, and a station that says so of 58 only,
    let mut desk = z21_desk::Desk::opened();
    for (train, forward) in [(24, true), (58, false)] {
        desk.station.locomotives.insert(train, state(train, Throttle::Stop, forward));
    }
    for train in [T24, T58] {
        desk.client.set_direction(train, false);
        desk.client.check_direction(train);
    }
    // when the next one begins,
    desk.run_for(500);
    // then it asks, and 24 may have been reversed just before the end, or the station may have forgotten how it ran:
    assert!(desk.notices.contains(&LinkNotice::DirectionContradicted(T24)), "{:?}", desk.notices);
    assert!(!desk.notices.contains(&LinkNotice::DirectionContradicted(T58)), "{:?}", desk.notices);
    // it is commanded as the station says, and the store keeps that.
    assert_eq!(desk.directions, [(T24, true)]);
    desk.command(speed(T24, 8));
    desk.run_for(300);
    assert_eq!(desk.commands(), [z21_drive(24, Throttle::Step(72), true)]);
    // Once is enough: a station that is restarted later has forgotten.
    assert_eq!(
        desk.notices.iter().filter(|notice| matches!(notice, LinkNotice::DirectionContradicted(_))).count(),
        1
    );
}

#[test]
fn a_direction_that_was_checked_outlives_a_restart_of_the_station() {
    let mut desk = z21_desk::Desk::opened();
    desk.station.locomotives.insert(58, state(58, Throttle::Stop, false));
    desk.client.set_direction(T58, false);
    desk.client.check_direction(T58);
    desk.run_for(500);
    // When the station, which has confirmed it, is restarted before the train runs, and says `forward` of every locomotive,
    desk.station.told = Broadcasts::NONE;
    desk.station.locomotives.clear();
    desk.run_for(6_000);
    assert!(desk.notices.contains(&LinkNotice::Restarted), "{:?}", desk.notices);
    desk.written.clear();
    desk.command(speed(T58, 8));
    desk.run_for(300);
    // then the train runs on as it did.
    assert_eq!(desk.commands(), [z21_drive(58, Throttle::Step(72), false)]);
    assert_eq!(desk.directions, [], "the store knows it");
}

#[test]
fn the_directions_of_a_session_without_an_end_are_read_at_once_from_every_board_that_drives_its_trains() {
    // Given a board that drives 24 backward and forgot 58, and a store that says backward of 58 and forward of 24,
    let mut desk = dcc_ex_desk::Desk::new(Settings { resets_on_open: true, ..Settings::default() });
    for (train, forward) in [(T24, true), (T58, false)] {
        desk.client.set_direction(train, forward);
        desk.client.check_direction(train);
    }
    desk.hear("<iDCC-EX V-5.6.0 / MEGA / X G-x>\n");
    desk.run_for(500);
    // then the direction of 24 is unknown, and 58, of which the board knows nothing, runs on as it did.
    let contradicted: Vec<&LinkNotice> =
        desk.notices.iter().filter(|notice| matches!(notice, LinkNotice::DirectionContradicted(_))).collect();
    assert_eq!(contradicted, [&LinkNotice::DirectionContradicted(T24)]);
    assert!(!desk.notices.contains(&LinkNotice::Restarted), "the banner of the opening: {:?}", desk.notices);
    assert_eq!(desk.directions, [(T24, false)]);
    desk.command(speed(T58, 9));
    desk.run_for(200);
    assert_eq!(desk.texts().last(), Some(&"<t 58 81 0>"));
}
