//! The end of a session: every train is stopped, then the power goes off, and the station has to confirm both.

use footplate_core::{Command, SpeedStep, Timestamp};

use super::Client;
use crate::farewell::Farewell;
use crate::session::{Closing, Confirmation, LinkNotice};

impl Client {
    /// Stops that wait are not dropped at the end: a train that an earlier session left running may never have been driven here.
    pub(super) fn keep_stops(&mut self) {
        let stop = |command: &Command| match command {
            Command::Speed { train, step: SpeedStep::STAND } => Some(*train),
            _ => None,
        };
        for train in self.waiting.iter().filter_map(stop) {
            self.locomotives.know(train);
            self.locomotives.get_mut(train).into_iter().for_each(|locomotive| locomotive.is_driven = true);
        }
    }

    /// Stops every train that ever had a speed. A speed says nothing of the direction, so that none has to be known.
    pub(super) fn stop_driven(&mut self) {
        for locomotive in self.locomotives.iter_mut().filter(|locomotive| locomotive.is_driven) {
            locomotive.is_stopped = false;
            // Stops are always taken.
            let _ = self.waiting.push(Command::Speed { train: locomotive.train, step: SpeedStep::STAND });
        }
        if let Farewell::SwitchingOff { .. } = self.farewell {
            self.farewell.begin(self.now);
        }
    }

    /// Whether it is time to switch the power off at the end; true once.
    pub(super) fn switch_off_is_due(&mut self, now: Timestamp) -> bool {
        let Farewell::Stopping { until } = self.farewell else { return false };
        let is_due = now >= until || self.locomotives.driven(false).is_empty();
        if is_due {
            self.farewell = Farewell::SwitchingOff { is_confirmed: false };
        }
        is_due
    }

    /// The station has said that the track has no power.
    pub(super) fn power_went_off(&mut self) {
        if let Farewell::SwitchingOff { is_confirmed } = &mut self.farewell {
            *is_confirmed = true;
        }
    }

    /// Ends the session when everything is confirmed.
    pub(super) fn end_if_confirmed(&mut self) {
        let is_off = self.farewell == Farewell::SwitchingOff { is_confirmed: true };
        if is_off && self.locomotives.driven(false).is_empty() {
            self.farewell = Farewell::Over;
            let closing = self.statement();
            self.notify(LinkNotice::Closed(closing));
        }
    }

    pub(super) fn statement(&self) -> Closing {
        Closing {
            commanded_to_stop: self.locomotives.driven(true),
            not_commanded: self.locomotives.driven(false),
            // No current flows from a track without power.
            solenoids_released: None,
            power_off: matches!(
                self.farewell,
                Farewell::Over | Farewell::SwitchingOff { is_confirmed: true }
            ),
            confirmation: Confirmation::Replies,
        }
    }
}
