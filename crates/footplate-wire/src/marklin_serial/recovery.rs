//! The words that bring the interface back into step after bytes may have been lost.
//!
//! An interface that waits for the second byte of a message takes the next byte for it, whatever that is. One word
//! about power is therefore enough to bring it into step: it is swallowed or obeyed, and does no harm either way. After
//! the first lost reply no more is said before the next read, so that sensors are read again soon; a solenoid that the
//! swallowed word may have powered is released after the reply. When that read is lost, too, or the line has just been
//! opened, the station may have been restarted: then the power and the reset mode are said as well.

use alloc::collections::VecDeque;

use super::codec::Message;

/// What still has to be said, and whether the interface can be out of step.
#[derive(Debug, Clone, Default)]
pub(super) struct Recovery {
    words: VecDeque<Message>,
    /// The solenoids are to be released once a whole reply has come.
    releases_later: bool,
    /// Nothing was answered since the last recovery began.
    is_unanswered: bool,
    /// The interface may take the next byte for the second one of a message.
    is_out_of_step: bool,
    /// The last frame on the line was one of these words.
    has_just_spoken: bool,
}

impl Recovery {
    /// After a disturbance: as little as brings it into step, unless that was tried and not answered.
    pub(super) fn begin(&mut self, power: Message) {
        if self.is_unanswered {
            return self.begin_anew(power);
        }
        self.words.clear();
        self.words.push_back(power);
        (self.releases_later, self.is_unanswered, self.is_out_of_step) = (true, true, true);
    }

    /// Everything that an interface has to know of which nothing is known.
    pub(super) fn begin_anew(&mut self, power: Message) {
        self.words.clear();
        // The first may be swallowed.
        self.words.extend([power, power, Message::SolenoidOff, Message::ResetMode { on: true }]);
        (self.releases_later, self.is_unanswered, self.is_out_of_step) = (false, true, true);
    }

    /// The next word. A release is left out while a solenoid is powered on purpose.
    pub(super) fn next(&mut self, solenoid_is_powered: bool) -> Option<Message> {
        let word = self.words.pop_front()?;
        if word == Message::SolenoidOff && solenoid_is_powered { self.words.pop_front() } else { Some(word) }
    }

    /// A frame has left; whether it was a word of these.
    pub(super) fn spoke(&mut self, is_word: bool) {
        self.is_out_of_step &= !is_word;
        self.has_just_spoken = is_word;
    }

    /// A whole reply has come.
    pub(super) fn answered(&mut self) {
        self.is_unanswered = false;
        if core::mem::take(&mut self.releases_later) {
            self.words.push_back(Message::SolenoidOff);
        }
    }

    /// The interface was in step all the time.
    pub(super) fn cancel(&mut self) {
        *self = Self::default();
    }

    pub(super) const fn is_out_of_step(&self) -> bool {
        self.is_out_of_step
    }

    /// Whether a stop may follow the last word as its next byte would.
    pub(super) const fn has_just_spoken(&self) -> bool {
        self.has_just_spoken
    }
}
