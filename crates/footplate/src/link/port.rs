//! Where a line to a station ends at this computer.

use std::fmt::{Display, Formatter, Result as FmtResult};

const TCP: &str = "tcp://";

/// Where a line ends at this computer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Port {
    /// At a server of the network.
    Tcp {
        /// Its name or address.
        host: String,
        /// Its port.
        port: u16,
    },
    /// At a serial port or pseudo-terminal.
    Device(String),
}

impl Port {
    /// Reads what follows a scheme: `tcp://HOST:PORT`, or the name of a device. The device and the network port of examples
    /// are those that are usual for the scheme.
    ///
    /// # Errors
    /// When nothing follows, or a server has no name or port.
    pub(super) fn named(scheme: &str, text: &str, device: &str, usual: u16) -> Result<Self, String> {
        let Some(server) = text.strip_prefix(TCP) else {
            if text.is_empty() {
                return Err(format!(
                    "`{scheme}` wants a port; write {scheme}{device} or {scheme}tcp://host:port"
                ));
            }
            return Ok(Self::Device(text.to_owned()));
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

impl Display for Port {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        match self {
            Self::Tcp { host, port } => write!(f, "{TCP}{host}:{port}"),
            Self::Device(path) => f.write_str(path),
        }
    }
}
