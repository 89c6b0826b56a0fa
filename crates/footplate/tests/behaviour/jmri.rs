//! A train behind JMRI is calibrated and stopped where it should; the truth is the simulated world's.

use std::io::{Read as _, Write as _};

use serde_json::Value;

use crate::board::{calibrated_over, driven_to_two, errors_over};
use crate::program::footplate;
use crate::station::Standing;

const LINK: &str = "sim:track-a?faults=none&trains=24&station=jmri&seed=";

#[test]
fn a_train_is_calibrated_behind_jmri_and_stops_where_it_should() {
    let (all, _) = errors_over(LINK, "jmri");
    assert!(all[all.len() / 2] < 15.0 && all[all.len() - 1] < 60.0, "{all:?}");
}

#[test]
fn it_stops_there_over_a_web_socket_with_polled_sensors_and_without_a_prefix() {
    let folder = calibrated_over(LINK, "jmri-network", 7);
    let quirks = ["--protocol", "jmri", "--quirks", "no-prefix,polled", "--seed", "7"];
    let station = Standing::with("tcp:127.0.0.1:0", "5", &quirks);
    assert!(station.address.starts_with("jmri:tcp://127.0.0.1:"), "{}", station.address);
    let link = format!("{}&sensor-delay=150", station.address);
    let doctor = footplate(&["doctor", "--link", &link, "--seconds", "20", "--json"]);
    let figures: Value = serde_json::from_str(&doctor.output).expect("JSON");
    assert_eq!(figures["sensors"].as_u64(), Some(80), "{figures}{}", doctor.errors);
    assert_eq!(figures["system"], "LocoNet (L)");
    let run = driven_to_two(&folder, &link);
    assert!(!run.errors.contains("did not confirm"), "{}", run.errors);
}

#[test]
fn a_port_that_speaks_no_web_socket_or_nothing_at_all_is_said_so_with_status_2() {
    for answer in
        [&b"HTTP/1.1 400 Bad Request\r\nConnection: close\r\n\r\n"[..], b"VERSION LbServer\r\n", b""]
    {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
        let link = format!("jmri:{}", listener.local_addr().expect("an address"));
        std::thread::spawn(move || {
            for mut client in listener.incoming().flatten() {
                let mut bytes = [0; 64];
                while let Ok(1..) = client.read(&mut bytes) {
                    let _ = client.write_all(answer);
                }
            }
        });
        let doctor = footplate(&["doctor", "--link", &link, "--seconds", "60"]);
        assert_eq!(doctor.status, 2, "{}", doctor.errors);
        assert!(doctor.errors.contains("belongs to JMRI's web server"), "{}", doctor.errors);
    }
}
