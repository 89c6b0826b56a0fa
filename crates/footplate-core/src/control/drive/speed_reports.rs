//! Trains whose decoders report their speed: what a report changes, and what a sensor says of reports.

use super::driven_train::DrivenTrain;
use super::driver::Driver;
use super::outputs::Outputs;
use super::reported_speed::LATEST;
use super::task::{Goal, Task, TaskPhase};
use crate::control::Notice;
use crate::ids::{NodeId, SensorId, SpeedStep, TrainId};
use crate::linalg::Gaussian;
use crate::link::DetectionWindow;
use crate::time::Timestamp;
use crate::tracking::{PassedSensor, TrackContext};

impl Driver {
    /// A decoder has reported the speed of its train. Returns whether the train has stalled: it reports 0 and should be running.
    pub(in crate::control) fn take_reported_speed(
        &mut self,
        now: Timestamp,
        train: TrainId,
        number: u16,
    ) -> bool {
        let context = self.track.context();
        let Some(train) = self.trains.get_mut(&train) else { return false };
        if train.take_reported_speed(context, now, number, &mut self.outputs) {
            return true;
        }
        self.update(now);
        false
    }
}

impl DrivenTrain {
    fn take_reported_speed(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        number: u16,
        out: &mut Outputs,
    ) -> bool {
        let is_running = self.commanded > SpeedStep::STAND && self.is_all_sent();
        if !is_running || now - self.steady_at < LATEST {
            self.reported.forget_run();
            return false;
        }
        if number == 0 {
            let speed = self.speed(context, now).as_m_per_s();
            return self.reported.take_zero(now, speed);
        }
        self.reported.take(now, number);
        if let Some(ln_speed) = self.reported.ln_speed()
            && self.locator.take_speed(&self.model, now, LATEST, ln_speed)
        {
            let since = self.expected.since;
            self.expect_after_command(context, now);
            self.expected.since = since;
            if let Some(Task { phase: TaskPhase::Running { .. }, goal: Goal::RestAt(_), .. }) = self.task {
                self.plan(context, now, out);
            }
        }
        false
    }

    /// A sensor has reported the train: the hop before it shows what the reported numbers mean.
    pub(super) fn learn_reported_speed(
        &mut self,
        context: TrackContext<'_>,
        node: NodeId,
        passed: &PassedSensor,
        out: &mut Outputs,
    ) {
        let to = (node, passed.window);
        let steady = self.reported.last_passed().filter(|(_, left)| left.after >= self.steady_at);
        let ln_speed = steady.and_then(|from| self.hop_speed(context, from, to, passed.sensor));
        if self.reported.pass(node, passed.window, ln_speed) {
            out.notify(Notice::SpeedReportsIgnored { train: self.id() });
        }
    }

    /// ln of its speed (m/s) between two sensors, from their detections alone; `None` if they are not neighbours.
    fn hop_speed(
        &self,
        context: TrackContext<'_>,
        (from, left): (NodeId, DetectionWindow),
        (to, reached): (NodeId, DetectionWindow),
        sensor: SensorId,
    ) -> Option<Gaussian> {
        let hop = context.hop_from(from).filter(|hop| hop.to == to)?;
        let took = (reached.middle() - left.middle()).as_s();
        let [length, deviation] = self.model.length(context.sections, &hop).map(|length| length.as_m());
        let sensors = 2.0 * self.model.sensor_variance(Some(sensor));
        let windows = left.variance_s2() + reached.variance_s2();
        let variance = (deviation * deviation + sensors) / (length * length) + windows / (took * took);
        (took > 0.0 && length > 0.0).then(|| Gaussian { mean: libm::log(length / took), variance })
    }
}
