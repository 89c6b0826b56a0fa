//! Chooses the next poll, and whether there is time for it.

use footplate_core::{SensorId, TimeSpan, Timestamp};

use super::codec::Message;
use super::exchange::longest_poll;
use super::line::time_on_line;
use super::module_reads::{ModuleReads, ReadsProbe};
use super::readings::Readings;
use super::reply_time::ReplyTime;
use super::s88::INPUTS_PER_MODULE;
use super::solenoid::Solenoid;

/// While one module is watched, all are asked this often: an input elsewhere is kept by its module and so not
/// missed, only less well dated, and a poll of five modules takes 60 ms, an eighth of the line's time.
const ALL_EVERY: TimeSpan = TimeSpan::from_ms(500);

/// How long the line stays held after the time at which the command was to leave; then it is not expected any more.
const HOLD_GRACE: TimeSpan = TimeSpan::from_ms(10);

/// Bytes of the longest command: the line is kept free for the whole of it, up to its last bit.
const COMMAND_BYTES: u32 = 2;

/// The modules, and when each was polled last.
#[derive(Debug, Clone)]
pub(super) struct Polls {
    modules: u8,
    watched: Option<u8>,
    held_until: Option<Timestamp>,
    asked_all: Option<Timestamp>,
    reads: ReadsProbe,
}

impl Polls {
    pub(super) fn new(modules: u8) -> Self {
        Self { modules, watched: None, held_until: None, asked_all: None, reads: ReadsProbe::default() }
    }

    pub(super) fn hold(&mut self, until: Option<Timestamp>) {
        self.held_until = until;
    }

    pub(super) fn watch(&mut self, sensor: Option<SensorId>) {
        let module = sensor.and_then(|sensor| u8::try_from(sensor.0 / INPUTS_PER_MODULE + 1).ok());
        self.watched = module.filter(|module| *module <= self.modules);
    }

    pub(super) fn asked(&mut self, at: Timestamp, request: Message) {
        if matches!(request, Message::ReadModules { .. }) {
            self.asked_all = Some(at);
        }
    }

    /// A whole reply has come; returns what has been found by it of the interface.
    pub(super) fn answered(&mut self, request: Message) -> Option<ModuleReads> {
        self.reads.answered(request)
    }

    /// A reply did not come whole; `found` bytes of it did. All modules are read next.
    pub(super) fn lost(&mut self, request: Message, found: usize) {
        self.asked_all = None;
        if found == 0 {
            self.reads.lost(request);
        }
    }

    /// Which reads the interface answers; `None` if unknown.
    pub(super) const fn reads(&self) -> Option<ModuleReads> {
        self.reads.found()
    }

    /// Forgets what was learnt: the station may be another one.
    pub(super) fn forget_reads(&mut self) {
        self.reads = ReadsProbe::default();
    }

    /// When the hold ends by itself.
    pub(super) fn hold_lapses(&self) -> Option<Timestamp> {
        self.held_until.map(|until| until + HOLD_GRACE)
    }

    /// The request for now, unless the line is wanted for something else before it could end. A solenoid has to be
    /// released in time although the reply is lost: `recovery` is how long it takes until the line is free then.
    pub(super) fn next(
        &mut self,
        now: Timestamp,
        readings: &Readings,
        solenoid: &Solenoid,
        reply_time: &ReplyTime,
        recovery: TimeSpan,
    ) -> Option<Message> {
        if self.hold_lapses().is_some_and(|lapses| now >= lapses) {
            self.held_until = None;
        }
        let free_until = self.held_until.map(|until| until - time_on_line(COMMAND_BYTES));
        let latest_release = solenoid.latest();
        let lost = reply_time.allowance() + recovery;
        let fits = |request: &Message| {
            free_until.is_none_or(|until| now + longest_poll(*request, reply_time.foreseen()) <= until)
                // A coil must be released in time even if the reply is lost.
                && latest_release.is_none_or(|latest| now + longest_poll(*request, lost) <= latest)
        };
        let all = Message::ReadModules { count: self.modules };
        let all_due = self.asked_all.is_none_or(|asked| now - asked >= ALL_EVERY);
        let one = Message::ReadModule { module: self.watched.unwrap_or_else(|| readings.oldest()) };
        // Reading one module takes as long as reading all of one.
        let reads = if self.modules == 1 { Some(ModuleReads::AllOnly) } else { self.reads.found() };
        let (first, second) = match reads {
            Some(ModuleReads::AllOnly) => (Some(all), None),
            Some(ModuleReads::Single) if self.watched.is_none() => (Some(all), Some(one)),
            // Single reads are tried once all modules have been read.
            None | Some(ModuleReads::Single) => (all_due.then_some(all), Some(one)),
        };
        first.into_iter().chain(second).find(fits)
    }
}
