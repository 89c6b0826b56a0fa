//! Records a live session on a thread of its own, so that control never waits for a disk.
//!
//! The loop passes entries through a bounded queue. The thread commits together all entries that arrived while the disk was
//! busy: an entry waits for two commits at most, and no commit waits for more entries. Entries that cannot be written are
//! kept and tried again, so a full disk or another process that holds the store costs nothing once it is over. Entries that
//! do not fit into the queue are lost and counted, and the run is broken there.

mod entry;
mod scribe;
mod writer;

use std::sync::atomic::Ordering;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, PoisonError};
use std::thread::{self, JoinHandle};

use anyhow::bail;
use footplate_core::{Event, Timestamp};
use footplate_store::{Direction, Journal, JournalEntry, TrainAtStart};

use self::entry::{Beginning, Entry, QUEUE, Shared};
pub(crate) use self::entry::{PROGRAM, WhenFull};
pub(crate) use self::scribe::Scribe;
use self::writer::Writer;
use crate::runtime::Recorder;
use crate::standard_error::say;

/// What to do when the session cannot be recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum IfUnkept {
    /// Stop the trains: the session is for the record.
    Stop,
    /// Continue, with one warning.
    GoOn,
}

/// The recorder of a live session.
#[derive(Debug)]
pub(crate) struct SessionJournal {
    queue: Option<SyncSender<Entry>>,
    when_full: WhenFull,
    if_unkept: IfUnkept,
    /// Whether the warning was printed.
    said: bool,
    /// Set if entries were lost since the last one in the queue: the run is broken there.
    broken: Option<Beginning>,
    beginning: Beginning,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<Journal>>,
}

/// Tells how much of a session is on disk.
#[derive(Debug, Clone)]
pub(crate) struct WrittenUntil(Arc<Shared>);

impl WrittenUntil {
    /// Returns the time before which all events are on disk.
    pub(crate) fn at(&self, now: Timestamp) -> Timestamp {
        // An event that arrives between the two reads makes the answer earlier, never later.
        let acknowledged = self.0.acknowledged.load(Ordering::Acquire);
        let written = Timestamp::from_ns(self.0.written_ns.load(Ordering::Acquire));
        if self.0.taken.load(Ordering::Acquire) <= acknowledged { now } else { written.min(now) }
    }
}

/// How much of a session was recorded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Kept {
    /// Entries on disk.
    pub(crate) acknowledged: u64,
    /// Entries that are lost.
    pub(crate) lost: u64,
    /// Why not.
    pub(crate) trouble: Option<String>,
}

impl SessionJournal {
    /// Starts the thread over a journal that has begun. `began_at` is when the session's clock was zero.
    ///
    /// # Errors
    /// The system gives no thread.
    pub(crate) fn start(
        journal: Journal,
        began_at: Option<Timestamp>,
        when_full: WhenFull,
        if_unkept: IfUnkept,
    ) -> std::io::Result<Self> {
        Self::with_queue(journal, began_at, when_full, if_unkept, QUEUE)
    }

    fn with_queue(
        journal: Journal,
        began_at: Option<Timestamp>,
        when_full: WhenFull,
        if_unkept: IfUnkept,
        length: usize,
    ) -> std::io::Result<Self> {
        let (queue, entries) = sync_channel(length);
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        let thread = thread::Builder::new()
            .name("journal".to_owned())
            .spawn(move || Writer { journal, shared: of_thread }.run(&entries))?;
        Ok(Self {
            queue: Some(queue),
            when_full,
            if_unkept,
            said: false,
            broken: None,
            beginning: Beginning { began_at, trains: Vec::new() },
            shared,
            thread: Some(thread),
        })
    }

    /// Passes an entry to the thread. Waits only with [`WhenFull::Wait`].
    fn hand_over(&mut self, event: &Event) {
        if let Some(beginning) = self.broken.take()
            && !self.offer(Entry::Run(beginning.clone()))
        {
            self.broken = Some(beginning);
            self.shared.lost.fetch_add(1, Ordering::Relaxed);
            return;
        }
        if self.offer(Entry::Of(JournalEntry::Event(*event))) {
            self.shared.taken.fetch_add(1, Ordering::Release);
        } else {
            self.broken = Some(self.beginning.clone());
            self.shared.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Begins the next run: a train was lifted, or other trains take part from here on.
    pub(crate) fn begin_run(&mut self, trains: &[TrainAtStart]) {
        self.beginning.trains = trains.to_vec();
        if !self.offer(Entry::Run(self.beginning.clone())) {
            self.broken = Some(self.beginning.clone());
        }
    }

    /// Returns whether the queue took the entry.
    fn offer(&self, entry: Entry) -> bool {
        self.queue.as_ref().is_some_and(|queue| self.when_full.offer(queue, entry))
    }

    /// Begins to record another machine; the one before has ended. Returns its scribe.
    pub(crate) fn begin_machine(&mut self, kind: &'static str, body: String) -> Option<Scribe> {
        if !self.offer(Entry::Machine(kind, body)) {
            // Nothing of it can be distinguished from the one before.
            self.shared.lost.fetch_add(1, Ordering::Relaxed);
            return None;
        }
        self.scribe()
    }

    /// Returns what records the inputs and decisions of a machine that the journal has [begun](Journal::begin_machine), in
    /// order with the events.
    pub(crate) fn scribe(&self) -> Option<Scribe> {
        let queue = self.queue.clone()?;
        Some(Scribe::new(queue, self.when_full, Arc::clone(&self.shared)))
    }

    /// Number of events of the session on disk.
    pub(crate) fn acknowledged(&self) -> u64 {
        self.shared.acknowledged.load(Ordering::Acquire)
    }

    /// Returns a handle that tells how much of the session is on disk.
    pub(crate) fn written(&self) -> WrittenUntil {
        WrittenUntil(Arc::clone(&self.shared))
    }

    /// Why entries are not recorded at present, if they are not.
    pub(crate) fn trouble(&self) -> Option<String> {
        let lost = self.shared.lost.load(Ordering::Relaxed);
        let trouble = self.shared.trouble.lock().unwrap_or_else(PoisonError::into_inner).clone();
        match (trouble, lost) {
            (None, 0) => None,
            (None, lost) => Some(format!("{lost} events came faster than the disk took them, and are lost")),
            (Some(trouble), 0) => Some(trouble),
            (Some(trouble), lost) => Some(format!("{trouble}; {lost} events are lost")),
        }
    }

    /// Writes the entries that still wait, once more even after failures. Returns how much of the session was recorded.
    pub(crate) fn finish(mut self) -> (Kept, Option<Journal>) {
        let journal = self.end();
        let kept = Kept {
            acknowledged: self.acknowledged(),
            lost: self.shared.lost.load(Ordering::Relaxed),
            trouble: self.trouble(),
        };
        (kept, journal)
    }

    fn end(&mut self) -> Option<Journal> {
        self.shared.ended.store(true, Ordering::Release);
        // Scribes may still hold the queue. If it is full, the thread is awake anyway.
        if let Some(queue) = self.queue.take() {
            let _ = queue.try_send(Entry::End);
        }
        self.thread.take()?.join().ok()
    }
}

/// Entries are passed on before the machine acts on them. They count as measured once they are
/// [acknowledged](SessionJournal::acknowledged).
impl Recorder for SessionJournal {
    fn record(&mut self, events: &[Event]) -> anyhow::Result<()> {
        events.iter().for_each(|event| self.hand_over(event));
        match (self.trouble(), self.if_unkept) {
            (None, _) => self.said = false,
            (Some(trouble), IfUnkept::Stop) => bail!("the session cannot be written down: {trouble}"),
            (Some(trouble), IfUnkept::GoOn) if !self.said => {
                self.said = true;
                say!("the session is not written down at present, and goes on as asked: {trouble}");
            }
            (Some(_), IfUnkept::GoOn) => {}
        }
        Ok(())
    }

    fn record_direction(&mut self, direction: Direction) {
        if !self.offer(Entry::Of(JournalEntry::Direction(direction))) {
            self.shared.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Drop for SessionJournal {
    /// Writes every entry that the queue took, also after an error.
    fn drop(&mut self) {
        self.end();
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::time::Duration;

    use footplate_core::{EventKind, TrainId};
    use footplate_store::Store;
    use rusqlite::Connection;

    use super::*;
    use crate::clock::now;

    fn event(number: u64) -> Event {
        let time = Timestamp::from_ns(1_000_000 * number as i64);
        Event { time, kind: EventKind::Reverse { train: TrainId(24) } }
    }

    fn journal(path: &Path) -> Journal {
        let store = Store::open_or_create(path).unwrap().with_patience(Duration::from_millis(5)).unwrap();
        Journal::begin(store, "evening", "track-a", None, &[], now()).unwrap()
    }

    /// `cargo nextest run -p footplate -E 'test(how_long_an_event)' --run-ignored all --no-capture`
    #[test]
    #[ignore = "measures the disk of this machine"]
    fn how_long_an_event_takes_to_the_disk() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("railway.db");
        let mut session =
            SessionJournal::start(journal(&path), None, WhenFull::Lose, IfUnkept::GoOn).unwrap();
        let mut took: Vec<f64> = Vec::new();
        for number in 1..=500 {
            let watch = crate::clock::Stopwatch::start();
            session.hand_over(&event(number));
            while session.acknowledged() < number {
                thread::sleep(Duration::from_micros(50));
            }
            took.push(1e3 * watch.elapsed().as_secs_f64());
            // As fast as a busy line brings them.
            thread::sleep(Duration::from_millis(20).saturating_sub(watch.elapsed()));
        }
        took.sort_by(f64::total_cmp);
        println!(
            "on the disk after: median {:.1} ms, p99 {:.1} ms, longest {:.1} ms",
            took[250], took[495], took[499]
        );
    }

    #[test]
    fn it_is_said_how_far_the_session_is_written_down() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("railway.db");
        let mut session =
            SessionJournal::start(journal(&path), None, WhenFull::Lose, IfUnkept::GoOn).unwrap();
        let (written, now) = (session.written(), event(9).time);
        assert_eq!(written.at(now), now);
        session.hand_over(&event(1));
        until(|| written.at(now) == now);
        let other = Connection::open(&path).unwrap();
        other.execute_batch("BEGIN IMMEDIATE").unwrap();
        session.hand_over(&event(2));
        assert_eq!(written.at(now), event(1).time);
        other.execute_batch("ROLLBACK").unwrap();
        until(|| written.at(now) == now);
    }

    fn times(path: &Path) -> Vec<Vec<i64>> {
        let store = Store::open(path).unwrap();
        let recording = store.recordings(now()).unwrap()[0].key;
        let runs = store.runs(recording, now()).unwrap();
        let time = |stored: &footplate_store::StoredEvent| stored.raw.event.time.as_ns() / 1_000_000;
        runs.iter().map(|run| run.events.iter().map(time).collect()).collect()
    }

    /// Waits, at most some seconds, until something holds.
    fn until(holds: impl Fn() -> bool) {
        for _ in 0..2_000 {
            if holds() {
                return;
            }
            thread::sleep(Duration::from_millis(5));
        }
        panic!("it never happened");
    }

    #[test]
    fn what_was_handed_over_is_there_in_order_and_in_its_runs() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("railway.db");
        let mut session =
            SessionJournal::start(journal(&path), None, WhenFull::Lose, IfUnkept::GoOn).unwrap();
        (0..5).for_each(|number| session.hand_over(&event(number)));
        session.begin_run(&[]);
        (5..5_000).for_each(|number| session.hand_over(&event(number)));
        until(|| session.acknowledged() == 5_000);
        let (kept, _) = session.finish();
        assert_eq!(kept, Kept { acknowledged: 5_000, lost: 0, trouble: None });
        assert_eq!(times(&path), [(0..5).collect::<Vec<_>>(), (5..5_000).collect()]);
    }

    #[test]
    fn trouble_is_said_and_what_waited_is_written_when_it_is_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("railway.db");
        let mut session =
            SessionJournal::start(journal(&path), None, WhenFull::Lose, IfUnkept::GoOn).unwrap();
        let other = Connection::open(&path).unwrap();
        other.execute_batch("BEGIN IMMEDIATE").unwrap();
        session.hand_over(&event(1));
        until(|| session.trouble().is_some_and(|trouble| trouble.contains("is in use by another process")));
        session.hand_over(&event(2));
        assert_eq!(session.acknowledged(), 0);
        other.execute_batch("ROLLBACK").unwrap();
        until(|| session.acknowledged() == 2 && session.trouble().is_none());
        drop(session);
        assert_eq!(times(&path), [[1, 2]]);
    }

    #[test]
    fn a_queue_that_is_full_loses_what_does_not_fit_says_so_and_breaks_the_run_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("railway.db");
        let mut session =
            SessionJournal::with_queue(journal(&path), None, WhenFull::Lose, IfUnkept::GoOn, 2).unwrap();
        let other = Connection::open(&path).unwrap();
        other.execute_batch("BEGIN IMMEDIATE").unwrap();
        session.hand_over(&event(1));
        until(|| session.trouble().is_some());
        // Handed over faster than the thread empties its queue: at some number it is full.
        (2..100_000).for_each(|number| session.hand_over(&event(number)));
        let lost = session.shared.lost.load(Ordering::Relaxed);
        assert!(lost > 0);
        assert!(session.trouble().unwrap().ends_with(&format!("; {lost} events are lost")));
        other.execute_batch("ROLLBACK").unwrap();
        until(|| session.acknowledged() + lost == 99_999);
        session.hand_over(&event(200_000));
        let (kept, _) = session.finish();
        assert_eq!((kept.acknowledged, kept.lost), (100_000 - lost, lost));
        let runs = times(&path);
        assert!(runs.len() > 1);
        assert!(runs.iter().all(|run| run.is_sorted_by_key(|time| *time)));
        assert_eq!(runs.last().unwrap().last(), Some(&200_000));
    }
}
