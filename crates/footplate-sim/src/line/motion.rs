//! How the train moves: two wheelsets that roll, creep, lock and spin, the others in groups, and all of them on a
//! mass that gradients and resistance act on.
//!
//! ```text
//! m dv/dt = F1 + F2 + sum of groups - W(v) - m g i
//! ```
//!
//! Where every wheel is well below its limit of adhesion, 5 ms are a step that the semi-implicit rotation takes
//! exactly enough; where one is not, ten steps are taken instead. Brakes and resistance are friction: they take
//! speed away until none is left, and then hold.

use super::bogie::Bogie;
use super::brake_cylinder::{BrakeCylinder, BrakeTimes, CommandLine, Valve};
use super::consist::Consist;
use super::creep_force::Film;
use super::gradients::Gradients;
use super::rail::Rail;
use super::recording::LineEnergy;
use super::resistance::GRAVITY;
use super::rotation::{Rotation, Step, Torques};
use super::slide_protection::SlideProtection;
use super::slip_control::SlipControl;

/// Steps into which a step is divided where a wheel is near its limit.
const FINE_STEPS: u32 = 10;
/// A wheel is near its limit when it passes on more than this part of the coefficient of friction.
const NEAR_LIMIT: f64 = 0.5;
/// Slower than this the steps are fine too (m/s): creep forces are stiffest there.
const SLOW_M_PER_S: f64 = 1.0;
/// What wheels under slide protection or slip control get out of the peak of adhesion, on average.
const CONTROLLED: f64 = 0.9;
/// Below this part of the coefficient of friction no peak of the curve lies: no need to look for it.
const SURELY_CARRIED: f64 = 0.4;

/// The moving train.
#[derive(Debug, Clone)]
pub(crate) struct Motion {
    pub(crate) consist: Consist,
    /// Where its first wheelset is (m).
    pub(crate) place: f64,
    /// Its speed (m/s).
    pub(crate) speed: f64,
    /// Its acceleration in the last step (m/s²).
    pub(crate) acceleration: f64,
    pub(crate) wheels: [Rotation; 2],
    /// What each measured wheelset passed on to the rail in the last step (N).
    pub(crate) forces: [f64; 2],
    /// What each of them met.
    pub(crate) films: [Film; 2],
    pub(crate) protection: SlideProtection,
    slip_control: SlipControl,
    cylinders: [BrakeCylinder; 2],
    others: BrakeCylinder,
    line: CommandLine,
    motors: CommandLine,
    brake_times: BrakeTimes,
    /// The effort after the limit of jerk.
    effort: f64,
    jerk: [f64; 2],
    pub(crate) energy: LineEnergy,
}

/// What the driver does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Command {
    /// −1 to 1.
    pub(crate) effort: f64,
    /// Whether traction drives backwards.
    pub(crate) backwards: bool,
}

impl Motion {
    /// A train that has run evenly at a speed (m/s) for long, its first wheelset at a place (m).
    pub(crate) fn new(
        consist: Consist,
        radii: [f64; 2],
        [place, speed]: [f64; 2],
        jerk: [f64; 2],
        protection: SlideProtection,
        brake_times: BrakeTimes,
    ) -> Self {
        let wheel = |at: usize| Rotation {
            inertia: consist.rotating[at],
            radius: radii[at],
            load: consist.load,
            angle: 0.0,
            omega: speed / radii[at],
        };
        // A train that stands is held by its brake.
        let (held, line, effort) = if speed == 0.0 {
            (BrakeCylinder::settled(0.5), CommandLine::settled(0.5), -0.5)
        } else {
            Default::default()
        };
        Self {
            wheels: [wheel(0), wheel(1)],
            consist,
            place,
            speed,
            acceleration: 0.0,
            forces: [0.0; 2],
            films: [Film::DRY; 2],
            protection,
            slip_control: SlipControl::new(speed.abs()),
            cylinders: [held; 2],
            others: held,
            line,
            motors: CommandLine::default(),
            brake_times,
            effort,
            jerk,
            energy: LineEnergy::default(),
        }
    }

    /// The speeds of the treads (m/s).
    pub(crate) fn wheel_speeds(&self) -> [f64; 2] {
        self.wheels.map(|wheel| wheel.speed())
    }

    /// The energy of motion and rotation (J).
    pub(crate) fn moving(&self) -> f64 {
        let turning = |wheel: &Rotation| 0.5 * wheel.inertia * wheel.omega * wheel.omega;
        0.5 * self.consist.followed_inertia * self.speed * self.speed
            + self.wheels.iter().map(turning).sum::<f64>()
    }

    /// Moves on by `dt` seconds.
    pub(crate) fn step(
        &mut self,
        dt: f64,
        command: Command,
        bogie: &mut Bogie,
        rail: &Rail,
        [gradients, curves]: &mut [Gradients; 2],
    ) {
        self.follow(command.effort, dt);
        let driven = self.motors.step(dt, self.effort.max(0.0), [self.brake_times.motors, 0.0]);
        let direction = if command.backwards { -1.0 } else { 1.0 };
        let pull = direction * self.consist.traction(driven, self.speed);
        let pressure = self.line.step(dt, (-self.effort).max(0.0), self.brake_times.dead);
        let speeds = self.wheel_speeds();
        let shares = self.slip_control.step(dt, speeds);
        let valves = self.protection.step(dt, speeds, self.speed, pressure > 0.0);
        for (film, (behind, before)) in self.films.iter_mut().zip(self.consist.places) {
            *film = rail.at(self.place - behind, before);
        }
        let middle = self.place - 0.5 * self.consist.length;
        let weight = self.consist.mass * GRAVITY;
        let others_pressure = self.others.step(dt, pressure, Valve::Apply, &self.brake_times);
        let (pull_of_groups, brake_of_groups) = self.groups(rail, pull, others_pressure);
        let outer = Outer {
            pull: pull_of_groups,
            climb: weight * gradients.at(middle),
            brake: brake_of_groups,
            resistance: self.consist.resistance(self.speed) + weight * curves.at(middle),
        };
        bogie.step(dt, self.consist.deceleration(pressure), self.effort, self.speed, speeds);

        let fine = self.is_near_limit(bogie);
        let steps = if fine { FINE_STEPS } else { 1 };
        let dt = dt / f64::from(steps);
        for _ in 0..steps {
            let mut torques = [Torques::default(); 2];
            for (at, torque) in torques.iter_mut().enumerate() {
                let wheel = &self.wheels[at];
                let pressure =
                    bogie.brake(&mut self.cylinders[at], dt, pressure, valves[at], &self.brake_times);
                let pull = if self.consist.powered[at] { shares[at] * pull } else { 0.0 };
                *torque = bogie.torques(wheel, pull, self.consist.braking(pressure));
            }
            self.fine_step(dt, torques, outer);
        }
    }

    /// The effort runs after the driver's handle.
    fn follow(&mut self, handle: f64, dt: f64) {
        let [up, down] = self.jerk;
        let rate = if self.effort + handle > 0.0 { up } else { down };
        let change = (handle - self.effort).clamp(-rate * dt, rate * dt);
        self.effort += change;
    }

    /// What the groups pull, and what they can brake (N).
    fn groups(&self, rail: &Rail, pull: f64, pressure: f64) -> (f64, f64) {
        let brake = self.consist.braking(pressure);
        let (mut pulls, mut brakes) = (0.0, 0.0);
        for group in &self.consist.groups {
            let film = rail.at(self.place - group.behind, group.before);
            let needed = pull.abs().max(brake);
            let carried = if needed <= SURELY_CARRIED * film.friction * self.consist.load {
                f64::INFINITY
            } else {
                let load = 0.5 * self.consist.load;
                CONTROLLED * film.peak(load, self.speed) * self.consist.load
            };
            pulls += group.driven * pull.clamp(-carried, carried);
            brakes += group.wheelsets * brake.min(carried);
        }
        (pulls, brakes)
    }

    fn is_near_limit(&self, bogie: &Bogie) -> bool {
        let loaded =
            |(force, film): (&f64, &Film)| force.abs() > NEAR_LIMIT * film.friction * self.consist.load;
        let stands = self.speed == 0.0 && self.wheels.iter().all(|wheel| wheel.omega == 0.0);
        (self.speed.abs() < SLOW_M_PER_S && !stands)
            || self.protection.is_active()
            || self.slip_control.is_active()
            || bogie.is_disturbed()
            || self.forces.iter().zip(&self.films).any(loaded)
            || self.wheel_speeds().iter().any(|wheel| (wheel - self.speed).abs() > 0.01 * self.speed.abs())
    }

    fn fine_step(&mut self, dt: f64, torques: [Torques; 2], outer: Outer) {
        let (mass, before) = (self.consist.followed_inertia, self.speed);
        let turned = self.wheels.map(|wheel| wheel.omega);
        let mut steps = [Step::default(); 2];
        for (at, torque) in torques.into_iter().enumerate() {
            steps[at] = self.wheels[at].step(dt, before, &self.films[at], torque);
        }
        self.forces = steps.map(|step| step.force);
        let force = outer.pull - outer.climb + self.forces[0] + self.forces[1];
        let free = before + dt * force / mass;
        let most = dt * (outer.brake + outer.resistance) / mass;
        self.speed = if free.abs() > most { free - most.copysign(free) } else { 0.0 };
        self.acceleration = (self.speed - before) / dt;
        let distance = 0.5 * dt * (before + self.speed);
        self.place += distance;

        let energy = &mut self.energy;
        for ((step, wheel), turned) in steps.iter().zip(&self.wheels).zip(turned) {
            let angle = 0.5 * dt * (turned + wheel.omega);
            energy.driven_j += step.driven * angle;
            energy.braked_j += step.braked * angle;
            energy.crept_j += step.force * (wheel.radius * angle - distance);
        }
        let rubbed = (free - self.speed) * mass / dt * distance;
        let by_resistance = outer.resistance / (outer.brake + outer.resistance);
        energy.driven_j += outer.pull * distance;
        energy.climbed_j += outer.climb * distance;
        energy.resisted_j += by_resistance * rubbed;
        energy.braked_j += (1.0 - by_resistance) * rubbed;
    }
}

/// What acts on the train apart from the measured wheelsets (N).
#[derive(Debug, Clone, Copy)]
struct Outer {
    pull: f64,
    /// Weight along the track, positive uphill.
    climb: f64,
    brake: f64,
    resistance: f64,
}
