//! Finds command stations: serial ports of this computer, and stations that answer a call to the whole network.
//!
//! Each question is harmless: it moves no train and changes no setting.

use std::collections::BTreeSet;
use std::net::{Ipv4Addr, UdpSocket};
use std::time::Duration;

use footplate_wire::marklin_can::{FRAME_BYTES, Frame, Message};
use footplate_wire::z21::{Datasets, LONGEST_DATAGRAM, Reply, Request};
use mdns_sd::{ResolvedService, ServiceDaemon, ServiceEvent};
use serde::Serialize;
use serialport::SerialPortType;

use crate::clock::Stopwatch;

/// Stations answer within a few milliseconds; a busy wireless network takes longer.
const ANSWERS_WITHIN: Duration = Duration::from_millis(1_200);
/// The port of a Z21 (Z21 LAN protocol, section 1.1).
const Z21_PORT: u16 = 21_105;
/// The ports of a CS2 or CS3 (CS2 CAN protocol, section 1.2): it listens at the first and answers to the second.
const CAN_PORTS: (u16, u16) = (15_731, 15_730);
/// The service by which DCC-EX boards announce themselves, and the beginning of their names.
const DCC_EX_SERVICE: &str = "_withrottle._tcp.local.";
const DCC_EX_NAME: &str = "dccex";
/// The service by which JMRI announces its web server, and the property in which it states its version.
const JMRI_SERVICE: &str = "_http._tcp.local.";
const JMRI_PROPERTY: &str = "jmri";

/// A place where a station is, or may be.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub(crate) struct FoundStation {
    /// `serial` for a port whose station is unknown, or `z21`, `marklin-can`, `dcc-ex`, `jmri`.
    kind: &'static str,
    /// The link, or the name of the port.
    place: String,
    /// What else is known: a serial number, the name of an adapter.
    note: String,
}

/// Searches for stations. Takes a second or two.
pub(crate) fn find_stations() -> Vec<FoundStation> {
    let searches =
        [serial_ports, z21_stations, can_stations, dcc_ex_boards, jmri_servers].map(std::thread::spawn);
    let found = searches.into_iter().flat_map(|search| search.join().unwrap_or_default());
    found.collect::<BTreeSet<_>>().into_iter().collect()
}

fn serial_ports() -> Vec<FoundStation> {
    let found = |port: serialport::SerialPortInfo| {
        let note = match port.port_type {
            SerialPortType::UsbPort(usb) => {
                [usb.manufacturer, usb.product].into_iter().flatten().collect::<Vec<_>>().join(" ")
            }
            _ => String::new(),
        };
        FoundStation { kind: "serial", place: port.port_name, note }
    };
    serialport::available_ports().unwrap_or_default().into_iter().map(found).collect()
}

/// Sends a question to all computers of the network, and to this one; collects the answers.
fn answers<T>(
    local_port: u16,
    port: u16,
    question: &[u8],
    read: impl Fn(&[u8], Ipv4Addr) -> Option<T>,
) -> Vec<T> {
    // A port in use, or no network: nothing is found there.
    let Ok(socket) = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, local_port)) else { return Vec::new() };
    let _ = socket.set_broadcast(true);
    for to in [Ipv4Addr::BROADCAST, Ipv4Addr::LOCALHOST] {
        let _ = socket.send_to(question, (to, port));
    }
    let began = Stopwatch::start();
    let (mut found, mut bytes) = (Vec::new(), [0; LONGEST_DATAGRAM]);
    while let Some(left) = ANSWERS_WITHIN.checked_sub(began.elapsed()).filter(|left| !left.is_zero()) {
        if socket.set_read_timeout(Some(left)).is_err() {
            break;
        }
        // An error is the end of the time, or a computer that refuses the port.
        if let Ok((length, std::net::SocketAddr::V4(from))) = socket.recv_from(&mut bytes) {
            found.extend(bytes.get(..length).and_then(|answer| read(answer, *from.ip())));
        }
    }
    found
}

fn z21_stations() -> Vec<FoundStation> {
    let mut question = Vec::new();
    Request::SerialNumber.write(&mut question);
    answers(0, Z21_PORT, &question, |answer, from| {
        let serial = Datasets::of(answer).find_map(|dataset| match Reply::read(&dataset) {
            Ok(Some(Reply::SerialNumber(serial))) => Some(serial),
            _ => None,
        })?;
        Some(FoundStation {
            kind: "z21",
            place: format!("z21:{from}"),
            note: format!("serial number {serial}"),
        })
    })
}

fn can_stations() -> Vec<FoundStation> {
    let question = Message::Ping.frame(false, 0).encode();
    let (station, own) = CAN_PORTS;
    answers(own, station, &question, |answer, from| {
        let frame = Frame::decode(<[u8; FRAME_BYTES]>::try_from(answer.get(..FRAME_BYTES)?).ok()?)?;
        let Message::Participant { kind, version, .. } = Message::of(&frame) else { return None };
        let words = footplate_wire::marklin_can::kind_in_words(kind);
        let note = format!("{words}, version {}.{}", version.0, version.1);
        Some(FoundStation { kind: "marklin-can", place: format!("marklin-can:{from}"), note })
    })
}

fn dcc_ex_boards() -> Vec<FoundStation> {
    announced(DCC_EX_SERVICE, |service| {
        let is_board = service.host.to_ascii_lowercase().starts_with(DCC_EX_NAME);
        is_board.then(|| ("dcc-ex", "dcc-ex:tcp://", service.host.clone()))
    })
}

fn jmri_servers() -> Vec<FoundStation> {
    announced(JMRI_SERVICE, |service| {
        let version = service.get_property_val_str(JMRI_PROPERTY)?;
        Some(("jmri", "jmri:", format!("version {version} on {}", service.host)))
    })
}

/// Listens to what announces itself as a service. `read` returns the kind of station, how its link begins, and a note.
fn announced(
    service: &str,
    read: impl Fn(&ResolvedService) -> Option<(&'static str, &'static str, String)>,
) -> Vec<FoundStation> {
    let Ok(daemon) = ServiceDaemon::new() else { return Vec::new() };
    let began = Stopwatch::start();
    let mut found = Vec::new();
    if let Ok(events) = daemon.browse(service) {
        while let Some(left) = ANSWERS_WITHIN.checked_sub(began.elapsed()) {
            match events.recv_timeout(left) {
                Ok(ServiceEvent::ServiceResolved(service)) => {
                    let Some((kind, scheme, note)) = read(&service) else { continue };
                    let addresses = service.addresses.iter().map(mdns_sd::ScopedIp::to_ip_addr);
                    found.extend(addresses.filter(std::net::IpAddr::is_ipv4).map(|address| {
                        let place = format!("{scheme}{address}:{}", service.port);
                        FoundStation { kind, place, note: note.clone() }
                    }));
                }
                Ok(_) => {}
                Err(_) => break,
            }
        }
    }
    let _ = daemon.shutdown();
    found
}
