//! A train that set out in the wrong direction: its decoder lost a command to reverse, or obeyed one that was not sent.
//!
//! Until a sensor has reported a train after its start, its direction is only known from commands. A second [`Locator`] follows where it
//! would be if it ran backward; a report that nothing else explains and that comes just there shows that it does.

use crate::event::{Event, Report};
use crate::ids::{SensorId, SpeedStep, TrainId};
use crate::time::Timestamp;
use crate::track::TurnoutNeed;
use crate::tracking::{Locator, PathPoint, TrackContext};
use crate::units::Length;

use super::driven_train::DrivenTrain;
use super::driver::Driver;
use super::path::reversed_location;

/// Chance that a train sets out in the wrong direction (chosen: once in a hundred sessions of ten starts).
const LOG_BACKWARD: f64 = -6.908;
/// A train is taken to run backward if that is this many times as likely as a spurious report, as ln: twenty times.
const LOG_CERTAIN: f64 = 3.0;

impl DrivenTrain {
    /// Where it is after reversing at rest, and one standard deviation; `None` where that is unknown.
    pub(super) fn back_at_rest(
        &self,
        context: TrackContext<'_>,
        time: Timestamp,
    ) -> Option<(PathPoint, Length)> {
        let rest = self.located(context, time).filter(|located| located.at_rest)?;
        reversed_location(context, &self.model, rest)
    }

    /// A step was sent to it: it would run backward by that, too.
    pub(super) fn command_backward(&mut self, context: TrackContext<'_>, event: &Event, step: SpeedStep) {
        if self.backward.is_none()
            && step > SpeedStep::STAND
            && let Some((at, uncertainty)) = self.back_at_rest(context, event.time)
        {
            let mut backward = Locator::new(self.id());
            backward.place(event.time, at, uncertainty);
            self.backward = Some(backward);
        }
        if let Some(backward) = &mut self.backward {
            backward.handle_command(context, &self.model, event);
        }
    }
}

impl Driver {
    /// Whether the position of a train at rest would still be known if it reversed.
    pub(in crate::control) fn stays_located_reversed(&self, train: TrainId, now: Timestamp) -> bool {
        let back = self.trains.get(&train).and_then(|train| train.back_at_rest(self.track.context(), now));
        back.is_some()
    }

    /// A turnout behind a train that has to be set before it reverses, for its position to remain known.
    pub(in crate::control) fn missing_for_reversal(
        &self,
        now: Timestamp,
        train: TrainId,
    ) -> Option<TurnoutNeed> {
        let reversed = self.reversed_position(train, now)?;
        let is_set = |need: &TurnoutNeed| self.turnouts().get(need.turnout) == Some(need.leg);
        self.layout().needs_of(reversed.edge).find(|need| need.facing && !is_set(need))
    }

    /// The train that runs backward, if a report that was not explained shows one.
    pub(in crate::control) fn runs_backward(
        &self,
        now: Timestamp,
        sensor: SensorId,
        time: Timestamp,
    ) -> Option<TrainId> {
        let window = self.detection(time, Report { sensor, poll_interval: None }).window;
        let context = self.track.context();
        let claim = |train: &DrivenTrain| {
            let missed = train.missed_share(context, time);
            let backward = train.backward.as_ref()?;
            let meanings = context.layout.meanings(sensor);
            let claims =
                meanings.filter_map(|one| backward.claim(context, &train.model, one, window, missed));
            claims.max_by(f64::total_cmp)
        };
        let claims = self.trains.values().filter_map(|train| Some((train.id(), claim(train)?)));
        let (train, density) = claims.max_by(|(_, one), (_, other)| one.total_cmp(other))?;
        let spurious = self.association.log_rate_before(sensor, now);
        (density + LOG_BACKWARD > spurious + LOG_CERTAIN).then_some(train)
    }
}
