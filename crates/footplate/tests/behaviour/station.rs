//! A simulated station serves other programs, `doctor` among them, and says what is wrong with a link.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use crate::program::footplate;

/// A station of the program's own, until it is dropped.
pub(crate) struct Standing {
    child: Child,
    pub(crate) address: String,
}

impl Standing {
    pub(crate) fn at(place: &str) -> Self {
        Self::with(place, "20", &[])
    }

    pub(crate) fn with(place: &str, speed: &str, more: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_footplate"))
            .args(["simulate", "layout", "--station", place, "--speed", speed, "--trains", "24"])
            .args(more)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program should start");
        let mut address = String::new();
        let output = child.stdout.take().expect("its output");
        BufReader::new(output).read_line(&mut address).expect("one line");
        Self { child, address: address.trim().to_owned() }
    }
}

impl Drop for Standing {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn a_station_prints_the_link_under_which_it_is_found() {
    for place in ["tcp:127.0.0.1:0", "pty"] {
        let standing = Standing::at(place);
        assert!(standing.address.starts_with("marklin-serial:"), "{}", standing.address);
        let output = footplate(&["doctor", "--link", &standing.address, "--seconds", "20", "--json"]);
        let figures: serde_json::Value = serde_json::from_str(&output.output).expect("JSON");
        let polls = figures["polls"].as_u64().expect("a count");
        assert!((100..=400).contains(&polls), "{place}: {figures}");
        // 11 bytes on the line take 50.4 ms, and the answer some time to begin.
        let period = figures["poll_period_ms"]["median"].as_f64().expect("a figure");
        assert!((50.4..90.0).contains(&period), "{place}: {figures}");
    }
}

#[test]
fn a_line_that_is_in_order_is_found_to_be() {
    let output = footplate(&["doctor", "--link", "sim:track-a?seed=3", "--seconds", "30"]);
    assert_eq!(output.status, 0, "{}", output.errors);
    assert!(output.output.contains(", 0 without a whole reply"), "{}", output.output);
}

#[test]
fn a_link_that_leads_nowhere_is_said_so_with_status_2() {
    let cases = [
        ("marklin-serial:/dev/no-such-port", "check the cable"),
        ("marklin-serial:tcp://127.0.0.1:1", "check that the station's server runs there"),
        ("track-a", "use sim:track-a"),
        ("sim:no-such-layout", "no-such-layout"),
    ];
    for (link, told) in cases {
        let output = footplate(&["doctor", "--link", link]);
        assert_eq!(output.status, 2, "{link}: {}", output.errors);
        assert!(output.errors.contains(told), "{link}: {}", output.errors);
    }
}

#[test]
fn a_station_that_says_nothing_ends_a_verb_with_status_2_within_seconds() {
    // Given a port at which somebody listens and never answers,
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
    let link = format!("marklin-serial:tcp://{}?pace=fast", listener.local_addr().expect("an address"));
    let output = footplate(&["doctor", "--link", &link, "--seconds", "60"]);
    assert_eq!(output.status, 2, "{}", output.errors);
    assert!(output.errors.contains("check its power, the cable and the port"), "{}", output.errors);
}

#[test]
fn a_port_that_takes_connections_and_closes_them_ends_the_doctor_with_status_1_and_why() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
    let place = listener.local_addr().expect("an address");
    std::thread::spawn(move || listener.incoming().for_each(drop));
    for link in
        [format!("marklin-serial:tcp://{place}"), format!("dcc-ex:tcp://{place}"), format!("loconet:{place}")]
    {
        let doctor = footplate(&["doctor", "--link", &link, "--seconds", "1000"]);
        assert_eq!(doctor.status, 1, "{link}: {}{}", doctor.output, doctor.errors);
        assert!(doctor.output.contains("another program may be connected"), "{link}: {}", doctor.output);
    }
}

#[test]
fn a_line_of_garbage_is_called_that_with_what_to_check() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
    let place = listener.local_addr().expect("an address");
    std::thread::spawn(move || {
        for mut client in listener.incoming().flatten() {
            std::thread::spawn(move || {
                // Any bytes: a generator of Marsaglia's (xorshift), about 100 000 a second.
                let mut state = 0x9E37_79B9_u32;
                loop {
                    let bytes: Vec<u8> = (0..1_000)
                        .map(|_| {
                            state ^= state << 13;
                            state ^= state >> 17;
                            state ^= state << 5;
                            state as u8
                        })
                        .collect();
                    if std::io::Write::write_all(&mut client, &bytes).is_err() {
                        return;
                    }
                    std::thread::sleep(std::time::Duration::from_millis(10));
                }
            });
        }
    });
    for (link, check) in [
        (format!("marklin-serial:tcp://{place}"), "belongs to a 6050 or 6051"),
        (format!("jmri:{place}"), "belongs to JMRI's web server"),
        (format!("dcc-ex:tcp://{place}"), "115200 baud"),
        (format!("loconet:{place}"), "LocoNet-over-TCP server"),
    ] {
        let doctor = footplate(&["doctor", "--link", &link, "--seconds", "5"]);
        assert_eq!(doctor.status, 2, "{link}: {}{}", doctor.output, doctor.errors);
        assert!(doctor.errors.contains(check), "{link}: {}", doctor.errors);
    }
}
