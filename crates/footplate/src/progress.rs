//! A progress bar for work that takes more than a second, on terminals only.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// Shorter work needs no bar.
const PATIENCE: Duration = Duration::from_secs(1);
/// Ten times a second looks smooth.
const FRAME: Duration = Duration::from_millis(100);

/// Does `work`, which counts up to `total` as it goes; a bar on standard error follows it from the second second
/// on, if that is a terminal, and vanishes at the end.
pub(crate) fn with_progress<T>(what: &'static str, total: usize, work: impl FnOnce(&AtomicU64) -> T) -> T {
    let done = AtomicU64::new(0);
    if !std::io::stderr().is_terminal() {
        return work(&done);
    }
    let (working, finished) = channel::<()>();
    thread::scope(|scope| {
        let done = &done;
        scope.spawn(move || follow(what, total as u64, done, &finished));
        let result = work(done);
        drop(working);
        result
    })
}

/// Shows `done` until the other end of `finished` is gone.
fn follow(what: &'static str, total: u64, done: &AtomicU64, finished: &Receiver<()>) {
    let goes_on = |time| finished.recv_timeout(time) == Err(RecvTimeoutError::Timeout);
    if !goes_on(PATIENCE) {
        return;
    }
    let style = ProgressStyle::with_template("{spinner} {msg} {wide_bar} {pos}/{len} {elapsed}");
    let bar = ProgressBar::new(total).with_message(what);
    let bar = if let Ok(style) = style { bar.with_style(style) } else { bar };
    while goes_on(FRAME) {
        bar.set_position(done.load(Ordering::Relaxed));
        bar.tick();
    }
    bar.finish_and_clear();
}
