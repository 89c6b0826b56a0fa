//! A train behind a Central Station is calibrated and stopped where it should; the truth is the simulated world's.

use std::net::UdpSocket;
use std::time::Duration;

use footplate_wire::marklin_can::{Frame, Message};
use serde_json::Value;

use crate::board::{calibrated_over, driven_to_two, errors_over};
use crate::program::footplate;
use crate::station::Standing;

const LINK: &str = "sim:track-a?faults=none&trains=24&station=marklin-can&seed=";

#[test]
fn a_train_is_calibrated_behind_a_central_station_and_stops_where_it_should() {
    let (all, broken) = errors_over(LINK, "can");
    assert!(all[all.len() / 2] < 15.0 && all[all.len() - 1] < 60.0, "{all:?}");
    assert!(broken <= 3, "{broken} of {} promises of 95 % broken", all.len());
}

#[test]
fn it_stops_there_over_every_line_whatever_that_does_to_frames() {
    let folder = calibrated_over(LINK, "can-lines", 7);
    for (place, quirks, begins) in [
        ("udp:127.0.0.1:0", "lossy,twice,overtaken", "marklin-can:127.0.0.1:"),
        ("tcp:127.0.0.1:0", "split,dcc", "marklin-can:tcp://"),
        #[cfg(unix)]
        ("pty", "split,no-polls,no-times,no-list,mm", "marklin-can:/dev/"),
    ] {
        let station =
            Standing::with(place, "5", &["--protocol", "marklin-can", "--quirks", quirks, "--seed", "7"]);
        assert!(station.address.starts_with(begins), "{}", station.address);
        let run = driven_to_two(&folder, &station.address);
        let wrong = ["another throttle", "lost its power", "NOT commanded", "could not be read"];
        assert!(wrong.iter().all(|wrong| !run.errors.contains(wrong)), "{place}: {}", run.errors);
    }
}

#[test]
fn the_doctor_names_the_station_and_its_locomotives() {
    let doctor =
        footplate(&["doctor", "--link", "sim:track-a?station=marklin-can", "--seconds", "20", "--json"]);
    assert_eq!(doctor.status, 0, "{}{}", doctor.output, doctor.errors);
    let figures: Value = serde_json::from_str(&doctor.output).expect("JSON");
    assert_eq!(
        (figures["sensors"].as_u64(), figures["lost_answers"].as_u64()),
        (Some(80), Some(0)),
        "{figures}"
    );
    assert_eq!(figures["participants"].as_array().map(Vec::len), Some(2), "{figures}");
    assert_eq!(figures["locomotives"][0]["name"], "Train 24", "{figures}");
    assert_eq!(figures["locomotives"][0]["number"], 0x4018, "{figures}");
}

#[test]
fn an_address_where_no_station_answers_is_said_so_with_status_2() {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    socket.set_read_timeout(Some(Duration::from_secs(20))).expect("an option of sockets");
    let link = format!("marklin-can:{}?receive=0", socket.local_addr().expect("an address"));
    let doctor = footplate(&["doctor", "--link", &link, "--seconds", "60"]);
    assert_eq!(doctor.status, 2, "{}", doctor.errors);
    assert!(doctor.errors.contains("CAN is switched on in the station's settings"), "{}", doctor.errors);
    // It was asked all the same, and asked again.
    let mut bytes = [0; 13];
    for _ in 0..2 {
        assert_eq!(socket.recv(&mut bytes).expect("a datagram"), 13);
        assert_eq!(Frame::decode(bytes).map(|frame| Message::of(&frame)), Some(Message::Ping));
    }
}
