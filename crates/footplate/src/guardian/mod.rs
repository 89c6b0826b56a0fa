//! Two processes: a small one that holds the line to the station, and the program that drives trains over it.
//!
//! `footplate drive` starts as the guardian, which starts the same program again as its child. The guardian opens the line
//! and relays bytes in both directions; it reads no files, no commands and no HTTP. The child tells it in advance which
//! bytes stop all trains: its last will. If the child dies, hangs or closes without a goodbye, the guardian sends these
//! bytes, and retries until it reaches the station. If the guardian dies, the child opens the line itself, stops all trains
//! and ends; one that answers no heartbeat is ended first.
//!
//! ```text
//! frame     frames between the two, and the pieces in which they arrive
//! monitor   what the guardian decides about its child
//! ward_link the line as the child sees it, over a connection to its guardian
//! ```
//!
//! Neither of these has a thread, a socket or a clock: chaos (`crates/footplate/src/chaos`) runs them, too. Around them:
//!
//! ```text
//! keeper    the guardian: starts its child, serves it, and does what the monitor decides
//! held_line the line that the guardian holds
//! signals   signals to the guardian
//! voice     the guardian's messages
//! ward      how the child finds its guardian
//! ward_connection frame_stream   the child's connection to it; the sockets of both
//! ```

mod frame;
mod monitor;
mod ward_link;

#[cfg(unix)]
mod frame_stream;
#[cfg(unix)]
mod held_line;
#[cfg(unix)]
mod keeper;
#[cfg(unix)]
mod signals;
#[cfg(unix)]
mod voice;
#[cfg(unix)]
mod ward;
#[cfg(unix)]
mod ward_connection;

pub(crate) use frame::{Frame, FrameBuffer, read_fuzzed};
#[cfg(unix)]
pub(crate) use keeper::keep;
pub(crate) use monitor::{Monitor, Request, Step};
#[cfg(unix)]
pub(crate) use ward::{become_ward, is_ward};
#[cfg(unix)]
pub(crate) use ward_connection::WardConnection;
pub(crate) use ward_link::{Connection, WardLink};
