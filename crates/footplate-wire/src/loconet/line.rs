//! Lines between a client and the server: a word in capitals and what belongs to it.
//!
//! Source: the LoconetOverTcp protocol, versions 0 to 2. A line ends with CR, LF or both; empty lines mean nothing.

use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt::Write as _;

use super::message::{Malformed, Message};

/// The longest line that is read: a message of 127 bytes takes 389 characters with its word; a longer one is taken for noise.
pub const LONGEST_LINE: usize = 400;

/// Whether a client's message came to the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SentReport {
    /// It did.
    Ok,
    /// It did not.
    Error,
}

/// A line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Line {
    /// What the server is.
    Version(String),
    /// A message has passed on the bus.
    Receive(Message),
    /// A client's message is to be put on the bus.
    Send(Message),
    /// What became of it.
    Sent(SentReport),
    /// When a message passed, a break or an error on the bus: for other clients.
    Other,
}

impl Line {
    /// Reads a line.
    ///
    /// # Errors
    /// When it has no word of the protocol or no sound message.
    pub fn read(line: &str) -> Result<Self, Malformed> {
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        match word {
            "VERSION" => Ok(Self::Version(rest.trim().to_string())),
            "RECEIVE" => message(rest).map(Self::Receive),
            "SEND" => message(rest).map(Self::Send),
            "SENT" if rest.split_whitespace().next() == Some("OK") => Ok(Self::Sent(SentReport::Ok)),
            "SENT" => Ok(Self::Sent(SentReport::Error)),
            "TIMESTAMP" | "BREAK" | "ERROR" => Ok(Self::Other),
            _ => Err(Malformed),
        }
    }

    /// The text of a line, with its end.
    pub fn text(&self) -> String {
        let with = |word: &str, message: &Message| {
            let mut line = String::from(word);
            for byte in message.encode() {
                // Writing to a string cannot fail.
                let _ = write!(line, " {byte:02X}");
            }
            line
        };
        let mut line = match self {
            Self::Version(version) => String::from("VERSION ") + version,
            Self::Receive(message) => with("RECEIVE", message),
            Self::Send(message) => with("SEND", message),
            Self::Sent(SentReport::Ok) => String::from("SENT OK"),
            Self::Sent(SentReport::Error) => String::from("SENT ERROR no echo from the bus"),
            Self::Other => String::from("ERROR LINE"),
        };
        line.push_str("\r\n");
        line
    }
}

/// Bytes in hexadecimal, with spaces between.
fn message(text: &str) -> Result<Message, Malformed> {
    let bytes: Option<Vec<u8>> =
        text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).ok()).collect();
    Message::decode(&bytes.ok_or(Malformed)?)
}

/// Cuts a stream into lines.
pub type Lines = crate::lines::Lines<LONGEST_LINE>;
