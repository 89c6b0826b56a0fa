//! What is asked all the time, so that nothing that was lost on its way stays unknown.

use footplate_core::{TimeSpan, Timestamp};

use super::super::detectors::Feedback;
use super::super::outstanding::Awaited;
use super::super::request::Request;
use super::{Client, query};
use crate::outstanding::Outgoing;

/// How often something is asked for: what changed in a datagram that was lost is known after that. It also keeps the station from
/// forgetting this client, which it does after a minute.
const POLL_EVERY: TimeSpan = TimeSpan::from_ms(200);
/// One question in so many is for a locomotive, so that all stay subscribed.
const POLLS_A_LOCOMOTIVE: u32 = 8;
/// One in so many is for what this client is told: a station that was restarted has forgotten it.
const POLLS_A_SUBSCRIPTION: u32 = 25;

impl Client {
    /// The next question of those that are asked all the time.
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
            return query(locomotive.train);
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

    /// A request whose answer is awaited where one comes.
    pub(super) const fn question(&self, request: Request) -> Outgoing<Awaited> {
        let awaited = match request {
            Request::SerialNumber => Awaited::SerialNumber,
            Request::Hardware => Awaited::Hardware,
            Request::LockCode => Awaited::LockCode,
            Request::SetBroadcasts(_) | Request::Broadcasts => Awaited::Broadcasts(self.wanted),
            Request::Status => Awaited::Status,
            Request::Feedback { group } => Awaited::Feedback(group),
            Request::Power { on } => Awaited::Power(on),
            _ => return Outgoing::says(request),
        };
        Outgoing::asks(request, awaited)
    }
}
