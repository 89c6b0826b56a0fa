//! A train behind a Z21 is calibrated and stopped where it should; the truth is the simulated world's.

use std::net::UdpSocket;
use std::time::Duration;

use footplate_wire::z21::{Datasets, Request};
use serde_json::Value;

use crate::board::{SCRIPT, calibrated_over, driven, driven_to_two, errors, errors_over};
use crate::program::footplate;
use crate::station::Standing;

const LINK: &str = "sim:track-a?faults=none&trains=24&station=z21&seed=";

#[test]
fn a_train_is_calibrated_behind_a_z21_and_stops_where_it_should() {
    let (all, broken) = errors_over(LINK, "z21");
    assert!(all[all.len() / 2] < 12.0 && all[all.len() - 1] < 60.0, "{all:?}");
    // One in twenty should be.
    assert!(broken <= 3, "{broken} of {} promises of 95 % broken", all.len());
}

#[test]
fn it_stops_there_over_a_network_that_loses_doubles_and_reorders_datagrams() {
    let folder = calibrated_over(LINK, "z21-network", 7);
    let quirks = ["--protocol", "z21", "--quirks", "lossy,twice,overtaken,unsubscribed,short", "--seed", "7"];
    let station = Standing::with("udp:127.0.0.1:0", "5", &quirks);
    assert!(station.address.starts_with("z21:127.0.0.1:"), "{}", station.address);
    let doctor = footplate(&["doctor", "--link", &station.address, "--seconds", "20", "--json"]);
    let figures: Value = serde_json::from_str(&doctor.output).expect("JSON");
    assert_eq!(
        (figures["sensors"].as_u64(), &figures["firmware"]),
        (Some(80), &"1.42".into()),
        "{}",
        doctor.errors
    );
    assert!(figures["lost_answers"].as_u64().is_some_and(|lost| lost > 0), "{figures}");
    let run = driven_to_two(&folder, &station.address);
    assert!(
        !run.errors.contains("another throttle") && !run.errors.contains("lost its power"),
        "{}",
        run.errors
    );
    assert!(!run.errors.contains("NOT commanded"), "{}", run.errors);
}

#[test]
fn a_locked_station_is_said_to_be_locked() {
    let doctor = footplate(&["doctor", "--link", "sim:track-a?station=z21&quirks=locked", "--seconds", "5"]);
    assert!(doctor.output.contains("until its unlock code is entered"), "{}{}", doctor.output, doctor.errors);
}

#[test]
fn an_address_where_no_station_answers_is_said_so_with_status_2() {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    socket.set_read_timeout(Some(Duration::from_secs(20))).expect("an option of sockets");
    let link = format!("z21:{}", socket.local_addr().expect("an address"));
    let doctor = footplate(&["doctor", "--link", &link, "--seconds", "60"]);
    assert_eq!(doctor.status, 2, "{}", doctor.errors);
    assert!(doctor.errors.contains("192.168.0.111"), "{}", doctor.errors);
    // It was asked all the same, and asked again.
    let mut bytes = [0; 100];
    for _ in 0..2 {
        let length = socket.recv(&mut bytes).expect("a datagram");
        let request = Datasets::of(&bytes[..length]).next().and_then(|dataset| Request::read(&dataset));
        assert_eq!(request, Some(Request::SerialNumber));
    }
}

#[test]
fn a_slow_network_is_measured_and_trains_are_driven_by_it() {
    const SLOW: &str = "sim:track-a?faults=none&trains=24&station=z21&quirks=slow&seed=";
    let folder = calibrated_over(LINK, "z21-slow", 7);
    let store = folder.join("railway.db").display().to_string();
    let link = format!("{SLOW}7");
    let doctor = footplate(&["doctor", "--link", &link, "--seconds", "60", "--store", &store]);
    // Answers that come after the repeat of their request count as lost, which makes the status 1.
    assert!(doctor.status <= 1, "{}{}", doctor.output, doctor.errors);
    assert!(doctor.output.contains("ms slower than usual (10 ms)"), "{}", doctor.output);
    let kept = std::fs::read_to_string(folder.join("railway.links.json")).expect("what was measured");
    let kept: Value = serde_json::from_str(&kept).expect("JSON");
    assert!(kept["lines"]["sim:track-a Z21"]["round_trips"]["longest_usual"].is_number(), "{kept}");
    let (stops, _) = errors(&driven(&folder, &link, SCRIPT).1);
    println!("{stops:.1?}");
    assert!(stops.len() >= 5 && stops.iter().all(|error| *error < 60.0), "{stops:?}");
}
