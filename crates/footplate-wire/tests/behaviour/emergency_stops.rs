//! An emergency stop lasts, whatever a session was about to write.

use footplate_core::{Command, TimeSpan, TurnoutId};
use footplate_wire::dcc_ex;
use footplate_wire::{Session, jmri, loconet, marklin_can, z21};

use crate::desk::{Desk, Station, T24, ms, speed};
use crate::marklin_serial_bench::Bench;
use crate::{dcc_ex_desk, jmri_session, loconet_session, marklin_can_session, z21_desk};

/// Longer than every opening, and than a recovery that was not answered (ms).
const OPENING: i64 = 1_500;

/// Switches the power off at a time (ms) during the opening; returns the last switch of the power that the station was written after.
fn last_switch<C: Session, S: Station, P: Copy>(
    mut desk: Desk<C, S>,
    at: i64,
    power: impl Fn(&S::Written) -> Option<P>,
) -> Option<P> {
    desk.run_until(ms(at));
    desk.command(Command::PowerOff);
    desk.run_for(OPENING);
    desk.written.iter().filter_map(|(_, written)| power(written)).next_back()
}

#[test]
fn an_emergency_stop_during_an_opening_is_not_undone_by_what_is_still_to_be_asked() {
    for at in (0..OPENING).step_by(7) {
        let z21 = last_switch(z21_desk::Desk::new(z21::Settings::default()), at, |written| match written {
            z21::Request::Power { on } => Some(*on),
            _ => None,
        });
        assert_eq!(z21, Some(false), "Z21, {at} ms");
        let loconet = loconet_session::Desk::new(loconet::Settings::default());
        let loconet = last_switch(loconet, at, |written| match written {
            loconet::Message::PowerOn => Some(true),
            loconet::Message::PowerOff => Some(false),
            _ => None,
        });
        assert_eq!(loconet, Some(false), "LocoNet, {at} ms");
        let dcc_ex = dcc_ex_desk::Desk::new(dcc_ex::Settings::default());
        let dcc_ex = last_switch(dcc_ex, at, |written| match written.as_str() {
            "<1 MAIN>" => Some(true),
            "<0>" => Some(false),
            _ => None,
        });
        assert_eq!(dcc_ex, Some(false), "DCC-EX, {at} ms");
        let jmri = jmri_session::Desk::new(jmri::Settings::default());
        let jmri = last_switch(jmri, at, |written| match written {
            jmri::Request::Power { on, .. } => Some(*on),
            _ => None,
        });
        assert_eq!(jmri, Some(false), "JMRI, {at} ms");
        let central = marklin_can_session::Desk::new(marklin_can::Settings::default());
        let central = last_switch(central, at, |written| match written {
            marklin_can::Message::Go(_) => Some(true),
            marklin_can::Message::Stop(_) => Some(false),
            _ => None,
        });
        assert_eq!(central, Some(false), "Central Station, {at} ms");
    }
}

#[test]
fn an_emergency_stop_outlives_the_restart_of_a_board() {
    // Given a board that resets when its line is opened, and a train that it drives,
    let mut desk = dcc_ex_desk::Desk::new(dcc_ex::Settings { resets_on_open: true, ..Default::default() });
    let banner = "<iDCC-EX V-5.6.0 / MEGA / STANDARD_MOTOR_SHIELD G-x>\n";
    desk.run_for(2_000);
    desk.hear(banner);
    desk.run_for(1_000);
    desk.command(speed(T24, 9));
    desk.run_for(500);
    // when its plug is lost, and power is switched off before the board has begun again,
    desk.client.handle_reopened(desk.now);
    desk.written.clear();
    desk.run_for(1_000);
    desk.command(Command::PowerOff);
    desk.run_for(1_000);
    desk.hear(banner);
    desk.run_for(1_000);
    // then the power stays off.
    assert!(desk.texts().contains(&"<0>"), "{:?}", desk.texts());
    assert!(!desk.texts().contains(&"<1 MAIN>"), "{:?}", desk.texts());
}

#[test]
fn an_emergency_stop_is_not_undone_by_the_recovery_of_an_interface() {
    for at in 0..600 {
        let mut bench = Bench::with_cts();
        bench.run_for(at);
        bench.say(Command::PowerOff);
        bench.run_for(OPENING);
        assert!(!bench.station.power, "after opening, {at} ms");
        // The same after two lost replies.
        let mut bench = Bench::with_cts();
        bench.run_until(ms(1_005));
        bench.lose_to_host(&[1, 2]);
        bench.run_for(at);
        bench.say(Command::PowerOff);
        bench.run_for(OPENING);
        assert!(!bench.station.power, "after lost replies, {at} ms");
    }
}

#[test]
fn a_stop_is_not_late_because_another_command_waits_for_a_coil() {
    // Given a step whose answer was lost, a coil under power, and another throw that waits for it,
    let mut desk = z21_desk::Desk::opened();
    desk.station.is_deaf_to = |request| matches!(request, z21::Request::Drive { .. });
    desk.command(speed(T24, 9));
    desk.run_for(5);
    for turnout in [3, 4] {
        desk.command(Command::Turnout { turnout: TurnoutId(turnout), curved: true });
    }
    desk.run_for(1);
    desk.station.is_deaf_to = |_| false;
    // when the train is stopped,
    let (commanded, before) = (desk.now, desk.written.len());
    desk.command(speed(T24, 0));
    desk.run_for(200);
    // then the stop waits no longer than a stop waits for an answer.
    let stops =
        |request: &z21::Request| matches!(request, z21::Request::Drive { throttle: z21::Throttle::Stop, .. });
    let (at, _) = desk.written[before..].iter().find(|(_, request)| stops(request)).unwrap();
    assert!(ms(*at) - commanded <= TimeSpan::from_ms(25), "{:?}", desk.written);
}
