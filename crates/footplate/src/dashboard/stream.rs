//! The event stream of one watcher: the newest picture when it is due, and all other events.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::Arc;

use axum::response::sse::Event;
use futures_util::stream::{Stream, unfold};
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until};

use super::board::{Board, WatcherSlot};

/// The state of one stream.
struct Watcher {
    board: Arc<Board>,
    watching: WatcherSlot,
    pictures: watch::Receiver<Arc<str>>,
    written: watch::Receiver<u64>,
    /// The number of the next event.
    next: u64,
    /// Events to send.
    ready: VecDeque<Event>,
    /// When the last picture was due.
    sent: Option<Instant>,
}

/// The stream from an event number on. A slow watcher gets fewer pictures; dropped events are counted in `gap`.
pub(super) fn events(
    board: Arc<Board>,
    watching: WatcherSlot,
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
                    // Counted from when the picture was due, so that a late one does not delay all others.
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
        let (happened, lost) = self.board.events_from(self.next);
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
