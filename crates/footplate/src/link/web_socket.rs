//! Lines through a WebSocket: each is a message of its own, in both directions.

use std::io::{Error, ErrorKind, Result as IoResult, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use footplate_wire::jmri::LONGEST_LINE;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message, WebSocket, accept_with_config, client::client_with_config};

use super::Lost;
use super::cable_end::{Arrival, CableEnd};
use super::served::Incoming;
use super::stream::dial;

/// Where JMRI speaks JSON.
const PATH: &str = "/json/";
/// How long the other end may take to agree on a WebSocket.
const AGREED_WITHIN: Duration = Duration::from_secs(2);
/// A message is passed on in portions of this size: a guardian takes no larger ones.
const PORTION: usize = 4_096;

fn config() -> WebSocketConfig {
    WebSocketConfig::default().max_message_size(Some(LONGEST_LINE)).max_frame_size(Some(LONGEST_LINE))
}

/// Connects to a server of the network.
///
/// # Errors
/// When no server answers, or what answers speaks no WebSocket.
pub(super) fn connect_socket(
    host: &str,
    port: u16,
    mut deliver: impl FnMut(Arrival<'_>) -> bool + Send + 'static,
) -> Result<CableEnd, Lost> {
    let stream = dial(host, port)?;
    let failed = |error: &dyn std::fmt::Display| {
        Lost(format!(
            "{host}:{port} speaks no WebSocket: {error}; check that the port belongs to JMRI's web server (usually port 12080)"
        ))
    };
    let writes = stream.try_clone().map_err(|error| failed(&error))?;
    stream.set_read_timeout(Some(AGREED_WITHIN)).map_err(|error| failed(&error))?;
    let host = if host.contains(':') { format!("[{host}]") } else { host.to_owned() };
    let (socket, _) = client_with_config(format!("ws://{host}:{port}{PATH}"), stream, Some(config()))
        .map_err(|error| failed(&error))?;
    socket.get_ref().set_read_timeout(None).map_err(|error| failed(&error))?;
    std::thread::spawn(move || {
        let why = listen(socket, |line| {
            line.chunks(PORTION).all(|portion| deliver(Arrival::Bytes(portion))).then_some(())
        });
        if let Some(why) = why {
            let _ = deliver(Arrival::Lost(&why));
        }
    });
    Ok(CableEnd { writer: Box::new(LineWriter::new(writes, Role::Client)), cts: None })
}

/// Passes on the lines that come, until the receiver has gone; returns why there are no more.
fn listen(mut socket: WebSocket<TcpStream>, mut pass: impl FnMut(&[u8]) -> Option<()>) -> Option<String> {
    loop {
        match socket.read() {
            Ok(Message::Text(text)) => {
                // Between the parts of JSON, the end of a line is a space.
                let line = text.replace(['\r', '\n'], " ") + "\n";
                pass(line.as_bytes())?;
            }
            // The library answers what keeps the connection alive.
            Ok(_) => {}
            Err(error) => return Some(error.to_string()),
        }
    }
}

/// Writes each line as a message. Dropped, it ends the connection.
struct LineWriter(WebSocket<TcpStream>);

impl LineWriter {
    fn new(stream: TcpStream, role: Role) -> Self {
        Self(WebSocket::from_raw_socket(stream, role, Some(config())))
    }
}

impl Write for LineWriter {
    fn write(&mut self, bytes: &[u8]) -> IoResult<usize> {
        let text = std::str::from_utf8(bytes).map_err(|error| Error::new(ErrorKind::InvalidData, error))?;
        for line in text.lines() {
            self.0.write(Message::text(line)).map_err(Error::other)?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> IoResult<()> {
        self.0.flush().map_err(Error::other)
    }
}

impl Drop for LineWriter {
    fn drop(&mut self) {
        let _ = self.0.close(None);
        let _ = self.0.flush();
        // The thread that reads holds the other handle.
        let _ = self.0.get_ref().shutdown(Shutdown::Both);
    }
}

/// Lets clients connect to a port, on threads of their own; returns the port, which the system chooses if none was asked for, and what
/// comes from them.
///
/// # Errors
/// When the port cannot be had.
pub(crate) fn listen_for_sockets(address: &str) -> IoResult<(u16, Receiver<Incoming>)> {
    let listener = TcpListener::bind(address)?;
    let port = listener.local_addr()?.port();
    let (sender, incoming) = channel();
    std::thread::spawn(move || {
        for (id, client) in listener.incoming().enumerate() {
            let (Ok(client), sender) = (client, sender.clone()) else { continue };
            // One that never agrees on a WebSocket keeps no other waiting.
            std::thread::spawn(move || serve(id, client, &sender));
        }
    });
    Ok((port, incoming))
}

/// `None` when the client speaks no WebSocket, or the server has gone.
fn serve(id: usize, client: TcpStream, sender: &Sender<Incoming>) -> Option<()> {
    client.set_nodelay(true).ok()?;
    client.set_read_timeout(Some(AGREED_WITHIN)).ok()?;
    let writes = client.try_clone().ok()?;
    let socket = accept_with_config(client, Some(config())).ok()?;
    socket.get_ref().set_read_timeout(None).ok()?;
    sender.send(Incoming::Client(id, Box::new(LineWriter::new(writes, Role::Server)))).ok()?;
    listen(socket, |line| line.iter().try_for_each(|byte| sender.send(Incoming::Byte(id, *byte))).ok())?;
    sender.send(Incoming::Gone(id)).ok()
}
