//! Ctrl-C and the signals that end a program: trains are stopped first.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

#[cfg(unix)]
use crate::guardian::is_ward;
use crate::standard_error::say;

/// How often the program was asked to end.
static ASKED: AtomicU32 = AtomicU32::new(0);
static INSTALLED: OnceLock<bool> = OnceLock::new();

/// Exit status of a program that was interrupted (128 and the number of the signal).
const INTERRUPTED: i32 = 130;

/// Whether the program was asked to end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StopFlag(());

impl StopFlag {
    /// Installs the handler: a signal raises the flag instead of ending the program; a third one ends it at once.
    pub(crate) fn install() -> Self {
        #[cfg(unix)]
        if is_ward() {
            return Self::install_saying("\nstopping all trains; a third signal leaves that to the guardian");
        }
        Self::install_saying("\nstopping all trains; a third signal leaves them running")
    }

    /// The same for a program that has no trains to stop.
    pub(crate) fn install_saying(words: &'static str) -> Self {
        INSTALLED.get_or_init(|| {
            let handler = move || match ASKED.fetch_add(1, Ordering::Relaxed) {
                0 => say!("{words}"),
                1 => {}
                _ => std::process::exit(INTERRUPTED),
            };
            ctrlc::set_handler(handler).is_ok()
        });
        Self(())
    }

    /// Raises the flag from inside the program.
    pub(crate) fn raise() {
        ASKED.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn is_up(self) -> bool {
        ASKED.load(Ordering::Relaxed) > 0
    }
}
