//! Between the control loop and those who watch it: the loop leaves things here and never waits.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use footplate_core::model::MotionModel;
use footplate_core::{Timestamp, TrainId};
use serde::Serialize;
use serde_json::json;
use tokio::sync::{oneshot, watch};

use super::history::{History, Sample};
use crate::session_journal::WrittenUntil;

/// Happenings that are kept for watchers who were away: a quarter of an hour of a busy railway.
const MOST_KEPT: usize = 4_000;
/// No browser draws more often than this: fifty pictures a second.
const BETWEEN_PICTURES: Duration = Duration::from_millis(20);
/// Pictures that are sent in a second to all watchers together: a few hundredths of a core.
const MOST_PICTURES_A_SECOND: u32 = 400;
/// More watchers than this are sent away: a lecture hall has fewer seats, and a process some thousand sockets.
const MOST_WATCHERS: usize = 2_000;
/// Orders that can wait for the loop, which looks every few hundredths of a second: more come from no person.
const MOST_WAITING: usize = 64;

/// Something that happened, with its number. Many watchers are sent the same text.
#[derive(Debug, Clone)]
pub(crate) struct Happening {
    /// One more than that of the one before.
    pub(crate) number: u64,
    /// What kind it is of: `line`, `passed`, `ended`, `alarm`.
    pub(crate) kind: &'static str,
    /// As JSON.
    pub(crate) json: Arc<str>,
}

/// How an order was taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Answer {
    /// It is being carried out; what comes of it is said in lines.
    Taken,
    /// It cannot be understood or carried out, and why.
    Refused(String),
}

/// What somebody asks of the control loop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Request {
    /// All trains stop and the track power goes off. It goes before everything else and always finds room.
    EmergencyStop,
    /// A line as the prompt understands it.
    Line(String),
}

/// A request that waits for the loop.
#[derive(Debug)]
pub(crate) struct Asked {
    pub(crate) request: Request,
    answer: oneshot::Sender<Answer>,
}

impl Asked {
    /// Tells whoever asked. They may have gone; nobody minds.
    pub(crate) fn answer(self, answer: Answer) {
        let _ = self.answer.send(answer);
    }
}

/// Orders cannot be taken: more wait than the loop has looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TooMany;

#[derive(Debug, Default)]
struct Log {
    happened: VecDeque<Happening>,
    /// The number of the next.
    next: u64,
}

/// Pictures, what happened, what was, and orders.
///
/// Pictures are views: one takes the place of the last, and who looks seldom sees few. What happened is kept, and whoever was
/// away finds what it missed, or is told how much is gone.
#[derive(Debug)]
pub(crate) struct Board {
    /// Tells lines of this session from those of another, which may have the same numbers.
    session: i64,
    picture: watch::Sender<Arc<str>>,
    log: Mutex<Log>,
    /// The number of the next happening, to wake those that wait for it.
    written: watch::Sender<u64>,
    histories: Mutex<BTreeMap<TrainId, History>>,
    models: Mutex<BTreeMap<TrainId, Arc<MotionModel>>>,
    waiting: Mutex<VecDeque<Asked>>,
    /// How far the session is written down, if it is.
    journal: Mutex<Option<WrittenUntil>>,
    /// Those who are sent events now.
    watchers: AtomicUsize,
}

impl Board {
    pub(crate) fn new(session: i64) -> Arc<Self> {
        Arc::new(Self {
            session,
            picture: watch::Sender::new("null".into()),
            log: Mutex::default(),
            written: watch::Sender::new(0),
            histories: Mutex::default(),
            models: Mutex::default(),
            waiting: Mutex::default(),
            journal: Mutex::default(),
            watchers: AtomicUsize::new(0),
        })
    }

    /// The session is written down from now on.
    pub(crate) fn follow_journal(&self, written: WrittenUntil) {
        *self.journal.lock().unwrap_or_else(PoisonError::into_inner) = Some(written);
    }

    /// All that happened before this is on the disk; `None` if nothing is written down.
    pub(super) fn written_until(&self, now: Timestamp) -> Option<Timestamp> {
        let journal = self.journal.lock().unwrap_or_else(PoisonError::into_inner);
        journal.as_ref().map(|written| written.at(now))
    }

    /// Shows something else from now on.
    pub(crate) fn show(&self, picture: &impl Serialize) {
        // What cannot be written as JSON is a mistake of ours that a test finds; the railway runs on.
        if let Ok(text) = serde_json::to_string(picture) {
            self.picture.send_replace(text.into());
        }
    }

    /// Says a line to everybody.
    pub(crate) fn say(&self, t_s: f64, text: &str) {
        self.tell("line", &json!({ "t_s": t_s, "text": text }));
    }

    /// Tells everybody that something happened.
    pub(crate) fn tell(&self, kind: &'static str, what: &impl Serialize) {
        let Ok(text) = serde_json::to_string(what) else { return };
        let mut log = lock(&self.log);
        let number = log.next;
        log.next += 1;
        log.happened.push_back(Happening { number, kind, json: text.into() });
        if log.happened.len() > MOST_KEPT {
            log.happened.pop_front();
        }
        drop(log);
        self.written.send_replace(number + 1);
    }

    /// Adds to what was. Whoever reads it at this moment is not waited for: what is left over comes with the next.
    pub(super) fn remember(&self, fresh: &mut Vec<(TrainId, Sample)>) {
        let Ok(mut histories) = self.histories.try_lock() else { return };
        for (train, sample) in fresh.drain(..) {
            histories.entry(train).or_default().add(sample);
        }
    }

    /// What was of a train; nothing if none of its number is driven.
    pub(super) fn history(&self, train: TrainId) -> Option<History> {
        lock(&self.histories).get(&train).cloned()
    }

    /// How a train moves is known better from now on.
    pub(super) fn know(&self, model: &MotionModel) {
        lock(&self.models).insert(model.train(), Arc::new(model.clone()));
    }

    /// How a train moves.
    pub(super) fn model(&self, train: TrainId) -> Option<Arc<MotionModel>> {
        lock(&self.models).get(&train).cloned()
    }

    /// The next thing that was asked for, until `None`.
    pub(crate) fn next_asked(&self) -> Option<Asked> {
        lock(&self.waiting).pop_front()
    }

    /// Asks for something.
    pub(crate) fn ask(&self, request: Request) -> Result<oneshot::Receiver<Answer>, TooMany> {
        let (answer, answered) = oneshot::channel();
        let mut waiting = lock(&self.waiting);
        match request {
            Request::EmergencyStop => waiting.push_front(Asked { request, answer }),
            Request::Line(_) if waiting.len() < MOST_WAITING => waiting.push_back(Asked { request, answer }),
            Request::Line(_) => return Err(TooMany),
        }
        Ok(answered)
    }

    pub(crate) fn pictures(&self) -> watch::Receiver<Arc<str>> {
        self.picture.subscribe()
    }

    pub(super) fn written(&self) -> watch::Receiver<u64> {
        self.written.subscribe()
    }

    /// Somebody begins to watch, unless too many do.
    pub(super) fn watch(self: &Arc<Self>) -> Option<Watching> {
        let before = self.watchers.fetch_add(1, Ordering::Relaxed);
        let watching = Watching(Arc::clone(self));
        (before < MOST_WATCHERS).then_some(watching)
    }

    /// What a happening is called, so that a browser that was away can say up to where it has heard.
    pub(super) fn name_of(&self, number: u64) -> String {
        format!("{}-{number}", self.session)
    }

    /// The number after that of a name; `None` for one of another session.
    pub(super) fn number_after(&self, name: &str) -> Option<u64> {
        let (session, number) = name.rsplit_once('-')?;
        (session.parse() == Ok(self.session)).then_some(number.parse::<u64>().ok()?.saturating_add(1))
    }

    /// What happened from a number on, and how much of it is gone.
    pub(crate) fn happened_from(&self, number: u64) -> (Vec<Happening>, u64) {
        let log = lock(&self.log);
        let first = log.happened.front().map_or(log.next, |happening| happening.number);
        let lost = first.saturating_sub(number);
        // Numbers have no gaps, so the place follows from the number.
        let from =
            usize::try_from(number.saturating_sub(first)).unwrap_or(usize::MAX).min(log.happened.len());
        (log.happened.range(from..).cloned().collect(), lost)
    }
}

/// One who is sent events, until it is dropped.
#[derive(Debug)]
pub(super) struct Watching(Arc<Board>);

impl Watching {
    /// Between two pictures: fifty a second for a few watchers, and fewer for each of many, so that all of them together
    /// take no more of a small machine.
    pub(super) fn pace(&self) -> Duration {
        let watchers = u32::try_from(self.0.watchers.load(Ordering::Relaxed)).unwrap_or(u32::MAX);
        BETWEEN_PICTURES.max(Duration::from_secs(1) / MOST_PICTURES_A_SECOND * watchers)
    }
}

impl Drop for Watching {
    fn drop(&mut self) {
        self.0.watchers.fetch_sub(1, Ordering::Relaxed);
    }
}

/// A thread that panicked while it held a lock left whole lines: they are moved in and out only.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_was_away_finds_what_was_said_and_how_much_is_gone() {
        let board = Board::new(7);
        for number in 0..MOST_KEPT + 10 {
            board.say(number as f64, "a line");
        }
        let (happened, lost) = board.happened_from(4);
        assert_eq!((happened.len(), lost), (MOST_KEPT, 6));
        assert_eq!(happened[0].number, 10);
        assert_eq!(board.happened_from(MOST_KEPT as u64 + 10).0.len(), 0);
        assert_eq!(board.number_after(&board.name_of(12)), Some(13));
        assert_eq!(board.number_after("8-12"), None, "of another session");
        assert_eq!(*board.written().borrow(), MOST_KEPT as u64 + 10);
    }

    #[test]
    fn many_watchers_share_the_pictures_and_too_many_are_sent_away() {
        let board = Board::new(7);
        let mut watching: Vec<Watching> = (0..8).filter_map(|_| board.watch()).collect();
        assert_eq!(watching[0].pace(), Duration::from_millis(20), "eight see fifty a second");
        watching.extend((8..MOST_WATCHERS).filter_map(|_| board.watch()));
        assert_eq!(watching.len(), MOST_WATCHERS);
        assert_eq!(watching[0].pace(), Duration::from_secs(5), "two thousand see one in five seconds");
        assert!(board.watch().is_none());
        watching.truncate(3);
        assert_eq!(watching[0].pace(), Duration::from_millis(20));
        assert!(board.watch().is_some());
    }

    #[test]
    fn an_emergency_stop_goes_first_however_many_wait() {
        let board = Board::new(7);
        for _ in 0..MOST_WAITING {
            drop(board.ask(Request::Line("where".into())).expect("room"));
        }
        assert!(board.ask(Request::Line("where".into())).is_err());
        let mut answered = board.ask(Request::EmergencyStop).expect("always");
        let first = board.next_asked().expect("one waits");
        assert_eq!(first.request, Request::EmergencyStop);
        first.answer(Answer::Taken);
        assert_eq!(answered.try_recv(), Ok(Answer::Taken));
    }
}
