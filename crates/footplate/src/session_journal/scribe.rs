//! Records the inputs and decisions of a machine, in order with the session's events.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::SyncSender;

use footplate_core::Timestamp;
use footplate_store::{JournalEntry, Side, Traced};

use super::entry::{Entry, Shared, WhenFull};

/// Records one machine through the queue of its session, which keeps the order of all entries.
#[derive(Debug)]
pub(crate) struct Scribe {
    queue: SyncSender<Entry>,
    when_full: WhenFull,
    shared: Arc<Shared>,
    number: u64,
    /// Time of the machine's last input.
    at: Timestamp,
}

impl Scribe {
    pub(super) const fn new(queue: SyncSender<Entry>, when_full: WhenFull, shared: Arc<Shared>) -> Self {
        Self { queue, when_full, shared, number: 0, at: Timestamp::ZERO }
    }

    /// Records an input, before the machine receives it.
    pub(crate) fn input(&mut self, now: Timestamp, kind: &'static str, text: String) {
        self.at = now;
        self.write(Side::Input, kind, text);
    }

    /// Records a decision, before it takes effect.
    pub(crate) fn decision(&mut self, kind: &'static str, text: String) {
        self.write(Side::Decision, kind, text);
    }

    /// Passes an entry on. An entry that the queue refuses is counted as lost, and leaves a gap in the numbers.
    fn write(&mut self, side: Side, kind: &'static str, text: String) {
        let (number, time) = (self.number, self.at);
        self.number += 1;
        let traced = Traced { number, time, side, kind: Cow::Borrowed(kind), text };
        if !self.when_full.offer(&self.queue, Entry::Of(JournalEntry::Traced(traced))) {
            self.shared.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use footplate_core::{Event, EventKind, TrainId};
    use footplate_store::{Journal, Store};
    use rusqlite::Connection;

    use super::super::{IfUnkept, SessionJournal};
    use super::*;
    use crate::clock::now;
    use crate::runtime::Recorder;

    fn session(path: &std::path::Path, when_full: WhenFull, queue: usize) -> SessionJournal {
        let store = Store::open_or_create(path).unwrap().with_patience(Duration::from_millis(5)).unwrap();
        let journal = Journal::begin(store, "evening", "track-a", None, &[], now()).unwrap();
        SessionJournal::with_queue(journal, None, when_full, IfUnkept::GoOn, queue).unwrap()
    }

    fn event(number: i64) -> Event {
        Event { time: Timestamp::from_ns(number), kind: EventKind::Reverse { train: TrainId(24) } }
    }

    #[test]
    fn inputs_and_decisions_stand_among_the_events_and_ends_with_the_session() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("railway.db");
        let mut session = session(&path, WhenFull::Wait, 100);
        let mut scribe = session.begin_machine("drive", "{}".to_owned()).unwrap();
        for number in 0..500 {
            session.record(&[event(number)]).unwrap();
            scribe.input(Timestamp::from_ns(number), "event", number.to_string());
            scribe.decision("command", format!("upon {number}"));
        }
        // A scribe that is still there holds nothing up, and is not heard any more.
        let (kept, _) = session.finish();
        assert_eq!((kept.acknowledged, kept.lost), (500, 0));
        scribe.decision("command", "too late".to_owned());
        let store = Store::open(&path).unwrap();
        let machine = store.machines().unwrap()[0].key;
        let trace = store.trace(machine).unwrap();
        assert_eq!(trace.len(), 1_000);
        assert!(trace.iter().zip(0..).all(|(row, number)| row.number == number));
        assert_eq!((trace[999].time, trace[999].text.as_str()), (Timestamp::from_ns(499), "upon 499"));
    }

    #[test]
    fn what_a_full_queue_does_not_take_leaves_a_gap_in_the_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("railway.db");
        let mut session = session(&path, WhenFull::Lose, 2);
        let mut scribe = session.begin_machine("drive", "{}".to_owned()).unwrap();
        let other = Connection::open(&path).unwrap();
        other.execute_batch("BEGIN IMMEDIATE").unwrap();
        let in_use =
            |session: &SessionJournal| session.trouble().is_some_and(|trouble| trouble.contains("in use"));
        scribe.input(Timestamp::ZERO, "timeout", String::new());
        while !in_use(&session) {
            std::thread::sleep(Duration::from_millis(5));
        }
        (0..100_000).for_each(|number| scribe.input(Timestamp::from_ns(number), "timeout", String::new()));
        assert!(session.trouble().is_some_and(|trouble| trouble.ends_with("are lost")));
        other.execute_batch("ROLLBACK").unwrap();
        // Once there is room again, it goes on under its number.
        while in_use(&session) {
            std::thread::sleep(Duration::from_millis(20));
        }
        scribe.input(Timestamp::ZERO, "end", String::new());
        let numbers = scribe.number;
        let (kept, _) = session.finish();
        let store = Store::open(&path).unwrap();
        let trace = store.trace(store.machines().unwrap()[0].key).unwrap();
        assert_eq!(trace.len() as u64 + kept.lost, numbers);
        assert!(trace.iter().zip(0..).any(|(row, number)| row.number != number), "there is a gap");
        assert!(trace.is_sorted_by_key(|row| row.number));
    }
}
