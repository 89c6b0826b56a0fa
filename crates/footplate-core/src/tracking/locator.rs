//! Position of one train between two sensors, through changes of speed, and where it would come to rest.
//!
//! Distances count from the sensor passed last, in path lengths: a hop from sensor to sensor is as long as
//! [`MotionModel::length`] gives. Places that people name, so many millimetres past a sensor, count in surveyed lengths, which
//! differ a little from path lengths.

use super::location::{DueSensor, Located, PassedSensor, PathPoint, Rest};
use super::motion_filter::MotionFilter;
use super::path_length::{PathReach, hop_length, path_reaches, taping_deviation};
use super::reachable_set::ReachableSet;
use super::rollout::Rollout;
use super::track_context::TrackContext;
use crate::event::{Event, EventKind};
use crate::ids::{NodeId, SensorId, SpeedStep, TrainId};
use crate::linalg::Gaussian;
use crate::link::{DetectionWindow, TruncatedNormal};
use crate::model::MotionModel;
use crate::time::{TimeSpan, Timestamp};
use crate::units::{Length, Speed};

/// Standard deviation of the position of a lost train (m).
const ANYWHERE_M: f64 = 30.0;
/// A sensor that is this many standard deviations behind the train was missed.
const MISSED_BEYOND: f64 = 4.0;
/// A less likely report (ln of a density in 1/s) belongs to another train, or to none.
const LEAST_LIKELIHOOD: f64 = -40.0;
/// A report with a larger innovation (standard deviations) contradicts the estimate of the train or of the path.
pub(super) const GATE: f64 = 3.0;
/// 95 % of starts are less late than this many standard deviations.
const LATE: f64 = 1.645;
/// The least speed with which times are converted to distances (m/s): a train thought at rest may still creep.
pub(super) const LEAST_SPEED_M_PER_S: f64 = 0.005;

/// Estimates the position of one train.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Locator {
    train: TrainId,
    /// Where the clock of the filter begins.
    epoch: Timestamp,
    /// The sensor from which distances count; `None` while the train is lost.
    node: Option<NodeId>,
    /// Whether no detection gave that sensor: a train that was placed or has reversed near it may still be about to pass it.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "core::ops::Not::not"))]
    is_unpassed: bool,
    #[cfg_attr(feature = "serde", serde(rename = "following"))]
    filter: MotionFilter,
}

impl Locator {
    /// A train at rest at an unknown place.
    pub fn new(train: TrainId) -> Self {
        let nowhere = Gaussian { mean: 0.0, variance: ANYWHERE_M * ANYWHERE_M };
        let filter = MotionFilter::at_rest(0.0, nowhere);
        Self { train, epoch: Timestamp::ZERO, node: None, is_unpassed: false, filter }
    }

    /// The train.
    pub const fn train(&self) -> TrainId {
        self.train
    }

    /// Whether its position is known.
    pub const fn is_located(&self) -> bool {
        self.node.is_some()
    }

    /// The sensor from which its distance counts; `None` while it is lost.
    pub(super) const fn node(&self) -> Option<NodeId> {
        self.node
    }

    fn seconds(&self, time: Timestamp) -> f64 {
        (time - self.epoch).as_s()
    }

    fn timestamp(&self, seconds: f64) -> Timestamp {
        self.epoch + TimeSpan::from_s(seconds)
    }

    /// The train is at rest here, within one standard deviation: placed by hand, measured with a tape, or reversed.
    pub fn place(&mut self, now: Timestamp, at: PathPoint, uncertainty: Length) {
        self.settle(now, at, uncertainty);
        self.is_unpassed = true;
    }

    /// From now on the train is at rest where it is estimated, even if a better model would predict another place.
    pub fn settle(&mut self, now: Timestamp, at: PathPoint, uncertainty: Length) {
        let sd = uncertainty.as_m();
        let place = Gaussian { mean: at.distance.as_m(), variance: sd * sd };
        self.filter = MotionFilter::at_rest(self.seconds(now), place);
        self.node = Some(at.node);
    }

    /// The position of the train is lost: it was lifted, or reports contradict it. It keeps running at the commanded step.
    pub const fn lose(&mut self) {
        self.node = None;
        self.filter.widen_place(ANYWHERE_M * ANYWHERE_M);
    }

    /// Whether the same commands repeat from now on, so that the filter should learn what its changes have in common.
    pub(crate) fn repeat(&mut self, is_repeating: bool) {
        self.filter.repeat(is_repeating);
    }

    /// A command to the train has left the line. Other entries are ignored.
    pub fn handle_command(&mut self, context: TrackContext<'_>, model: &MotionModel, event: &Event) {
        match event.kind {
            EventKind::Speed { train, step } if train == self.train => {
                self.filter.command(model, self.seconds(event.time), step.get());
                self.filter.offset_stop(self.stop_offset(context, model, &self.filter));
            }
            // It faces the other direction now; how far its pickup reaches on that side is unknown here.
            EventKind::Reverse { train } if train == self.train => self.lose(),
            _ => {}
        }
    }

    /// Whether it is at rest at a time not before the last entry, located or not.
    pub fn is_at_rest(&self, model: &MotionModel, at: Timestamp) -> bool {
        let time = self.seconds(at);
        self.filter.at(model, time).rests_at(time)
    }

    /// The node from which its distance counts, the distance (m) and the speed (m/s); `None` while it is lost.
    pub(super) fn motion_at(&self, model: &MotionModel, at: Timestamp) -> Option<(NodeId, Gaussian, f64)> {
        let time = self.seconds(at);
        Some((self.node?, self.filter.place(model, time), self.filter.speed(model, time).mean))
    }

    /// Every path to a sensor that is open by the known turnouts.
    pub(super) fn reaches<'g>(
        &self,
        context: TrackContext<'g>,
        model: &'g MotionModel,
        sensor: SensorId,
    ) -> impl Iterator<Item = PathReach> + 'g {
        let from = self.node;
        let own = from.filter(|node| self.is_unpassed && context.layout.sensor_at(*node) == Some(sensor));
        let paths = from.into_iter().flat_map(move |from| path_reaches(context, model, from, sensor));
        own.map(|_| PathReach::NONE).into_iter().chain(paths)
    }

    /// The most likely path to a sensor, how far the train was short of it when it reported, and the log-likelihood.
    pub(super) fn best_reach(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        sensor: SensorId,
        window: DetectionWindow,
    ) -> Option<(PathReach, Gaussian, f64)> {
        let time = self.seconds(window.middle());
        let place = self.filter.place(model, time);
        let speed = self.filter.speed(model, time).mean.max(LEAST_SPEED_M_PER_S);
        let noise = model.sensor_variance(Some(sensor)) + speed * speed * window.variance_s2();
        let short = |reach: &PathReach| Gaussian {
            mean: reach.length.mean - place.mean,
            variance: place.variance + reach.length.variance + noise,
        };
        self.reaches(context, model, sensor)
            .map(|reach| {
                let short = short(&reach);
                (reach, short, log_density(short) + libm::log(speed) + reach.log_chance())
            })
            .max_by(|(_, _, one), (_, _, other)| one.total_cmp(other))
    }

    /// Log-likelihood that this train closed a sensor within a window: ln of a probability density in 1/s, `None` if it is
    /// impossible. A lost train may be anywhere (`0`).
    pub fn likelihood(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        sensor: SensorId,
        window: DetectionWindow,
    ) -> Option<f64> {
        if self.node.is_none() {
            return Some(0.0);
        }
        let (_, _, likelihood) = self.best_reach(context, model, sensor, window)?;
        Some(likelihood).filter(|likelihood| *likelihood > LEAST_LIKELIHOOD)
    }

    /// Takes a report that data association assigned to this train.
    pub fn pass(
        &mut self,
        context: TrackContext<'_>,
        model: &MotionModel,
        sensor: SensorId,
        window: DetectionWindow,
    ) -> PassedSensor {
        let time = self.seconds(window.middle());
        let (at, is_origin) = (window.middle(), false);
        let known = PassedSensor { sensor, window, at, late: None, short: None, missed: 0, is_origin };
        let Some(node) = context.node_of(sensor) else { return known };
        let scatter = model.sensor_variance(Some(sensor));
        let Some((reach, short, _)) = self.best_reach(context, model, sensor, window) else {
            // Lost until now, or no path leads here: the train is here all the same, at the speed it had.
            self.filter.widen_place(ANYWHERE_M * ANYWHERE_M);
            self.filter.shift(-self.filter.place(model, time).mean, 0.0);
            let here = Gaussian { mean: 0.0, variance: scatter };
            self.filter.pass(model, time, window.variance_s2(), here);
            (self.node, self.is_unpassed) = (Some(node), false);
            return known;
        };
        let speed = self.filter.speed(model, time).mean.max(LEAST_SPEED_M_PER_S);
        let here = Gaussian { mean: 0.0, variance: scatter };
        let contradicts = short.mean * short.mean > GATE * GATE * short.variance;
        let mut at = window.middle();
        if !contradicts {
            at = self.fuse(model, [reach.length, here], window, time + short.mean / speed);
        } else if !self.blame_change(model, time, window, [reach.length, here], short.mean) {
            // Model and report contradict each other. An error of the path is not attributed to the train's speed, so that
            // the next sensors still show it.
            let place = Gaussian { variance: reach.length.variance + scatter, ..reach.length };
            self.filter.pass(model, time, window.variance_s2(), place);
            self.filter.shift(-reach.length.mean, 0.0);
            // The sensor gives the position all the same: the innovation exceeds its predicted variance.
            self.filter.widen_place(short.mean * short.mean);
            self.filter.pass(model, time, window.variance_s2(), here);
        }
        (self.node, self.is_unpassed) = (Some(node), false);
        let late = [-short.mean / speed, libm::sqrt(short.variance) / speed].map(TimeSpan::from_s);
        PassedSensor {
            at,
            late: Some(late),
            short: Some(Length::from_m(short.mean)),
            missed: reach.missed,
            is_origin: reach.is_none(),
            ..known
        }
    }

    /// Updates with a report that contradicts the prediction while the speed changes: a change that is not complete will continue to
    /// deviate, and the sensor gives the position, however uncertain the path to it is. Returns `false`, and leaves the estimate as it
    /// was, if no change explains the report: a train that stalled before it was to start comes later than any start.
    fn blame_change(
        &mut self,
        model: &MotionModel,
        time: f64,
        window: DetectionWindow,
        [length, sensor]: [Gaussian; 2],
        short: f64,
    ) -> bool {
        let before = self.filter;
        if !self.filter.widen_change(model, time, short) {
            return false;
        }
        self.filter.shift(-length.mean, length.variance);
        self.filter.pass(model, time, window.variance_s2(), sensor);
        let left = self.filter.place(model, time);
        let speed = self.filter.speed(model, time).mean.max(LEAST_SPEED_M_PER_S);
        let variance = left.variance + sensor.variance + speed * speed * window.variance_s2();
        let explains = left.mean * left.mean <= GATE * GATE * variance;
        if !explains {
            self.filter = before;
        }
        explains
    }

    /// Updates with a report that agrees with the prediction, by which the train was due at a time (s). The train reached the
    /// sensor within the window; within it, the prediction alone says which times are likely. Distances count from this
    /// sensor from now on. Returns the most likely time of the passage.
    fn fuse(
        &mut self,
        model: &MotionModel,
        [length, sensor]: [Gaussian; 2],
        window: DetectionWindow,
        due: f64,
    ) -> Timestamp {
        let [after, until] = [window.after, window.until].map(|end| self.seconds(end));
        let time = due.clamp(after, until.max(after));
        let place = self.filter.place(model, time);
        let speed = self.filter.speed(model, time).mean.max(LEAST_SPEED_M_PER_S);
        let short = TruncatedNormal {
            mean: length.mean - place.mean,
            variance: place.variance + length.variance + sensor.variance,
            low: speed * (after - time),
            high: speed * (until - time),
        };
        let (measured, variance) = short.as_measurement();
        self.filter.shift(-length.mean, length.variance);
        let here = Gaussian { mean: -measured, variance: sensor.variance + variance };
        self.filter.pass(model, time, 0.0, here);
        self.timestamp(time + short.moments().0 / speed)
    }

    /// Its decoder reports its speed (ln m/s), at most so much late. Returns whether that changed the estimate.
    pub(crate) fn take_speed(
        &mut self,
        model: &MotionModel,
        now: Timestamp,
        latest: TimeSpan,
        ln_speed: Gaussian,
    ) -> bool {
        self.filter.take_speed(model, self.seconds(now), latest.as_s(), ln_speed)
    }

    /// Position and speed at a time not before the last entry; `None` while it is lost.
    pub fn locate(&self, context: TrackContext<'_>, model: &MotionModel, at: Timestamp) -> Option<Located> {
        let node = self.node?;
        let time = self.seconds(at);
        let place = self.filter.place(model, time);
        let here = PathPoint { node, distance: Length::from_m(place.mean) };
        let taping = taping_deviation(context, model, here);
        let speed = self.filter.speed(model, time);
        let at_rest = self.filter.at(model, time).rests_at(time);
        Some(Located {
            at: here,
            uncertainty: Length::from_m(libm::sqrt(place.variance + taping * taping)),
            speed: Speed::from_m_per_s(if at_rest { 0.0 } else { speed.mean }),
            speed_uncertainty: Speed::from_m_per_s(libm::sqrt(speed.variance)),
            step: SpeedStep::new(self.filter.step()).unwrap_or(SpeedStep::STAND),
            at_rest,
        })
    }

    /// The sensor it reaches next without another command; `None` while it is at rest, stops short of it or is lost.
    pub fn next_sensor(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        now: Timestamp,
    ) -> Option<DueSensor> {
        let node = self.node?;
        let time = self.seconds(now);
        let here = self.filter.place(model, time);
        let mut run = Gaussian { mean: 0.0, variance: 0.0 };
        for hop in context.hops_ahead(node).take(MOST_HOPS) {
            let reach = hop_length(context, model, &hop);
            run = Gaussian { mean: run.mean + reach.mean, variance: run.variance + reach.variance };
            let beyond = here.mean - run.mean;
            let at = Gaussian { variance: run.variance + model.sensor_variance(hop.sensor), ..run };
            if beyond > MISSED_BEYOND * libm::sqrt(here.variance + at.variance) {
                continue;
            }
            let sensor = hop.sensor?;
            let (due, uncertain_s) = self.filter.reaches(model, at, time)?;
            let speed = self.filter.speed(model, due).mean;
            return Some(DueSensor {
                sensor,
                time: self.timestamp(due),
                uncertainty: TimeSpan::from_s(uncertain_s),
                speed: Speed::from_m_per_s(speed),
            });
        }
        None
    }

    /// The most likely motion from here; `None` while it is lost.
    pub(crate) fn rollout(&self) -> Option<Rollout> {
        Some(Rollout::new(self.node?, self.epoch, self.filter.course()))
    }

    /// All motion that is possible from here.
    pub(crate) const fn reachable_set(&self) -> ReachableSet {
        ReachableSet::new(self.node, self.epoch, self.filter)
    }

    /// Where it would come to rest if step 0 left the line at a time not before the last entry. For a train that was commanded
    /// to stop already, where it comes to rest anyway.
    pub fn rest_if_stopped(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        at: Timestamp,
    ) -> Option<Rest> {
        let mut stopped = self.filter;
        stopped.command(model, self.seconds(at), 0);
        self.rest_of(context, stopped, model)
    }

    /// The same for a train at rest that receives a step at `start` first: a short move.
    pub fn rest_after_move(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        start: Timestamp,
        step: SpeedStep,
        stop: Timestamp,
    ) -> Option<Rest> {
        let mut moved = self.filter;
        moved.command(model, self.seconds(start), step.get());
        moved.command(model, self.seconds(stop.max(start)), 0);
        self.rest_of(context, moved, model)
    }

    /// Whether the change of speed commanded last has shown: one more would interrupt it otherwise.
    pub fn has_change_shown(&self, model: &MotionModel, at: Timestamp) -> bool {
        self.filter.has_shown(model, self.seconds(at))
    }

    /// By when a train that was commanded to start from rest has started, with 95 % probability.
    pub(crate) fn started_by(&self, model: &MotionModel) -> Option<Timestamp> {
        let (begins, deviation) = self.filter.course().start(model)?;
        Some(self.timestamp(begins + LATE * deviation))
    }

    /// By how much (m) the stop of a train that was commanded to stop is longer because of the track that it runs over.
    fn stop_offset(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        filter: &MotionFilter,
    ) -> Option<Gaussian> {
        let mut anywhere = *filter;
        anywhere.offset_stop(None);
        let (rest, effect) = anywhere.stop(model)?;
        let mut begins = 0.0;
        let edges = context.hops_ahead(self.node?).take(MOST_HOPS).flat_map(|hop| {
            let length = hop_length(context, model, &hop).mean;
            let scale = if hop.length > Length::ZERO { length / hop.length.as_m() } else { 0.0 };
            hop.edges.iter().map(move |edge| (*edge, scale))
        });
        let parts = edges.map_while(|(edge, scale)| {
            let from = begins;
            begins += scale * context.layout.edge(edge)?.length.as_m();
            (from < rest).then(|| (edge, effect.between(rest - from, rest - begins)))
        });
        Some(model.stop_offset(parts, effect.speed))
    }

    fn rest_of(
        &self,
        context: TrackContext<'_>,
        mut filter: MotionFilter,
        model: &MotionModel,
    ) -> Option<Rest> {
        let node = self.node?;
        filter.offset_stop(self.stop_offset(context, model, &filter));
        let (place, scatter, time) = filter.rest(model)?;
        let at = PathPoint { node, distance: Length::from_m(place.mean) };
        let taping = taping_deviation(context, model, at);
        Some(Rest {
            at,
            doubt: Length::from_m(libm::sqrt(place.variance + taping * taping)),
            scatter: Length::from_m(libm::sqrt(scatter)),
            time: self.timestamp(time),
        })
    }
}

/// Hops considered ahead of a train: more than its stopping distance and a few missed detections.
const MOST_HOPS: usize = 8;

/// ln of the density of a normal distribution at zero.
pub(super) fn log_density(of: Gaussian) -> f64 {
    let variance = of.variance.max(f64::MIN_POSITIVE);
    -0.5 * (of.mean * of.mean / variance + libm::log(2.0 * core::f64::consts::PI * variance))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::survey::SectionIndex;
    use crate::track::TurnoutStates;
    use crate::track::example::oval;

    #[test]
    fn commands_of_its_own_train_move_it_and_its_reversal_loses_it() {
        let (layout, turnouts) = (oval(), TurnoutStates::unknown());
        let sections = SectionIndex::of(&layout);
        let context = TrackContext { layout: &layout, sections: &sections, turnouts: &turnouts };
        let step = SpeedStep::new(14).unwrap();
        let [train, other] = [24, 58].map(TrainId);
        let model = MotionModel::unknown(train, step);
        let at = PathPoint { node: layout.node_named("D1").unwrap(), distance: Length::from_mm(100.0) };
        let mut locator = Locator::new(train);
        assert!(!locator.is_located());
        locator.place(Timestamp::from_s(1.0), at, Length::from_mm(3.0));
        let mut handle = |kind| {
            locator.handle_command(context, &model, &Event { time: Timestamp::from_s(2.0), kind });
            (locator.is_located(), locator.is_at_rest(&model, Timestamp::from_s(6.0)))
        };
        assert_eq!(handle(EventKind::Reverse { train: other }), (true, true));
        assert_eq!(handle(EventKind::Speed { train: other, step }), (true, true));
        assert_eq!(handle(EventKind::Speed { train, step }), (true, false));
        assert_eq!(handle(EventKind::Reverse { train }), (false, false), "it runs on, at an unknown place");
    }
}
