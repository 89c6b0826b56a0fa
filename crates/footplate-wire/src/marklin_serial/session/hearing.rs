//! What becomes of the bytes that come: whole replies are read, all others dropped and the line brought into step.

use footplate_core::{Command, Event, EventKind, Report, SpeedStep, Timestamp};

use super::super::exchange::{Awaited, Exchange, Purpose, Quiet, Sending, reply_bytes};
use super::super::module_reads::ModuleReads;
use super::super::readings::Read;
use super::super::s88::decode_reply;
use super::Interface;
use crate::session::{LinkNotice, Transmit};

impl Interface {
    /// A reply did not come whole in time.
    pub(super) fn lose(&mut self, now: Timestamp, awaited: Awaited) -> bool {
        let found = self.reply.as_bytes().len();
        self.notify(LinkNotice::ReplyLost { expected: reply_bytes(awaited.request), found });
        self.silence.heard_stray(found);
        self.polls.lost(awaited.request, found);
        let silent = self.silence.lost(now);
        self.output.extend(silent.map(Transmit::Notice));
        if found > 0 {
            self.garbled(now);
        }
        self.distrust(now, awaited.heard);
        if let Exchange::Quiet(quiet) = &mut self.exchange {
            quiet.lost = Some(awaited);
        }
        true
    }

    /// Bytes may be lost in either direction: wait until the line has been silent for a while, bring the interface into
    /// step, and say again what it may have missed.
    pub(super) fn distrust(&mut self, now: Timestamp, heard: Timestamp) {
        // What was being said may have come half. A release is said again by itself.
        if let Exchange::Sending(sending @ Sending { purpose: Purpose::Command(command), .. }) = self.exchange
        {
            self.unanswered.push(command);
            // All its bytes may have arrived: the solenoid is released before another is powered.
            if let Command::Turnout { turnout, .. } = command
                && sending.next_byte().is_none()
            {
                self.solenoid.power(turnout, now);
            }
        }
        (self.disturbed, self.is_overtaken) = (false, false);
        self.exchange = Exchange::Quiet(Quiet::begin(now, heard, true));
        self.recovery.begin();
    }

    /// What the interface may have missed before the lost reply.
    fn say_again(&mut self) {
        for command in self.unanswered.take() {
            match command {
                Command::Reverse { train } => self.notify(LinkNotice::ReverseInDoubt(train)),
                // The power goes off as its last word.
                Command::PowerOff | Command::PowerOn | Command::Turnout { .. } if self.farewell.begun => {}
                Command::Speed { step, .. } if self.farewell.begun && step != SpeedStep::STAND => {}
                _ => {
                    if self.waiting.push_again(command) {
                        self.notify(LinkNotice::Repeated(command));
                    }
                }
            }
        }
    }

    /// A reply came whole and nothing more with it.
    pub(super) fn accept(&mut self, awaited: Awaited) -> bool {
        if let Ok(states) = decode_reply(awaited.request, self.reply.as_bytes()) {
            for state in states {
                self.readings.take(awaited.asked, state, |read| {
                    let is_released = |report: Report| self.released.contains(&report.sensor);
                    self.output.push_back(match read {
                        Read::Opened(Event { kind: EventKind::Freed(report), .. })
                            if !is_released(report) =>
                        {
                            return;
                        }
                        Read::Closed(event) | Read::Opened(event) => Transmit::Event(event),
                        Read::Held(sensor) => Transmit::Notice(LinkNotice::HeldClosed(sensor)),
                    });
                });
            }
        }
        if let Some(reads @ ModuleReads::AllOnly) = self.polls.answered(awaited.request) {
            self.notify(LinkNotice::LimitedReads { how: reads.text() });
        }
        let answers = self.silence.answered(self.now);
        self.output.extend(answers.map(Transmit::Notice));
        self.unanswered.clear();
        self.recovery.answered();
        self.solenoid.answered();
        self.pacing.answered();
        self.exchange = Exchange::Free;
        true
    }

    pub(super) fn keep_quiet(&mut self, now: Timestamp, quiet: Quiet) -> bool {
        // A line that babbles on must not burn a coil.
        let is_over = now >= quiet.until || self.solenoid.hurries(now);
        let release_is_due = self.solenoid.due().is_some_and(|due| now >= due);
        let command_may_go = self.waiting.has_next(|waiting| self.solenoid.lets(waiting));
        let interrupted = !quiet.is_uncertain && (self.farewell.begun || command_may_go || release_is_due);
        let overtakes = quiet.is_uncertain && self.waiting.has_urgent() && now >= quiet.stops_may_go();
        if is_over {
            self.complain(now);
            if quiet.is_uncertain {
                self.say_again();
            }
        } else if interrupted {
            // The interface is in step; only what it answers was disturbed. The silence begins anew after this.
            self.recovery.cancel();
            self.disturbed = true;
        } else if overtakes {
            // It is said again once the silence is over, because it may be lost in what is in transit.
            self.is_overtaken = true;
        }
        let goes_on = is_over || interrupted || overtakes;
        if goes_on {
            self.exchange = Exchange::Free;
        }
        goes_on
    }

    fn complain(&mut self, now: Timestamp) {
        if self.stray > 0 {
            self.notify(LinkNotice::UnexpectedBytes { count: self.stray });
            self.stray = 0;
            self.garbled(now);
        }
    }

    fn garbled(&mut self, now: Timestamp) {
        let notice = self.silence.garbled(now);
        self.output.extend(notice.map(Transmit::Notice));
    }

    pub(super) fn hear(&mut self, now: Timestamp, byte: u8) {
        match &mut self.exchange {
            Exchange::Awaiting(awaited) => {
                awaited.heard = now;
                let awaited = *awaited;
                self.reply.push(byte);
                if self.reply.as_bytes().len() == reply_bytes(awaited.request) {
                    self.heard_all(now, awaited);
                }
            }
            Exchange::Settling(awaited) => {
                let expected = reply_bytes(awaited.request);
                self.notify(LinkNotice::ReplyLost { expected, found: expected + 1 });
                self.garbled(now);
                self.exchange = Exchange::Quiet(Quiet::begin(now, now, false));
                self.recovery.begin();
            }
            Exchange::Quiet(quiet) => {
                quiet.disturb(now);
                if let Some(lost) = quiet.lost {
                    self.reply_time.missed(lost.late(now));
                }
                self.stray += 1;
                self.silence.heard_stray(1);
            }
            Exchange::Free | Exchange::Sending(_) => {
                self.disturbed = true;
                self.stray += 1;
                self.silence.heard_stray(1);
            }
        }
    }

    fn heard_all(&mut self, now: Timestamp, awaited: Awaited) {
        self.reply_time.answered(awaited.late(now));
        let states = decode_reply(awaited.request, self.reply.as_bytes());
        let news = states.is_ok_and(|mut states| states.any(|state| self.readings.shows_new(state)));
        if news {
            self.exchange = Exchange::Settling(awaited.settling(now));
        } else {
            self.accept(awaited);
        }
    }
}
