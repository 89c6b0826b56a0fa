//! Polls, which find changes whose datagrams were lost.

use footplate_core::{TimeSpan, Timestamp};

use super::super::detectors::Feedback;
use super::super::outstanding::Awaited;
use super::super::request::Request;
use super::Client;
use crate::outstanding::Outgoing;
use crate::protocol::Protocol as _;

/// The interval between polls. They find changes whose datagrams were lost, and keep the station from forgetting this client, which
/// it does after a minute.
const POLL_EVERY: TimeSpan = TimeSpan::from_ms(200);
/// One poll in this many is for a locomotive, so that all stay subscribed.
const POLLS_A_LOCOMOTIVE: u32 = 8;
/// One poll in this many is for the subscription, which a restarted station has lost.
const POLLS_A_SUBSCRIPTION: u32 = 25;

impl Client {
    /// Returns the next poll.
    pub(super) fn poll(&mut self, now: Timestamp) -> Outgoing<Awaited> {
        (self.polled, self.polls) = (now, self.polls.wrapping_add(1));
        let groups = self.settings.groups();
        let nth = self.polls / POLLS_A_LOCOMOTIVE;
        let driven = self.dialogue.locomotives.iter().filter(|locomotive| locomotive.is_driven).count();
        let turn = (nth as usize).checked_rem(driven).unwrap_or(0);
        let locomotive = self.dialogue.locomotives.iter().filter(|locomotive| locomotive.is_driven).nth(turn);
        let request = if self.polls.is_multiple_of(POLLS_A_SUBSCRIPTION) {
            Request::Broadcasts
        } else if let Some(locomotive) = locomotive.filter(|locomotive| {
            self.polls.is_multiple_of(POLLS_A_LOCOMOTIVE)
                && self.dialogue.outstanding.blocks(locomotive.train, false).is_none()
        }) {
            return self.query(locomotive.train);
        } else {
            match self.settings.feedback {
                Feedback::RBus => {
                    let group = self.polls % (u32::from(*groups.end()) + 1);
                    Request::Feedback { group: u8::try_from(group).unwrap_or_default() }
                }
                Feedback::Can if self.polls.is_multiple_of(2) => Request::ALL_CAN,
                Feedback::Can | Feedback::LocoNet => Request::Status,
            }
        };
        self.question(request)
    }

    pub(super) fn poll_due(&self) -> Timestamp {
        let groups = i64::from(*self.settings.groups().end()) + 1;
        self.polled + TimeSpan::from_ns(POLL_EVERY.as_ns() / groups)
    }

    /// Returns a request, with the answer that it has.
    pub(super) fn question(&self, request: Request) -> Outgoing<Awaited> {
        let awaited = match request {
            Request::SerialNumber => Awaited::SerialNumber,
            Request::Hardware => Awaited::Hardware,
            Request::LockCode => Awaited::LockCode,
            Request::SetBroadcasts(_) | Request::Broadcasts => Awaited::Broadcasts(self.wanted),
            Request::Status => Awaited::Status,
            Request::Feedback { group } => Awaited::Feedback(group),
            Request::Power { .. } => return self.wanted_power(),
            _ => return Outgoing::says(request),
        };
        Outgoing::asks(request, awaited)
    }
}
