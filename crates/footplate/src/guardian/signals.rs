//! Signals to a guardian: it passes them on to its child, and does not end before its trains are stopped.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};

use rustix::process::{Pid, Signal, kill_process};
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP};

/// No child.
const NONE: i32 = 0;

/// The signals that the guardian handles.
#[derive(Debug, Clone)]
pub(super) struct Signals {
    child: Arc<AtomicI32>,
    gives_up: Arc<AtomicBool>,
    ends: Arc<AtomicBool>,
}

impl Signals {
    /// Installs the handlers. From now on only SIGKILL ends this process. A terminal sends its keys to the child as well; the
    /// guardian passes on signals from elsewhere.
    ///
    /// # Errors
    /// The system refuses the handlers.
    pub(super) fn listen() -> std::io::Result<Self> {
        let signals =
            Self { child: Arc::new(AtomicI32::new(NONE)), gives_up: Arc::default(), ends: Arc::default() };
        let mut incoming = signal_hook::iterator::Signals::new([SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP])?;
        let heard = signals.clone();
        std::thread::spawn(move || incoming.forever().for_each(|signal| heard.hear(signal)));
        Ok(signals)
    }

    fn hear(&self, signal: i32) {
        let wanted = match signal {
            SIGINT if has_terminal() => None,
            SIGINT => Some(Signal::INT),
            SIGTERM => Some(Signal::TERM),
            SIGHUP => Some(Signal::HUP),
            // Keys of a terminal, which the child has received itself.
            _ => None,
        };
        match Pid::from_raw(self.child.load(Ordering::Acquire)) {
            Some(child) => {
                // The child may have ended at this moment.
                let _ = wanted.map(|signal| kill_process(child, signal));
            }
            None => {
                let asks = matches!(signal, SIGINT | SIGTERM);
                self.gives_up.fetch_or(asks, Ordering::Release);
                self.ends.fetch_or(asks || signal == SIGHUP, Ordering::Release);
            }
        }
    }

    /// Sets the child that receives signals. `None`: from now on a signal to end means not to wait for a lost line.
    pub(super) fn pass_on_to(&self, child: Option<u32>) {
        let child = child.and_then(|child| child.try_into().ok()).unwrap_or(NONE);
        self.child.store(child, Ordering::Release);
    }

    /// Ends the child because of a signal that came before it was there.
    pub(super) fn pass_on_late(&self) {
        if let Some(child) = Pid::from_raw(self.child.load(Ordering::Acquire)) {
            let _ = kill_process(child, Signal::TERM);
        }
    }

    /// Whether a signal asked not to wait any longer for a line over which trains are to be stopped.
    pub(super) fn gives_up(&self) -> bool {
        self.gives_up.load(Ordering::Acquire)
    }

    /// Whether a signal asked to start no program any more; the end of the terminal is one.
    pub(super) fn ends(&self) -> bool {
        self.ends.load(Ordering::Acquire)
    }
}

/// Whether this process is in the foreground of a terminal, whose keys then reach its child as well.
fn has_terminal() -> bool {
    rustix::termios::tcgetpgrp(std::io::stdin()).is_ok_and(|group| group == rustix::process::getpgrp())
}
