//! The virtual command station on LocoNet answers as the protocols say, at the pace of its bus, and its world does what it is asked.

use footplate_core::track::{Layout, Leg};
use footplate_core::{Ratio, TimeSpan, Timestamp, TurnoutId};
use footplate_sim::{Delivery, End, LocoNetSwitches, VirtualLocoNet};

use crate::yard::{TRAIN, odometer, one_train, two_loops};

/// A station in front of the two loops, with one train 100 mm behind S0 that leads with its nose.
fn station(layout: &Layout, switches: LocoNetSwitches) -> VirtualLocoNet<'_> {
    VirtualLocoNet::new(one_train(layout, End::Nose), 7, switches)
}

/// Waits for a time and returns what is heard in it.
fn hear(station: &mut VirtualLocoNet<'_>, for_ms: i64) -> String {
    let until = station.now() + TimeSpan::from_ms(for_ms);
    let mut heard = Vec::new();
    while let Some(bytes) = station.advance(until) {
        heard.extend(bytes);
    }
    String::from_utf8(heard).unwrap()
}

fn ask(station: &mut VirtualLocoNet<'_>, line: &str) -> Vec<String> {
    station.write(format!("{line}\r\n").as_bytes());
    hear(station, 60).lines().map(str::to_owned).collect()
}

#[test]
fn requests_are_answered_as_the_protocols_say() {
    let layout = two_loops();
    let mut station = station(&layout, LocoNetSwitches::default());
    assert_eq!(hear(&mut station, 10), "VERSION LbServer (simulated by Footplate)\r\n");
    let conversation: [(&str, &[&str]); 6] = [
        // The station's own slot: no power.
        (
            "SEND BB 00 00 44",
            &["RECEIVE BB 00 00 44", "SENT OK", "RECEIVE E7 0E 00 03 00 00 00 02 00 00 00 00 00 17"],
        ),
        ("SEND 83 7C", &["RECEIVE 83 7C", "SENT OK"]),
        // Train 24 is in slot 1, which is not in use; then by this throttle.
        (
            "SEND BF 00 18 58",
            &["RECEIVE BF 00 18 58", "SENT OK", "RECEIVE E7 0E 01 13 18 00 00 03 00 00 00 00 00 1F"],
        ),
        (
            "SEND BA 01 01 45",
            &["RECEIVE BA 01 01 45", "SENT OK", "RECEIVE E7 0E 01 33 18 00 00 03 00 00 00 00 00 3F"],
        ),
        ("SEND A0 01 3F 60", &["SENT ERROR no echo from the bus"]),
        ("SEND A0 01 3F 61", &["RECEIVE A0 01 3F 61", "SENT OK"]),
    ];
    for (line, expected) in conversation {
        assert_eq!(ask(&mut station, line), expected, "{line}");
    }
    let before = odometer(&station.world);
    hear(&mut station, 3_000);
    assert!(odometer(&station.world) > before + 200.0, "{}", odometer(&station.world));
    // All stop at once; the slot keeps its speed.
    ask(&mut station, "SEND 85 7A");
    let stopped = odometer(&station.world);
    hear(&mut station, 2_000);
    assert!(odometer(&station.world) < stopped + 60.0, "{} after {stopped}", odometer(&station.world));
    assert!(station.world.truth().train(TRAIN).unwrap().at_rest_since.is_some());
}

#[test]
fn the_bus_carries_one_message_after_the_other() {
    let layout = two_loops();
    let mut station = station(&layout, LocoNetSwitches::default());
    hear(&mut station, 10);
    (0..20).for_each(|_| station.write(b"SEND BB 01 00 45\r\n"));
    let begun = station.now();
    let mut answers: Vec<Timestamp> = Vec::new();
    while let Some(bytes) = station.advance(begun + TimeSpan::from_ms(2_000)) {
        let count = String::from_utf8(bytes).unwrap().matches("RECEIVE E7").count();
        answers.extend((0..count).map(|_| station.now()));
    }
    assert_eq!(answers.len(), 20);
    // Four bytes there and fourteen back with two silences are at least 13.3 ms.
    let took = *answers.last().unwrap() - begun;
    assert!(took >= TimeSpan::from_ms(266) && took < TimeSpan::from_ms(400), "{took:?}");
}

#[test]
fn detectors_report_changes_and_when_they_are_asked() {
    let layout = two_loops();
    let mut station = station(&layout, LocoNetSwitches::default());
    hear(&mut station, 10);
    station.write(b"SEND B0 78 27 10\r\n");
    let states = hear(&mut station, 400);
    assert_eq!(states.matches("RECEIVE B2").count(), layout.sensors().count(), "{states}");
    for line in ["SEND 83 7C", "SEND BF 00 18 58", "SEND BA 01 01 45", "SEND A0 01 7F 21"] {
        ask(&mut station, line);
    }
    let reports = hear(&mut station, 20_000);
    assert!(reports.matches("RECEIVE B2").count() > 4, "{reports}");
}

#[test]
fn turnouts_are_thrown_and_a_restarted_station_has_forgotten_its_slots() {
    let layout = two_loops();
    let mut station = station(&layout, LocoNetSwitches::default());
    ask(&mut station, "SEND 83 7C");
    // Address 1 on the wire is the second turnout.
    ask(&mut station, "SEND B0 01 10 5E");
    hear(&mut station, 1_000);
    assert_eq!(station.world.lies(TurnoutId(2)), Some(Leg::Curved));
    station.restart();
    assert_eq!(ask(&mut station, "SEND BB 01 00 45"), ["RECEIVE BB 01 00 45", "SENT OK"]);
    hear(&mut station, 2_500);
    let free = ask(&mut station, "SEND BB 01 00 45");
    assert_eq!(free.last().unwrap(), "RECEIVE E7 0E 01 03 00 00 00 02 00 00 00 00 00 16");
}

#[test]
fn quirks_are_what_they_say() {
    let layout = two_loops();
    let switches = LocoNetSwitches {
        has_version: false,
        echoes: false,
        refused: Ratio::from_percent(50.0),
        slots: 1,
        delivery: Delivery::Split,
    };
    let mut station = station(&layout, switches);
    assert_eq!(hear(&mut station, 10), "");
    let reports: Vec<String> = (0..40).flat_map(|_| ask(&mut station, "SEND 83 7C")).collect();
    let refused = reports.iter().filter(|line| line.starts_with("SENT ERROR")).count();
    assert!((10..=30).contains(&refused) && reports.len() == 40, "{reports:?}");
    // The only slot is in use: there is none for another locomotive.
    (0..8).for_each(|_| drop(ask(&mut station, "SEND BA 01 01 45")));
    let refusals: Vec<String> = (0..8).flat_map(|_| ask(&mut station, "SEND BF 00 3A 7A")).collect();
    assert!(refusals.contains(&"RECEIVE B4 3F 00 74".to_owned()), "{refusals:?}");
}
