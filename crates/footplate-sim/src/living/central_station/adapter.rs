//! The serial CAN adapter before the station: lines of text, a bit rate that has to be right, and a channel that has to be opened.

use footplate_wire::marklin_can::{Frame, LONGEST_LINE};

/// The rate of Märklin's bus, 250 kbit/s, among the adapter's ten.
const RATE: &str = "S5";
/// Its answers: done, a frame was sent, refused.
const DONE: &str = "\r";
const SENT: &str = "Z\r";
const REFUSED: &str = "\x07";

/// The adapter.
#[derive(Debug, Clone, Default)]
pub(super) struct Adapter {
    line: Vec<u8>,
    has_rate: bool,
    is_open: bool,
}

impl Adapter {
    /// Whether frames of the bus are passed on.
    pub(super) const fn is_open(&self) -> bool {
        self.is_open && self.has_rate
    }

    /// Takes the next byte; returns the answer to a line and the frame that it puts on the bus.
    pub(super) fn push(&mut self, byte: u8) -> (Option<&'static str>, Option<Frame>) {
        if byte != b'\r' {
            if self.line.len() <= LONGEST_LINE {
                self.line.push(byte);
            }
            return (None, None);
        }
        let line = std::mem::take(&mut self.line);
        let line = String::from_utf8_lossy(&line);
        let answer = match &*line {
            "" => DONE,
            "O" if !self.is_open => {
                self.is_open = true;
                DONE
            }
            "C" => {
                self.is_open = false;
                DONE
            }
            "V" => "V1013\r",
            "N" => "NF7E1\r",
            "F" if self.is_open => "F00\r",
            "Z0" => DONE,
            rate if !self.is_open && rate.len() == 2 && rate.starts_with('S') => {
                self.has_rate = rate == RATE;
                DONE
            }
            frame => match Frame::of_text(frame).filter(|_| self.is_open) {
                // At a wrong rate no device on the bus understands it.
                frame @ Some(_) => return (Some(SENT), frame.filter(|_| self.has_rate)),
                None => REFUSED,
            },
        };
        (Some(answer), None)
    }
}
