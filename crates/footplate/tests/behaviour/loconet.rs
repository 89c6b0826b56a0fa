//! A train behind LocoNet is calibrated and stopped where it should; the truth is the simulated world's.

use std::io::{Read as _, Write as _};

use serde_json::Value;

use crate::board::{calibrated_over, driven_to_two, errors_over};
use crate::program::footplate;
use crate::station::Standing;

const LINK: &str = "sim:track-a?faults=none&trains=24&station=loconet&seed=";

#[test]
fn a_train_is_calibrated_behind_loconet_and_stops_where_it_should() {
    let (all, _) = errors_over(LINK, "loconet");
    assert!(all[all.len() / 2] < 12.0 && all[all.len() - 1] < 60.0, "{all:?}");
}

#[test]
fn it_stops_there_through_a_server_that_refuses_splits_and_returns_nothing() {
    let folder = calibrated_over(LINK, "loconet-network", 7);
    let quirks = ["--protocol", "loconet", "--quirks", "refused,no-echo,no-version,split", "--seed", "7"];
    let station = Standing::with("tcp:127.0.0.1:0", "5", &quirks);
    assert!(station.address.starts_with("loconet:tcp://127.0.0.1:"), "{}", station.address);
    let doctor = footplate(&["doctor", "--link", &station.address, "--seconds", "20", "--json"]);
    let figures: Value = serde_json::from_str(&doctor.output).expect("JSON");
    assert_eq!(figures["sensors"].as_u64(), Some(80), "{figures}{}", doctor.errors);
    assert!(figures["refused_messages"].as_u64() > Some(0), "{figures}");
    let run = driven_to_two(&folder, &station.address);
    assert!(!run.errors.contains("did not confirm"), "{}", run.errors);
}

#[test]
fn a_port_of_something_else_is_told_from_a_server_that_is_silent() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
    let link = format!("loconet:{}", listener.local_addr().expect("an address"));
    std::thread::spawn(move || {
        for client in listener.incoming().flatten() {
            let mut client = client;
            let mut bytes = [0; 64];
            while let Ok(1..) = client.read(&mut bytes) {
                let _ = client.write_all(b"HTTP/1.1 400 Bad Request\r\nConnection: keep-alive\r\n\r\n");
            }
        }
    });
    let doctor = footplate(&["doctor", "--link", &link, "--seconds", "60"]);
    assert_eq!(doctor.status, 2, "{}", doctor.errors);
    assert!(doctor.errors.contains("belongs to a LocoNet-over-TCP server"), "{}", doctor.errors);
}
