//! A train that runs at a speed between those of its steps.

use crate::control::drive::driven_train::DrivenTrain;
use crate::control::drive::order::OrderId;
use crate::control::drive::outputs::Outputs;
use crate::control::drive::refusal::Refusal;
use crate::control::drive::task::{Goal, Phase, Task};
use crate::control::{Notice, PacedLine};
use crate::event::Approach;
use crate::ids::{NodeId, SpeedStep};
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::TrackContext;
use crate::units::{Length, Speed};

use super::ideal_line::IdealLine;
use super::pace::{Holding, Pace, Pacing};
use super::reference::Reference;
use super::surveyed_way::SurveyedWay;

impl Holding {
    /// Where it should be; `None` before there is a line, and when the way does not lead on from it any more.
    pub(super) fn reference(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        node: NodeId,
    ) -> Option<Reference> {
        if self.line?.node != node {
            self.line = self.line?.counted_from(context, node, now);
        }
        let line = self.line?;
        let speed = line.speed.as_m_per_s();
        Some(Reference::of(|ahead| line.place(now + TimeSpan::from_s(ahead)), [speed; 2]))
    }
}

impl DrivenTrain {
    /// Takes an order to hold a speed.
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
        self.take(Task { order, goal: Goal::Pace, phase: Phase::Pacing }, out);
        self.pacing = Some(Pacing::new(Pace::Hold(holding), usable, now));
        // Where zones are, it may have to slow down at any time, and what keeps it to them knows it as it was calibrated.
        self.locator.repeat(context.layout.zones().is_empty());
        if step != self.commanded {
            self.issue_step(context, now, step, out);
        }
        Ok(())
    }

    /// The first contact that is passed at a settled speed begins the line; from then on it is counted from every one.
    pub(super) fn begin_line(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        holding: &mut Holding,
        out: &mut Outputs,
    ) {
        let Some(located) = self.located(context, now) else { return };
        let node = located.at.node;
        holding.line = holding.line.and_then(|line| line.counted_from(context, node, now));
        if holding.line.is_some() || now < holding.settled || self.is_restrained() {
            return;
        }
        let way = SurveyedWay::ahead(context, &self.model, node).of_felt(located.at.way.as_m());
        let line = IdealLine { node, way: Length::from_m(way), time: now, speed: holding.speed };
        holding.line = Some(line);
        let IdealLine { way, time, speed, .. } = line;
        out.say(Notice::Paced(PacedLine { order, train: self.id(), node, way, time, speed }));
    }

    /// How far it is ahead of its line, as far as is believed; `None` while there is none.
    pub(in crate::control::drive) fn ahead_of_line(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
    ) -> Option<Length> {
        let Pacing { pace: Pace::Hold(Holding { line: Some(line), .. }), .. } = self.paced()? else {
            return None;
        };
        let at = self.located(context, now)?.at;
        let line = line.counted_from(context, at.node, now)?;
        let way = SurveyedWay::ahead(context, &self.model, at.node).of_felt(at.way.as_m());
        Some(Length::from_m(way - line.place(now)))
    }

    /// It is slowed down for a zone: the line ends here.
    pub(in crate::control::drive) const fn interrupt_line(&mut self) {
        if let Some(Pacing { pace: Pace::Hold(holding), .. }) = &mut self.pacing {
            holding.line = None;
        }
    }

    /// It is told a step again at which it can hold its speed: another line begins once it is settled.
    pub(in crate::control::drive) fn resume_line(&mut self, now: Timestamp, step: SpeedStep) {
        let settles = self.model.settles_within(self.commanded, step);
        if let Some(Pacing { pace: Pace::Hold(holding), .. }) = &mut self.pacing {
            holding.settled = now + settles;
        }
    }
}
