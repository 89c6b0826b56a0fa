//! Holds a speed that may lie between those of two steps.

use crate::control::drive::driven_train::DrivenTrain;
use crate::control::drive::order::OrderId;
use crate::control::drive::outputs::Outputs;
use crate::control::drive::refusal::Refusal;
use crate::control::drive::task::{Goal, Task, TaskPhase};
use crate::control::{Notice, PacedLine};
use crate::event::Approach;
use crate::ids::{NodeId, SpeedStep};
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::TrackContext;
use crate::units::{Length, Speed};

use super::pace::{Holding, Pace, Pacing};
use super::reference::{IdealLine, Reference, SurveyedPath};

impl Holding {
    /// Where the train should be; `None` before the line starts, and when the path leads elsewhere.
    pub(super) fn reference(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        node: NodeId,
    ) -> Option<Reference> {
        if self.line?.node != node {
            self.line = self.line?.recount_from(context, node, now);
        }
        let line = self.line?;
        let speed = line.speed.as_m_per_s();
        Some(Reference::of(|ahead| line.place(now + TimeSpan::from_s(ahead)), [speed; 2]))
    }
}

impl DrivenTrain {
    /// Starts an order to hold a speed.
    pub(in crate::control::drive) fn hold(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        speed: Speed,
        out: &mut Outputs,
    ) -> Result<(), Refusal> {
        let usable = self.usable_steps();
        let ends = [usable.first(), usable.last()].map(|step| {
            let steady = |step: &SpeedStep| self.model.steady_speed(*step, Approach::Below);
            step.map_or(Speed::ZERO, steady)
        });
        let [lowest, highest] = ends;
        if !(speed >= lowest && speed <= highest && speed > Speed::ZERO) {
            return Err(Refusal::SpeedOutOfRange { found: speed, lowest, highest });
        }
        let off = |step: &SpeedStep| (self.model.steady_speed(*step, Approach::Below) - speed).abs();
        let nearest = usable
            .iter()
            .copied()
            .min_by(|one, other| off(one).as_m_per_s().total_cmp(&off(other).as_m_per_s()));
        let step = nearest.unwrap_or(self.commanded);
        let settles = if step == self.commanded {
            TimeSpan::ZERO
        } else {
            self.model.settles_within(self.commanded, step)
        };
        let holding = Holding { speed, settled: now + settles, line: None };
        self.start_task(Task { order, goal: Goal::Pace, phase: TaskPhase::Pacing }, out);
        self.pacing = Some(Pacing::new(Pace::Hold(holding), usable, now));
        // Near zones, speed supervision relies on the calibrated motion: corrections from repeated runs stay off.
        self.locator.repeat(context.layout.zones().is_empty());
        if step != self.commanded {
            self.command_step(context, now, step, out);
        }
        Ok(())
    }

    /// Starts the line at the first sensor that the train passes at a settled speed, and measures it again from each
    /// further one.
    pub(super) fn start_line(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        holding: &mut Holding,
        out: &mut Outputs,
    ) {
        let Some(located) = self.located(context, now) else { return };
        let node = located.at.node;
        holding.line = holding.line.and_then(|line| line.recount_from(context, node, now));
        if holding.line.is_some() || now < holding.settled || self.is_speed_limited() {
            return;
        }
        let surveyed = SurveyedPath::ahead(context, &self.model, node).surveyed(located.at.distance.as_m());
        let line = IdealLine { node, distance: Length::from_m(surveyed), time: now, speed: holding.speed };
        holding.line = Some(line);
        let IdealLine { distance: way, time, speed, .. } = line;
        out.notify(Notice::Paced(PacedLine { order, train: self.id(), node, way, time, speed }));
    }

    /// The estimated distance ahead of the line; `None` while there is none.
    pub(in crate::control::drive) fn ahead_of_line(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
    ) -> Option<Length> {
        let Pacing { pace: Pace::Hold(Holding { line: Some(line), .. }), .. } = self.paced()? else {
            return None;
        };
        let at = self.located(context, now)?.at;
        let line = line.recount_from(context, at.node, now)?;
        let distance = SurveyedPath::ahead(context, &self.model, at.node).surveyed(at.distance.as_m());
        Some(Length::from_m(distance - line.place(now)))
    }

    /// Ends the line: speed supervision slows the train down.
    pub(in crate::control::drive) const fn interrupt_line(&mut self) {
        if let Some(Pacing { pace: Pace::Hold(holding), .. }) = &mut self.pacing {
            holding.line = None;
        }
    }

    /// The speed can be held again: another line starts once the step has settled.
    pub(in crate::control::drive) fn resume_line(&mut self, now: Timestamp, step: SpeedStep) {
        let settles = self.model.settles_within(self.commanded, step);
        if let Some(Pacing { pace: Pace::Hold(holding), .. }) = &mut self.pacing {
            holding.settled = now + settles;
        }
    }
}
