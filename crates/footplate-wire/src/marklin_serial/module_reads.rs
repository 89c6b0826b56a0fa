//! Finds out whether the interface answers reads of one module, or only reads of all.

use core::fmt::{Display, Formatter, Result as FmtResult};

use super::codec::Message;

/// Reads of one module that are lost while reads of all are answered: more than chance takes in a row.
const UNANSWERED: u8 = 3;

/// Which reads an interface answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModuleReads {
    /// Reads of one module (192 + n) and of all up to one (128 + n).
    Single,
    /// Only reads of all modules up to one (128 + n). Most of these do not keep a sensor that was occupied between two
    /// reads either.
    AllOnly,
}

impl ModuleReads {
    /// Reads of single modules that are lost until it is known that none is answered.
    pub const READS_TRIED: usize = UNANSWERED as usize;

    /// What the interface does, after its name.
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            Self::Single => "answers reads of single sensor modules",
            Self::AllOnly => {
                "answers reads of all sensor modules only: every read takes as long as all of them, and a sensor \
                 that is occupied for less may be missed"
            }
        }
    }
}

impl Display for ModuleReads {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        f.write_str(self.text())
    }
}

/// Finds out which.
#[derive(Debug, Clone, Default)]
pub(super) struct ReadsProbe {
    found: Option<ModuleReads>,
    /// A read of one module was lost since a read of all was answered.
    is_missed: bool,
    unanswered: u8,
}

impl ReadsProbe {
    pub(super) const fn found(&self) -> Option<ModuleReads> {
        self.found
    }

    /// Notes a complete reply; returns what it shows, if that is new.
    pub(super) fn answered(&mut self, request: Message) -> Option<ModuleReads> {
        let before = self.found;
        if matches!(request, Message::ReadModule { .. }) {
            *self = Self { found: Some(ModuleReads::Single), ..Self::default() };
        } else if core::mem::take(&mut self.is_missed) {
            self.unanswered = self.unanswered.saturating_add(1);
            if self.unanswered >= UNANSWERED {
                self.found = Some(ModuleReads::AllOnly);
            }
        }
        self.found.filter(|_| self.found != before)
    }

    /// No byte of a reply came.
    pub(super) fn lost(&mut self, request: Message) {
        self.is_missed |= matches!(request, Message::ReadModule { .. });
    }
}
