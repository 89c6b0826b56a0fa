//! Opens a serial port or a network connection; a thread of its own reads bytes and the hand-shake line.

use std::fmt::Display;
use std::io::{ErrorKind, Read};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use serialport::{DataBits, FlowControl, Parity, SerialPort, StopBits};

use super::Lost;
use super::cable_end::{Arrival, CableEnd};

/// How often the hand-shake line is looked at: it is down for a millisecond or so after each byte.
const CTS_EVERY: Duration = Duration::from_micros(500);
/// How long a connection over a network may take to be made.
const CONNECT_WITHIN: Duration = Duration::from_secs(2);
/// A line that can not even be written to for so long is taken for lost.
const WRITE_WITHIN: Duration = Duration::from_secs(1);

/// Connects to a server of the network.
///
/// # Errors
/// When the name has no address or no server answers.
pub(super) fn connect(
    host: &str,
    port: u16,
    mut deliver: impl FnMut(Arrival<'_>) -> bool + Send + 'static,
) -> Result<CableEnd, Lost> {
    let stream = dial(host, port)?;
    let mut reader = stream.try_clone().map_err(|error| unreached(host, port, &error))?;
    std::thread::spawn(move || {
        let mut bytes = [0; 64];
        loop {
            match reader.read(&mut bytes) {
                Ok(0) => {
                    let _ = deliver(Arrival::Lost("the connection was closed"));
                    return;
                }
                Ok(count) => {
                    if !deliver(Arrival::Bytes(bytes.get(..count).unwrap_or_default())) {
                        return;
                    }
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => {
                    let _ = deliver(Arrival::Lost(&error.to_string()));
                    return;
                }
            }
        }
    });
    Ok(CableEnd { writer: Box::new(stream), cts: None })
}

/// Makes a connection to a server of the network.
///
/// # Errors
/// When the name has no address or no server answers.
pub(super) fn dial(host: &str, port: u16) -> Result<TcpStream, Lost> {
    let failed = |error: &dyn Display| unreached(host, port, error);
    let mut addresses = (host, port).to_socket_addrs().map_err(|error| failed(&error))?;
    let address = addresses.next().ok_or_else(|| failed(&"the name has no address"))?;
    let stream = TcpStream::connect_timeout(&address, CONNECT_WITHIN).map_err(|error| failed(&error))?;
    // Each byte leaves at once.
    stream.set_nodelay(true).map_err(|error| failed(&error))?;
    stream.set_write_timeout(Some(WRITE_WITHIN)).map_err(|error| failed(&error))?;
    Ok(stream)
}

fn unreached(host: &str, port: u16, error: &dyn Display) -> Lost {
    Lost(format!("cannot connect to {host}:{port}: {error}; check that the station's server runs there"))
}

/// How a serial port is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SerialFormat {
    pub(super) baud: u32,
    pub(super) stop_bits: StopBits,
    /// Whether its hand-shake line is used; `None`: if it can be read.
    pub(super) cts: Option<bool>,
}

/// Opens a serial port.
///
/// # Errors
/// When there is no such port, it may not be used, or its hand-shake line cannot be read and should be.
pub(super) fn open_device(
    path: &str,
    format: &SerialFormat,
    deliver: impl FnMut(Arrival<'_>) -> bool + Send + 'static,
) -> Result<CableEnd, Lost> {
    let failed = |error: &serialport::Error| {
        Lost(format!(
            "cannot open `{path}`: {error}; check the cable, the name of the port and that you may use it"
        ))
    };
    let port = serialport::new(path, format.baud)
        .data_bits(DataBits::Eight)
        .parity(Parity::None)
        .stop_bits(format.stop_bits)
        // The hand-shake is kept byte by byte above; the driver's own lets buffered bytes slip through.
        .flow_control(FlowControl::None)
        .timeout(CTS_EVERY)
        .open();
    let mut port = port.map_err(|error| failed(&error))?;
    let cts = if format.cts == Some(false) { None } else { port.read_clear_to_send().ok() };
    if format.cts == Some(true) && cts.is_none() {
        return Err(Lost(format!(
            "`{path}` has no CTS line that can be read, as a pseudo-terminal has none; leave out `cts=yes`"
        )));
    }
    let reader = port.try_clone().map_err(|error| failed(&error))?;
    std::thread::spawn(move || listen(reader, cts, deliver));
    Ok(CableEnd { writer: Box::new(port), cts })
}

fn listen(
    mut port: Box<dyn SerialPort>,
    mut cts: Option<bool>,
    mut deliver: impl FnMut(Arrival<'_>) -> bool,
) {
    let mut bytes = [0; 64];
    loop {
        let mut goes_on = true;
        match port.read(&mut bytes) {
            // A pseudo-terminal whose other end is gone reads nothing, at once and for ever.
            Ok(0) => {
                let _ = deliver(Arrival::Lost("the other end has gone"));
                return;
            }
            Ok(count) => goes_on = deliver(Arrival::Bytes(bytes.get(..count).unwrap_or_default())),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(error) => {
                let _ = deliver(Arrival::Lost(&error.to_string()));
                return;
            }
        }
        if cts.is_some() {
            match port.read_clear_to_send() {
                Ok(up) if cts != Some(up) => {
                    cts = Some(up);
                    goes_on &= deliver(Arrival::Cts(up));
                }
                Ok(_) => {}
                Err(error) => {
                    let _ = deliver(Arrival::Lost(&error.to_string()));
                    return;
                }
            }
        }
        if !goes_on {
            return;
        }
    }
}
