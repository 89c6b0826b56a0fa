//! Where one train is between two contacts, through changes of speed, and where it would come to rest.
//!
//! Ways are counted from a contact passed, in lengths as the train feels them: a contact-to-contact hop is as long as
//! [`MotionModel::length`] says. What people call a place, so many millimetres past a contact, is counted in lengths of a
//! tape, which a train feels a little longer or shorter.

use super::motion_filter::MotionFilter;
use super::path_length::{PathReach, hop_length, path_reaches, taping_doubt};
use super::reachable_set::ReachableSet;
use super::rollout::Rollout;
use super::track_context::TrackContext;
use crate::event::{Event, EventKind};
use crate::ids::{NodeId, SensorId, SpeedStep, TrainId};
use crate::linalg::Gaussian;
use crate::link::{ContactWindow, TruncatedNormal};
use crate::model::MotionModel;
use crate::time::{TimeSpan, Timestamp};
use crate::track::HopId;
use crate::units::{Length, Speed};

/// Contacts close a little earlier or later from one passage to the next (m).
pub(super) const CONTACT_SCATTER_M: f64 = 0.0015;
/// Nobody knows where a train is that is lost, to this far (m).
const ANYWHERE_M: f64 = 30.0;
/// A contact that is this many standard deviations behind the train has been missed.
const MISSED_BEYOND: f64 = 4.0;
/// A report this unlikely (ln of a density in 1/s) is of another train, or of none.
const LEAST_LIKELIHOOD: f64 = -40.0;
/// A report that is off by more standard deviations contradicts what is believed of the train or of the way.
pub(super) const BELIEVED: f64 = 3.0;
/// A moment (s) in which a train at rest could have come a little further than is known.
pub(super) const LEAST_SPEED_M_PER_S: f64 = 0.005;

/// A place on the way of a train, counted in lengths as the train feels them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WayPoint {
    /// The node of the contact from which it is counted.
    pub node: NodeId,
    /// How far past it, along the way as the turnouts lie.
    pub way: Length,
}

/// Where a train is and how sure that is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Located {
    /// The most likely place of its pickup.
    pub at: WayPoint,
    /// One standard deviation of the way.
    pub uncertainty: Length,
    /// Its speed.
    pub speed: Speed,
    /// One standard deviation of that.
    pub speed_uncertainty: Speed,
    /// The step it was commanded last.
    pub step: SpeedStep,
    /// Whether it stands, as far as is known.
    pub at_rest: bool,
}

/// Where a train would come to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// The most likely place.
    pub at: WayPoint,
    /// One standard deviation of what is not known: the place now and the way to rest.
    pub doubt: Length,
    /// One standard deviation of what no knowledge would narrow: how stops from there scatter.
    pub scatter: Length,
    /// When it stands, at the latest as far as is foreseen.
    pub time: Timestamp,
}

/// The next contact that is due.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DueContact {
    /// The contact.
    pub sensor: SensorId,
    /// When it should close.
    pub time: Timestamp,
    /// One standard deviation of that.
    pub uncertainty: TimeSpan,
    /// How fast the train will be there.
    pub speed: Speed,
}

/// A contact that the train passed, beside what had been expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassedContact {
    /// The contact.
    pub sensor: SensorId,
    /// When it closed, as the report has it.
    pub window: ContactWindow,
    /// When it closed most likely, as report and forecast have it together.
    pub at: Timestamp,
    /// How much later than expected the middle of the window was, and one standard deviation of that expectation with
    /// the window in it; `None` for the first contact after the train was lost.
    pub late: Option<[TimeSpan; 2]>,
    /// The same as way: how far the train was short of the contact when it was expected there.
    pub short: Option<Length>,
    /// Contacts between the one passed before and this one that did not report.
    pub missed: usize,
}

/// Follows one train.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Locator {
    train: TrainId,
    /// Where the clock of `following` begins.
    epoch: Timestamp,
    /// The contact from which ways are counted; `None` while the train is lost.
    node: Option<NodeId>,
    following: MotionFilter,
}

impl Locator {
    /// A train that stands nobody knows where.
    #[must_use]
    pub fn new(train: TrainId) -> Self {
        let nowhere = Gaussian { mean: 0.0, variance: ANYWHERE_M * ANYWHERE_M };
        Self { train, epoch: Timestamp::ZERO, node: None, following: MotionFilter::at_rest(0.0, nowhere) }
    }

    /// The train.
    #[must_use]
    pub const fn train(&self) -> TrainId {
        self.train
    }

    /// Whether anybody knows where it is.
    #[must_use]
    pub const fn is_located(&self) -> bool {
        self.node.is_some()
    }

    /// The contact from which its way is counted; `None` while it is lost.
    pub(super) const fn node(&self) -> Option<NodeId> {
        self.node
    }

    fn seconds(&self, time: Timestamp) -> f64 {
        (time - self.epoch).as_s()
    }

    fn timestamp(&self, seconds: f64) -> Timestamp {
        self.epoch + TimeSpan::from_s(seconds)
    }

    /// The train stands here, within one standard deviation: a person put it there or read it off a tape.
    pub fn place(&mut self, now: Timestamp, at: WayPoint, uncertainty: Length) {
        let sd = uncertainty.as_m();
        let place = Gaussian { mean: at.way.as_m(), variance: sd * sd };
        self.following = MotionFilter::at_rest(self.seconds(now), place);
        self.node = Some(at.node);
    }

    /// Nobody knows where the train is: it was lifted, or reports make no sense. It runs on at the step it was told.
    pub const fn lose(&mut self) {
        self.node = None;
        self.following.doubt_place(ANYWHERE_M * ANYWHERE_M);
    }

    /// Whether from now on it is told the same again and again, so that what its changes have in common is worth learning.
    pub(crate) fn repeat(&mut self, is_repeating: bool) {
        self.following.repeat(is_repeating);
    }

    /// A command to the train has left the line. Other entries say nothing here.
    pub fn handle_command(&mut self, context: TrackContext<'_>, model: &MotionModel, event: &Event) {
        match event.kind {
            EventKind::Speed { train, step } if train == self.train => {
                self.following.command(model, self.seconds(event.time), step.get());
                self.following.stop_on(self.stops_on(context, model, &self.following));
            }
            // It faces the other way now; how far its pickup reaches on that side is not known here.
            EventKind::Reverse { train } if train == self.train => self.lose(),
            _ => {}
        }
    }

    /// The node from which its way is counted, where it is from there (m) and how fast it runs (m/s); `None` while it is
    /// lost.
    pub(super) fn motion_at(&self, model: &MotionModel, at: Timestamp) -> Option<(NodeId, Gaussian, f64)> {
        let time = self.seconds(at);
        Some((self.node?, self.following.place(model, time), self.following.speed(model, time).mean))
    }

    /// The way to a contact that fits best, and how far the train was short of it when it reported.
    pub(super) fn best_reach(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        sensor: SensorId,
        window: ContactWindow,
    ) -> Option<(PathReach, Gaussian, f64)> {
        let time = self.seconds(window.middle());
        let place = self.following.place(model, time);
        let speed = self.following.speed(model, time).mean.max(LEAST_SPEED_M_PER_S);
        let noise = CONTACT_SCATTER_M * CONTACT_SCATTER_M + speed * speed * window.variance_s2();
        let short = |reach: &PathReach| Gaussian {
            mean: reach.length.mean - place.mean,
            variance: place.variance + reach.length.variance + noise,
        };
        path_reaches(context, model, self.node?, sensor)
            .map(|reach| {
                let short = short(&reach);
                (reach, short, log_density(short) + libm::log(speed) + reach.log_chance())
            })
            .max_by(|(_, _, one), (_, _, other)| one.total_cmp(other))
    }

    /// How likely it is that this train closed a contact within a window: the logarithm of the probability density in
    /// 1/s, `None` if it cannot be. A train that is lost may be anywhere (`0`).
    #[must_use]
    pub fn likelihood(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        sensor: SensorId,
        window: ContactWindow,
    ) -> Option<f64> {
        if self.node.is_none() {
            return Some(0.0);
        }
        let (_, _, likelihood) = self.best_reach(context, model, sensor, window)?;
        Some(likelihood).filter(|likelihood| *likelihood > LEAST_LIKELIHOOD)
    }

    /// The train passed a contact: it is judged to have been this train.
    pub fn pass(
        &mut self,
        context: TrackContext<'_>,
        model: &MotionModel,
        sensor: SensorId,
        window: ContactWindow,
    ) -> PassedContact {
        let time = self.seconds(window.middle());
        let known = PassedContact { sensor, window, at: window.middle(), late: None, short: None, missed: 0 };
        let Some(node) = context.node_of(sensor) else { return known };
        let Some((reach, short, _)) = self.best_reach(context, model, sensor, window) else {
            // Lost until now, or no way leads here: it is here all the same, as fast as it was.
            self.following.doubt_place(ANYWHERE_M * ANYWHERE_M);
            self.following.shift(-self.following.place(model, time).mean, 0.0);
            let here = Gaussian { mean: 0.0, variance: CONTACT_SCATTER_M * CONTACT_SCATTER_M };
            self.following.pass(model, time, window.variance_s2(), here);
            self.node = Some(node);
            return known;
        };
        let speed = self.following.speed(model, time).mean.max(LEAST_SPEED_M_PER_S);
        let scatter = CONTACT_SCATTER_M * CONTACT_SCATTER_M;
        let contradicts = short.mean * short.mean > BELIEVED * BELIEVED * short.variance;
        let mut at = window.middle();
        if !contradicts {
            at = self.fuse(model, &reach, window, time + short.mean / speed);
        } else if self.following.doubt_change(model, time, short.mean) {
            // What was believed is off by more than it said of itself; a change of speed under way will go on to be.
            // The contact says where the train is past it, however little is known of the way there.
            self.following.shift(-reach.length.mean, reach.length.variance);
            let here = Gaussian { mean: 0.0, variance: scatter };
            self.following.pass(model, time, window.variance_s2(), here);
        } else {
            // Something is not as it is believed to be. What the way may be wrong by is not laid to the train's speed, so
            // that the next contacts go on saying it.
            let place = Gaussian { variance: reach.length.variance + scatter, ..reach.length };
            self.following.pass(model, time, window.variance_s2(), place);
            self.following.shift(-reach.length.mean, 0.0);
            // Where it is the contact says all the same: what was believed is off by more than it said of itself.
            self.following.doubt_place(short.mean * short.mean);
            let here = Gaussian { mean: 0.0, variance: scatter };
            self.following.pass(model, time, window.variance_s2(), here);
        }
        self.node = Some(node);
        let late = [-short.mean / speed, libm::sqrt(short.variance) / speed].map(TimeSpan::from_s);
        PassedContact {
            at,
            late: Some(late),
            short: Some(Length::from_m(short.mean)),
            missed: reach.missed,
            ..known
        }
    }

    /// Takes in a report that agrees with the forecast, by which the train was due at a time (s): it came to the sensor
    /// within the window, and no time in it is more likely than the forecast makes it. Places are counted from there
    /// from now on. Returns when the train was there most likely.
    fn fuse(&mut self, model: &MotionModel, reach: &PathReach, window: ContactWindow, due: f64) -> Timestamp {
        let [after, until] = [window.after, window.until].map(|end| self.seconds(end));
        let time = due.clamp(after, until.max(after));
        let place = self.following.place(model, time);
        let speed = self.following.speed(model, time).mean.max(LEAST_SPEED_M_PER_S);
        let scatter = CONTACT_SCATTER_M * CONTACT_SCATTER_M;
        let short = TruncatedNormal {
            mean: reach.length.mean - place.mean,
            variance: place.variance + reach.length.variance + scatter,
            low: speed * (after - time),
            high: speed * (until - time),
        };
        let (measured, variance) = short.as_measurement();
        self.following.shift(-reach.length.mean, reach.length.variance);
        let here = Gaussian { mean: -measured, variance: scatter + variance };
        self.following.pass(model, time, 0.0, here);
        self.timestamp(time + short.moments().0 / speed)
    }

    /// Where it is at a time that is not before the last entry; `None` while it is lost.
    #[must_use]
    pub fn locate(&self, context: TrackContext<'_>, model: &MotionModel, at: Timestamp) -> Option<Located> {
        let node = self.node?;
        let time = self.seconds(at);
        let place = self.following.place(model, time);
        let here = WayPoint { node, way: Length::from_m(place.mean) };
        let taping = taping_doubt(context, model, here);
        let speed = self.following.speed(model, time);
        let at_rest = self.following.at(model, time).rests_at(time);
        Some(Located {
            at: here,
            uncertainty: Length::from_m(libm::sqrt(place.variance + taping * taping)),
            speed: Speed::from_m_per_s(if at_rest { 0.0 } else { speed.mean }),
            speed_uncertainty: Speed::from_m_per_s(libm::sqrt(speed.variance)),
            step: SpeedStep::new(self.following.step()).unwrap_or(SpeedStep::STAND),
            at_rest,
        })
    }

    /// The contact it comes to next if nothing else is commanded; `None` while it stands, stops short of it or is lost.
    #[must_use]
    pub fn next_contact(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        now: Timestamp,
    ) -> Option<DueContact> {
        let node = self.node?;
        let time = self.seconds(now);
        let here = self.following.place(model, time);
        let mut way = Gaussian { mean: 0.0, variance: CONTACT_SCATTER_M * CONTACT_SCATTER_M };
        for hop in context.hops_ahead(node).take(MOST_HOPS) {
            let reach = hop_length(context, model, &hop);
            way = Gaussian { mean: way.mean + reach.mean, variance: way.variance + reach.variance };
            let beyond = here.mean - way.mean;
            if beyond > MISSED_BEYOND * libm::sqrt(here.variance + way.variance) {
                continue;
            }
            let sensor = hop.sensor?;
            let (due, doubt) = self.following.reaches(model, way, time)?;
            let speed = self.following.speed(model, due).mean;
            return Some(DueContact {
                sensor,
                time: self.timestamp(due),
                uncertainty: TimeSpan::from_s(doubt),
                speed: Speed::from_m_per_s(speed),
            });
        }
        None
    }

    /// Where it most likely goes from here; `None` while it is lost.
    pub(crate) fn rollout(&self) -> Option<Rollout> {
        Some(Rollout::new(self.node?, self.epoch, self.following.course()))
    }

    /// What is to be reckoned with from here.
    pub(crate) const fn reachable_set(&self) -> ReachableSet {
        ReachableSet::new(self.node, self.epoch, self.following)
    }

    /// Where it would come to rest if step 0 left the line at a time (not before the last entry), after any commands
    /// that were sent. For a train that was commanded to stop already, where it comes to rest anyway.
    #[must_use]
    pub fn rest_if_stopped(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        at: Timestamp,
    ) -> Option<Rest> {
        let mut stopped = self.following;
        stopped.command(model, self.seconds(at), 0);
        self.rest_of(context, stopped, model)
    }

    /// The same for a train at rest that is first told a step at `start`: what a short move is made of.
    #[must_use]
    pub fn rest_after_move(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        start: Timestamp,
        step: SpeedStep,
        stop: Timestamp,
    ) -> Option<Rest> {
        let mut moved = self.following;
        moved.command(model, self.seconds(start), step.get());
        moved.command(model, self.seconds(stop.max(start)), 0);
        self.rest_of(context, moved, model)
    }

    /// The hop on which a train that was commanded to stop comes to rest, as far as is known before that is distinguished by hops.
    fn stops_on(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        following: &MotionFilter,
    ) -> Option<HopId> {
        let mut anywhere = *following;
        anywhere.stop_on(None);
        let (rest, ..) = anywhere.rest(model)?;
        let mut way = 0.0;
        for hop in context.hops_ahead(self.node?).take(MOST_HOPS) {
            way += hop_length(context, model, &hop).mean;
            if rest.mean < way {
                return Some(hop.id);
            }
        }
        None
    }

    fn rest_of(
        &self,
        context: TrackContext<'_>,
        mut following: MotionFilter,
        model: &MotionModel,
    ) -> Option<Rest> {
        let node = self.node?;
        following.stop_on(self.stops_on(context, model, &following));
        let (place, scatter, time) = following.rest(model)?;
        let at = WayPoint { node, way: Length::from_m(place.mean) };
        let taping = taping_doubt(context, model, at);
        Some(Rest {
            at,
            doubt: Length::from_m(libm::sqrt(place.variance + taping * taping)),
            scatter: Length::from_m(libm::sqrt(scatter)),
            time: self.timestamp(time),
        })
    }
}

/// Hops looked at ahead of a train: more than its way to rest and a few silent contacts.
const MOST_HOPS: usize = 8;

/// ln of the density of a normal distribution at zero.
pub(super) fn log_density(of: Gaussian) -> f64 {
    let variance = of.variance.max(f64::MIN_POSITIVE);
    -0.5 * (of.mean * of.mean / variance + libm::log(2.0 * core::f64::consts::PI * variance))
}
