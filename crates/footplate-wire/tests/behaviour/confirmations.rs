//! What the station has not confirmed is repeated, and a repeat never harms a coil.

use footplate_core::{Command, TurnoutId};
use footplate_wire::marklin_can::Message;
use footplate_wire::z21::{CentralState, Reply, Request, Throttle};
use footplate_wire::{LinkNotice, Session};

use crate::desk::{T24, speed};
use crate::{marklin_can_session, z21_desk};

const TURNOUT: Command = Command::Turnout { turnout: TurnoutId(5), curved: true };

/// Asserts that each throw of a coil is released within a time (ms), before it is thrown again.
fn assert_pulses(coil: &[(i64, bool)], within: i64) {
    let mut powered = None;
    for (at, is_thrown) in coil {
        if *is_thrown {
            assert_eq!(powered.replace(*at), None, "thrown again under power: {coil:?}");
        } else if let Some(since) = powered.take() {
            assert!(at - since <= within, "{coil:?}");
        }
    }
    assert_eq!(powered, None, "{coil:?}");
}

#[test]
fn a_turnout_of_a_z21_that_is_not_confirmed_is_repeated_in_short_pulses() {
    let mut desk = z21_desk::Desk::opened();
    desk.station.loses = |_| true;
    desk.command(TURNOUT);
    desk.run_for(1_000);
    desk.station.loses = |_| false;
    desk.run_for(1_000);
    let coil = desk.written.iter().filter_map(|(at, request)| match request {
        Request::SetTurnout { activate, .. } => Some((*at, *activate)),
        _ => None,
    });
    let coil: Vec<(i64, bool)> = coil.collect();
    assert!(coil.iter().filter(|(_, is_thrown)| *is_thrown).count() >= 3, "{coil:?}");
    assert_pulses(&coil, 180);
    assert_eq!(desk.station.turnouts.len(), 1);
}

#[test]
fn a_throw_that_a_central_station_missed_is_repeated_although_the_release_was_confirmed() {
    let mut desk = marklin_can_session::Desk::opened();
    desk.station.ignores = |message| matches!(message, Message::Accessory { current: 1, .. });
    desk.command(TURNOUT);
    desk.run_for(300);
    desk.station.ignores = |_| false;
    desk.run_for(1_000);
    let coil = desk.written.iter().filter_map(|(at, message)| match message {
        Message::Accessory { current, .. } => Some((*at, *current == 1)),
        _ => None,
    });
    let coil: Vec<(i64, bool)> = coil.collect();
    assert!(coil.iter().filter(|(_, is_thrown)| *is_thrown).count() >= 2, "{coil:?}");
    assert_pulses(&coil, 220);
}

#[test]
fn a_question_does_not_end_the_repeats_of_a_stop() {
    // Given a train that runs, and a station that was silent,
    let mut desk = z21_desk::Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(300);
    desk.station.answers = false;
    desk.run_for(6_000);
    // when it answers again, but hears no stop for a while,
    desk.station.answers = true;
    desk.station.is_deaf_to = |request| matches!(request, Request::Drive { .. });
    desk.command(speed(T24, 0));
    desk.run_for(2_000);
    desk.station.is_deaf_to = |_| false;
    desk.run_for(500);
    // then the stop is repeated until it does, and no other throttle is blamed.
    assert_eq!(desk.station.locomotive(24).throttle, Throttle::Stop, "{:?}", desk.written);
    let blames = |notice: &LinkNotice| matches!(notice, LinkNotice::OtherThrottle { .. });
    assert!(!desk.notices.iter().any(blames), "{:?}", desk.notices);
}

#[test]
fn stopped_locomotives_do_not_confirm_that_a_z21_has_switched_the_power_off() {
    let written = |desk: &z21_desk::Desk| {
        desk.written.iter().filter(|(_, request)| *request == Request::Power { on: false }).count()
    };
    for (says, is_off) in [
        (Reply::Stopped, false),
        (Reply::Status(CentralState(CentralState::STOPPED)), false),
        (Reply::Status(CentralState(CentralState::POWER_OFF)), true),
        (Reply::Status(CentralState(CentralState::STOPPED | CentralState::SHORT_CIRCUIT)), true),
        (Reply::Power { on: false }, true),
        (Reply::ShortCircuit, true),
    ] {
        let mut desk = z21_desk::Desk::opened();
        desk.station.answers = false;
        desk.command(Command::PowerOff);
        desk.run_for(20);
        desk.hear(says);
        let before = written(&desk);
        desk.run_for(500);
        assert_eq!(written(&desk) == before, is_off, "{says:?}");
        // Nor does the session end by it.
        desk.client.close(desk.now);
        desk.run_for(2_000);
        desk.hear(says);
        assert_eq!(desk.client.closing().power_off, is_off, "{says:?}");
    }
}
