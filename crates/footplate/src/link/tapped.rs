//! A link with a listener: what was written and heard, and when.

use std::time::Duration;

use footplate_core::{TimeSpan, Timestamp};

use super::{Guardian, Heard, Link, Lost};

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
    fn now(&self) -> Timestamp {
        self.link.now()
    }

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

    fn cts(&self) -> Option<bool> {
        self.link.cts()
    }

    fn patience(&self) -> TimeSpan {
        self.link.patience()
    }

    fn reopen(&mut self) -> Result<(), Lost> {
        self.link.reopen()
    }

    fn may_be_half_open(&self) -> bool {
        self.link.may_be_half_open()
    }

    fn real_time(&self) -> Duration {
        self.link.real_time()
    }

    fn pause(&mut self, span: Duration) {
        self.link.pause(span);
    }

    fn guardian(&mut self) -> Option<&mut dyn Guardian> {
        self.link.guardian()
    }
}
