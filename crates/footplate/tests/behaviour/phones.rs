//! A phone drives a train through the whole program: WiThrottle in, the station's bytes out.
#![cfg(unix)]
#![expect(clippy::disallowed_methods, reason = "how soon trains are stopped is measured")]

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::time::Instant;

use crate::guardian::{PATIENCE, WITHIN, over_a_board};

/// A phone as Engine Driver is one, on a socket of this machine.
struct Handset {
    lines: BufReader<TcpStream>,
    socket: TcpStream,
}

impl Handset {
    fn connect(place: &str) -> Self {
        let socket = TcpStream::connect(place).expect("a connection");
        socket.set_read_timeout(Some(PATIENCE)).expect("an option of sockets");
        let mut handset = Self { lines: BufReader::new(socket.try_clone().expect("a handle")), socket };
        handset.send("HU0123456789");
        handset.send("NTest phone");
        handset
    }

    fn send(&mut self, line: &str) {
        self.socket.write_all(format!("{line}\n").as_bytes()).expect("sent");
    }

    /// The first line from here on that begins like this.
    fn await_line(&mut self, beginning: &str) -> String {
        loop {
            let mut line = String::new();
            assert!(self.lines.read_line(&mut line).expect(beginning) > 0, "closed before {beginning}");
            if line.starts_with(beginning) {
                return line.trim_end().to_owned();
            }
        }
    }
}

#[test]
fn a_phone_drives_and_no_train_runs_on_without_it() {
    let (_board, line, driven) = over_a_board("phones", &["--phones", "127.0.0.1:0"]);
    driven.await_errors("phones (WiThrottle, Engine Driver) connect to ");
    let errors = driven.errors();
    let place =
        errors.split("connect to ").nth(1).and_then(|rest| rest.split(';').next()).expect("an address");
    // More connections that say nothing than there are places for phones lock none out.
    let silent: Vec<TcpStream> = (0..100).map(|_| TcpStream::connect(place).expect("a connection")).collect();
    let mut phone = Handset::connect(place);
    assert_eq!(phone.await_line("RL"), "RL1]\\[train 24}|{24}|{S");
    assert!(phone.await_line("PTL").contains("FT11}|{turnout 11}|{"));
    phone.send("MT+S24<;>S24");
    phone.await_line("MTAS24<;>R1");
    drop(silent);
    // Step 14 of 14 is 126 of the board's 126 steps.
    let since = Instant::now();
    phone.send("MTAS24<;>V126");
    line.await_words(b"<t 24 126", since);
    // A key switches the light; the phone shows it.
    let since = Instant::now();
    phone.send("MTAS24<;>F10");
    line.await_words(b"<F 24 0 1>", since);
    phone.await_line("MTAS24<;>F10");
    // What the train cannot do is shown with its reason.
    phone.send("PTATFT99");
    assert!(phone.await_line("HM").contains("`99` is not a turnout of track-a"));
    let since = Instant::now();
    drop(phone);
    let stop = line.await_words(b"<t 24 0", since) - since;
    assert!(stop < WITHIN, "the phone is gone: {stop:?}");
    // The next phone is silent: it shows why its train stops after twelve seconds.
    let mut phone = Handset::connect(place);
    phone.await_line("PPA");
    phone.send("MT+S24<;>S24");
    phone.send("*+");
    let since = Instant::now();
    phone.send("MTAS24<;>V15");
    line.await_words(b"<t 24 ", since);
    let silent = Instant::now();
    assert_eq!(phone.await_line("HM"), "HMno sign of life for 12 s: your trains were stopped");
    let stop = line.await_words(b"<t 24 0", silent) - silent;
    assert!((11.5..14.0).contains(&stop.as_secs_f64()), "{stop:?}");
    // An emergency stop of a phone is one of the railway.
    let since = Instant::now();
    phone.send("MT+S24<;>S24");
    phone.send("MTAS24<;>X");
    let off = line.await_words(b"<0>", since) - since;
    assert!(off < WITHIN, "{off:?}");
    phone.await_line("PPA0");
    // An order that the railway refuses is answered with the reason.
    phone.send("MTAS24<;>V126");
    let refused = phone.await_line("HM");
    let reasons = ["train 24 is stopped for safety", "track power is off"];
    assert!(reasons.iter().any(|reason| refused.contains(reason)), "{refused}");
}
