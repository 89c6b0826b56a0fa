//! A link with a listener: what was written and heard, and when.

use footplate_core::Timestamp;

use super::line::passes_on;
use super::{Heard, Link, Lost};

/// One byte that passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Passed {
    /// To the station; when it was put on the line.
    Written(Timestamp, u8),
    /// From the station; when it was heard.
    Heard(Timestamp, u8),
}

/// More is not noted: an hour of the fastest line in use, or some seconds of a flood, in about 100 MB.
const MOST_BYTES: usize = 4_000_000;

/// A link whose bytes are noted.
pub(crate) struct TappedLink<L> {
    link: L,
    passed: Vec<Passed>,
}

impl<L: Link> TappedLink<L> {
    pub(crate) fn new(link: L) -> Self {
        Self { link, passed: Vec::new() }
    }

    fn note(&mut self, passed: impl IntoIterator<Item = Passed>) {
        let room = MOST_BYTES.saturating_sub(self.passed.len());
        self.passed.extend(passed.into_iter().take(room));
    }

    /// What passed, in order, up to the first four million bytes.
    pub(crate) fn passed(&self) -> &[Passed] {
        &self.passed
    }
}

impl<L: Link> Link for TappedLink<L> {
    passes_on!(self, self.link);

    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        let now = self.link.now();
        self.note(bytes.iter().map(|byte| Passed::Written(now, *byte)));
        self.link.write(bytes)
    }

    fn wait(&mut self, until: Timestamp) -> Heard {
        let heard = self.link.wait(until);
        match &heard {
            Heard::Byte(byte) => self.note([Passed::Heard(self.link.now(), *byte)]),
            Heard::Datagram(datagram) => {
                let now = self.link.now();
                self.note(datagram.iter().map(|byte| Passed::Heard(now, *byte)));
            }
            Heard::Cts(_) | Heard::Nothing | Heard::Lost(_) => {}
        }
        heard
    }
}
