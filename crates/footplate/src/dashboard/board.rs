//! The exchange between the control loop and its watchers. The loop writes here and never waits.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use footplate_core::model::MotionModel;
use footplate_core::{Command, Timestamp, TrainId};
use footplate_store::Schedule;
use serde::Serialize;
use serde_json::json;
use tokio::sync::{broadcast, oneshot, watch};

use super::history::{History, Sample};
use crate::session_journal::WrittenUntil;

/// Events kept for watchers that reconnect: a quarter of an hour of a busy railway.
const MAX_EVENTS: usize = 4_000;
/// The shortest interval between pictures for one watcher: 50 a second.
const PICTURE_INTERVAL: Duration = Duration::from_millis(20);
/// Pictures a second for all watchers together: a few hundredths of a core.
const MAX_PICTURES_A_SECOND: u32 = 400;
/// The most watchers: more than a lecture hall seats, less than the sockets of a process.
const MAX_WATCHERS: usize = 2_000;
/// Requests that may wait for the loop, which reads them every few hundredths of a second: operators do not reach it.
const MAX_WAITING: usize = 64;
/// Refusals kept for a listener that is slow: more than all lines that can wait.
const MAX_REFUSALS: usize = 128;

/// An event with its number. All watchers share its text.
#[derive(Debug, Clone)]
pub(crate) struct BoardEvent {
    /// Consecutive.
    pub(crate) number: u64,
    /// The kind: `line`, `passed`, `ended` or `alarm`.
    pub(crate) kind: &'static str,
    /// The event as JSON.
    pub(crate) json: Arc<str>,
}

/// The answer to a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Answer {
    /// Accepted; lines of text report the result.
    Taken,
    /// Rejected, with the reason.
    Refused(String),
    /// What was asked for, as JSON.
    Found(String),
}

/// A request to the control loop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Request {
    /// Stop all trains and switch the track power off. It goes before all others and is never rejected.
    EmergencyStop,
    /// A line in the syntax of the prompt.
    Line(String),
    /// End an alarm: the operator has seen to it.
    EndAlarm(u64),
    /// Where simulated trains really are; a real railway does not know.
    Truth,
    /// Whether the lines of a schedule can be read.
    CheckSchedule(Schedule),
    /// The saved schedules have changed.
    SavedSchedules(Vec<Schedule>),
    /// Begin a schedule.
    RunSchedule(Schedule),
    /// End the schedule of this name.
    EndSchedule(String),
}

impl Request {
    /// Whether it is carried out although its client no longer waits for the answer: it stops trains, or only says what has changed.
    fn is_done_late(&self, only_stops: impl Fn(&str) -> bool) -> bool {
        match self {
            Self::EmergencyStop | Self::SavedSchedules(_) => true,
            Self::Line(line) => only_stops(line),
            _ => false,
        }
    }
}

/// A request that waits for the loop.
#[derive(Debug)]
pub(crate) struct PendingRequest {
    pub(crate) request: Request,
    answer: oneshot::Sender<Answer>,
}

impl PendingRequest {
    /// Sends the answer; a client that has disconnected does not get it.
    pub(crate) fn answer(self, answer: Answer) {
        let _ = self.answer.send(answer);
    }
}

/// The longest wait for the control loop, which reads requests every few hundredths of a second.
const LOOP_TIMEOUT: Duration = Duration::from_secs(2);

/// Why a request was not carried out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum NotDone {
    /// Too many requests wait.
    TooMany,
    /// Rejected, with the reason.
    Refused(String),
    /// The control loop has not answered in time.
    NoAnswer,
}

impl NotDone {
    /// The reason, for people.
    pub(crate) fn says(&self) -> &str {
        match self {
            Self::TooMany => "too many orders wait: ask again in a moment",
            Self::Refused(why) => why,
            Self::NoAnswer => "the control loop did not answer: is the link in order?",
        }
    }
}

/// What was not carried out after it had been accepted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Unfulfilled {
    /// The order of this line.
    Line(String),
    /// A command that the link did not send.
    Command(Command),
}

/// An accepted order that was not carried out, with the reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LateRefusal {
    pub(crate) of: Unfulfilled,
    pub(crate) why: String,
}

/// Rejected: too many requests are waiting.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TooMany;

#[derive(Debug, Default)]
struct Log {
    happened: VecDeque<BoardEvent>,
    /// The number of the next event.
    next: u64,
}

/// Pictures, events, history and requests of a session.
///
/// A picture replaces the one before it, so that slow watchers skip pictures. Events are kept: a watcher that
/// reconnects gets those it missed, or the number of those that were dropped.
#[derive(Debug)]
pub(crate) struct Board {
    /// Distinguishes the events of this session from those of another with the same numbers.
    session: i64,
    picture: watch::Sender<Arc<str>>,
    log: Mutex<Log>,
    /// The number of the next event; a change wakes the watchers.
    written: watch::Sender<u64>,
    histories: Mutex<BTreeMap<TrainId, History>>,
    models: Mutex<BTreeMap<TrainId, Arc<MotionModel>>>,
    waiting: Mutex<VecDeque<PendingRequest>>,
    /// Orders that were refused after they had been accepted, for the programs that gave them.
    refusals: broadcast::Sender<LateRefusal>,
    /// How much of the session is on disk, if it is recorded.
    journal: Mutex<Option<WrittenUntil>>,
    /// The number of connected watchers.
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
            refusals: broadcast::Sender::new(MAX_REFUSALS),
            journal: Mutex::default(),
            watchers: AtomicUsize::new(0),
        })
    }

    /// The session is recorded from now on.
    pub(crate) fn follow_journal(&self, written: WrittenUntil) {
        *self.journal.lock().unwrap_or_else(PoisonError::into_inner) = Some(written);
    }

    /// Returns the time before which all events are on disk; `None` if the session is not recorded.
    pub(super) fn written_until(&self, now: Timestamp) -> Option<Timestamp> {
        let journal = self.journal.lock().unwrap_or_else(PoisonError::into_inner);
        journal.as_ref().map(|written| written.at(now))
    }

    /// Replaces the picture.
    pub(crate) fn show(&self, picture: &impl Serialize) {
        // A failure to write JSON is a bug that a test finds; it must not stop the railway.
        if let Ok(text) = serde_json::to_string(picture) {
            self.picture.send_replace(text.into());
        }
    }

    /// Publishes a line of text.
    pub(crate) fn say(&self, t_s: f64, text: &str) {
        self.publish("line", &json!({ "t_s": t_s, "text": text }));
    }

    /// Publishes that an accepted order was not carried out.
    pub(crate) fn refuse(&self, of: Unfulfilled, why: &str) {
        // Without a listener there is no one to answer.
        let _ = self.refusals.send(LateRefusal { of, why: why.to_owned() });
    }

    /// The orders that are refused from now on although they were accepted.
    pub(crate) fn refusals(&self) -> broadcast::Receiver<LateRefusal> {
        self.refusals.subscribe()
    }

    /// Publishes an event.
    pub(crate) fn publish(&self, kind: &'static str, what: &impl Serialize) {
        let Ok(text) = serde_json::to_string(what) else { return };
        let mut log = lock(&self.log);
        let number = log.next;
        log.next += 1;
        log.happened.push_back(BoardEvent { number, kind, json: text.into() });
        if log.happened.len() > MAX_EVENTS {
            log.happened.pop_front();
        }
        drop(log);
        self.written.send_replace(number + 1);
    }

    /// Appends to the histories. If a reader has them locked, the samples stay in `fresh` for the next call.
    pub(super) fn remember(&self, fresh: &mut Vec<(TrainId, Sample)>) {
        let Ok(mut histories) = self.histories.try_lock() else { return };
        for (train, sample) in fresh.drain(..) {
            histories.entry(train).or_default().add(sample);
        }
    }

    /// The history of a train; `None` if the session has no such train.
    pub(super) fn history(&self, train: TrainId) -> Option<History> {
        lock(&self.histories).get(&train).cloned()
    }

    /// Replaces the motion model of a train.
    pub(super) fn know(&self, model: &MotionModel) {
        lock(&self.models).insert(model.train(), Arc::new(model.clone()));
    }

    /// The motion model of a train.
    pub(crate) fn model(&self, train: TrainId) -> Option<Arc<MotionModel>> {
        lock(&self.models).get(&train).cloned()
    }

    /// The next request, until `None`. A client that has waited too long was answered that nothing was done, and its order is not carried
    /// out later; a line that only stops trains is.
    pub(crate) fn next_request(&self, only_stops: impl Fn(&str) -> bool) -> Option<PendingRequest> {
        let mut waiting = lock(&self.waiting);
        loop {
            let next = waiting.pop_front()?;
            if !next.answer.is_closed() || next.request.is_done_late(&only_stops) {
                return Some(next);
            }
        }
    }

    /// Adds a request.
    pub(crate) fn ask(&self, request: Request) -> Result<oneshot::Receiver<Answer>, TooMany> {
        let (answer, answered) = oneshot::channel();
        let mut waiting = lock(&self.waiting);
        match request {
            Request::EmergencyStop => waiting.push_front(PendingRequest { request, answer }),
            _ if waiting.len() < MAX_WAITING => waiting.push_back(PendingRequest { request, answer }),
            _ => return Err(TooMany),
        }
        Ok(answered)
    }

    /// Adds a request and waits for the control loop's answer, which is JSON if something was asked for.
    pub(crate) async fn ask_and_wait(&self, request: Request) -> Result<Option<String>, NotDone> {
        let answered = self.ask(request).map_err(|TooMany| NotDone::TooMany)?;
        match tokio::time::timeout(LOOP_TIMEOUT, answered).await {
            Ok(Ok(Answer::Taken)) => Ok(None),
            Ok(Ok(Answer::Found(json))) => Ok(Some(json)),
            Ok(Ok(Answer::Refused(why))) => Err(NotDone::Refused(why)),
            _ => Err(NotDone::NoAnswer),
        }
    }

    pub(crate) fn pictures(&self) -> watch::Receiver<Arc<str>> {
        self.picture.subscribe()
    }

    pub(super) fn written(&self) -> watch::Receiver<u64> {
        self.written.subscribe()
    }

    /// Registers a watcher; `None` if there are too many.
    pub(super) fn watch(self: &Arc<Self>) -> Option<WatcherSlot> {
        let before = self.watchers.fetch_add(1, Ordering::Relaxed);
        let watching = WatcherSlot(Arc::clone(self));
        (before < MAX_WATCHERS).then_some(watching)
    }

    /// The id of an event in the stream, which a browser repeats when it reconnects.
    pub(super) fn name_of(&self, number: u64) -> String {
        format!("{}-{number}", self.session)
    }

    /// The number after the event with this id; `None` for one of another session.
    pub(super) fn number_after(&self, name: &str) -> Option<u64> {
        let (session, number) = name.rsplit_once('-')?;
        (session.parse() == Ok(self.session)).then_some(number.parse::<u64>().ok()?.saturating_add(1))
    }

    /// The events from a number on, and how many of those have been dropped.
    pub(crate) fn events_from(&self, number: u64) -> (Vec<BoardEvent>, u64) {
        let log = lock(&self.log);
        let first = log.happened.front().map_or(log.next, |happening| happening.number);
        let lost = first.saturating_sub(number);
        // Numbers are consecutive, so that the index follows from the number.
        let from =
            usize::try_from(number.saturating_sub(first)).unwrap_or(usize::MAX).min(log.happened.len());
        (log.happened.range(from..).cloned().collect(), lost)
    }
}

/// A registered watcher, until it is dropped.
#[derive(Debug)]
pub(super) struct WatcherSlot(Arc<Board>);

impl WatcherSlot {
    /// The interval between two pictures for this watcher: it grows with the number of watchers, which limits their
    /// total load.
    pub(super) fn pace(&self) -> Duration {
        let watchers = u32::try_from(self.0.watchers.load(Ordering::Relaxed)).unwrap_or(u32::MAX);
        PICTURE_INTERVAL.max(Duration::from_secs(1) / MAX_PICTURES_A_SECOND * watchers)
    }
}

impl Drop for WatcherSlot {
    fn drop(&mut self) {
        self.0.watchers.fetch_sub(1, Ordering::Relaxed);
    }
}

/// A lock after a panic of its holder is still usable: its data is only moved in and out as a whole.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_watcher_that_reconnects_gets_missed_events_and_the_number_dropped() {
        let board = Board::new(7);
        for number in 0..MAX_EVENTS + 10 {
            board.say(number as f64, "a line");
        }
        let (happened, lost) = board.events_from(4);
        assert_eq!((happened.len(), lost), (MAX_EVENTS, 6));
        assert_eq!(happened[0].number, 10);
        assert_eq!(board.events_from(MAX_EVENTS as u64 + 10).0.len(), 0);
        assert_eq!(board.number_after(&board.name_of(12)), Some(13));
        assert_eq!(board.number_after("8-12"), None, "of another session");
        assert_eq!(*board.written().borrow(), MAX_EVENTS as u64 + 10);
    }

    #[test]
    fn many_watchers_share_the_pictures_and_too_many_are_sent_away() {
        let board = Board::new(7);
        let mut watching: Vec<WatcherSlot> = (0..8).filter_map(|_| board.watch()).collect();
        assert_eq!(watching[0].pace(), Duration::from_millis(20), "eight see fifty a second");
        watching.extend((8..MAX_WATCHERS).filter_map(|_| board.watch()));
        assert_eq!(watching.len(), MAX_WATCHERS);
        assert_eq!(watching[0].pace(), Duration::from_secs(5), "two thousand see one in five seconds");
        assert!(board.watch().is_none());
        watching.truncate(3);
        assert_eq!(watching[0].pace(), Duration::from_millis(20));
        assert!(board.watch().is_some());
    }

    #[test]
    fn an_emergency_stop_precedes_all_waiting_requests() {
        let board = Board::new(7);
        let ask = || board.ask(Request::Line("where".into())).expect("room");
        let _waiting: Vec<_> = (0..MAX_WAITING).map(|_| ask()).collect();
        assert!(board.ask(Request::Line("where".into())).is_err());
        let mut answered = board.ask(Request::EmergencyStop).expect("always");
        let first = board.next_request(|_| false).expect("one waits");
        assert_eq!(first.request, Request::EmergencyStop);
        first.answer(Answer::Taken);
        assert_eq!(answered.try_recv(), Ok(Answer::Taken));
    }

    #[test]
    fn what_was_answered_with_a_timeout_is_not_carried_out_later_unless_it_stops_trains() {
        let board = Board::new(7);
        for line in ["speed 24 8", "reverse 24", "stop 24", "power on"] {
            drop(board.ask(Request::Line(line.into())).expect("room"));
        }
        let _waits = board.ask(Request::Line("speed 58 8".into())).expect("room");
        drop(board.ask(Request::EmergencyStop).expect("always"));
        let carried_out = std::iter::from_fn(|| board.next_request(|line| line == "stop 24"))
            .map(|pending| pending.request);
        let expected = ["stop 24", "speed 58 8"].map(|line| Request::Line(line.into()));
        assert!(carried_out.eq([Request::EmergencyStop].into_iter().chain(expected)));
    }
}
