//! A machine whose inputs and decisions are recorded.

use std::fmt::Debug;

use footplate_core::control::{Machine, Output};
use footplate_core::{Event, Timestamp};

use super::decision::Decision;
use super::input::Input;
use crate::session_journal::Scribe;

/// A machine whose inputs are recorded before it receives them, and whose decisions before they take effect.
#[derive(Debug)]
pub(crate) struct Recorded<M> {
    machine: M,
    scribe: Option<Scribe>,
}

impl<M: Listener> Recorded<M> {
    /// Joins them. Without a scribe nothing is recorded.
    pub(crate) const fn new(machine: M, scribe: Option<Scribe>) -> Self {
        Self { machine, scribe }
    }

    /// The machine.
    pub(crate) const fn machine(&self) -> &M {
        &self.machine
    }

    /// Ends the record at this time and returns the machine.
    pub(crate) fn end(mut self, now: Timestamp) -> M {
        self.note(now, &Input::End);
        self.machine
    }

    /// Returns the machine and leaves the record without an end.
    pub(crate) fn into_machine(self) -> M {
        self.machine
    }

    /// Records an input of a person or a program, and passes it on.
    pub(crate) fn handle_word(&mut self, now: Timestamp, word: &Input) {
        self.tell(now, word);
    }

    /// The same where there is an answer at once: `say` says it to the machine, as
    /// [`handle_word`](Listener::handle_word) does.
    pub(crate) fn ask<A>(&mut self, now: Timestamp, word: &Input, say: impl FnOnce(&mut M) -> A) -> A {
        self.note(now, word);
        say(&mut self.machine)
    }

    fn tell(&mut self, now: Timestamp, input: &Input) {
        self.note(now, input);
        self.machine.handle_input(now, input);
    }

    fn note(&mut self, now: Timestamp, input: &Input) {
        if let Some(scribe) = &mut self.scribe {
            let (kind, text) = input.written();
            scribe.input(now, kind, text);
        }
    }
}

impl<M: Listener> Machine for Recorded<M> {
    type Notice = M::Notice;

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        self.tell(now, &Input::Event(*event));
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.tell(now, &Input::Timeout);
    }

    fn poll_output(&mut self) -> Option<Output<M::Notice>> {
        let output = self.machine.poll_output()?;
        if let Some(scribe) = &mut self.scribe {
            let Decision { kind, text } = Decision::of(&output);
            scribe.decision(kind, text);
        }
        Some(output)
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        self.machine.next_timeout()
    }
}

/// A machine whose decisions follow from its inputs alone.
pub(crate) trait Listener: Machine<Notice: Debug> {
    /// Takes an input that comes from a person or a program. The default ignores it.
    fn handle_word(&mut self, _now: Timestamp, _word: &Input) {}

    /// Takes any input.
    fn handle_input(&mut self, now: Timestamp, input: &Input) {
        match input {
            Input::Event(event) => self.handle_event(now, event),
            Input::Timeout => self.handle_timeout(now),
            Input::End => {}
            word => self.handle_word(now, word),
        }
    }
}
