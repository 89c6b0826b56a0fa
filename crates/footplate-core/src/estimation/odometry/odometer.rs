//! One period in, one estimate out.
//!
//! The order of a period: read both wheelsets; ask what the command allows; predict the train; judge which wheelset
//! slips or slides; narrow the bounds; let the trusted wheels correct the filter, or the virtual sensor stand in for
//! them; add up the distance.

use super::balise_link::DistanceInterval;
use super::command_watch::CommandWatch;
use super::distance_bounds::DistanceBounds;
use super::inertia::Inertia;
use super::motion_estimate::{Mode, MotionEstimate, WheelState};
use super::past::Past;
use super::places::{Places, Rolled};
use super::published::Published;
use super::settings::{Carrier, OdometrySettings};
use super::speed_bounds::SpeedBounds;
use super::train_filter::TrainFilter;
use super::virtual_sensor::VirtualSensor;
use super::wheel_channel::WheelChannel;
use crate::calibration::WheelScale;
use crate::units::{Acceleration, Length, Speed};
use crate::wheels::{Heading, Loss, Period, Range, SlipSlide, Vehicle, VehicleError, larger, smaller};

/// A longer time without a period breaks the run: the train can have done anything (s).
const GAP_S: f64 = 2.0;
/// Faster than this a train does not turn round from one period to the next (m/s).
const CERTAIN_HEADING: f64 = 1.5;
/// Slower than this it may (m/s).
const TURNED_ROUND: f64 = 0.1;
/// Variance of the speed that the first period tells, in squared pulses per period: a count at a random phase.
const FIRST_COUNT: f64 = 1.0 / 6.0;
/// By how much the speed of the first period may be wrong for the diameter and creepage of a wheel (part of it).
const FIRST_CREEP: f64 = 0.02;
/// What is larger is no command, no reading of an accelerometer (m/s²) and no place on any line (m).
const LARGEST_EFFORT: f64 = 1.5;
const LARGEST_READING: f64 = 50.0;
const FARTHEST_PLACE: f64 = 1e8;
/// Jerk density while the virtual sensor stands in (m²/s⁵): accelerations are known to 0.3 m/s² after a second.
const BLIND_JERK: f64 = 0.1;

/// Follows one train from its first period.
#[derive(Debug, Clone)]
pub struct Odometer {
    pub(super) vehicle: Vehicle,
    pub(super) settings: OdometrySettings,
    pub(super) wheels: [WheelChannel; 2],
    pub(super) command: CommandWatch,
    pub(super) slips: SlipSlide,
    pub(super) bounds: SpeedBounds,
    pub(super) ways: DistanceBounds,
    pub(super) train: TrainFilter,
    pub(super) stand_in: Option<VirtualSensor>,
    pub(super) last: Option<MotionEstimate>,
    /// Seconds since the first period.
    pub(super) clock: f64,
    /// 1 the way in which distance grows, −1 the other.
    pub(super) way: f64,
    pub(super) distance: f64,
    /// How far the counts put the train ahead of where the filter believes it (m).
    pub(super) ahead: f64,
    pub(super) blind: f64,
    /// No wheel has been read yet.
    pub(super) unread: bool,
    /// How long both wheels have turned alike (s).
    pub(super) alike_for: f64,
    /// What the train did before anything slipped or slid.
    pub(super) past: Past,
    /// The published filter, where it carries the estimate.
    pub(super) published: Option<Published>,
    pub(super) places: Option<Places>,
    /// The inertial sensor, once there is one.
    pub(super) inertia: Option<Inertia>,
    /// Over- and under-reading up to the last balise (m).
    pub(super) amounts: [f64; 2],
}

impl Odometer {
    /// An odometer that knows the vehicle and nothing else.
    ///
    /// # Errors
    /// The first value of the vehicle that no railway has.
    pub fn new(vehicle: Vehicle, settings: OdometrySettings) -> Result<Self, VehicleError> {
        vehicle.check()?;
        Ok(Self::fresh(vehicle, settings))
    }

    /// How it works.
    #[must_use]
    pub fn settings(&self) -> OdometrySettings {
        self.settings
    }

    /// What was learnt of the diameters; nothing if the settings do without.
    #[must_use]
    pub fn diameters(&self) -> Option<[WheelScale; 2]> {
        self.places.as_ref().map(|places| places.diameters().scales())
    }

    /// Takes in the readings of one period. Distance is zero at the end of the first.
    pub fn step(&mut self, period: &Period) -> MotionEstimate {
        let Some(last) = self.last else { return self.begin(period) };
        let t = (period.time - last.time).as_s();
        if t <= 0.0 {
            // Time that stands still or goes back says nothing about the train.
            return MotionEstimate { mode: worse(last.mode, Mode::Degraded), ..last };
        }
        if t > GAP_S {
            return self.resume(period, last, t);
        }
        let estimate =
            if self.unread { self.begin_late(period, last, t) } else { self.follow(period, last, t) };
        self.last = Some(estimate);
        estimate
    }

    /// A period after a first one of which nothing was read, as of running counters, whose first value says nothing.
    fn begin_late(&mut self, period: &Period, last: MotionEstimate, t: f64) -> MotionEstimate {
        let first = self.begin(period);
        let Range { low, high } = self.bounds.speed();
        let before = self.ways.distance();
        let reach = Range { low: before.low + (low * t).min(0.0), high: before.high + (high * t).max(0.0) };
        self.ways.relocate(reach);
        self.distance += self.train.v * t;
        self.finished(MotionEstimate { distance: Length::from_m(self.distance), ..first }, &last)
    }

    /// The first period of a run.
    fn begin(&mut self, period: &Period) -> MotionEstimate {
        let t = self.vehicle.period.as_s();
        let [first, second] = &mut self.wheels;
        let read = [first.begin(period, 0, t), second.begin(period, 1, t)];
        let most = self.vehicle.max_speed.as_m_per_s();
        let off = 1.5 * first.pitch.max(second.pitch) / t;
        let mut bounds = Range { low: 0.0, high: most };
        let speeds = read.iter().flatten();
        if let Some(fastest) = speeds.clone().copied().reduce(f64::max) {
            bounds.high = (fastest + FIRST_CREEP * fastest.abs() + off).min(most);
        }
        if let Some(slowest) = speeds.copied().reduce(f64::min) {
            let low = (slowest - FIRST_CREEP * slowest.abs() - off).max(-most);
            bounds.low = if slowest < 0.0 { low } else { low.max(0.0) };
        }
        let (speed, variance) = match read {
            [Some(a), Some(b)] => (0.5 * (a + b), 0.5 * FIRST_COUNT),
            [Some(v), None] | [None, Some(v)] => (v, FIRST_COUNT),
            [None, None] => (0.0, most * most * t * t),
        };
        self.unread = read == [None, None];
        if bounds.is_empty() {
            // Faster than the train can be: no count of a wheel.
            bounds = Range { low: -most, high: most };
        }
        let speed = bounds.nearest(speed);
        self.bounds = SpeedBounds::new(bounds);
        self.train = TrainFilter::new(speed, variance * (first.pitch / t) * (first.pitch / t) + 1e-4);
        let estimate = MotionEstimate {
            time: period.time,
            speed: Speed::from_m_per_s(speed),
            speed_deviation: Speed::from_m_per_s(self.train.speed_deviation()),
            speed_low: Speed::from_m_per_s(bounds.low),
            speed_high: Speed::from_m_per_s(bounds.high),
            acceleration: Acceleration::ZERO,
            distance: Length::ZERO,
            distance_low: Length::ZERO,
            distance_high: Length::ZERO,
            over: Length::ZERO,
            under: Length::ZERO,
            wheels: [WheelState::Rolling; 2],
            mode: if read.iter().all(Option::is_some) { Mode::Normal } else { Mode::Degraded },
            shares: [0.5, 0.5, 0.0],
        };
        self.last = Some(estimate);
        estimate
    }

    /// A period after a gap in which the train can have done anything it is able to.
    fn resume(&mut self, period: &Period, last: MotionEstimate, t: f64) -> MotionEstimate {
        let top = self.vehicle.max_speed.as_m_per_s();
        let before = self.ways.distance();
        let reach = Range { low: before.low - top * t, high: before.high + top * t };
        let fresh = Self::fresh(self.vehicle, self.settings);
        let mut fresh = Self {
            way: self.way,
            distance: self.distance,
            places: self.places.clone(),
            amounts: self.amounts,
            ..fresh
        };
        fresh.ways.relocate(reach);
        let first = fresh.begin(period);
        *self = fresh;
        let estimate =
            self.finished(MotionEstimate { mode: Mode::Degraded, distance: last.distance, ..first }, &last);
        self.last = Some(estimate);
        estimate
    }

    fn fresh(vehicle: Vehicle, settings: OdometrySettings) -> Self {
        let [first, second] = vehicle.wheelsets;
        let fastest = vehicle.max_speed.as_m_per_s();
        Self {
            vehicle,
            settings,
            wheels: [WheelChannel::new(first, &vehicle), WheelChannel::new(second, &vehicle)],
            command: CommandWatch::new(),
            slips: SlipSlide::new(vehicle.thresholds, settings.both_axles, settings.latch),
            bounds: SpeedBounds::new(Range { low: 0.0, high: fastest }),
            ways: DistanceBounds::new(Range::exactly(0.0)),
            train: TrainFilter::new(0.0, fastest * fastest),
            stand_in: None,
            last: None,
            clock: 0.0,
            way: 1.0,
            distance: 0.0,
            ahead: 0.0,
            blind: 0.0,
            unread: true,
            alike_for: 0.0,
            past: Past::new(),
            published: match settings.carrier {
                Carrier::Published { fusion, manoeuvre } => Some(Published::new(fusion, manoeuvre)),
                Carrier::Counts { .. } => None,
            },
            places: settings.balises.map(|accuracy| Places::new(vehicle.wheelsets, accuracy)),
            inertia: None,
            amounts: [0.0; 2],
        }
    }

    fn follow(&mut self, period: &Period, last: MotionEstimate, t: f64) -> MotionEstimate {
        self.clock += t;
        let effort = period.effort.filter(|effort| effort.abs() <= LARGEST_EFFORT);
        let seen = {
            let [first, second] = &self.wheels;
            let (a, b) = (first.smooth_acceleration, second.smooth_acceleration);
            if smaller(a, b) < -larger(a, b) { smaller(a, b) } else { larger(a, b) }
        };
        let held = self.slips.lost().contains(&Some(Loss::Slide));
        let allowed = self.command.next(effort, seen, held, t, &self.vehicle);
        // One forward and the other backward: then neither says that the train has turned round.
        for (wheel, reading) in self.wheels.iter_mut().zip(&period.wheels) {
            wheel.hear(reading, self.way, t);
        }
        let disputed = {
            let [first, second] = &self.wheels;
            first.told.way() * second.told.way() < 0.0
        };
        if disputed && self.way < 0.0 {
            // One of the two is wired the wrong way round; trains that run backward are rarer.
            self.turn();
        }
        let heading = Heading { way: self.way, certain: self.train.v.abs() > CERTAIN_HEADING, disputed };
        let [first_lost, second_lost] = self.slips.lost();
        let at = (t, self.vehicle.period.as_s());
        let [first, second] = &mut self.wheels;
        let counted = [
            first.read(period, 0, at, heading, &allowed, first_lost),
            second.read(period, 1, at, heading, &allowed, second_lost),
        ];

        let possible = self.bounds.possible(&allowed, t);
        let turns = [first.turns(allowed.acceleration), second.turns(allowed.acceleration)];
        let before = self.train.v;
        let jerk = match self.settings.carrier {
            Carrier::Counts { jerk_density } if self.stand_in.is_none() => jerk_density,
            _ => BLIND_JERK,
        };
        let way = self.train.run(t, jerk);
        let mut lost = self.judge(&turns, possible, &allowed, t);
        if self.agreed(&allowed, t) {
            self.slips.clear();
            for wheel in &mut self.wheels {
                wheel.watch.believe();
            }
            lost = [None; 2];
        }
        if lost == [Some(Loss::Slide); 2] {
            self.command.disprove();
        }
        let speed_before = self.bounds.speed();
        let mut bounded = self.narrow(possible, &turns, &allowed, lost, t);
        if self.settings.inertial {
            bounded = self.feel(period, before, bounded, t);
        }

        let trusted = self.trusted(lost);
        let (way, shares) = self.carry(counted, lost, &allowed, before, way, t);
        if self.published.is_none() {
            self.train.v = bounded.nearest(self.train.v);
        }
        self.distance += self.way * way;
        self.ways.moved(speed_before, bounded, allowed.acceleration, &self.counted(lost, &allowed), t);
        self.place(period, effort, lost, way);
        let estimate = MotionEstimate {
            time: period.time,
            speed: Speed::from_m_per_s(self.way * self.train.v),
            speed_deviation: Speed::from_m_per_s(self.train.speed_deviation()),
            acceleration: Acceleration::from_m_per_s2(self.way * self.train.a),
            distance: Length::from_m(self.distance),
            wheels: self.states(lost),
            mode: self.mode(lost, trusted),
            shares,
            ..last
        };
        let estimate = self.finished(estimate, &last);
        self.turn_round();
        estimate
    }

    /// Lets the inertial sensor narrow the bounds; what is left of them.
    fn feel(&mut self, period: &Period, before: f64, bounded: Range, t: f64) -> Range {
        let reading = period
            .acceleration
            .map(|reading| self.way * reading.as_m_per_s2())
            .filter(|reading| reading.abs() <= LARGEST_READING);
        if self.inertia.is_none() && reading.is_some() {
            self.inertia = Some(Inertia::new(before, self.bounds.speed()));
        }
        let Some(inertia) = &mut self.inertia else { return bounded };
        inertia.read(reading, t);
        let both = inertia.hold(bounded);
        self.bounds.set(both);
        both
    }

    /// Lets balises correct the distance and the diameters. The train has just run `way` (m).
    fn place(&mut self, period: &Period, effort: Option<f64>, lost: [Option<Loss>; 2], way: f64) {
        let Some(places) = &mut self.places else { return };
        let [first, second] = &self.wheels;
        let [first_lost, second_lost] = lost;
        let rolled = |wheel: &WheelChannel, lost: Option<Loss>| Rolled {
            nominal: self.way * wheel.pulses * wheel.wheelset_pitch,
            rolls: lost.is_none() && wheel.is_read() && wheel.doubt == 0.0,
        };
        places.roll(period.time, [rolled(first, first_lost), rolled(second, second_lost)], effort);
        let Some(balise) = period.balise.filter(|place| place.as_m().abs() <= FARTHEST_PLACE) else { return };
        let mut bounds = self.ways.distance();
        if self.way < 0.0 {
            bounds = bounds.reversed();
        }
        let now = DistanceInterval {
            estimate: Length::from_m(self.distance),
            low: Length::from_m(bounds.low),
            high: Length::from_m(bounds.high),
        };
        let ran = Length::from_m(self.way * way);
        if let Some(known) = places.pass(period.time, balise, ran, &now) {
            // What was uncertain up to here is summed up; what is uncertain from here on begins anew.
            let [over, under] = &mut self.amounts;
            *over += (self.distance - bounds.low).max(0.0);
            *under += (bounds.high - self.distance).max(0.0);
            self.distance = known.estimate.as_m();
            let place = Range { low: known.low.as_m(), high: known.high.as_m() };
            self.ways.relocate(if self.way < 0.0 { place.reversed() } else { place });
        }
        for (wheel, (scale, bounds)) in self.wheels.iter_mut().zip(places.scales()) {
            wheel.rescale(scale, bounds);
        }
    }

    /// Looks the other way once the train has turned round.
    fn turn_round(&mut self) {
        let says = |wheel: &WheelChannel| wheel.told.way() * self.way;
        let back = self.wheels.iter().any(|wheel| says(wheel) < 0.0 && wheel.told.convincing());
        if self.train.v > -TURNED_ROUND || !back || self.wheels.iter().any(|wheel| says(wheel) > 0.0) {
            return;
        }
        self.turn();
    }

    fn turn(&mut self) {
        self.way = -self.way;
        self.train.reverse();
        self.bounds.reverse();
        self.ways.reverse();
        self.slips.clear();
        self.stand_in = None;
        if let Some(published) = &mut self.published {
            published.restart();
        }
        self.ahead = -self.ahead;
        // Its bias and the gradient are felt the other way round.
        self.inertia = None;
        for wheel in &mut self.wheels {
            wheel.reverse();
        }
    }
}

fn worse(one: Mode, other: Mode) -> Mode {
    if one == Mode::Ambiguous { one } else { other }
}
