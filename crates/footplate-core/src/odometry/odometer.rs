//! One period in, one estimate out.
//!
//! The order of a period: read both wheelsets; ask what the command allows; narrow the guaranteed bounds; let every
//! hypothesis explain the counts; sum up the estimate and its interval; add up the distance.

use super::balise_link::DistanceInterval;
use super::command_watch::CommandWatch;
use super::diameter::WheelScale;
use super::distance_bounds::DistanceBounds;
use super::guaranteed_speed::GuaranteedSpeed;
use super::hypotheses::Bank;
use super::inertia::Inertia;
use super::motion_estimate::{Mode, MotionBounds, MotionEstimate, WheelState};
use super::paper::Published;
use super::places::{Places, Rolled};
use super::settings::{Carrier, OdometrySettings};
use super::wheel_channel::WheelChannel;
use super::wheels::{Loss, Period, Range, Vehicle, VehicleError, larger, smaller};
use crate::units::{Acceleration, Length, Speed};

/// A longer time without a period breaks the run: the train can have done anything (s).
const GAP_S: f64 = 2.0;
/// Slower than this it may (m/s).
const TURNED_ROUND: f64 = 0.1;
/// First counts that differ by less are of one speed (pulses).
const AGREE_PULSES: f64 = 2.5;
/// Deviation of the speed that the first period tells (m/s): its counts may be a spike.
const FIRST_SPEED: f64 = 20.0;
/// What is larger is no command and no place on any line (m).
const LARGEST_EFFORT: f64 = 1.5;
const FARTHEST_PLACE: f64 = 1e8;
/// Wheels that turn this much faster than the train can run (part) are no noise.
const TOO_FAST: f64 = 1.05;

/// Follows one train from its first period.
#[derive(Debug, Clone)]
pub struct Odometer {
    pub(super) vehicle: Vehicle,
    pub(super) settings: OdometrySettings,
    pub(super) wheels: [WheelChannel; 2],
    pub(super) command: CommandWatch,
    /// Guaranteed bounds of speed and distance, in the direction of travel.
    pub(super) bounds: GuaranteedSpeed,
    pub(super) ways: DistanceBounds,
    pub(super) bank: Bank,
    /// The same with the stated probability.
    pub(super) probable_speed: Range,
    pub(super) probable_distance: Range,
    pub(super) last: Option<MotionEstimate>,
    /// 1 the way in which distance grows, −1 the other.
    pub(super) way: f64,
    /// Speed and acceleration in the direction of travel (m/s, m/s²), and the variance of the speed.
    pub(super) speed: f64,
    pub(super) acceleration: f64,
    pub(super) variance: f64,
    pub(super) distance: f64,
    pub(super) blind: f64,
    /// How long no wheelset has told the speed (s).
    pub(super) corrected_for: f64,
    /// No wheel has been read yet.
    pub(super) unread: bool,
    /// The published odometer, where it carries the estimate.
    pub(super) published: Option<Published>,
    pub(super) places: Option<Places>,
    /// The inertial sensor, once there is one.
    pub(super) inertia: Option<Inertia>,
    /// Over- and under-reading up to the last balise (m).
    pub(super) amounts: [f64; 2],
    /// Periods in which both wheelsets turned faster than the train can run.
    pub(super) above_top: u64,
    /// A sensor has told a direction, and a wheel has turned.
    pub(super) signed: bool,
    pub(super) turned: bool,
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

    /// The probability of every hypothesis, in the order of [`HYPOTHESES`](super::HYPOTHESES).
    #[must_use]
    pub fn probabilities(&self) -> [f64; 8] {
        self.bank.probabilities()
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
        let top = self.vehicle.max_speed.as_m_per_s();
        let before = self.ways.distance();
        let reach = Range { low: before.low - top * t, high: before.high + top * t };
        self.relocate(reach, reach);
        self.distance += self.speed * t;
        self.finished(MotionEstimate { distance: Length::from_m(self.distance), ..first }, &last)
    }

    /// The first period of a run. Its counts may be a spike: they begin the estimate and bound nothing.
    fn begin(&mut self, period: &Period) -> MotionEstimate {
        let t = self.vehicle.period.as_s();
        let [first, second] = &mut self.wheels;
        let read = [first.begin(period, 0, t), second.begin(period, 1, t)];
        let pulse = larger(first.pitch, second.pitch) / t;
        let most = self.vehicle.max_speed.as_m_per_s();
        let turns_forward = read.iter().flatten().any(|speed| *speed > 0.0);
        let backwards = read.iter().flatten().any(|speed| *speed < 0.0) || !turns_forward;
        let bounds = Range { low: if backwards { -most } else { 0.0 }, high: most };
        let speed = match read {
            [Some(a), Some(b)] if (a - b).abs() < AGREE_PULSES * pulse => 0.5 * (a + b),
            // A spike adds pulses.
            [Some(a), Some(b)] if a.abs() < b.abs() => a,
            [_, Some(b)] => b,
            [Some(a), None] => a,
            [None, None] => 0.0,
        };
        self.unread = read == [None, None];
        let speed = bounds.nearest(speed);
        self.bounds = GuaranteedSpeed::new(bounds, most);
        self.bank = Bank::new(speed, FIRST_SPEED * FIRST_SPEED, &self.vehicle.wheelsets);
        (self.speed, self.acceleration, self.variance) = (speed, 0.0, FIRST_SPEED * FIRST_SPEED);
        self.probable_speed = bounds;
        // Where within a pulse the wheels stand nothing tells.
        let Range { low, high } = self.probable_distance;
        self.probable_distance = Range { low: low - pulse * t, high: high + pulse * t };
        if let Some(published) = &mut self.published {
            published.begin(speed);
        }
        let nothing = MotionBounds {
            speed_low: Speed::ZERO,
            speed_high: Speed::ZERO,
            distance_low: Length::ZERO,
            distance_high: Length::ZERO,
        };
        let estimate = MotionEstimate {
            time: period.time,
            speed: Speed::from_m_per_s(speed),
            speed_deviation: Speed::from_m_per_s(FIRST_SPEED),
            guaranteed: nothing,
            confidence: nothing,
            acceleration: Acceleration::ZERO,
            distance: Length::ZERO,
            over: Length::ZERO,
            under: Length::ZERO,
            wheels: [WheelState::Rolling; 2],
            mode: if read.iter().all(Option::is_some) { Mode::Normal } else { Mode::Degraded },
            shares: [0.5, 0.5, 0.0],
        };
        let estimate = self.finished(estimate, &estimate);
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
            above_top: self.above_top,
            signed: self.signed,
            turned: self.turned,
            ..fresh
        };
        fresh.relocate(reach, reach);
        let first = fresh.begin(period);
        *self = fresh;
        let estimate =
            self.finished(MotionEstimate { mode: Mode::Degraded, distance: last.distance, ..first }, &last);
        self.last = Some(estimate);
        estimate
    }

    fn fresh(vehicle: Vehicle, settings: OdometrySettings) -> Self {
        let [first, second] = vehicle.wheelsets;
        let top = vehicle.max_speed.as_m_per_s();
        let all = Range { low: -top, high: top };
        Self {
            vehicle,
            settings,
            wheels: [WheelChannel::new(first, &vehicle), WheelChannel::new(second, &vehicle)],
            command: CommandWatch::new(),
            bounds: GuaranteedSpeed::new(all, top),
            ways: DistanceBounds::new(Range::exactly(0.0)),
            bank: Bank::new(0.0, top * top, &vehicle.wheelsets),
            probable_speed: all,
            probable_distance: Range::exactly(0.0),
            last: None,
            way: 1.0,
            speed: 0.0,
            acceleration: 0.0,
            variance: top * top,
            distance: 0.0,
            blind: 0.0,
            corrected_for: 0.0,
            unread: true,
            published: match settings.carrier {
                Carrier::Published { fusion, manoeuvre, reading } => {
                    Some(Published::new(fusion, manoeuvre, reading, &vehicle))
                }
                Carrier::Hypotheses => None,
            },
            places: settings.balises.map(|accuracy| Places::new(vehicle.wheelsets, accuracy)),
            inertia: None,
            amounts: [0.0; 2],
            above_top: 0,
            signed: false,
            turned: false,
        }
    }

    fn follow(&mut self, period: &Period, last: MotionEstimate, t: f64) -> MotionEstimate {
        let effort = period.effort.filter(|effort| effort.abs() <= LARGEST_EFFORT);
        let allowed = self.command.next(effort, t, &self.vehicle);
        let counted = self.read(period, &allowed, t);
        let before = self.speed;
        let speed_before = self.bounds.speed();
        let bounded = self.narrow(period, &allowed, before, t);
        let scene = self.scene(counted, &allowed);
        let too_fast =
            scene.wheels.iter().all(|wheel| wheel.read && wheel.speed > TOO_FAST * scene.top_speed);
        self.above_top += u64::from(too_fast);
        let ran = self.bank.step(&scene, t);
        let [probable_speed, probable_way] = self.bank.interval(&scene, 1.0 - self.settings.confidence, t);
        let (lost, dead) = self.probable();
        let (ran, shares, lost, dead) = if let Some(published) = &mut self.published {
            let fused = published.next(&self.wheels, counted, &allowed, &self.vehicle, t);
            let top = self.vehicle.max_speed.as_m_per_s();
            let speed = larger(smaller(fused.speed, top), -top);
            (self.speed, self.acceleration, self.variance) = (speed, fused.acceleration, fused.variance);
            self.corrected_for = published.corrected_for();
            (0.5 * (before + speed) * t, fused.shares, fused.lost, [false; 2])
        } else {
            (self.speed, self.acceleration, self.variance) = self.bank.motion();
            self.speed = bounded.nearest(self.speed);
            let lost_both = lost.iter().all(Option::is_some);
            self.corrected_for = if lost_both { self.corrected_for + t } else { 0.0 };
            (ran, self.shares(), lost, dead)
        };
        let read = self.wheels.iter().any(WheelChannel::is_read);
        self.blind = if read { 0.0 } else { self.blind + t };
        if let (Some(inertia), [None, None]) = (&mut self.inertia, lost) {
            inertia.align(self.speed, !allowed.slide && !allowed.slip);
        }
        self.distance += self.way * ran;
        self.ways.moved(speed_before, bounded, allowed.acceleration, &self.counted(&allowed), t);
        self.enclose(probable_speed, probable_way, bounded);
        self.place(period, effort, lost, ran);
        let states = self.states(lost, dead);
        let estimate = MotionEstimate {
            time: period.time,
            speed: Speed::from_m_per_s(self.way * self.speed),
            speed_deviation: Speed::from_m_per_s(libm::sqrt(self.variance)),
            acceleration: Acceleration::from_m_per_s2(self.way * self.acceleration),
            distance: Length::from_m(self.distance),
            wheels: states,
            mode: self.mode(states),
            shares,
            ..last
        };
        let estimate = self.finished(estimate, &last);
        self.turn_round();
        estimate
    }

    /// The train is known to be between these places (m, in the direction of travel): guaranteed, and probably.
    fn relocate(&mut self, guaranteed: Range, probable: Range) {
        self.ways.relocate(guaranteed);
        self.probable_distance = probable;
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
        let bounds_nothing = period.balise_deviation.is_some();
        let place = period.balise.filter(|place| place.as_m().abs() <= FARTHEST_PLACE && !bounds_nothing);
        let Some(balise) = place else { return };
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
            let place = if self.way < 0.0 { place.reversed() } else { place };
            self.ways.relocate(place);
            self.probable_distance = place;
        }
        for (wheel, (scale, bounds)) in self.wheels.iter_mut().zip(places.scales()) {
            wheel.rescale(scale, bounds);
        }
    }

    /// Looks the other way once the train has turned round.
    fn turn_round(&mut self) {
        let says = |wheel: &WheelChannel| wheel.told.way() * self.way;
        let back = self.wheels.iter().any(|wheel| says(wheel) < 0.0 && wheel.told.convincing());
        if self.speed > -TURNED_ROUND || !back || self.wheels.iter().any(|wheel| says(wheel) > 0.0) {
            return;
        }
        self.turn();
    }

    pub(super) fn turn(&mut self) {
        self.way = -self.way;
        self.speed = -self.speed;
        self.acceleration = -self.acceleration;
        self.bank.reverse();
        self.bounds.reverse();
        self.ways.reverse();
        self.probable_speed = self.probable_speed.reversed();
        self.probable_distance = self.probable_distance.reversed();
        if let Some(published) = &mut self.published {
            published.restart(self.speed);
        }
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
