//! Two processes: a small one that holds the line to the station, and the program that drives trains over it.
//!
//! Whoever types `footplate drive` starts the guardian, which starts the same program again as its child. The guardian
//! opens the line, passes bytes in both directions and reads no files, no orders and no HTTP. What stops the trains it is
//! told in advance, as bytes. If its child dies, falls silent or closes without a word, the guardian says these bytes,
//! however long it takes to reach the station. If the guardian dies, its child opens the line itself, stops all trains and
//! ends.
//!
//! ```text
//! frame     what the two say to each other
//! keeper    the guardian: starts its child, watches it, and does its last will
//! held_line the line that the guardian holds
//! signals   what people say to the guardian by signals
//! voice     what the guardian says to people
//! ward      how the child finds its guardian
//! ward_link the line, as the child sees it
//! ```

mod frame;
mod held_line;
mod keeper;
mod signals;
mod voice;
mod ward;
mod ward_link;

pub(crate) use keeper::keep;
pub(crate) use ward::{become_ward, is_ward};
pub(crate) use ward_link::WardLink;
