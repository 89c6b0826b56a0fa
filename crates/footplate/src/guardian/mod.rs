//! Two processes: a small one that holds the line to the station, and the program that drives trains over it.
//!
//! `footplate drive` starts as the guardian, which starts the same program again as its child. The guardian opens the line
//! and relays bytes in both directions; it reads no files, no commands and no HTTP. The child tells it in advance which
//! bytes stop all trains: its last will. If the child dies, hangs or closes without a goodbye, the guardian sends these
//! bytes, and retries until it reaches the station. If the guardian dies, the child opens the line itself, stops all trains
//! and ends; one that answers no heartbeat is ended first.
//!
//! ```text
//! frame     the protocol between the two
//! keeper    the guardian: starts its child, monitors it, and sends its last will
//! held_line the line that the guardian holds
//! signals   signals to the guardian
//! voice     the guardian's messages
//! ward      how the child finds its guardian
//! ward_link the line as the child sees it
//! ```

mod frame;
mod held_line;
mod keeper;
mod signals;
mod voice;
mod ward;
mod ward_link;

pub(crate) use frame::read_fuzzed;
pub(crate) use keeper::keep;
pub(crate) use ward::{become_ward, is_ward};
pub(crate) use ward_link::WardLink;
