//! What one watcher is sent: the newest picture whenever it is ready for one, and everything that happens.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::Arc;

use axum::response::sse::Event;
use futures_util::stream::{Stream, unfold};
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until};

use super::board::{Board, Watching};

/// One who watches.
struct Watcher {
    board: Arc<Board>,
    watching: Watching,
    pictures: watch::Receiver<Arc<str>>,
    written: watch::Receiver<u64>,
    /// The number of the happening that it is sent next.
    next: u64,
    /// What waits to be sent.
    ready: VecDeque<Event>,
    /// When it was sent a picture, or should have been if that was a little late.
    sent: Option<Instant>,
}

/// Events for one watcher, from a number on. A slow one gets fewer pictures; happenings that are gone are counted in `gap`.
pub(super) fn events(
    board: Arc<Board>,
    watching: Watching,
    from: u64,
) -> impl Stream<Item = Result<Event, Infallible>> {
    let mut pictures = board.pictures();
    pictures.mark_changed();
    let mut written = board.written();
    written.mark_changed();
    let watcher =
        Watcher { board, watching, pictures, written, next: from, ready: VecDeque::new(), sent: None };
    unfold(watcher, |mut watcher| async move {
        loop {
            if let Some(event) = watcher.ready.pop_front() {
                return Some((Ok(event), watcher));
            }
            let pace = watcher.watching.pace();
            let due = watcher.sent.map(|sent| sent + pace);
            let pictures = &mut watcher.pictures;
            let next_picture = async {
                if let Some(due) = due {
                    sleep_until(due).await;
                }
                pictures.changed().await
            };
            tokio::select! {
                changed = watcher.written.changed() => {
                    changed.ok()?;
                    watcher.gather();
                }
                changed = next_picture => {
                    changed.ok()?;
                    let now = Instant::now();
                    // Counted from when it was due: one that is late does not make all others late.
                    watcher.sent = now.checked_sub(pace).max(due).or(Some(now));
                    let picture = watcher.pictures.borrow_and_update().clone();
                    watcher.ready.push_back(Event::default().event("picture").data(&*picture));
                }
            }
        }
    })
}

impl Watcher {
    fn gather(&mut self) {
        self.written.mark_unchanged();
        let (happened, lost) = self.board.happened_from(self.next);
        if lost > 0 {
            self.ready.push_back(Event::default().event("gap").data(lost.to_string()));
        }
        for happening in happened {
            self.next = happening.number + 1;
            let name = self.board.name_of(happening.number);
            self.ready.push_back(Event::default().event(happening.kind).id(name).data(&*happening.json));
        }
    }
}
