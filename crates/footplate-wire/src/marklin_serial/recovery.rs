//! The messages that synchronise the interface after bytes may have been lost.
//!
//! An interface that waits for the second byte of a message takes any next byte for it. One power message is therefore enough to
//! synchronise it: it is swallowed or obeyed, and harmless in both cases. After the first lost reply nothing else is sent before the next
//! read, so that sensors are read again soon; a solenoid that the swallowed message may have powered is released after the reply, and
//! the reset mode is set, without which every sensor reports once and never again. If that read is lost, too, or the line has just been
//! opened, the station may have been restarted: then power and reset mode are set as well, and again after the first answer, as a
//! station that is switched on hears nothing before that.

use alloc::collections::VecDeque;

use super::codec::Message;

/// A message of a recovery.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    /// Power on or off, as it is wanted when the message is sent.
    Power,
    SolenoidOff,
    ResetMode,
}

/// The messages still to send, and whether the interface may be out of step.
#[derive(Debug, Clone, Default)]
pub(super) struct Recovery {
    words: VecDeque<Word>,
    /// What is to be sent once a whole reply has come.
    later: Option<Word>,
    /// Nothing was answered since the last recovery began.
    is_unanswered: bool,
    /// The interface may take the next byte for the second one of a message.
    is_out_of_step: bool,
    /// The last frame on the line was one of these messages.
    has_just_spoken: bool,
}

impl Recovery {
    /// After a disturbance: as little as brings it into step, unless that was tried and not answered.
    pub(super) fn begin(&mut self) {
        if self.is_unanswered {
            self.begin_anew();
            self.later = Some(Word::Power);
            return;
        }
        self.words.clear();
        self.words.push_back(Word::Power);
        (self.later, self.is_unanswered, self.is_out_of_step) = (Some(Word::SolenoidOff), true, true);
    }

    /// All messages that an interface in an unknown state needs.
    pub(super) fn begin_anew(&mut self) {
        self.words.clear();
        // The first may be swallowed.
        self.words.extend([Word::Power, Word::Power, Word::SolenoidOff, Word::ResetMode]);
        (self.later, self.is_unanswered, self.is_out_of_step) = (None, true, true);
    }

    /// The next message; `power`: the one that switches the power as it is wanted now. A release is left out while a solenoid is
    /// powered on purpose.
    pub(super) fn next(&mut self, solenoid_is_powered: bool, power: Message) -> Option<Message> {
        let word = self.words.pop_front()?;
        let is_left_out = word == Word::SolenoidOff && solenoid_is_powered;
        Some(match if is_left_out { self.words.pop_front()? } else { word } {
            Word::Power => power,
            Word::SolenoidOff => Message::SolenoidOff,
            Word::ResetMode => Message::ResetMode { on: true },
        })
    }

    /// Notes a frame that has left; returns whether it was one of these messages.
    pub(super) fn spoke(&mut self, is_word: bool) {
        self.is_out_of_step &= !is_word;
        self.has_just_spoken = is_word;
    }

    /// A whole reply has come.
    pub(super) fn answered(&mut self) {
        self.is_unanswered = false;
        if let Some(later) = self.later.take() {
            // A byte that is swallowed as the address of a turnout powers a solenoid: the release comes last.
            self.words.extend([later, Word::ResetMode, Word::SolenoidOff]);
        }
    }

    /// Notes that the interface was in step.
    pub(super) fn cancel(&mut self) {
        *self = Self::default();
    }

    pub(super) const fn is_out_of_step(&self) -> bool {
        self.is_out_of_step
    }

    /// Whether a stop may directly follow the last message.
    pub(super) const fn has_just_spoken(&self) -> bool {
        self.has_just_spoken
    }
}
