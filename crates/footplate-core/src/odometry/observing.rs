//! One period: the counts of both wheelsets, the bounds they guarantee, and what hypotheses have to explain.

use super::command_watch::Allowed;
use super::distance_bounds::Counted;
use super::guaranteed_speed::WheelBounds;
use super::hypotheses::{Scene, WheelScene};
use super::inertia::Inertia;
use super::odometer::Odometer;
use super::wheel_channel::WheelChannel;
use super::wheels::{Count, Direction, Heading, Period, Range, WheelReading};

/// A train that runs faster in its direction of travel cannot reverse between two periods (m/s).
const CERTAIN_HEADING: f64 = 1.5;
/// A larger reading of an accelerometer is a fault (m/s²).
const LARGEST_READING: f64 = 50.0;

impl Odometer {
    /// Reads both wheelsets. Returns how far each turned (m).
    pub(super) fn read(&mut self, period: &Period, allowed: &Allowed, t: f64) -> [f64; 2] {
        for (wheel, reading) in self.wheels.iter_mut().zip(&period.wheels) {
            wheel.read_direction(reading, self.direction, t);
        }
        // One forward and the other backward: one of them may have swapped wires. Sensors that once reported the same direction
        // together do not: a wheel spins on a train that rolls back.
        let disputed = {
            let [first, second] = &self.wheels;
            let product = first.reported.direction() * second.reported.direction();
            self.agreed |= product > 0.0 && first.reported.convincing() && second.reported.convincing();
            product < 0.0 && !self.agreed
        };
        if disputed && self.direction < 0.0 {
            // Trains that run backward are rarer than swapped wires.
            self.turn();
        }
        let heading = Heading { direction: self.direction, certain: self.speed > CERTAIN_HEADING, disputed };
        let at = (t, self.vehicle.period.as_s());
        let [first, second] = &mut self.wheels;
        let counted =
            [first.read(period, 0, at, heading, allowed), second.read(period, 1, at, heading, allowed)];
        first.compare(second, t);
        counted
    }

    /// Narrows the guaranteed bounds by the counts and by an inertial sensor, and returns them.
    pub(super) fn narrow(&mut self, period: &Period, allowed: &Allowed, before: f64, t: f64) -> Range {
        let [first, second] = &self.wheels;
        let of = |wheel: &WheelChannel| WheelBounds {
            turns: wheel.turns(allowed.acceleration),
            axle: wheel.wheelset.axle,
        };
        let wheels = [of(first), of(second)];
        // Without a direction, a speed is an amount. Before its first pulse no sensor can report one.
        let tells = |reading: &WheelReading| {
            reading.direction != Direction::Unknown || matches!(reading.count, Count::Counter(_))
        };
        self.signed |= period.wheels.iter().any(tells);
        self.turned |= period.wheels.iter().any(|reading| matches!(reading.count, Count::Pulses(1..)));
        let unsigned = self.turned && !self.signed;
        let least = if unsigned { 0.0 } else { -self.vehicle.max_speed.as_m_per_s() };
        let bounded = self.bounds.narrow(&wheels, allowed, self.vehicle.slide_protection, least, t);
        if self.settings.inertial { self.feel(period, before, bounded, t) } else { bounded }
    }

    /// What the hypotheses have to explain.
    pub(super) fn scene(
        &self,
        [first_counted, second_counted]: [f64; 2],
        allowed: &Allowed,
        bounded: Range,
    ) -> Scene {
        let of = |wheel: &WheelChannel, counted: f64| WheelScene {
            counted,
            late: wheel.late * wheel.pitch,
            read: wheel.is_read(),
            stuck: wheel.stuck,
            speed: wheel.tracker.speed(),
            speed_deviation: wheel.tracker.speed_deviation(),
            acceleration: wheel.tracker.acceleration(),
            acceleration_deviation: wheel.tracker.acceleration_deviation(),
            pitch: wheel.pitch,
            tolerance: wheel.tolerance(),
            braked: wheel.wheelset.axle.may_slide(),
            driven: wheel.wheelset.axle.may_slip(),
        };
        let [first, second] = &self.wheels;
        Scene {
            wheels: [of(first, first_counted), of(second, second_counted)],
            acceleration: allowed.acceleration,
            rolling: allowed.rolling,
            commanded: allowed.commanded,
            brake: if allowed.slide { allowed.brake } else { 0.0 },
            traction: if allowed.slip { allowed.traction } else { 0.0 },
            slide: allowed.slide,
            slip: allowed.slip,
            inertial: self.inertia.as_ref().map(Inertia::acceleration),
            independent: self.vehicle.independent,
            bounded,
            top_speed: self.vehicle.max_speed.as_m_per_s(),
        }
    }

    /// The shares of the first wheelset, of the second, and of the prediction without wheels.
    pub(super) fn shares(&self) -> [f64; 3] {
        let [both, first_slips, second_slips, slip, creep, standing, first_dead, second_dead] =
            self.bank.probabilities();
        let half = 0.5 * (both + standing);
        let (one, other) = (half + second_slips + second_dead, half + first_slips + first_dead);
        let total = one + other + slip + creep;
        [one / total, other / total, (slip + creep) / total]
    }

    /// Takes in the interval of the stated probability. The guaranteed bounds narrow it.
    pub(super) fn enclose(&mut self, speed: Range, distance: Range, bounded: Range) {
        let both = speed.and(bounded);
        self.probable_speed = if both.is_empty() { bounded } else { both };
        let before = self.probable_distance;
        let distance = Range { low: before.low + distance.low, high: before.high + distance.high };
        let both = distance.and(self.distance_bounds.distance());
        self.probable_distance = if both.is_empty() { self.distance_bounds.distance() } else { both };
    }

    /// How the counts bound the distance of the period, as long as the claims hold.
    pub(super) fn counted(&self, allowed: &Allowed) -> [Counted; 2] {
        let [first, second] = &self.wheels;
        let [first_wrong, second_wrong] = self.bounds.wrong();
        let of = |wheel: &WheelChannel, wrong: bool| {
            let sound = wheel.uncertainty.is_finite() && !wrong && !wheel.stuck;
            let (may_slide, may_slip) = wheel.may_differ(allowed);
            Counted {
                pulses: wheel.pulses,
                uncertainty: if sound { wheel.uncertainty } else { 0.0 },
                may_slip,
                may_slide,
                pitch: wheel.pitch_range,
                sound,
            }
        };
        [of(first, first_wrong), of(second, second_wrong)]
    }

    /// Lets the inertial sensor narrow the bounds, and returns them.
    fn feel(&mut self, period: &Period, before: f64, bounded: Range, t: f64) -> Range {
        let reading = period
            .acceleration
            .map(|reading| self.direction * reading.as_m_per_s2())
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
}
