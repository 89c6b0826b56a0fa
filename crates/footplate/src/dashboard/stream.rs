//! What one watcher is sent: the newest picture whenever it is ready for one, and everything that happens.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::response::sse::Event;
use futures_util::stream::{Stream, unfold};
use tokio::sync::watch;

use super::board::Board;

/// No browser draws more often than this: fifty pictures a second.
const BETWEEN_PICTURES: Duration = Duration::from_millis(20);

/// One who watches.
struct Watcher {
    board: Arc<Board>,
    pictures: watch::Receiver<Arc<str>>,
    written: watch::Receiver<u64>,
    /// The number of the happening that it is sent next.
    next: u64,
    /// What waits to be sent.
    ready: std::collections::VecDeque<Event>,
    paced: tokio::time::Interval,
}

/// Events for one watcher, from a number on. A slow one gets fewer pictures; happenings that are gone are counted in `gap`.
pub(super) fn events(board: Arc<Board>, from: u64) -> impl Stream<Item = Result<Event, Infallible>> {
    let mut pictures = board.pictures();
    pictures.mark_changed();
    let mut written = board.written();
    written.mark_changed();
    let mut paced = tokio::time::interval(BETWEEN_PICTURES);
    paced.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let watcher =
        Watcher { board, pictures, written, next: from, ready: std::collections::VecDeque::new(), paced };
    unfold(watcher, |mut watcher| async move {
        loop {
            if let Some(event) = watcher.ready.pop_front() {
                return Some((Ok(event), watcher));
            }
            tokio::select! {
                changed = watcher.written.changed() => {
                    changed.ok()?;
                    watcher.gather();
                }
                changed = watcher.pictures.changed() => {
                    changed.ok()?;
                    watcher.paced.tick().await;
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
