//! The end of a session: every train is stopped, then the power goes off, and the station has to confirm both.

use alloc::vec::Vec;

use footplate_core::TrainId;

use super::super::request::Request;
use super::Client;
use crate::farewell::Farewell;
use crate::session::{LinkNotice, Transmit};

impl Client {
    /// Stops that wait are not dropped at the end. A train that was never driven here, as one that an earlier session left running,
    /// cannot be commanded before the station has said how it faces: it is stopped with all others first.
    pub(super) fn keep_stops(&mut self) {
        for train in self.waiting.stops() {
            self.locomotives.know_driven(train);
            self.stops_all |= !self.locomotives.has_direction(train);
        }
    }

    /// Stops every train that ever had a speed.
    pub(super) fn stop_driven(&mut self) {
        self.locomotives.stop_driven(&mut self.waiting);
        self.farewell.begin_again(self.now);
    }

    /// At the end, a train to be stopped of which the board has not said yet how it faces, and was not asked.
    pub(super) fn without_direction_at_end(&self) -> Option<TrainId> {
        let is_unasked = |train: &TrainId| {
            !self.locomotives.has_direction(*train) && self.outstanding.blocks(*train, false).is_none()
        };
        let waits = matches!(self.farewell, Farewell::Stopping { .. });
        self.locomotives.driven(false).into_iter().filter(|_| waits).find(is_unasked)
    }

    /// Ends the session when everything is confirmed.
    pub(super) fn end_if_confirmed(&mut self) {
        if let Some(closing) = self.farewell.end_if_confirmed(&self.locomotives) {
            self.log_off();
            self.notify(LinkNotice::Closed(closing));
        }
    }

    /// The station need not keep a place for this client any longer.
    fn log_off(&mut self) {
        let mut bytes = Vec::new();
        Request::LogOff.write(&mut bytes);
        self.output.push_back(Transmit::Message(bytes));
    }
}
