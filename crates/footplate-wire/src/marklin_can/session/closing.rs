//! The end of a session: every train is stopped, then the power goes off, and the station has to confirm both.

use super::Client;
use crate::session::LinkNotice;

impl Client {
    /// Stops that wait are not dropped at the end: a train that an earlier session left running may never have been driven here.
    pub(super) fn keep_stops(&mut self) {
        for train in self.waiting.stops() {
            self.locomotives.know_driven(train);
        }
    }

    /// Stops every train that ever had a speed. A speed says nothing of the direction, so that none has to be known.
    pub(super) fn stop_driven(&mut self) {
        self.locomotives.stop_driven(&mut self.waiting);
        self.farewell.begin_again(self.now);
    }

    /// Ends the session when everything is confirmed.
    pub(super) fn end_if_confirmed(&mut self) {
        if let Some(closing) = self.farewell.end_if_confirmed(&self.locomotives) {
            self.notify(LinkNotice::Closed(closing));
        }
    }
}
