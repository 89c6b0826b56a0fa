//! `footplate simulate layout --station`: a simulated station for any program that speaks to one.

use std::io::Write;
use std::sync::mpsc::Receiver;

use anyhow::{Context, anyhow, bail};
use footplate_core::DecoderSteps;
use footplate_core::track::Layout;
use footplate_sim::{CanTransport, LawFamily};
use footplate_wire::z21::Feedback;

use crate::link::{
    Incoming, Quirks, Server, SimulatedAddress, StationKind, listen_for_datagrams, listen_for_sockets,
    listen_on, open_pseudo_terminal, station, trains,
};
use crate::runtime::StopFlag;
use crate::standard_error::say;

/// Where a simulated station is put.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Place {
    /// At an address of this computer, such as `127.0.0.1:0`; port 0 is any that is free.
    Tcp(String),
    /// At an address of this computer, for datagrams.
    Udp(String),
    /// At a pseudo-terminal.
    PseudoTerminal,
}

pub(super) fn place_named(text: &str) -> anyhow::Result<Place> {
    let address = |scheme| text.strip_prefix(scheme).filter(|address| address.contains(':'));
    let plain = |address: &str| address.trim_start_matches('/').to_owned();
    match (address("tcp:"), address("udp:")) {
        (Some(address), _) => Ok(Place::Tcp(plain(address))),
        (_, Some(address)) => Ok(Place::Udp(plain(address))),
        _ if text == "pty" => Ok(Place::PseudoTerminal),
        _ => Err(anyhow!(
            "write tcp:127.0.0.1:0 for a network port, udp:127.0.0.1:0 for datagrams, or pty for a pseudo-terminal"
        )),
    }
}

/// What is simulated.
pub(super) struct Wanted<'a> {
    pub(super) layout: &'a str,
    pub(super) seed: u64,
    pub(super) trains: Option<&'a str>,
    pub(super) law: Option<LawFamily>,
    pub(super) decoder: DecoderSteps,
    pub(super) speed: f64,
    pub(super) protocol: StationKind,
    pub(super) quirks: Quirks,
}

/// Serves until somebody stops the program.
pub(super) fn serve(
    place: &Place,
    wanted: &Wanted<'_>,
    layout: &Layout,
    output: &mut dyn Write,
) -> anyhow::Result<()> {
    let mut address = SimulatedAddress::of(wanted.layout).map_err(|error| anyhow!(error))?;
    (address.seed, address.law) = (wanted.seed, wanted.law);
    (address.station, address.quirks) = (wanted.protocol, wanted.quirks);
    address.decoder = wanted.decoder;
    if let Some(named) = wanted.trains {
        address.trains = trains(named).map_err(|error| anyhow!(error))?;
    }
    for train in &address.trains {
        address.station.check(*train, address.decoder).map_err(|error| anyhow!(error))?;
    }
    if !(wanted.speed > 0.0 && wanted.speed.is_finite()) {
        bail!("speed {} is no multiple of real time; write --speed 20", wanted.speed);
    }
    match (wanted.protocol, place) {
        (StationKind::Z21, Place::Udp(_)) => {}
        (StationKind::MarklinCan, place) => {
            address.quirks.can.transport = match place {
                Place::Tcp(_) => CanTransport::Stream,
                Place::Udp(_) => CanTransport::Datagrams,
                Place::PseudoTerminal => CanTransport::Adapter,
            };
        }
        (StationKind::Z21, _) => bail!("a Z21 is spoken to over UDP: write --station udp:127.0.0.1:0"),
        (_, Place::Udp(_)) => {
            bail!(
                "only a Z21 and a Central Station are spoken to over UDP: write --protocol z21 or marklin-can, or --station tcp:127.0.0.1:0"
            )
        }
        (StationKind::LocoNet | StationKind::Jmri, Place::PseudoTerminal) => {
            bail!("such a server is spoken to over TCP: write --station tcp:127.0.0.1:0")
        }
        _ => {}
    }
    let station = station(&address, layout)?;
    let (port, incoming) = open(place, wanted.protocol)?;
    let stop = StopFlag::install_saying("\nthe station is switched off");
    let speed = wanted.speed;
    let name = match wanted.protocol {
        StationKind::Marklin => {
            writeln!(output, "marklin-serial:{port}?pace=fast&speed={speed}")?;
            "6051"
        }
        // A pseudo-terminal resets no board when it is opened.
        StationKind::DccEx => {
            writeln!(output, "dcc-ex:{port}?reset=no&speed={speed}")?;
            "DCC-EX board"
        }
        StationKind::Z21 => {
            // What its sensors are connected to has to be said with the link, as of a real one.
            let feedback = match wanted.quirks.z21.feedback {
                Feedback::RBus => "",
                Feedback::Can => "feedback=can&",
                Feedback::LocoNet => "feedback=loconet&",
            };
            writeln!(output, "z21:{port}?{feedback}speed={speed}")?;
            "Z21"
        }
        StationKind::MarklinCan => {
            // It answers to where it was written from, so that several programs can be tried on one computer.
            let receive = if matches!(place, Place::Udp(_)) { "receive=0&" } else { "" };
            let scan = wanted.quirks.can.scan.as_ms();
            writeln!(output, "marklin-can:{port}?{receive}scan={scan}&speed={speed}")?;
            "Central Station"
        }
        StationKind::LocoNet => {
            writeln!(output, "loconet:{port}?speed={speed}")?;
            "command station on LocoNet"
        }
        StationKind::Jmri => {
            let system = if wanted.quirks.jmri.has_prefix { "" } else { "system=L&" };
            writeln!(output, "jmri:{port}?{system}speed={speed}")?;
            "JMRI"
        }
    };
    output.flush()?;
    let named: Vec<String> = address.trains.iter().map(ToString::to_string).collect();
    say!(
        "a simulated {name} with trains {} on {}, seed {}; Ctrl-C ends it",
        named.join(", "),
        wanted.layout,
        address.seed
    );
    let mut server = Server::new(station, speed, incoming);
    server.serve(|| stop.is_up());
    say_what_happened(&server);
    Ok(())
}

fn open(place: &Place, protocol: StationKind) -> anyhow::Result<(String, Receiver<Incoming>)> {
    match place {
        Place::Tcp(address) => {
            let listen = if protocol == StationKind::Jmri { listen_for_sockets } else { listen_on };
            let (port, incoming) = listen(address).with_context(|| format!("cannot listen on {address}"))?;
            let host = address.rsplit_once(':').map_or(address.as_str(), |(host, _)| host);
            Ok((format!("tcp://{host}:{port}"), incoming))
        }
        Place::Udp(address) => {
            let (port, incoming) =
                listen_for_datagrams(address).with_context(|| format!("cannot listen on {address}"))?;
            let host = address.rsplit_once(':').map_or(address.as_str(), |(host, _)| host);
            Ok((format!("{host}:{port}"), incoming))
        }
        Place::PseudoTerminal => open_pseudo_terminal().context("cannot open a pseudo-terminal"),
    }
}

fn say_what_happened(server: &Server<'_>) {
    for incident in server.station().world().incidents() {
        let train = incident.train.map_or_else(String::new, |train| format!("train {train}: "));
        say!("at {:.1} s {train}{:?}", incident.at.as_s(), incident.kind);
    }
    for alarm in server.station().alarms() {
        let since = alarm.since.as_s();
        say!("the solenoid of turnout {} was powered for too long, from {since:.1} s", alarm.turnout);
    }
}
