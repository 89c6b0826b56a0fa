//! From the raw entries of a run to passages: the sensor that a train passed, the window of the detection, and the path.
//!
//! Recordings hold more reports than passages: a sensor reports again in every poll while the shoe is on it, a
//! station still remembers a detection from before the start, and now and then a sensor stays silent. This file classifies
//! each report, for the review of runs and for the live estimator alike.

use crate::event::{Approach, Event, EventKind};
use crate::ids::{NodeId, SensorId, SpeedStep, TrainId};
use crate::link::{DetectionWindow, PollTimingEstimator};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{DirectionFinder, Layout, Leg, Reach, TurnoutStates};

/// A report this soon after a start from rest is of a sensor that the train stood on, or that the station still
/// remembered: command delay (0.1 to 0.6 s measured) and the first 0.5 s of any start move a train by less
/// than its shoe is long.
pub const STALE_WITHIN: TimeSpan = TimeSpan::from_ms(1_000);
/// Sensors that may stay silent in a row before the path counts as unknown.
const MOST_MISSED: usize = 2;

/// Commands that follow one another this fast keep the line busy: a solenoid is switched off 150 to 200 ms after it is switched
/// on, and the next one behind it.
const SAME_BURST: TimeSpan = TimeSpan::from_ms(250);

/// What a train was commanded last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Drive {
    /// The step it is to run at.
    pub step: SpeedStep,
    /// The step it ran at before.
    pub from: SpeedStep,
    /// When it was commanded; `None` when the recording begins with the train running at `step`.
    pub commanded: Option<Timestamp>,
}

impl Drive {
    /// From which side the step was reached.
    #[must_use]
    pub fn approach(self) -> Approach {
        match self.commanded {
            None => Approach::Unknown,
            Some(_) if self.from > self.step => Approach::Above,
            Some(_) => Approach::Below,
        }
    }
}

/// A passage of a train at a sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// The sensor.
    pub sensor: SensorId,
    /// Its node, which gives the direction of travel.
    pub node: NodeId,
    /// When it closed.
    pub window: DetectionWindow,
    /// The path from the passage before; `None` for the first of a run and where no path leads from there.
    pub path: Option<Reach>,
    /// What the train was commanded at the time.
    pub drive: Drive,
    /// The entry of the run that reported it, counted from 0.
    pub entry: usize,
}

/// What a report was taken for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sighting {
    /// The train passed the sensor.
    Passage(Passage),
    /// The shoe is still on the sensor of the last passage.
    Repeat,
    /// The train stands on it, or the station remembered it from before.
    Standing,
    /// The train passed the sensor, which does not report the direction, and its direction is not known.
    UnknownDirection,
    /// The layout has no such sensor.
    UnknownSensor,
}

/// Follows one train through the entries of a run.
#[derive(Debug, Clone)]
pub struct PassageTracker {
    train: TrainId,
    drive: Drive,
    /// Node of the last passage.
    at: Option<NodeId>,
    directions: DirectionFinder,
    last_sensor: Option<SensorId>,
    last_report: Option<Timestamp>,
    timing: PollTimingEstimator,
    /// The first and the last of the commands that were sent one right after the other.
    burst: Option<[Timestamp; 2]>,
    turnouts: TurnoutStates,
    entries: usize,
}

impl PassageTracker {
    /// A run of `train` begins, which has been running at `step` for long or stands.
    pub fn new(train: TrainId, step: SpeedStep, timing: PollTimingEstimator) -> Self {
        Self {
            train,
            drive: Drive { step, from: step, commanded: None },
            at: None,
            directions: DirectionFinder::default(),
            last_sensor: None,
            last_report: None,
            timing,
            burst: None,
            turnouts: TurnoutStates::unknown(),
            entries: 0,
        }
    }

    /// The next entry of the run; the sighting where it is a report.
    #[inline]
    pub fn take(&mut self, layout: &Layout, event: &Event) -> Option<Sighting> {
        let entry = self.entries;
        self.entries += 1;
        match event.kind {
            EventKind::Sensor(report) => {
                let mut window = DetectionWindow::of_report(
                    event.time,
                    report.poll_interval,
                    self.last_report,
                    self.timing.timing(),
                );
                if report.poll_interval.is_none() {
                    window.after = window.after.min(self.pushed_from(event.time));
                }
                self.timing.report(event.time);
                self.last_report = Some(event.time);
                if self.last_sensor == Some(report.sensor) {
                    return Some(Sighting::Repeat);
                }
                Some(self.sight(layout, report.sensor, window, entry))
            }
            EventKind::Speed { train, step } => {
                self.command_sent(event.time);
                if train == self.train && step != self.drive.step {
                    self.drive = Drive { step, from: self.drive.step, commanded: Some(event.time) };
                }
                None
            }
            EventKind::Reverse { train } => {
                self.command_sent(event.time);
                if train == self.train {
                    // The sensor behind becomes the one ahead, at an unknown distance.
                    self.at = None;
                    self.last_sensor = None;
                    self.directions.reverse(layout, &self.turnouts);
                }
                None
            }
            EventKind::Turnout { turnout, curved } => {
                self.command_sent(event.time);
                self.turnouts.set(turnout, Leg::from_curved(curved));
                None
            }
            EventKind::Stopped { .. } | EventKind::Freed(_) => None,
        }
    }

    /// A command went over the line before the next poll.
    fn command_sent(&mut self, time: Timestamp) {
        self.timing.command_sent();
        self.burst = match self.burst {
            Some([first, last]) if time - last < SAME_BURST => Some([first, time]),
            _ => Some([time, time]),
        };
    }

    /// Since when the sensor of a report may have been closed: commands right before it pushed its poll, and the last poll
    /// before them is as old as they are.
    fn pushed_from(&self, stamp: Timestamp) -> Timestamp {
        let period = self.timing.timing().period;
        match self.burst {
            Some([first, last]) if stamp - last < SAME_BURST + period + period => {
                (first - period).max(self.last_report.unwrap_or(first - period))
            }
            _ => stamp,
        }
    }

    /// The next entry of the run was excluded by a person: it counts, but nothing is made of it.
    pub const fn skip(&mut self) {
        self.entries += 1;
    }

    fn sight(
        &mut self,
        layout: &Layout,
        sensor: SensorId,
        window: DetectionWindow,
        entry: usize,
    ) -> Sighting {
        if layout.sensor_node(sensor).is_none() {
            return Sighting::UnknownSensor;
        }
        self.last_sensor = Some(sensor);
        let passed = self.directions.passed(layout, &self.turnouts, sensor);
        let Some((sensor, node)) = passed.and_then(|sensor| Some((sensor, layout.sensor_node(sensor)?)))
        else {
            self.at = None;
            return Sighting::UnknownDirection;
        };
        if self.stands_until().is_some_and(|until| window.until < until) {
            // It moves off from somewhere behind or on the sensor: no path can be measured from here.
            self.at = None;
            return Sighting::Standing;
        }
        let path = self.at.and_then(|from| {
            // The path past the fewest silent sensors, and of these the shortest.
            (0..=MOST_MISSED).find_map(|missed| {
                layout
                    .reaches(from, &self.turnouts, missed)
                    .filter(|reach| reach.sensor == Some(sensor))
                    .min_by(|one, other| one.length.as_m().total_cmp(&other.length.as_m()))
            })
        });
        self.at = Some(node);
        Sighting::Passage(Passage { sensor, node, window, path, drive: self.drive, entry })
    }

    /// Until when reports say nothing of the motion of a train that starts from rest.
    fn stands_until(&self) -> Option<Timestamp> {
        match self.drive.commanded {
            None if self.drive.step == SpeedStep::STAND => Some(Timestamp::from_ns(i64::MAX)),
            Some(commanded) if self.drive.from == SpeedStep::STAND => Some(commanded + STALE_WITHIN),
            _ => None,
        }
    }

    /// What it was commanded last.
    pub const fn drive(&self) -> Drive {
        self.drive
    }

    /// The turnout positions, as far as the run shows them.
    pub const fn turnouts(&self) -> &TurnoutStates {
        &self.turnouts
    }

    /// The rhythm of the link as learnt so far.
    pub const fn timing(&self) -> &PollTimingEstimator {
        &self.timing
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::Report;
    use crate::track::example::oval;

    #[test]
    fn commands_before_a_poll_push_it_and_its_sensor_may_have_closed_since_the_last_one() {
        let layout = oval();
        let seen_since = |last_report: f64, reported: f64| {
            let mut tracker =
                PassageTracker::new(TrainId(24), SpeedStep::STAND, PollTimingEstimator::default());
            let mut take =
                |seconds: f64, kind| tracker.take(&layout, &Event { time: Timestamp::from_s(seconds), kind });
            let sensor = |number| EventKind::Sensor(Report { sensor: SensorId(number), poll_interval: None });
            take(last_report, sensor(0));
            for (seconds, number) in [(20.0, 4), (20.2, 6)] {
                let step = SpeedStep::new(number).expect("a step");
                take(seconds, EventKind::Speed { train: TrainId(24), step });
            }
            match take(reported, sensor(2)) {
                Some(Sighting::Passage(passage)) => passage.window.after.as_s(),
                other => panic!("{other:?}"),
            }
        };
        // Polls are 70 ms apart: one at 19.93 s is the last before both commands.
        let is =
            |found: f64, expected: f64| assert!((found - expected).abs() < 1e-6, "{found}, not {expected}");
        is(seen_since(10.0, 20.4), 19.93);
        // A quarter of a second and two polls after the last of them, they push nothing any more.
        is(seen_since(10.0, 20.58), 19.93);
        assert!(seen_since(10.0, 20.60) > 20.4);
        // What was reported later than that poll was not yet closed then.
        is(seen_since(19.97, 20.4), 19.97);
    }
}
