//! What carries the estimate in a period: the wheels that are trusted, or the virtual sensor that stands in for them.

use super::command_watch::Allowed;
use super::inertia::Inertia;
use super::odometer::Odometer;
use super::published::PeriodCount;
use super::virtual_sensor::{Beginning, Envelope, Guides, LostWheel, VirtualSensor};
use super::wheel_channel::WheelChannel;
use crate::wheels::{Loss, Range, larger};

/// Difference of speeds at which the wheel that seems to slip or slide loses half its share: three standard deviations
/// of the difference of two wheels that roll (m/s), and what their diameters may differ by (part of the speed).
const APART: (f64, f64) = (0.25, 0.004);
/// Share of a powered wheel in traction beside one that is not: its creep is a bias, the other has none.
const CREEPING_SHARE: f64 = 0.05;
/// Wheels silent for longer in a slide are locked (s).
const LOCKED_S: f64 = 0.15;

/// The acceleration of a train of which no wheel is read fades in so long (s).
const FADES_S: f64 = 5.0;

impl Odometer {
    /// Moves the estimate over a period in which the filter was run on by `way` (m) from `before` (m/s); how far the train
    /// went, and which shares the wheels and the virtual sensor had in that.
    pub(super) fn carry(
        &mut self,
        counted: [f64; 2],
        lost: [Option<Loss>; 2],
        allowed: &Allowed,
        before: f64,
        way: f64,
        t: f64,
    ) -> (f64, [f64; 3]) {
        if self.published.is_some() {
            return self.carry_as_published(counted, lost, allowed, before, t);
        }
        let trusted = self.trusted(lost);
        let shares = self.shares(trusted, allowed);
        let way = if trusted.contains(&true) {
            self.blind = 0.0;
            let way = way + self.correct(counted, way, shares);
            if let Some(inertia) = &mut self.inertia {
                inertia.align(self.train.v, !allowed.slide && !allowed.slip);
            }
            way
        } else {
            self.stand_in(lost, allowed, before, t)
        };
        if self.stand_in.is_none() {
            self.past.remember(self.train.v, self.train.a, self.clock);
        }
        (way, shares)
    }

    /// The same with the published filter.
    fn carry_as_published(
        &mut self,
        counted: [f64; 2],
        lost: [Option<Loss>; 2],
        allowed: &Allowed,
        before: f64,
        t: f64,
    ) -> (f64, [f64; 3]) {
        let stood_in = if lost.iter().all(Option::is_some) {
            self.stand_in(lost, allowed, before, t);
            Some(self.train.v)
        } else {
            self.stand_in = None;
            None
        };
        let [first, second] = &self.wheels;
        let [first_counted, second_counted] = counted;
        let [first_lost, second_lost] = lost;
        let count = |wheel: &WheelChannel, counted: f64, lost: Option<Loss>| PeriodCount {
            speed: wheel.is_read().then_some(counted / t),
            quantum: wheel.pitch / t,
            rolls: lost.is_none(),
        };
        let counts = [count(first, first_counted, first_lost), count(second, second_counted, second_lost)];
        self.blind = if first.is_read() || second.is_read() { 0.0 } else { self.blind + t };
        let Some(published) = &mut self.published else { return (0.0, [0.0, 0.0, 1.0]) };
        let fused = published.next(counts, stood_in, before, t);
        let top = self.vehicle.max_speed.as_m_per_s();
        let speed = Range { low: -top, high: top }.nearest(fused.speed);
        self.train.set(speed, fused.acceleration, fused.variance);
        (0.5 * (before + speed) * t, fused.shares)
    }

    /// Which wheels may correct the filter.
    pub(super) fn trusted(&self, lost: [Option<Loss>; 2]) -> [bool; 2] {
        let [first, second] = &self.wheels;
        let [first_lost, second_lost] = lost;
        [first.is_read() && first_lost.is_none(), second.is_read() && second_lost.is_none()]
    }

    /// How much each wheel and the virtual sensor say.
    fn shares(&self, trusted: [bool; 2], allowed: &Allowed) -> [f64; 3] {
        let [first, second] = &self.wheels;
        match trusted {
            [false, false] => [0.0, 0.0, 1.0],
            [true, false] => [1.0, 0.0, 0.0],
            [false, true] => [0.0, 1.0, 0.0],
            [true, true] => {
                // By how much the first one seems to slip or slide beside the second, in usual differences.
                let first_ahead = first.tracker.speed() - second.tracker.speed();
                let (noise, part) = APART;
                let usual = noise + part * self.train.v.abs();
                let apart = if allowed.slide {
                    -first_ahead / usual
                } else if allowed.slip {
                    first_ahead / usual
                } else {
                    0.0
                };
                let weight = |wheel: &WheelChannel, other: &WheelChannel, apart: f64| {
                    let sharp = 1.0 / (wheel.pitch * wheel.pitch);
                    let creeps =
                        allowed.slip && wheel.wheelset.axle.may_slip() && !other.wheelset.axle.may_slip();
                    let apart = larger(apart, 0.0);
                    sharp * if creeps { CREEPING_SHARE } else { 1.0 } / (1.0 + apart * apart * apart * apart)
                };
                let (a, b) = (weight(first, second, apart), weight(second, first, -apart));
                [a / (a + b), b / (a + b), 0.0]
            }
        }
    }

    /// Lets the trusted wheels correct the filter; by how much that moved the train (m).
    ///
    /// The wheels are read as one counter to which each adds its share of every period. Two counters of their own would
    /// drift apart by what their diameters differ, and tear at the filter whenever the shares change.
    fn correct(&mut self, [first_counted, second_counted]: [f64; 2], way: f64, [a, b, _]: [f64; 3]) -> f64 {
        if self.stand_in.take().is_some() {
            self.ahead = 0.0;
        }
        let [first, second] = &self.wheels;
        let off = |wheel: &WheelChannel, share: f64| share * share * wheel.pitch * wheel.pitch * (1.0 / 12.0);
        let r = off(first, a) + off(second, b);
        self.ahead += a * first_counted + b * second_counted - way;
        let moved = self.train.place(self.ahead, r).moved;
        self.ahead -= moved;
        moved
    }

    /// The virtual sensor takes over; how far the train went (m).
    fn stand_in(&mut self, lost: [Option<Loss>; 2], allowed: &Allowed, before: f64, t: f64) -> f64 {
        let [first, second] = lost;
        let Some(kind) = first.or(second) else {
            // No wheel is read at all: the train goes on as it did.
            self.blind += t;
            self.train.a *= 1.0 - (t / FADES_S).min(1.0);
            return 0.5 * (before + self.train.v) * t;
        };
        let thresholds = self.vehicle.thresholds;
        let limit = self.vehicle.max_traction.as_m_per_s2();
        let envelope = self.settings.envelope;
        let speed = match envelope {
            Envelope::Fixed => before,
            Envelope::Touches => self.past.speed_without(kind, before, self.clock),
        };
        let commanded = allowed.commanded;
        let begins = Beginning { speed, commanded };
        let sensor = self
            .stand_in
            .get_or_insert_with(|| VirtualSensor::new(kind, begins, limit, envelope, thresholds));
        let [a, b] = &self.wheels;
        let rate = sensor.rate();
        let wheels = [a, b].map(|wheel| {
            let speed = match envelope {
                Envelope::Fixed => Some(wheel.tracker.speed()),
                Envelope::Touches => wheel.steady_speed(rate),
            };
            let acceleration = wheel.tracker.acceleration();
            speed.filter(|_| wheel.is_read()).map(|speed| LostWheel { speed, acceleration })
        });
        let locked = [a, b].iter().all(|wheel| !wheel.is_read() || wheel.tracker.silence() > LOCKED_S);
        let felt = self.inertia.as_ref().map(Inertia::acceleration);
        let top = self.vehicle.max_speed.as_m_per_s();
        let speed = sensor.next(wheels, Guides { commanded, felt, locked }, t).min(top);
        self.train.a = sensor.rate();
        self.train.v = speed;
        0.5 * (before + speed) * t
    }
}
