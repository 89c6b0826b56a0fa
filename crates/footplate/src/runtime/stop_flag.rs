//! Ctrl-C and the signals that end a program, so that trains are stopped before it goes.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

#[cfg(unix)]
use crate::guardian::is_ward;

/// How often somebody wanted the program to end.
static ASKED: AtomicU32 = AtomicU32::new(0);
static INSTALLED: OnceLock<bool> = OnceLock::new();

/// Exit status of a program that was interrupted (128 and the number of the signal).
const INTERRUPTED: i32 = 130;

/// Whether somebody wants the program to end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StopFlag(());

impl StopFlag {
    /// From now on a signal does not end the program but raises the flag; a third one ends it at once.
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
                0 => eprintln!("{words}"),
                1 => {}
                _ => std::process::exit(INTERRUPTED),
            };
            ctrlc::set_handler(handler).is_ok()
        });
        Self(())
    }

    /// The program itself wants to end, as if somebody had asked.
    pub(crate) fn raise() {
        ASKED.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn is_up(self) -> bool {
        ASKED.load(Ordering::Relaxed) > 0
    }
}
