//! What one watcher is sent: the newest picture whenever it is ready for one, and every line.

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
    /// The number of the line that it is sent next.
    next_line: u64,
    /// What waits to be sent.
    ready: std::collections::VecDeque<Event>,
    paced: tokio::time::Interval,
}

/// Events for one watcher, from a line on. A slow one gets fewer pictures; lines that are gone are counted in `gap`.
pub(super) fn events(board: Arc<Board>, from_line: u64) -> impl Stream<Item = Result<Event, Infallible>> {
    let mut pictures = board.pictures();
    pictures.mark_changed();
    let mut written = board.written();
    written.mark_changed();
    let mut paced = tokio::time::interval(BETWEEN_PICTURES);
    paced.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let watcher = Watcher {
        board,
        pictures,
        written,
        next_line: from_line,
        ready: std::collections::VecDeque::new(),
        paced,
    };
    unfold(watcher, |mut watcher| async move {
        loop {
            if let Some(event) = watcher.ready.pop_front() {
                return Some((Ok(event), watcher));
            }
            tokio::select! {
                changed = watcher.written.changed() => {
                    changed.ok()?;
                    watcher.gather_lines();
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
    fn gather_lines(&mut self) {
        self.written.mark_unchanged();
        let (lines, lost) = self.board.lines_from(self.next_line);
        if lost > 0 {
            self.ready.push_back(Event::default().event("gap").data(lost.to_string()));
        }
        for line in lines {
            self.next_line = line.number + 1;
            if let Ok(text) = serde_json::to_string(&line) {
                self.ready
                    .push_back(Event::default().event("line").id(self.board.name_of(line.number)).data(text));
            }
        }
    }
}
