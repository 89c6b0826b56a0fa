//! Where a line to a station ends at this computer.

use std::fmt::{Display, Formatter, Result as FmtResult};

use serialport::StopBits;

use super::datagrams::Correspondent;
use super::stream::SerialFormat;

const TCP: &str = "tcp://";

/// Where a line ends at this computer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Place {
    /// At a serial port or pseudo-terminal.
    Device(String, SerialFormat),
    /// At a server of the network.
    Tcp { host: String, port: u16 },
    /// At a server of the network that speaks WebSocket.
    WebSocket { host: String, port: u16 },
    /// At a station that exchanges datagrams.
    Datagrams(Correspondent),
}

impl Place {
    /// Reads what follows a scheme: `tcp://HOST:PORT`, or the name of a device. The device and the network port of examples
    /// are those that are usual for the scheme.
    ///
    /// # Errors
    /// When nothing follows, or a server has no name or port.
    pub(super) fn named(
        scheme: &str,
        text: &str,
        device: &str,
        usual: u16,
        format: SerialFormat,
    ) -> Result<Self, String> {
        let Some(server) = text.strip_prefix(TCP) else {
            if text.is_empty() {
                return Err(format!(
                    "`{scheme}` wants a port; write {scheme}{device} or {scheme}tcp://host:port"
                ));
            }
            return Ok(Self::Device(text.to_owned(), format));
        };
        let wanted = || {
            format!(
                "`{server}` is not a server: use tcp://host:port, such as \
                        tcp://127.0.0.1:{usual}"
            )
        };
        let (host, port) = server.rsplit_once(':').ok_or_else(wanted)?;
        let host = host.trim_start_matches('[').trim_end_matches(']');
        if host.is_empty() {
            return Err(wanted());
        }
        Ok(Self::Tcp { host: host.to_owned(), port: port.parse().map_err(|_| wanted())? })
    }
}

impl Display for Place {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        match self {
            Self::Device(path, _) => f.write_str(path),
            Self::Tcp { host, port } => write!(f, "{TCP}{host}:{port}"),
            Self::WebSocket { host, port } | Self::Datagrams(Correspondent { host, port, .. }) => {
                write!(f, "{host}:{port}")
            }
        }
    }
}

impl SerialFormat {
    /// How the serial port of a station that answers by itself is used.
    pub(super) const fn of_baud(baud: u32) -> Self {
        Self { baud, stop_bits: StopBits::One, cts: Some(false) }
    }
}

/// Reads a place in the network, `HOST` or `HOST:PORT`, with the port that is usual where none is written.
pub(super) fn host_and_port(place: &str, usual: u16) -> Option<(String, u16)> {
    let (host, port) = match place.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        Some((host, "")) => (host, usual),
        Some((host, rest)) => (host, rest.strip_prefix(':')?.parse().ok()?),
        None => match place.rsplit_once(':') {
            Some((host, port)) => (host, port.parse().ok()?),
            None => (place, usual),
        },
    };
    let is_name = !host.is_empty() && (!host.contains(['/', ':']) || host.contains("::"));
    is_name.then(|| (host.to_owned(), port))
}
