//! This computer's end of an open line, and what arrives at it: the same for ports, connections and datagrams.

use std::io::Write;

/// This computer's end of an open cable.
pub(crate) struct CableEnd {
    /// Where bytes are put on the line; with datagrams, each call of `write` sends one. Dropped, it closes the line.
    pub(crate) writer: Box<dyn Write + Send>,
    /// Whether the station's hand-shake line is up; `None` where there is none that could be read.
    pub(crate) cts: Option<bool>,
}

/// What arrives over a cable.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Arrival<'a> {
    /// Bytes from the station: one whole datagram, where it sends datagrams.
    Bytes(&'a [u8]),
    /// The hand-shake line is up or down now.
    Cts(bool),
    /// The line is gone; why.
    Lost(&'a str),
}
