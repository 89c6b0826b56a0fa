//! The loop between a line, a session and a machine.

use std::time::Duration;

use footplate_core::control::{Machine, Output};
use footplate_core::{Event, TimeSpan, Timestamp, TrainId};
use footplate_store::Direction;
use footplate_wire::{BlockReports, Closing, LinkNotice, ReportedFunctions, Session, Transmit};

use super::attendant::{Attendant, Recorder, Wish};
use super::ending::{Ended, REOPEN_WITHIN, SECOND_CHANCE, WITHIN};
use super::last_will::LastWill;
use super::stop_flag::StopFlag;
use crate::link::{Heard, Link, Lost, OpenSession};
use crate::standard_error::say;

/// A machine that was woken and still asks for a past time is woken again after this time, so that time always advances:
/// the duration of a byte on the line.
const NEXT_WAKING: TimeSpan = TimeSpan::from_ms(5);

/// Between two attempts to open a line again.
const REOPEN_EVERY: Duration = Duration::from_millis(250);

/// A line that opens so often and is lost again each time before the station has answered is given up: the server accepts
/// connections and closes them, as one does that allows a single client.
const REOPENED_IN_VAIN: u32 = 4;

/// A line, a session over it and the recorder.
///
/// When it is dropped, at its end, after an error or in a panic, it commands all trains to stop first.
pub(crate) struct Runtime<'r, L: Link> {
    link: L,
    session: Box<dyn Session>,
    blocks: Option<BlockReports>,
    recorder: Option<&'r mut dyn Recorder>,
    stop: Option<StopFlag>,
    /// Entries that are not recorded yet; reused, so that no byte costs an allocation.
    fresh: Vec<Event>,
    notices: Vec<LinkNotice>,
    /// What the station reported of functions and the attendant has not taken yet.
    functions: Vec<(TrainId, ReportedFunctions)>,
    /// Speeds that decoders reported and the attendant has not taken yet.
    speeds: Vec<(TrainId, u16)>,
    will: LastWill,
    /// How often the line was opened again since the station answered last.
    reopened: u32,
    /// Whether the station has answered since the line was opened last.
    has_answered: bool,
    is_closed: bool,
}

/// What interrupts a turn of the loop.
enum Broken {
    Lost(Lost),
    Recorder(anyhow::Error),
}

impl<'r, L: Link> Runtime<'r, L> {
    /// Joins them. `stop` is the flag that ends a run, if signals may end it.
    pub(crate) fn new(
        link: L,
        session: impl Into<OpenSession>,
        recorder: Option<&'r mut dyn Recorder>,
        stop: Option<StopFlag>,
    ) -> Self {
        let OpenSession { mut session, blocks } = session.into();
        if let Some(up) = link.cts() {
            session.handle_cts(link.now(), up);
        }
        let (fresh, notices, functions) = (Vec::new(), Vec::new(), Vec::new());
        Self {
            link,
            session,
            blocks,
            recorder,
            stop,
            fresh,
            notices,
            functions,
            speeds: Vec::new(),
            will: LastWill::new(),
            reopened: 0,
            has_answered: false,
            is_closed: false,
        }
    }

    /// The line.
    pub(crate) fn link(&self) -> &L {
        &self.link
    }

    /// The line, mutably: to change a simulated world.
    pub(crate) fn link_mut(&mut self) -> &mut L {
        &mut self.link
    }

    /// The session with the station.
    pub(crate) fn session(&self) -> &dyn Session {
        self.session.as_ref()
    }

    /// Runs until the attendant or a signal ends it, or the line is lost. The session stays open: another machine may
    /// continue with it.
    ///
    /// # Errors
    /// The recorder failed.
    pub(crate) fn run<M: Machine>(
        &mut self,
        machine: &mut M,
        attendant: &mut dyn Attendant<M>,
    ) -> anyhow::Result<Ended> {
        let mut unanswered: Option<(Timestamp, String)> = None;
        let mut attended = self.link.now();
        self.ask(machine, attendant);
        let mut wakes = machine.next_timeout();
        loop {
            let now = self.link.now();
            let mut eventful = match self.serve(machine) {
                Ok(eventful) => eventful,
                Err(Broken::Recorder(error)) => return Err(error),
                Err(Broken::Lost(lost)) => match self.open_again(lost, attendant) {
                    Ok(()) => false,
                    Err(lost) => return Ok(Ended::LineLost(lost)),
                },
            };
            for notice in self.notices.drain(..) {
                judge(&mut unanswered, now, &notice);
                attendant.hear_of_line(now, &notice);
            }
            for (train, reported) in self.functions.drain(..) {
                attendant.hear_of_functions(train, reported);
            }
            for (train, number) in self.speeds.drain(..) {
                attendant.hear_of_speed(train, number);
            }
            if unanswered.as_ref().is_some_and(|(until, _)| now >= *until)
                && let Some((_, why)) = unanswered.take()
            {
                return Ok(Ended::NoAnswer(why));
            }
            if eventful || now - attended >= self.link.patience() {
                attended = now;
                if self.stop.is_some_and(StopFlag::is_up) {
                    return Ok(Ended::Interrupted);
                }
                self.ask(machine, attendant);
                if let Some(blocks) = &self.blocks {
                    attendant.see_blocks(blocks);
                }
                if attendant.attend(now, machine) == Wish::Finish {
                    return Ok(Ended::Finished);
                }
                eventful = true;
            }
            let is_woken = wakes.is_some_and(|at| now >= at);
            if is_woken {
                machine.handle_timeout(now);
            }
            if is_woken || eventful {
                self.ask(machine, attendant);
                wakes = next_waking(machine, now, is_woken);
            }
            if self.session.next_timeout().is_some_and(|at| now >= at) {
                self.session.handle_timeout(now);
            }
            if let Err(lost) = self.write() {
                match self.open_again(lost, attendant) {
                    Ok(()) => continue,
                    Err(lost) => return Ok(Ended::LineLost(lost)),
                }
            }
            if !self.fresh.is_empty() || !self.notices.is_empty() {
                continue;
            }
            let until = (attended + self.link.patience()).max(now);
            let until = [wakes, self.session.next_timeout()].into_iter().flatten().fold(until, Ord::min);
            match self.link.wait(until) {
                Heard::Nothing => {}
                heard => {
                    // Commands that are due now precede the next poll, which may begin with this byte.
                    let now = self.link.now();
                    if wakes.is_some_and(|at| now >= at) {
                        machine.handle_timeout(now);
                        self.ask(machine, attendant);
                        wakes = next_waking(machine, now, true);
                    }
                    match heard {
                        Heard::Byte(byte) => self.session.handle_bytes(now, &[byte]),
                        Heard::Datagram(datagram) => self.session.handle_bytes(now, &datagram),
                        Heard::Cts(up) => self.session.handle_cts(now, up),
                        Heard::Lost(lost) => {
                            if let Err(lost) = self.open_again(lost, attendant) {
                                return Ok(Ended::LineLost(lost));
                            }
                        }
                        Heard::Nothing => {}
                    }
                }
            }
        }
    }

    /// Takes the session's outputs. Entries are recorded before the machine receives them.
    fn serve<M: Machine>(&mut self, machine: &mut M) -> Result<bool, Broken> {
        self.write().map_err(Broken::Lost)?;
        if self.fresh.is_empty() {
            return Ok(false);
        }
        self.write_down().map_err(Broken::Recorder)?;
        let now = self.link.now();
        for event in self.fresh.drain(..) {
            machine.handle_event(now, &event);
        }
        Ok(true)
    }

    fn write_down(&mut self) -> anyhow::Result<()> {
        match &mut self.recorder {
            Some(recorder) => recorder.record(&self.fresh),
            None => Ok(()),
        }
    }

    /// Writes the session's bytes to the line; collects its entries and notices.
    fn write(&mut self) -> Result<(), Lost> {
        self.will.keep(self.session.as_ref(), &mut self.link)?;
        while let Some(output) = self.session.poll_output() {
            let output = match &mut self.blocks {
                Some(blocks) => blocks.take(output),
                None => Some(output),
            };
            let Some(output) = output else { continue };
            match output {
                Transmit::Byte(byte) => self.link.write(&[byte])?,
                Transmit::Message(bytes) => self.link.write(&bytes)?,
                Transmit::Event(event) => {
                    self.will.left(&event);
                    self.fresh.push(event);
                }
                Transmit::Notice(notice) => {
                    if notice == LinkNotice::Answers {
                        (self.reopened, self.has_answered) = (0, true);
                    }
                    // A station that fell silent may still be there, and only this connection to it gone.
                    let is_half_open = matches!(notice, LinkNotice::Silent { .. })
                        && self.link.may_be_half_open()
                        && std::mem::take(&mut self.has_answered);
                    let lost = is_half_open.then(|| Lost(notice.to_string()));
                    self.notices.push(notice);
                    if let Some(lost) = lost {
                        return Err(lost);
                    }
                }
                Transmit::Functions(train, reported) => self.functions.push((train, reported)),
                Transmit::ReportedSpeed(train, number) => self.speeds.push((train, number)),
                Transmit::Direction(train, forward) => {
                    self.will.directed();
                    if let Some(recorder) = &mut self.recorder {
                        recorder.record_direction(Direction { train, forward });
                    }
                }
            }
        }
        self.will.keep(self.session.as_ref(), &mut self.link)
    }

    /// Takes the machine's outputs.
    fn ask<M: Machine>(&mut self, machine: &mut M, attendant: &mut dyn Attendant<M>) {
        let now = self.link.now();
        while let Some(output) = machine.poll_output() {
            match output {
                Output::Command(command) => match self.session.handle_command(now, command) {
                    Ok(()) => self.will.accepted(now, command),
                    Err(error) => attendant.hear_of_refusal(now, command, error),
                },
                Output::HoldLine(until) => self.session.hold_line(until),
                Output::Watch(sensor) => {
                    let input = |sensor| self.blocks.as_ref().map_or(sensor, |blocks| blocks.input(sensor));
                    self.session.watch(sensor.map(input));
                }
                Output::Notice(notice) => attendant.hear(now, notice),
            }
        }
    }

    /// Tries to reopen a lost line: a plug may be pushed in again, a server restarted.
    fn open_again<M: Machine>(&mut self, lost: Lost, attendant: &mut dyn Attendant<M>) -> Result<(), Lost> {
        if self.reopened >= REOPENED_IN_VAIN {
            return Err(Lost(format!(
                "{lost}, {} times in a row without an answer: another program may be connected to the station already, or \
                 the port belongs to something else; check address and port",
                self.reopened + 1
            )));
        }
        self.reopened += 1;
        self.has_answered = false;
        let now = self.link.now();
        self.notices.drain(..).for_each(|notice| attendant.hear_of_line(now, &notice));
        attendant.read(&format!("{lost}; trying to open it again for {} s", REOPEN_WITHIN.as_secs()));
        let began = self.link.real_time();
        // Where the guardian has failed, the line itself is there.
        let mut pause = if self.link.is_without_guardian() { Duration::ZERO } else { REOPEN_EVERY };
        while self.link.real_time() - began < REOPEN_WITHIN && !self.stop.is_some_and(StopFlag::is_up) {
            self.link.pause(std::mem::replace(&mut pause, REOPEN_EVERY));
            if self.link.reopen().is_ok() {
                let now = self.reopened();
                attendant.hear_of_line(now, &LinkNotice::Reopened);
                return Ok(());
            }
        }
        Err(lost)
    }

    /// Stops all trains, releases solenoids and switches the track power off. Returns what the station confirmed. Takes a few
    /// seconds at most, whatever the line does, unless a guardian that would go on has failed: then this process tries as it would,
    /// until the station has confirmed everything.
    pub(crate) fn close(&mut self) -> Closing {
        if !std::mem::replace(&mut self.is_closed, true) {
            let before = self.session.copied();
            let mut has_reopened = false;
            while self.say_goodbye().and_then(|()| self.release_guardian()).is_err() {
                let is_alone = self.link.is_without_guardian();
                if !is_alone && std::mem::replace(&mut has_reopened, true)
                    || !self.reopen_for_farewell(before.as_ref())
                {
                    break;
                }
            }
        }
        self.session.closing()
    }

    /// Opens the line again to say goodbye once more, until it is open where nothing else is left to stop trains.
    fn reopen_for_farewell(&mut self, before: &dyn Session) -> bool {
        while self.link.reopen().is_err() {
            if !self.link.is_without_guardian() {
                return false;
            }
            self.link.pause(REOPEN_EVERY);
        }
        // What was given to a guardian that failed or lost the line may not have been written: all is said again.
        self.session = before.copied();
        while self.session.poll_output().is_some() {}
        self.reopened();
        true
    }

    /// Lets the guardian know that no train is left to stop.
    fn release_guardian(&mut self) -> Result<(), Lost> {
        let closing = self.session.closing();
        let is_complete = closing.is_complete();
        if !is_complete && self.link.is_without_guardian() {
            let lost = format!("{closing}; all of it is commanded again");
            say!("{lost}");
            return Err(Lost(lost));
        }
        match self.link.guardian() {
            Some(guardian) if is_complete => guardian.say_goodbye(),
            _ => Ok(()),
        }
    }

    fn reopened(&mut self) -> Timestamp {
        let now = self.link.now();
        self.session.handle_reopened(now);
        if let Some(up) = self.link.cts() {
            self.session.handle_cts(now, up);
        }
        now
    }

    fn say_goodbye(&mut self) -> Result<(), Lost> {
        let (began, since) = (self.link.now(), self.link.real_time());
        self.session.close(began);
        loop {
            self.write()?;
            // The last commands belong to the record, but a failing record must not keep a train running.
            if !self.fresh.is_empty() {
                if let Err(error) = self.write_down() {
                    say!("the last commands were not recorded: {error:#}");
                }
                self.fresh.clear();
            }
            self.notices.clear();
            self.functions.clear();
            self.speeds.clear();
            let now = self.link.now();
            let waited = self.link.real_time() - since;
            let late = now - began >= WITHIN || waited.as_secs_f64() >= WITHIN.as_s();
            if late || self.session.closing().is_complete() {
                return Ok(());
            }
            let end = began + WITHIN;
            match self.link.wait(self.session.next_timeout().unwrap_or(end).min(end)) {
                Heard::Byte(byte) => self.session.handle_bytes(self.link.now(), &[byte]),
                Heard::Datagram(datagram) => self.session.handle_bytes(self.link.now(), &datagram),
                Heard::Cts(up) => self.session.handle_cts(self.link.now(), up),
                Heard::Nothing => self.session.handle_timeout(self.link.now()),
                Heard::Lost(lost) => return Err(lost),
            }
        }
    }
}

/// When to wake a machine next.
fn next_waking<M: Machine>(machine: &M, now: Timestamp, is_woken: bool) -> Option<Timestamp> {
    let asked = machine.next_timeout()?;
    Some(if is_woken && asked <= now { now + NEXT_WAKING } else { asked })
}

/// Updates the time until which a silent station may still answer.
fn judge(unanswered: &mut Option<(Timestamp, String)>, now: Timestamp, notice: &LinkNotice) {
    match notice {
        LinkNotice::Silent { .. } | LinkNotice::NotReady { .. } => {
            *unanswered = Some((now + SECOND_CHANCE, notice.to_string()));
        }
        LinkNotice::Answers => *unanswered = None,
        _ => {}
    }
}

impl<L: Link> Drop for Runtime<'_, L> {
    fn drop(&mut self) {
        if !self.is_closed {
            let closing = self.close();
            if std::thread::panicking() || !closing.is_complete() {
                say!("{closing}");
            }
        }
    }
}
