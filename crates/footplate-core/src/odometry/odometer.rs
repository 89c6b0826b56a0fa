//! One period in, one estimate out.
//!
//! The order of a period: read both wheelsets; derive what the command allows; narrow the guaranteed bounds; update every
//! hypothesis; combine them into an estimate and its interval; add up the distance.

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

/// A longer gap between periods breaks the run (s): the train can have done anything.
const GAP_S: f64 = 2.0;
/// The estimate has to run backwards by this much before the train counts as reversed (m/s).
const REVERSED: f64 = 0.1;
/// First counts that differ by less agree on a speed (pulses).
const AGREE_PULSES: f64 = 2.5;
/// Standard deviation of the speed from the first period (m/s): its counts may be a spike.
const FIRST_SPEED: f64 = 20.0;
/// A larger command, and a place that is farther (m), are faults.
const LARGEST_EFFORT: f64 = 1.5;
const FARTHEST_PLACE: f64 = 1e8;
/// Wheels that turn this many times faster than the train can run are no noise.
const TOO_FAST: f64 = 1.05;

/// Follows one train from its first period.
#[derive(Debug, Clone)]
pub struct Odometer {
    pub(super) vehicle: Vehicle,
    pub(super) settings: OdometrySettings,
    pub(super) wheels: [WheelChannel; 2],
    pub(super) command: CommandWatch,
    /// Guaranteed bounds of the speed and of the distance, in the direction of travel.
    pub(super) bounds: GuaranteedSpeed,
    pub(super) distance_bounds: DistanceBounds,
    pub(super) bank: Bank,
    /// The same with the stated probability.
    pub(super) probable_speed: Range,
    pub(super) probable_distance: Range,
    pub(super) last: Option<MotionEstimate>,
    /// 1 where distance grows, −1 where it falls.
    pub(super) direction: f64,
    /// Speed and acceleration in the direction of travel (m/s, m/s²), and the variance of the speed.
    pub(super) speed: f64,
    pub(super) acceleration: f64,
    pub(super) variance: f64,
    pub(super) distance: f64,
    pub(super) blind: f64,
    /// How long both wheelsets have been taken to slip (s).
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
    /// A sensor has reported a direction; a wheel has turned.
    pub(super) signed: bool,
    /// Both sensors have reported the same direction at once.
    pub(super) agreed: bool,
    pub(super) turned: bool,
}

impl Odometer {
    /// An odometer for a vehicle, before its first period.
    ///
    /// # Errors
    /// The first value of the vehicle that no railway has.
    pub fn new(vehicle: Vehicle, settings: OdometrySettings) -> Result<Self, VehicleError> {
        vehicle.check()?;
        Ok(Self::fresh(vehicle, settings))
    }

    /// Its settings.
    #[must_use]
    pub fn settings(&self) -> OdometrySettings {
        self.settings
    }

    /// The learnt diameters; none if the settings exclude balises.
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
            // A time that does not advance tells nothing.
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

    /// A period after a first one without a count, as of running counters, whose first value only starts them.
    fn begin_late(&mut self, period: &Period, last: MotionEstimate, t: f64) -> MotionEstimate {
        let first = self.begin(period);
        let top = self.vehicle.max_speed.as_m_per_s();
        let before = self.distance_bounds.distance();
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
        // The phase of each wheel within its pulse is unknown.
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
        let before = self.distance_bounds.distance();
        let reach = Range { low: before.low - top * t, high: before.high + top * t };
        let fresh = Self::fresh(self.vehicle, self.settings);
        let mut fresh = Self {
            direction: self.direction,
            distance: self.distance,
            places: self.places.clone(),
            amounts: self.amounts,
            above_top: self.above_top,
            signed: self.signed,
            agreed: self.agreed,
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
        // What the first period overwrites is anything here.
        Self {
            vehicle,
            settings,
            wheels: [WheelChannel::new(first, &vehicle), WheelChannel::new(second, &vehicle)],
            command: CommandWatch::new(),
            bounds: GuaranteedSpeed::new(Range::ANY, top),
            distance_bounds: DistanceBounds::new(Range::exactly(0.0)),
            bank: Bank::new(0.0, FIRST_SPEED, &vehicle.wheelsets),
            probable_speed: Range::ANY,
            probable_distance: Range::exactly(0.0),
            last: None,
            direction: 1.0,
            speed: 0.0,
            acceleration: 0.0,
            variance: FIRST_SPEED,
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
            agreed: false,
            turned: false,
        }
    }

    fn follow(&mut self, period: &Period, last: MotionEstimate, t: f64) -> MotionEstimate {
        let effort = period.effort.filter(|effort| effort.abs() <= LARGEST_EFFORT);
        let allowed = self.command.next(effort, self.direction < 0.0, t, &self.vehicle);
        let counted = self.read(period, &allowed, t);
        let before = self.speed;
        let speed_before = self.bounds.speed();
        let bounded = self.narrow(period, &allowed, before, t);
        let scene = self.scene(counted, &allowed, bounded);
        let too_fast =
            scene.wheels.iter().all(|wheel| wheel.read && wheel.speed > TOO_FAST * scene.top_speed);
        self.above_top += u64::from(too_fast);
        let ran = self.bank.step(&scene, t);
        let [probable_speed, probable_distance] =
            self.bank.interval(&scene, 1.0 - self.settings.confidence, t);
        let (lost, dead) = self.probable();
        let (ran, shares, lost, dead) = if let Some(published) = &mut self.published {
            let fused = published.next(&self.wheels, counted, &allowed, dead, &self.vehicle, t);
            let top = self.vehicle.max_speed.as_m_per_s();
            let speed = larger(smaller(fused.speed, top), -top);
            (self.speed, self.acceleration, self.variance) = (speed, fused.acceleration, fused.variance);
            self.corrected_for = published.corrected_for();
            (0.5 * (before + speed) * t, fused.shares, fused.lost, fused.dead)
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
        self.distance += self.direction * ran;
        self.distance_bounds.moved(speed_before, bounded, allowed.acceleration, &self.counted(&allowed), t);
        self.enclose(probable_speed, probable_distance, bounded);
        self.place(period, effort, lost, ran);
        let states = self.states(lost, dead);
        let estimate = MotionEstimate {
            time: period.time,
            speed: Speed::from_m_per_s(self.direction * self.speed),
            speed_deviation: Speed::from_m_per_s(libm::sqrt(self.variance)),
            acceleration: Acceleration::from_m_per_s2(self.direction * self.acceleration),
            distance: Length::from_m(self.distance),
            wheels: states,
            mode: self.mode(states),
            shares,
            ..last
        };
        let estimate = self.finished(estimate, &last);
        self.reverse_if_due();
        estimate
    }

    /// Sets both distance intervals (m, in the direction of travel).
    fn relocate(&mut self, guaranteed: Range, probable: Range) {
        self.distance_bounds.relocate(guaranteed);
        self.probable_distance = probable;
    }

    /// Lets balises correct the distance and the diameters. The train has just run by `ran` (m).
    fn place(&mut self, period: &Period, effort: Option<f64>, lost: [Option<Loss>; 2], ran: f64) {
        let Some(places) = &mut self.places else { return };
        let [first, second] = &self.wheels;
        let [first_lost, second_lost] = lost;
        let rolled = |wheel: &WheelChannel, lost: Option<Loss>| Rolled {
            nominal: self.direction * wheel.pulses * wheel.wheelset_pitch,
            rolls: lost.is_none() && wheel.is_read() && wheel.uncertainty == 0.0,
        };
        places.roll(period.time, [rolled(first, first_lost), rolled(second, second_lost)], effort);
        let bounds_nothing = period.balise_deviation.is_some();
        let place = period.balise.filter(|place| place.as_m().abs() <= FARTHEST_PLACE && !bounds_nothing);
        let Some(balise) = place else { return };
        let mut bounds = self.distance_bounds.distance();
        if self.direction < 0.0 {
            bounds = bounds.reversed();
        }
        let now = DistanceInterval {
            estimate: Length::from_m(self.distance),
            low: Length::from_m(bounds.low),
            high: Length::from_m(bounds.high),
        };
        let ran = Length::from_m(self.direction * ran);
        if let Some(known) = places.pass(period.time, balise, ran, &now) {
            // The amounts of the stretch up to here are final; a new stretch begins.
            let [over, under] = &mut self.amounts;
            *over += (self.distance - bounds.low).max(0.0);
            *under += (bounds.high - self.distance).max(0.0);
            self.distance = known.estimate.as_m();
            let place = Range { low: known.low.as_m(), high: known.high.as_m() };
            let place = if self.direction < 0.0 { place.reversed() } else { place };
            self.distance_bounds.relocate(place);
            self.probable_distance = place;
        }
        for (wheel, (scale, bounds)) in self.wheels.iter_mut().zip(places.scales()) {
            wheel.rescale(scale, bounds);
        }
    }

    /// Changes the direction of travel once the train has reversed.
    fn reverse_if_due(&mut self) {
        let reports = |wheel: &WheelChannel| wheel.reported.direction() * self.direction;
        let back = self.wheels.iter().any(|wheel| reports(wheel) < 0.0 && wheel.reported.convincing());
        if self.speed > -REVERSED || !back || self.wheels.iter().any(|wheel| reports(wheel) > 0.0) {
            return;
        }
        self.turn();
    }

    pub(super) fn turn(&mut self) {
        self.direction = -self.direction;
        self.speed = -self.speed;
        self.acceleration = -self.acceleration;
        self.bank.reverse();
        self.bounds.reverse();
        self.distance_bounds.reverse();
        self.probable_speed = self.probable_speed.reversed();
        self.probable_distance = self.probable_distance.reversed();
        if let Some(published) = &mut self.published {
            published.restart(self.speed);
        }
        // Its bias and the gradient change sign.
        self.inertia = None;
        for wheel in &mut self.wheels {
            wheel.reverse();
        }
    }
}

fn worse(one: Mode, other: Mode) -> Mode {
    if one == Mode::Ambiguous { one } else { other }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::odometry::wheels::{Axle, Count, Direction, WheelReading, Wheelset};
    use crate::time::{TimeSpan, Timestamp};

    /// Of a train of 40 m/s with periods of 0.1 s, in which a pulse is π · 1 m / 100.
    fn odometer() -> Odometer {
        let (axle, diameter) = (Axle::Powered, Length::from_m(1.0));
        let wheelset = Wheelset { teeth: 100, diameter, diameter_tolerance: 0.002, axle };
        let abilities = [1.0, 1.2].map(Acceleration::from_m_per_s2);
        let (period, top) = (TimeSpan::from_ms(100), Speed::from_m_per_s(40.0));
        let vehicle = Vehicle::new(period, top, abilities, [wheelset; 2]).unwrap();
        Odometer::new(vehicle, OdometrySettings::recommended()).unwrap()
    }

    fn period(ms: i64, wheels: [WheelReading; 2]) -> Period {
        let time = Timestamp::ZERO + TimeSpan::from_ms(ms);
        Period { time, wheels, effort: None, acceleration: None, balise: None, balise_deviation: None }
    }

    fn assert_near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-5, "{found}, not {expected}");
    }

    fn speeds(bounds: &MotionBounds) -> [f64; 2] {
        [bounds.speed_low, bounds.speed_high].map(Speed::as_m_per_s)
    }

    #[test]
    fn the_first_counts_give_a_speed_if_they_agree_and_otherwise_the_lower_one_does() {
        // 30 pulses in a period are 9.424778 m/s.
        let pulses = WheelReading::pulses;
        for (wheels, speed, mode) in [
            ([pulses(30), pulses(32)], 9.738_937, Mode::Normal),
            ([pulses(30), pulses(33)], 9.424_778, Mode::Normal),
            ([pulses(45), pulses(30)], 9.424_778, Mode::Normal),
            ([pulses(30), WheelReading::MISSING], 9.424_778, Mode::Degraded),
            ([WheelReading::MISSING, pulses(30)], 9.424_778, Mode::Degraded),
        ] {
            let first = odometer().step(&period(0, wheels));
            assert_near(first.speed.as_m_per_s(), speed);
            assert_eq!((first.mode, first.distance), (mode, Length::ZERO));
            assert_eq!([speeds(&first.guaranteed), speeds(&first.confidence)], [[0.0, 40.0]; 2]);
            assert_eq!(first.speed_deviation.as_m_per_s(), 20.0);
        }
        // Wheels that do not turn, or turn backward, do not say that the train runs forward.
        let backward = WheelReading { direction: Direction::Backward, ..pulses(30) };
        for (wheels, speed) in [([pulses(0); 2], 0.0), ([backward; 2], -9.424_778)] {
            let first = odometer().step(&period(0, wheels));
            assert_near(first.speed.as_m_per_s(), speed);
            assert_eq!(speeds(&first.guaranteed), [-40.0, 40.0]);
        }
    }

    #[test]
    fn running_counters_begin_with_their_second_value_and_the_train_may_have_run_until_then() {
        let mut odometer = odometer();
        let counters = |value| [WheelReading { count: Count::Counter(value), ..WheelReading::MISSING }; 2];
        let first = odometer.step(&period(0, counters(1000)));
        assert_eq!((first.mode, first.speed, first.distance), (Mode::Degraded, Speed::ZERO, Length::ZERO));
        let second = odometer.step(&period(100, counters(1030)));
        assert_eq!(second.mode, Mode::Normal);
        assert_near(second.speed.as_m_per_s(), 9.424_778);
        assert_near(second.distance.as_m(), 0.942_478);
        // 40 m/s for 0.1 s either direction.
        assert_near(second.guaranteed.distance_low.as_m(), -4.0);
        assert_near(second.guaranteed.distance_high.as_m(), 4.0);
        assert_near(second.over.as_m(), 4.942_478);
        assert!(second.under.as_m() >= 3.057_522 - 1e-5, "{second:?}");
    }

    #[test]
    fn a_time_that_does_not_advance_changes_nothing_but_the_mode() {
        let mut odometer = odometer();
        odometer.step(&period(0, [WheelReading::pulses(30); 2]));
        let last = odometer.step(&period(100, [WheelReading::pulses(30); 2]));
        for ms in [100, 50] {
            let again = odometer.step(&period(ms, [WheelReading::pulses(99); 2]));
            assert_eq!(again, MotionEstimate { mode: Mode::Degraded, ..last });
        }
        let next = odometer.step(&period(200, [WheelReading::pulses(30); 2]));
        assert!((next.distance - last.distance).as_m() > 0.9, "{next:?}");
    }
}
