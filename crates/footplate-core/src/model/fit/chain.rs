//! From commands and reports to trips: the commands a train received and the sensors it passed, in order.

use alloc::vec::Vec;

use super::trip::{MeasuredRest, PassedEdge, Trip, TripDetection};
use crate::event::{Event, EventKind};
use crate::ids::{NodeId, SensorId, SpeedStep};
use crate::link::TimeModel;
use crate::model::parameters::Answers;
use crate::model::segment::SpeedCommand;
use crate::model::survey::SectionIndex;
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Layout, Reach, TurnoutStates};
use crate::units::Length;

/// The poll interval where the recording has none: that of an unknown link.
const USUAL_INTERVAL: TimeSpan = TimeModel::ASSUMED.report_window;
/// Seconds between the last entry of a run and the first of the next, whose clocks have nothing in common.
const BETWEEN_RUNS: f64 = 60.0;
/// No stop is longer (m): published ones take up to 1.6 m.
const LONGEST_STOP: f64 = 3.0;
/// An edge from which less than this part of the effect of gradients comes is left out.
const LEAST_PART: f64 = 0.02;
/// With more missed detections in a row than this, the path between two sensors counts as unknown.
const MOST_MISSED: usize = 2;

/// The trips of one train; the last one may still be running.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Chain {
    pub(super) trips: Vec<Trip>,
    /// When the recording's clock shows this, the chain's clock shows `begins`.
    origin: Option<Timestamp>,
    begins: f64,
    /// Seconds of the latest entry.
    latest: f64,
    /// Whether the train is known to be at rest because its run begins there.
    at_rest: bool,
    step: u8,
    above: bool,
    /// The sensor passed last.
    at: Option<NodeId>,
    last_sensor: Option<SensorId>,
    /// The edges passed last before that sensor, with their lengths (m), as far as a stop may reach back.
    #[cfg_attr(feature = "serde", serde(default))]
    behind: Vec<(usize, f64)>,
    /// Whether the next trip begins where the last one ended.
    unbroken: bool,
    /// Whether the train has moved as commanded since it was last at rest.
    #[cfg_attr(feature = "serde", serde(default))]
    moves_as_commanded: bool,
}

impl Chain {
    fn seconds(&mut self, time: Timestamp) -> f64 {
        let seconds = self.begins + (time - *self.origin.get_or_insert(time)).as_s();
        self.latest = self.latest.max(seconds);
        seconds
    }

    /// A run begins in which the train has been running steadily at `step`, or is at rest at step 0. Its clock has
    /// nothing to do with that of the run before.
    pub(super) fn begin_run(&mut self, step: SpeedStep) {
        self.interrupt();
        self.origin = None;
        self.begins = self.latest + BETWEEN_RUNS;
        (self.step, self.above, self.at_rest) = (step.get(), false, step == SpeedStep::STAND);
    }

    /// Breaks the chain: the train's position no longer follows from its earlier positions.
    pub(super) fn interrupt(&mut self) {
        self.lose_place();
        self.moves_as_commanded = false;
    }

    /// The position no longer follows from earlier positions; the train moves as commanded all the same.
    pub(super) fn lose_place(&mut self) {
        self.unbroken = false;
        self.at = None;
        self.last_sensor = None;
        self.behind.clear();
    }

    /// Takes a command to the train. The model decides whether the train was at rest by then.
    pub(super) fn command(&mut self, time: Timestamp, step: SpeedStep, answers: &Answers<'_>) {
        let sent = self.seconds(time);
        let (from, to) = (self.step, step.get());
        if to == from {
            return;
        }
        let at_rest = from == 0
            && (self.at_rest || self.trips.last().is_none_or(|trip| trip.rests_at(answers) <= sent));
        self.at_rest = false;
        if from == 0 && (at_rest || self.trips.is_empty()) {
            if let Some(last) = self.trips.last_mut().filter(|_| self.unbroken) {
                last.came_to_rest = true;
            }
            let continues = self.unbroken && self.trips.last().is_some();
            self.trips.push(Trip::new(sent, None, continues));
            self.moves_as_commanded = true;
            self.unbroken = true;
        } else if !self.unbroken {
            self.trips.push(Trip::new(sent, Some((from, self.above)), false));
            self.unbroken = true;
        }
        if let Some(trip) = self.trips.last_mut() {
            trip.command(SpeedCommand { sent, from, to, at_rest });
        }
        (self.step, self.above) = (to, to < from);
    }

    /// Takes a report that data association assigned to the train. Whether it is a passage.
    pub(super) fn pass(
        &mut self,
        layout: &Layout,
        sections: &SectionIndex,
        turnouts: &TurnoutStates,
        event: &Event,
        answers: &Answers<'_>,
    ) -> bool {
        let EventKind::Sensor(report) = event.kind else { return false };
        let Some(node) = layout.sensor_node(report.sensor) else { return false };
        if self.last_sensor == Some(report.sensor) {
            return false;
        }
        let interval = report.poll_interval.unwrap_or(USUAL_INTERVAL).abs().as_s();
        let time = self.seconds(event.time) - 0.5 * interval;
        if self.step == 0 && (self.at_rest || self.trips.is_empty()) {
            return false;
        }
        let path = self
            .at
            .filter(|_| self.unbroken)
            .and_then(|from| reach_of(layout, turnouts, from, report.sensor));
        let begins_anew = !self.unbroken || (self.at.is_some() && path.is_none());
        if begins_anew && self.step == 0 {
            // What is left of a stop would say how long all of it is: an error of its law moved the stops from all steps by 50 mm.
            self.lose_place();
            return false;
        }
        if begins_anew {
            // The earlier path is unknown: distances count from here. A train that has moved as commanded since it was at rest
            // may still be accelerating; any other counts as running steadily.
            let trip = match self.trips.last().filter(|_| self.moves_as_commanded) {
                Some(moving) => moving.at_another_place(),
                None => Trip::new(time, Some((self.step, self.above)), false),
            };
            self.trips.push(trip);
            self.unbroken = true;
        }
        let ahead: Vec<(usize, f64)> = path.as_ref().map_or_else(Vec::new, |path| edges(layout, path));
        if let [.., stopped, trip] = self.trips.as_mut_slice()
            && trip.continues
            && trip.detections.is_empty()
        {
            stopped.stop_edges = stop_edges(stopped, answers, &self.behind, &ahead);
        }
        if begins_anew {
            self.behind.clear();
        } else {
            self.behind.extend(ahead);
            let mut length = 0.0;
            let far = self.behind.iter().rposition(|(_, of_edge)| {
                length += of_edge;
                length > LONGEST_STOP
            });
            self.behind.drain(..far.unwrap_or(0));
        }
        let Some(trip) = self.trips.last_mut() else { return false };
        let (length, sections) = path.filter(|_| !begins_anew).map_or((0.0, Vec::new()), |path| {
            (path.length.as_m(), path.hops().iter().filter_map(|hop| sections.section(*hop)).collect())
        });
        let (sensor, variance) = (Some(report.sensor), interval * interval / 12.0);
        trip.pass(TripDetection { node, sensor, time, variance, length, sections });
        (self.at, self.last_sensor) = (Some(node), Some(report.sensor));
        true
    }

    /// The last passage, with the step, if the train was running steadily then.
    pub(super) fn steady_pass(&self, answers: &Answers<'_>) -> Option<(&TripDetection, SpeedStep)> {
        let trip = self.trips.last()?;
        let detection = trip.detections.last()?;
        let step = SpeedStep::new(self.step).filter(|step| *step != SpeedStep::STAND)?;
        (trip.settles_at(answers) <= detection.time).then_some((detection, step))
    }

    /// Takes a tape measurement: the train came to rest this far past a sensor.
    pub(super) fn measure_rest(
        &mut self,
        layout: &Layout,
        index: &SectionIndex,
        turnouts: &TurnoutStates,
        landmark: SensorId,
        offset: Length,
    ) {
        let Some(node) = layout.sensor_node(landmark).filter(|_| self.step == 0 && self.unbroken) else {
            return;
        };
        let at = self.at;
        let Some(trip) = self.trips.last_mut() else { return };
        let passed = trip.detections.iter().rposition(|detection| detection.node == node);
        let beyond = (offset.as_m(), Vec::new());
        let (detections, (beyond, sections)) = match passed {
            Some(place) => (place + 1, beyond),
            None => {
                let Some(reach) = at.and_then(|from| reach_of(layout, turnouts, from, landmark)) else {
                    return;
                };
                let sections = reach.hops().iter().filter_map(|hop| index.section(*hop)).collect();
                (trip.detections.len(), (reach.length.as_m() + offset.as_m(), sections))
            }
        };
        trip.came_to_rest = true;
        trip.measured = Some(MeasuredRest { detections, beyond, sections });
    }
}

/// The edges of a path, with their lengths (m).
fn edges(layout: &Layout, path: &Reach) -> Vec<(usize, f64)> {
    let hops = path.hops().iter().filter_map(|hop| layout.hop(*hop));
    let edges = hops.flat_map(|hop| hop.edges.iter().copied());
    edges.filter_map(|edge| Some((usize::from(edge.0), layout.edge(edge)?.length.as_m()))).collect()
}

/// The edges that a stop ran over, of those behind and ahead of the sensor passed last.
fn stop_edges(
    stopped: &Trip,
    answers: &Answers<'_>,
    behind: &[(usize, f64)],
    ahead: &[(usize, f64)],
) -> Vec<PassedEdge> {
    let Some((rest, effect)) = stopped.stop(answers) else { return Vec::new() };
    let mut begins = -behind.iter().map(|(_, length)| length).sum::<f64>();
    let all = behind.iter().chain(ahead).map(|(edge, length)| {
        let passed = PassedEdge { edge: *edge, begins, ends: begins + length };
        begins = passed.ends;
        passed
    });
    all.filter(|passed| passed.part_of(effect, rest) >= LEAST_PART).collect()
}

/// The path with the fewest missed detections, and of these the shortest.
fn reach_of(layout: &Layout, turnouts: &TurnoutStates, from: NodeId, sensor: SensorId) -> Option<Reach> {
    (0..=MOST_MISSED).find_map(|missed| {
        layout
            .reaches(from, turnouts, missed)
            .filter(|reach| reach.sensor == Some(sensor))
            .min_by(|one, other| one.length.as_m().total_cmp(&other.length.as_m()))
    })
}
