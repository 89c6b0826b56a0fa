//! A session, the station it speaks with, and the line between them.

use std::collections::BTreeMap;

use footplate_core::{
    Command, Event, EventKind, FunctionNumber, Report, SpeedStep, TimeSpan, Timestamp, TrainId,
};
use footplate_wire::{Closing, LinkNotice, ReportedFunctions, Session, Transmit};

pub(crate) const T24: TrainId = TrainId(24);
pub(crate) const T58: TrainId = TrainId(58);

pub(crate) fn ms(ms: i64) -> Timestamp {
    Timestamp::ZERO + TimeSpan::from_ms(ms)
}

pub(crate) fn speed(train: TrainId, step: u8) -> Command {
    Command::Speed { train, step: SpeedStep::new(step).unwrap() }
}

pub(crate) fn function(train: TrainId, number: u8, on: bool) -> Command {
    Command::Function { train, function: FunctionNumber::new(number).unwrap(), on }
}

/// The station's side of a line.
pub(crate) trait Station {
    /// What is written to it, as it reads it.
    type Written;
    /// From a request to the answer.
    const ANSWER: TimeSpan;

    /// Reads what the session wrote in one piece; returns it as read, and the answers.
    fn hear(&mut self, bytes: Vec<u8>) -> (Vec<Self::Written>, Vec<Vec<u8>>);
}

/// A session, the station, and the line between them.
pub(crate) struct Desk<C, S: Station> {
    pub(crate) client: C,
    pub(crate) now: Timestamp,
    pub(crate) station: S,
    /// Answers that have not arrived yet, and when they arrive.
    pub(crate) coming: Vec<(Timestamp, Vec<u8>)>,
    /// What was written, and when (ms).
    pub(crate) written: Vec<(i64, S::Written)>,
    pub(crate) events: Vec<Event>,
    pub(crate) notices: Vec<LinkNotice>,
    /// What the station has reported of each train's functions.
    pub(crate) functions: BTreeMap<TrainId, ReportedFunctions>,
    /// The directions that a later session has to know.
    pub(crate) directions: Vec<(TrainId, bool)>,
    /// The speeds that decoders reported.
    pub(crate) speeds: Vec<(TrainId, u16)>,
}

impl<C: Session, S: Station> Desk<C, S> {
    pub(crate) fn with(client: C, station: S) -> Self {
        let (coming, written, events, notices) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (functions, directions, speeds) = (BTreeMap::new(), Vec::new(), Vec::new());
        Self { client, now: ms(0), station, coming, written, events, notices, functions, directions, speeds }
    }

    pub(crate) fn run_until(&mut self, end: Timestamp) {
        loop {
            while let Some(output) = self.client.poll_output() {
                match output {
                    Transmit::Message(bytes) => {
                        let at = (self.now - ms(0)).as_ns() / 1_000_000;
                        let (written, answers) = self.station.hear(bytes);
                        self.written.extend(written.into_iter().map(|written| (at, written)));
                        let due = self.now + S::ANSWER;
                        self.coming.extend(answers.into_iter().map(|bytes| (due, bytes)));
                    }
                    Transmit::Event(event) => self.events.push(event),
                    Transmit::Notice(notice) => self.notices.push(notice),
                    Transmit::Functions(train, reported) => {
                        self.functions.insert(train, reported);
                    }
                    Transmit::ReportedSpeed(train, number) => self.speeds.push((train, number)),
                    Transmit::Direction(train, forward) => self.directions.push((train, forward)),
                    Transmit::Byte(byte) => unreachable!("a lone byte {byte}"),
                }
            }
            self.coming.sort_by_key(|(at, _)| *at);
            let next = [self.coming.first().map(|(at, _)| *at), self.client.next_timeout()];
            let Some(at) = next.into_iter().flatten().min().filter(|at| *at <= end) else { break };
            self.now = self.now.max(at);
            if self.coming.first().is_some_and(|(due, _)| *due <= at) {
                let (_, bytes) = self.coming.remove(0);
                self.client.handle_bytes(self.now, &bytes);
            } else {
                self.client.handle_timeout(at);
                let next = self.client.next_timeout();
                assert!(next.is_none_or(|next| next > at), "a session that is never done");
            }
        }
        self.now = end;
    }

    pub(crate) fn run_for(&mut self, span_ms: i64) {
        self.run_until(self.now + TimeSpan::from_ms(span_ms));
    }

    pub(crate) fn command(&mut self, command: Command) {
        self.client.handle_command(self.now, command).unwrap();
    }

    /// Drives two trains for half a second; nothing that was written until then counts.
    pub(crate) fn drive_two(&mut self) {
        for command in [speed(T24, 8), speed(T58, 9)] {
            self.command(command);
        }
        self.run_for(500);
        self.written.clear();
    }

    /// Ends the session, and waits for the station; returns how far the end has come.
    pub(crate) fn close(&mut self, span_ms: i64) -> Closing {
        self.client.close(self.now);
        self.run_for(span_ms);
        self.client.closing()
    }

    /// Hears bytes again and again; asserts that they are called noise once, with what to check.
    pub(crate) fn assert_noise(&mut self, times: usize, bytes: &[u8], check: &str) {
        for _ in 0..times {
            self.client.handle_bytes(self.now, bytes);
            self.run_for(20);
        }
        let is_noise = |notice: &&LinkNotice| matches!(notice, LinkNotice::Unreadable { .. });
        let noise: Vec<String> = self.notices.iter().filter(is_noise).map(ToString::to_string).collect();
        assert_eq!(noise.len(), 1);
        assert!(noise[0].contains(check), "{}", noise[0]);
    }

    /// Asserts that commands are refused, each with its reason.
    pub(crate) fn assert_refused(&mut self, refusals: &[(Command, &str)]) {
        for (command, reason) in refusals {
            assert_eq!(self.client.handle_command(self.now, *command).unwrap_err().to_string(), *reason);
        }
    }

    /// The reports of sensors: when, which, and the width of the span before it (ms).
    pub(crate) fn reports(&self) -> Vec<(i64, u16, i64)> {
        let report = |event: &Event| match event.kind {
            EventKind::Sensor(Report { sensor, poll_interval }) => {
                let at = (event.time - ms(0)).as_ns() / 1_000_000;
                Some((at, sensor.0, poll_interval.unwrap().as_ns() / 1_000_000))
            }
            _ => None,
        };
        self.events.iter().filter_map(report).collect()
    }
}
