//! Listening sockets whose queue of connections is as long as the kernel allows.
//!
//! A connection waits in the queue of its listener until the program accepts it. The standard library asks for 128 places.
//! When they are taken, the kernel drops the first packet of a new connection without an answer, and the client sends it
//! again a second later: so long an emergency stop was delayed by a flood of connections.

use std::io;
use std::net::{SocketAddr, TcpListener};

use socket2::SockRef;

/// Places in the queue: what Linux allows by default (`net.core.somaxconn`, since 5.4). A system that allows fewer gives fewer.
const PLACES: i32 = 4096;

/// Listens at an address.
///
/// # Errors
/// The address is in use, or not of this machine.
pub(crate) fn listen(at: SocketAddr) -> io::Result<TcpListener> {
    let listener = TcpListener::bind(at)?;
    // A socket that listens already only gets the longer queue.
    SockRef::from(&listener).listen(PLACES)?;
    Ok(listener)
}

#[cfg(test)]
mod tests {
    use std::net::TcpStream;
    use std::time::Duration;

    use super::*;

    /// Less than the second after which a client tries again.
    const SOON: Duration = Duration::from_millis(900);

    #[test]
    fn more_connections_than_the_usual_queue_takes_wait_to_be_accepted() {
        let listener = listen(SocketAddr::from(([127, 0, 0, 1], 0))).expect("a free port");
        let at = listener.local_addr().expect("an address");
        // A connection beyond the queue would wait for the second packet of the client.
        let waiting: Vec<_> = (0..400).map(|_| TcpStream::connect_timeout(&at, SOON)).collect();
        assert_eq!(waiting.iter().filter(|connected| connected.is_ok()).count(), 400);
    }
}
