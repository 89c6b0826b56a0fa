//! How far the station has been asked for all that has to be known before trains are driven.

use alloc::collections::VecDeque;

use super::broadcasts::Broadcasts;
use super::detectors::Feedback;
use super::request::Request;
use super::settings::Settings;

/// Where the opening is.
#[derive(Debug, Clone)]
pub(super) enum Opening {
    /// These requests are still to be written, each when the one before is answered.
    Asking(VecDeque<Request>),
    /// Trains may be driven.
    Open,
}

impl Opening {
    /// What the station is asked: what it is, what this client is told or is to be told, where trains are, and the power.
    ///
    /// `is_subscribed`: whether it was told already what it is to tell this client. It is only asked then, so that a station that
    /// was restarted is recognised by what it has forgotten.
    pub(super) fn begin(settings: &Settings, wanted: Broadcasts, is_subscribed: bool, power: bool) -> Self {
        let broadcasts = if is_subscribed { Request::Broadcasts } else { Request::SetBroadcasts(wanted) };
        let first = [Request::SerialNumber, Request::Hardware, Request::LockCode, broadcasts];
        let groups = settings.groups().map(|group| Request::Feedback { group });
        let detectors = match settings.feedback {
            Feedback::RBus => None,
            Feedback::Can => Some(Request::ALL_CAN),
            Feedback::LocoNet => Some(Request::ALL_LOCO_NET),
        };
        let groups = groups.filter(|_| detectors.is_none());
        let last = [Request::Power { on: power }, Request::Status];
        Self::Asking(first.into_iter().chain(groups).chain(detectors).chain(last).collect())
    }

    pub(super) const fn is_open(&self) -> bool {
        matches!(self, Self::Open)
    }
}
