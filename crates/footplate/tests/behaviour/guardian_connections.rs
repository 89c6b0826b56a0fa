//! However the program dies, trains behind LocoNet over TCP and behind JMRI are commanded to stop within a second.
//!
//! `cargo nextest run -p footplate -E 'test(over_connections)' --no-capture` prints how soon, as the station's end of the line
//! sees it.
#![cfg(unix)]
#![expect(clippy::disallowed_methods, reason = "how soon trains are stopped is measured")]

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::thread::{self, sleep};
use std::time::Instant;

use footplate_wire::dcc_ex::Throttle;
use footplate_wire::jmri::Request;
use footplate_wire::loconet::{Line, Message};

use crate::board::calibrated_over;
use crate::guardian::{Driven, WITHIN, running as running_behind_a_board, signal, stopped};
use crate::guardian_datagrams::{Commanded, Said, ended_by_signal};
use crate::station::Standing;

fn said_to_loconet(line: &str) -> Option<Said> {
    match Line::read(line.trim()) {
        Ok(Line::Send(Message::Speed { speed: 2.., .. })) => Some(Said::Run),
        Ok(Line::Send(Message::Speed { .. } | Message::StopAll)) => Some(Said::Stop),
        Ok(Line::Send(Message::PowerOff)) => Some(Said::PowerOff),
        _ => None,
    }
}

fn said_to_jmri(line: &str) -> Option<Said> {
    match Request::read(line) {
        Ok(Some(Request::Throttle(message))) => match message.throttle? {
            Throttle::Speed(1..) => Some(Said::Run),
            _ => Some(Said::Stop),
        },
        Ok(Some(Request::Power { on: false, .. })) => Some(Said::PowerOff),
        _ => None,
    }
}

/// The first line of a text, which is taken out of it.
fn line_of(bytes: &mut Vec<u8>) -> Option<String> {
    let end = bytes.iter().position(|byte| *byte == b'\n')?;
    Some(String::from_utf8_lossy(&bytes.drain(..=end).collect::<Vec<_>>()).into_owned())
}

/// The text of the first frame of a WebSocket's client (RFC 6455), or a line of the request before it.
fn frame_of(bytes: &mut Vec<u8>) -> Option<String> {
    const IS_WHOLE: u8 = 0x80;
    if bytes.first()? & IS_WHOLE == 0 {
        return line_of(bytes);
    }
    let (length, header) = match bytes.get(1)? & 0x7F {
        126 => (usize::from(u16::from_be_bytes([*bytes.get(2)?, *bytes.get(3)?])), 4),
        length => (usize::from(length), 2),
    };
    let frame: Vec<u8> = bytes.get(..header + 4 + length)?.to_vec();
    bytes.drain(..frame.len());
    let (mask, payload) = frame[header..].split_at(4);
    let text = payload.iter().zip(mask.iter().cycle()).map(|(byte, mask)| byte ^ mask).collect::<Vec<_>>();
    Some(String::from_utf8_lossy(&text).into_owned())
}

/// A kind of server: its name, how messages to it are told apart, what they mean, and by what a guardian stops the train.
type Kind = (&'static str, fn(&mut Vec<u8>) -> Option<String>, fn(&str) -> Option<Said>, Said);
const KINDS: [Kind; 2] = [
    ("loconet", line_of, said_to_loconet, Said::Stop),
    // JMRI has to be asked for a train before it takes a stop, and a guardian reads no answer.
    ("jmri", frame_of, said_to_jmri, Said::PowerOff),
];

/// Passes connections on to a server, and notes what is commanded over them.
fn between(server: &str, (_, next, meaning, _): Kind) -> (SocketAddr, Commanded) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let place = listener.local_addr().expect("an address");
    let (all, server) = (Commanded::default(), server.to_owned());
    let commanded = all.clone();
    thread::spawn(move || {
        for mut program in listener.incoming().flatten() {
            let mut server = TcpStream::connect(&server).expect("the server");
            for end in [&program, &server] {
                end.set_nodelay(true).expect("an option of sockets");
            }
            let mut back = program.try_clone().expect("a handle");
            let mut answers = server.try_clone().expect("a handle");
            thread::spawn(move || std::io::copy(&mut answers, &mut back));
            let commanded = commanded.clone();
            thread::spawn(move || {
                let (mut bytes, mut read) = ([0; 4096], Vec::new());
                while let Ok(count @ 1..) = program.read(&mut bytes) {
                    read.extend_from_slice(&bytes[..count]);
                    while let Some(message) = next(&mut read) {
                        meaning(&message).into_iter().for_each(|said| commanded.push(said));
                    }
                    if server.write_all(&bytes[..count]).is_err() {
                        break;
                    }
                }
                let _ = server.shutdown(Shutdown::Both);
            });
        }
    });
    (place, all)
}

/// A train that runs behind a server of a kind.
fn running(kind: Kind, how: &str) -> (Standing, Commanded, Driven) {
    let name = kind.0;
    let link = format!("sim:track-a?faults=none&trains=24&station={name}&seed=");
    let folder = calibrated_over(&link, &format!("guardian-{name}-{how}"), 7);
    let station = Standing::with("tcp:127.0.0.1:0", "1", &["--protocol", name, "--seed", "7"]);
    let begins = format!("{name}:tcp://");
    let of_station = station.address.strip_prefix(&begins).expect(&station.address);
    let (at, more) = of_station.split_once('?').unwrap_or((of_station, ""));
    let (place, commanded) = between(at, kind);
    let driven = Driven::over(&format!("{begins}{place}?{more}"), &folder.join("railway.db"), &[]);
    let began = Instant::now();
    driven.order("speed 24 8");
    commanded.delay_of(Said::Run, began);
    (station, commanded, driven)
}

#[test]
fn every_death_stops_the_trains_over_connections() {
    for kind in KINDS {
        for death in ["KILL", "STOP"] {
            let (_station, commanded, mut driven) = running(kind, death);
            let since = Instant::now();
            signal(death, driven.child());
            commanded.stopped(kind.3, since, &format!("{} {death}", kind.0));
            ended_by_signal(&mut driven);
        }
    }
}

#[test]
fn the_death_of_the_guardian_stops_the_trains_over_connections() {
    for kind in KINDS {
        let (_station, commanded, driven) = running(kind, "guardian");
        let (child, since) = (driven.child(), Instant::now());
        signal("KILL", driven.guardian());
        commanded.stopped(Said::Stop, since, &format!("{}, guardian killed", kind.0));
        driven.ended_without_guardian(child);
    }
}

#[test]
fn a_program_without_a_guardian_stops_the_trains_once_its_line_is_back() {
    let (_board, line, driven, _) = running_behind_a_board("guardian-killed-and-unplugged");
    let child = driven.child();
    line.is_pulled(true);
    signal("KILL", driven.guardian());
    driven.await_errors("trying for ever to stop all trains");
    // Longer than a program waits for a line that it may still drive over.
    sleep(8 * WITHIN);
    let since = Instant::now();
    line.is_pulled(false);
    stopped(&line, since, "the guardian was killed, and the plug was put back");
    driven.ended_without_guardian(child);
}
