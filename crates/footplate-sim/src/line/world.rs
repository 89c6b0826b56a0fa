//! The world of one run: a train, its rail and its line, stepped from sample to sample.

use footplate_core::{Acceleration, Length, Speed};

use super::balises::{Balises, Passed};
use super::bogie::Bogie;
use super::consist::{Consist, DIAMETER_M};
use super::faults::Fault;
use super::gradients::Gradients;
use super::inertial_sensor::InertialSensor;
use super::motion::{Command, Motion};
use super::rail::{Patch, Rail};
use super::recording::{LineTruth, WheelTruth};
use super::setup::{Lay, Setup};
use super::slide_protection::SlideProtection;
use super::steering::Steering;
use super::tachometer::Tachometer;
use crate::draws::{Draws, Purpose};

/// The longest step of the world (s); its fine steps are a tenth of that.
const STEP_S: f64 = 0.005;
/// Farther than any train gets between two samples (m).
const LOOK_AHEAD_M: f64 = 200.0;
/// The wheels of a train are off in common by so much of their tolerance, and each for itself by so much more.
const OFF_IN_COMMON: f64 = 0.7;
const OFF_EACH: f64 = 0.25;

/// The world of one run.
pub(crate) struct World {
    pub(crate) motion: Motion,
    pub(crate) bogie: Bogie,
    pub(crate) steering: Steering,
    rail: Rail,
    line: [Gradients; 2],
    films: std::vec::IntoIter<Lay>,
    next_film: Option<Lay>,
    pub(crate) tachometers: [Tachometer; 2],
    balises: Option<Balises>,
    pub(crate) inertial_sensor: InertialSensor,
    /// Balises that were passed and not yet reported.
    pub(crate) passed: Vec<Passed>,
    /// What the driver asks for.
    pub(crate) command: Command,
    /// Since the first sample (s).
    pub(crate) time: f64,
}

impl World {
    /// The world of a setup, one period (s) before its first sample. Diameters are the assumed ones unless they are drawn.
    pub(crate) fn new(setup: Setup, seed: u64, teeth: [u32; 2], draws_diameters: bool, period: f64) -> Self {
        let mut of_train = Draws::new(seed, Purpose::Train);
        let mut of_line = Draws::new(seed, Purpose::Line);
        let design = &setup.design;
        let consist = Consist::draw(design, setup.powered, setup.placement, &mut of_train);
        let common = of_train.uniform(-OFF_IN_COMMON..OFF_IN_COMMON);
        let radii = [0, 1].map(|_| {
            let off = setup.diameter_tolerance * (common + of_train.uniform(-OFF_EACH..OFF_EACH));
            0.5 * DIAMETER_M * (1.0 + if draws_diameters { off } else { 0.0 })
        });
        let mut tachometers = teeth.map(|teeth| Tachometer::draw(teeth, 0.0, &mut of_line));
        if setup.fault == Fault::MissingTooth {
            let [first, second] = tachometers;
            tachometers = [first.without_a_tooth(), second];
        }
        // Drawn whether the run has them or not, so that one leaves the other as it is.
        let balises = Balises::draw(setup.place, setup.marks, &mut of_line);
        let mut of_motion = Draws::new(seed, Purpose::Motion);
        let protection =
            SlideProtection::draw(setup.protected, setup.protection, setup.speed, &mut of_motion);
        let jerk = [design.jerk / design.start(), design.jerk / design.full_brake()];
        let mut films = setup.films.into_iter();
        Self {
            motion: Motion::new(
                consist,
                radii,
                [setup.place, setup.speed],
                jerk,
                protection,
                setup.brake_times,
            ),
            bogie: Bogie::new(setup.bogie, -period),
            steering: setup.steering,
            rail: Rail::draw(setup.base, &mut Draws::new(seed, Purpose::Track)),
            line: setup.line,
            next_film: films.next(),
            films,
            tachometers,
            balises: Some(balises).filter(|_| setup.has_balises || setup.marks.is_some()),
            inertial_sensor: InertialSensor::draw(&mut of_line),
            passed: Vec::new(),
            command: Command { effort: 0.0, backwards: false },
            time: -period,
        }
    }

    /// Goes on to a time (s).
    pub(crate) fn go_on(&mut self, until: f64) {
        let steps = ((until - self.time) / STEP_S - 1e-6).ceil().max(1.0);
        let (begins, dt) = (self.time, (until - self.time) / steps);
        self.rail.reach(self.motion.place + LOOK_AHEAD_M);
        for step in 0..steps as u32 {
            let now = begins + f64::from(step) * dt;
            self.step(now, dt);
        }
        self.time = until;
    }

    fn step(&mut self, now: f64, dt: f64) {
        while let Some(lay) = self.next_film.take_if(|lay| lay.at <= now) {
            let from = self.motion.place + lay.ahead;
            let Lay { length, onset, film, cleaning, .. } = lay;
            self.rail.lay(Patch { from, to: from + length, onset, film, cleaning });
            self.next_film = self.films.next();
        }
        let before = self.motion.place;
        self.command = self.steering.step(dt, now, before, self.motion.speed);
        self.motion.step(dt, self.command, &mut self.bogie, &self.rail, &mut self.line);
        for (tachometer, wheel) in self.tachometers.iter_mut().zip(&self.motion.wheels) {
            tachometer.follow(wheel.angle, now, now + dt);
        }
        let passed = self.balises.as_mut().and_then(|b| b.pass([before, self.motion.place], [now, now + dt]));
        self.passed.extend(passed);
    }

    /// The gradient under the train (m/m).
    pub(crate) fn gradient(&mut self) -> f64 {
        self.line[0].at(self.motion.place - 0.5 * self.motion.consist.length)
    }

    /// What really is now, with distance from a place (m).
    pub(crate) fn truth(&self, zero: f64) -> LineTruth {
        let motion = &self.motion;
        let wheels = motion.wheel_speeds();
        LineTruth {
            speed: Speed::from_m_per_s(motion.speed),
            distance: Length::from_m(motion.place - zero),
            acceleration: Acceleration::from_m_per_s2(motion.acceleration),
            wheel_speeds: wheels.map(Speed::from_m_per_s),
            adhesion: motion.forces.map(|force| force / motion.consist.load),
            friction: motion.films.map(|film| film.friction),
            wheels: wheels.map(|wheel| WheelTruth::of(wheel, motion.speed)),
        }
    }
}
