//! The published odometer: counts per period through flags, three local filters and a master, and a virtual sensor.

use super::federated_filter::{FederatedFilter, Fusion};
use super::local_filter::MeasuredSpeed;
use super::manoeuvre::{Manoeuvre, ManoeuvreSettings};
use super::published_flags::{PublishedFlags, Reading, Shown};
use super::sharing::Sharing;
use super::virtual_sensor::VirtualSensor;
use crate::odometry::command_watch::Allowed;
use crate::odometry::wheel_channel::WheelChannel;
use crate::odometry::wheels::{Loss, Vehicle, larger, smaller};

/// Variance of a count at a random phase, and of the jitter of its pulses, in squared pulses.
const COUNT_VARIANCE: f64 = 1.0 / 6.0 + 0.05;
/// Wheels silent for longer are locked or at rest (s).
const LOCKED_S: f64 = 0.15;
/// A correction of a train that is slower ends by itself (m/s).
const NEARLY_STANDING: f64 = 0.1;
/// What was so longer ago says nothing of the beginning of a slide (s).
const CALM_S: f64 = 1.5;
/// Without a command, an acceleration of the estimate beyond this shows whether wheels can slip or slide (m/s²).
const BY_ITSELF: f64 = 0.1;

/// What came out of a period.
#[derive(Debug, Clone, Copy)]
pub(in crate::odometry) struct Fused {
    pub(in crate::odometry) speed: f64,
    pub(in crate::odometry) acceleration: f64,
    pub(in crate::odometry) variance: f64,
    pub(in crate::odometry) shares: [f64; 3],
    pub(in crate::odometry) lost: [Option<Loss>; 2],
    /// Which sensors were left out as dead.
    pub(in crate::odometry) dead: [bool; 2],
}

/// Follows the train as published.
#[derive(Debug, Clone)]
pub(in crate::odometry) struct Published {
    fusion: Fusion,
    manoeuvre: Manoeuvre,
    filter: Option<FederatedFilter>,
    flags: PublishedFlags,
    stand_in: Option<VirtualSensor>,
    speed: f64,
    acceleration: f64,
    /// Speed and acceleration when both wheels were last calm, gone on since, and for how long (m/s, m/s², s).
    calm: [f64; 3],
}

impl Published {
    pub(in crate::odometry) fn new(
        fusion: Fusion,
        settings: ManoeuvreSettings,
        reading: Reading,
        vehicle: &Vehicle,
    ) -> Self {
        Self {
            fusion,
            manoeuvre: Manoeuvre::new(settings),
            filter: None,
            flags: PublishedFlags::new(vehicle.thresholds, reading),
            stand_in: None,
            speed: 0.0,
            acceleration: 0.0,
            calm: [0.0; 3],
        }
    }

    /// The first speed (m/s).
    pub(in crate::odometry) fn begin(&mut self, speed: f64) {
        self.speed = speed;
    }

    /// How long the virtual sensor has carried the estimate (s).
    pub(in crate::odometry) fn corrected_for(&self) -> f64 {
        self.stand_in.as_ref().map_or(0.0, VirtualSensor::elapsed)
    }

    /// Takes in `t` seconds in which the wheels turned by `counted` (m).
    pub(in crate::odometry) fn next(
        &mut self,
        wheels: &[WheelChannel; 2],
        counted: [f64; 2],
        allowed: &Allowed,
        dead: [bool; 2],
        vehicle: &Vehicle,
        t: f64,
    ) -> Fused {
        let shown = |wheel: &WheelChannel, read: bool| Shown {
            speed: wheel.tracker.speed(),
            acceleration: wheel.tracker.acceleration(),
            acceleration_deviation: wheel.tracker.acceleration_deviation(),
            read,
            axle: wheel.wheelset.axle,
        };
        let [first, second] = wheels;
        // The paper removes interference before; a dead sensor is no wheel that slips.
        let dead = if self.flags.is_literal() { [false; 2] } else { dead };
        let [first_dead, second_dead] = dead;
        let read = [first.is_read() && !first_dead, second.is_read() && !second_dead];
        let may = if allowed.commanded.is_some() {
            [allowed.slide, allowed.slip]
        } else {
            [self.acceleration < BY_ITSELF, self.acceleration > -BY_ITSELF]
        };
        let predicted = self.speed + self.acceleration * t;
        let commanded = allowed.commanded.unwrap_or(-vehicle.max_brake.as_m_per_s2());
        self.keep_calm(first, second, vehicle, t);
        let mut lost =
            self.flags.judge(&[shown(first, read[0]), shown(second, read[1])], predicted, may, commanded, t);
        let both = lost.iter().all(Option::is_some);
        let silent = [first, second].iter().all(|wheel| wheel.tracker.silence() > LOCKED_S);
        let stood_in = if both { Some(self.stand_in(wheels, lost, silent, vehicle, t)) } else { None };
        if stood_in.is_some_and(|speed| speed < NEARLY_STANDING) && silent {
            self.flags.clear();
            lost = self.flags.lost();
        }
        if !both {
            self.stand_in = None;
        }
        let quantum = |wheel: &WheelChannel| wheel.pitch / t;
        let coarse = larger(quantum(first), quantum(second));
        let measured = |speed: Option<f64>, quantum: f64| {
            let variance = COUNT_VARIANCE * quantum * quantum;
            speed.map_or(MeasuredSpeed::MISSING, |speed| MeasuredSpeed { speed, variance })
        };
        let [first_counted, second_counted] = counted;
        let first_speed = read[0].then_some(first_counted / t);
        let second_speed = read[1].then_some(second_counted / t);
        let before = MeasuredSpeed { speed: self.speed, variance: COUNT_VARIANCE * coarse * coarse };
        let filter = self.filter.get_or_insert_with(|| FederatedFilter::starting_at(self.fusion, before));
        let [first_lost, second_lost] = lost;
        let rolls = [first_lost.is_none(), second_lost.is_none()];
        let trusted = [rolls[0] && first_speed.is_some(), rolls[1] && second_speed.is_some()];
        let speeds = [first_speed, second_speed, stood_in].map(|speed| speed.unwrap_or(0.0));
        let shares = Sharing::PAPER.shares(speeds, trusted);
        let step = self.manoeuvre.next_step(t);
        let measured = [
            measured(first_speed, quantum(first)),
            measured(second_speed, quantum(second)),
            measured(stood_in, coarse),
        ];
        filter.step(&step, measured, shares);
        let master = filter.master();
        let [speed, acceleration] = master.state;
        self.manoeuvre.learn(acceleration, rolls == [true; 2]);
        (self.speed, self.acceleration) = (speed, acceleration);
        Fused { speed, acceleration, variance: master.covariance.speed, shares, lost, dead }
    }

    /// The virtual sensor carries the speed (m/s).
    fn stand_in(
        &mut self,
        wheels: &[WheelChannel; 2],
        [first, second]: [Option<Loss>; 2],
        locked: bool,
        vehicle: &Vehicle,
        t: f64,
    ) -> f64 {
        let kind = first.or(second).unwrap_or(Loss::Slide);
        let most = vehicle.max_traction.as_m_per_s2();
        let speed = self.before(kind);
        let sensor =
            self.stand_in.get_or_insert_with(|| VirtualSensor::new(kind, speed, most, vehicle.thresholds));
        let [a, b] = wheels;
        let speeds = [a, b].map(|wheel| wheel.is_read().then(|| wheel.tracker.speed()));
        sensor.next(speeds, locked, t)
    }

    /// Remembers what the train did while both wheels accelerated as a train can: a slide is flagged a little late.
    fn keep_calm(&mut self, first: &WheelChannel, second: &WheelChannel, vehicle: &Vehicle, t: f64) {
        let most = vehicle.thresholds.correction.as_m_per_s2();
        let calm = |wheel: &WheelChannel| {
            wheel.tracker.acceleration().abs() < most + wheel.tracker.acceleration_deviation()
        };
        self.calm = match self.calm {
            _ if calm(first) && calm(second) => [self.speed, self.acceleration, 0.0],
            [speed, acceleration, age] => [speed + acceleration * t, acceleration, age + t],
        };
    }

    /// The speed before a slide or spin pulled the estimate along (m/s).
    fn before(&self, kind: Loss) -> f64 {
        let [speed, _, age] = self.calm;
        match kind {
            _ if age > CALM_S => self.speed,
            Loss::Slide => larger(self.speed, speed),
            Loss::Spin => smaller(self.speed, larger(speed, 0.0)),
        }
    }

    /// The train has turned round: begins again at the next period.
    pub(in crate::odometry) fn restart(&mut self, speed: f64) {
        self.filter = None;
        self.stand_in = None;
        self.flags.clear();
        self.speed = speed;
        self.acceleration = 0.0;
        self.calm = [speed, 0.0, 0.0];
    }
}
