//! While a train is in danger no other sets out, and it gets clearance to creep once all others are at rest.

use alloc::vec::Vec;

use crate::control::supervise::Alarm;
use crate::ids::TrainId;
use crate::time::Timestamp;
use crate::units::Length;

use super::dispatched_train::State;
use super::dispatcher::Dispatcher;
use super::reservation::{Reservation, Span};
use crate::control::Notice;

/// The gap between two reservations: those that touch overlap.
const APART: Length = Length::from_mm(1.0);

impl Dispatcher {
    /// Reacts to a notice of the watchdog.
    pub(super) fn hear_of_danger(&mut self, now: Timestamp, notice: &Notice) {
        match notice {
            Notice::Danger { train, stopped, why, .. } => {
                if matches!(why, Alarm::Lost | Alarm::Elsewhere(_)) {
                    self.doubt_turnouts();
                }
                for stopped in stopped {
                    self.gives_up(*stopped);
                }
                self.gives_up(*train);
                self.set_state(*train, State::InDanger);
            }
            Notice::AsksToCreep { train } => {
                self.crawlers.insert(*train);
            }
            Notice::Recovered { train, .. } => {
                self.crawlers.remove(train);
                if let Some(known) = self.trains.get_mut(train) {
                    // It has left the track of its authority.
                    known.held = Reservation::empty();
                    known.kept = Reservation::empty();
                    known.seen_since_start = true;
                }
                self.halted(now, *train, true);
            }
            Notice::NeedsOperator { train, .. } => {
                self.crawlers.remove(train);
                self.set_state(*train, State::Lost);
            }
            Notice::PowerOff { .. }
            | Notice::PowerOn
            | Notice::Creeps { .. }
            | Notice::Located { .. }
            | Notice::SpeedMeasured { .. }
            | Notice::StopChecked { .. }
            | Notice::Resumed { .. }
            | Notice::Cancelled { .. } => {}
            _ => return,
        }
        self.is_stirred = true;
    }

    /// A train was not where it should have been: turnouts may lie otherwise than they were commanded, several at once. Each
    /// is commanded again before another train relies on it.
    fn doubt_turnouts(&mut self) {
        self.commanded.values_mut().for_each(|commanded| commanded.times = 0);
    }

    /// Clears a train in danger to creep once all others are at rest: from then on no other moves. Returns whether one was.
    pub(super) fn let_crawl(&mut self, now: Timestamp) -> bool {
        let mut is_let = false;
        let crawlers: Vec<TrainId> = self.crawlers.iter().copied().collect();
        for id in crawlers {
            let others = self.trains.keys().filter(|other| **other != id);
            let moves = |other: &TrainId| {
                !self.watchdog.is_in_danger(*other) && !self.watchdog.driver().is_at_rest(*other, now)
            };
            if !others.copied().any(|other| moves(&other)) {
                self.crawlers.remove(&id);
                let free = self.all_that_is_free(id);
                if let Some(train) = self.trains.get_mut(&id) {
                    train.held = free;
                }
                self.watchdog.permit(now, id);
                is_let = true;
            }
        }
        is_let
    }

    /// All track that no other train has reserved: a creeping train may enter any of it, and no other sets out.
    fn all_that_is_free(&self, id: TrainId) -> Reservation {
        let layout = self.watchdog.driver().layout();
        let others = || self.trains.values().filter(|other| other.id != id);
        let mut free = Reservation::empty();
        for (edge, known) in layout.edges().filter(|(edge, _)| *edge < edge.twin()) {
            let taken = others().flat_map(|other| other.held.spans());
            let mut taken: Vec<Span> =
                taken.filter(|(stretch, _)| *stretch == edge.stretch()).map(|(_, span)| span).collect();
            taken.sort_by(|one, other| one.from.as_m().total_cmp(&other.from.as_m()));
            let mut from = Length::ZERO;
            for span in taken {
                free.take_rails(layout, edge, from, span.from - APART);
                from = from.max(span.to + APART);
            }
            free.take_rails(layout, edge, from, known.length);
        }
        for (turnout, _) in layout.turnouts() {
            if !others().any(|other| other.held.takes(turnout)) {
                free.take_turnout(layout, turnout);
            }
        }
        free
    }
}
