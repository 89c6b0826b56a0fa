//! A machine with somebody beside it who writes down what it is told and what it decides.

use footplate_core::control::{Machine, Output};
use footplate_core::{Event, Timestamp};

use super::decision::Decision;
use super::input::Input;
use super::listener::Listener;
use crate::session_journal::Scribe;

/// A machine whose inputs are written down before it hears of them, and whose decisions before anybody acts on them.
#[derive(Debug)]
pub(crate) struct Witnessed<M> {
    machine: M,
    scribe: Option<Scribe>,
}

impl<M: Listener> Witnessed<M> {
    /// Without a scribe nobody writes.
    pub(crate) const fn new(machine: M, scribe: Option<Scribe>) -> Self {
        Self { machine, scribe }
    }

    /// The machine, to look at.
    pub(crate) const fn machine(&self) -> &M {
        &self.machine
    }

    /// Whoever ran it has had enough, at this time.
    pub(crate) fn end(mut self, now: Timestamp) -> M {
        self.note(now, &Input::End);
        self.machine
    }

    /// Somebody says something to it.
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

impl<M: Listener> Machine for Witnessed<M> {
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
