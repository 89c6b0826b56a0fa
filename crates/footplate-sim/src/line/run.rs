//! A scenario run from its first sample to its last: the world steps, the recorder reads.

use footplate_core::{Acceleration, Length, Speed, TimeSpan, Timestamp};

use super::balises::{Balises, Passed};
use super::bogie::{Bogie, Conduct};
use super::consist::{Consist, DIAMETER_M};
use super::faults::{Channels, Fault};
use super::gradients::Gradients;
use super::inertial_sensor::InertialSensor;
use super::motion::{Command, Motion};
use super::rail::{Patch, Rail};
use super::recording::{LineEvent, LineEventKind, LineRun, LineSample, LineTruth, WheelTruth};
use super::setup::{Lay, Setup};
use super::slide_protection::SlideProtection;
use super::steering::Steering;
use super::tachometer::Tachometer;
use super::vehicle::{LineVehicle, LineWheelset};
use crate::draws::{Draws, Purpose};

/// The longest step of the world (s); its fine steps are a tenth of that.
const STEP_S: f64 = 0.005;
/// The wheels of a train are off in common by so much of their tolerance, and each for itself by so much more.
const OFF_IN_COMMON: f64 = 0.7;
const OFF_EACH: f64 = 0.25;
/// How long a train is watched that has arrived (s).
const WATCHED_S: f64 = 10.0;
/// How far the clock of a faulty recorder drifts (part of the time).
const CLOCK_DRIFT: f64 = 1e-4;
/// How often it loses a row, and how often it reads one late.
const LOST: f64 = 2e-3;
const LATE: f64 = 5e-3;

/// How a scenario is recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineConditions {
    /// Pulses per revolution of both tachometers.
    pub teeth: u32,
    /// From one sample to the next.
    pub period: TimeSpan,
    /// Whether the believed diameters are the true ones.
    pub exact_diameters: bool,
    /// Whether there is an inertial sensor.
    pub inertial_sensor: bool,
}

impl Default for LineConditions {
    /// 100 teeth, 50 ms, diameters within their tolerance, no inertial sensor.
    fn default() -> Self {
        Self { teeth: 100, period: TimeSpan::from_ms(50), exact_diameters: false, inertial_sensor: false }
    }
}

/// The world of one run.
struct World {
    motion: Motion,
    bogie: Bogie,
    steering: Steering,
    rail: Rail,
    line: [Gradients; 2],
    films: std::vec::IntoIter<Lay>,
    next_film: Option<Lay>,
    tachometers: [Tachometer; 2],
    balises: Option<Balises>,
    passed: Vec<Passed>,
    command: Command,
    time: f64,
}

impl World {
    /// Goes on to a time (s).
    fn go_on(&mut self, until: f64) {
        let steps = ((until - self.time) / STEP_S - 1e-6).ceil().max(1.0);
        let (begins, dt) = (self.time, (until - self.time) / steps);
        self.rail.reach(self.motion.place + 200.0);
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

    /// What really is now, with distance from a place.
    fn truth(&self, zero: f64) -> LineTruth {
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

/// Runs what was set up.
pub(crate) fn run(name: &str, setup: Setup, seed: u64, conditions: LineConditions) -> LineRun {
    let LineConditions { teeth, period, exact_diameters, inertial_sensor } = conditions;
    let span = period.as_s();
    let mut of_train = Draws::new(seed, Purpose::Train);
    let mut of_track = Draws::new(seed, Purpose::Track);
    let mut of_motion = Draws::new(seed, Purpose::Motion);
    let mut of_line = Draws::new(seed, Purpose::Line);
    let mut of_faults = Draws::new(seed, Purpose::Faults);

    let design = setup.design;
    let consist = Consist::draw(&design, setup.powered, setup.placement, &mut of_train);
    let common = of_train.uniform(-OFF_IN_COMMON..OFF_IN_COMMON);
    let radii = [0, 1].map(|_| {
        let off = setup.diameter_tolerance * (common + of_train.uniform(-OFF_EACH..OFF_EACH));
        0.5 * DIAMETER_M * (1.0 + if exact_diameters { 0.0 } else { off })
    });
    let wheelset = |at: usize| LineWheelset {
        teeth,
        diameter: Length::from_m(DIAMETER_M),
        diameter_tolerance: setup.diameter_tolerance,
        is_powered: setup.powered[at],
    };
    let wheelsets = [wheelset(0), wheelset(1)];
    let vehicle =
        LineVehicle::claimed(name, &design, setup.steepest, setup.brake_tolerance, period, wheelsets);

    let mut channels = Channels::draw(setup.fault, vehicle.counter_modulus, &mut of_faults);
    let mut tachometers = [0, 1].map(|_| Tachometer::draw(teeth, 0.0, &mut of_line));
    if setup.fault == Fault::MissingTooth {
        let [first, second] = tachometers;
        tachometers = [first.without_a_tooth(), second];
    }
    let protection = SlideProtection::draw(setup.protected, setup.speed, &mut of_motion);
    let jerk = [design.jerk / design.start(), design.jerk / design.full_brake()];
    let mut films = setup.films.into_iter();
    let mut inertial = inertial_sensor.then(|| InertialSensor::draw(&mut of_line));
    let mut world = World {
        motion: Motion::new(consist, radii, [setup.place, setup.speed], jerk, protection),
        bogie: Bogie::new(setup.bogie, -span),
        steering: setup.steering,
        rail: Rail::draw(setup.base, &mut of_track),
        line: setup.line,
        next_film: films.next(),
        films,
        tachometers,
        balises: setup.has_balises.then(|| Balises::draw(setup.place, &mut of_line)),
        passed: Vec::new(),
        command: Command { effort: 0.0, backwards: false },
        time: -span,
    };
    let begins_with = world.motion.moving();

    let rows = (setup.lasts / span).round().max(1.0) as usize + 1;
    let mut samples = Vec::with_capacity(rows);
    let mut truth: Vec<LineTruth> = Vec::with_capacity(rows);
    let mut diary = Diary::new(&channels);
    let (mut zero, mut arrived) = (None, None);
    for row in 0..rows {
        let stamp = Timestamp::from_ns(period.as_ns() * row as i64);
        let faulty_clock = channels.fault() == Fault::Clock && row > 0;
        let (drift, late, lost) = if faulty_clock {
            let late = if of_faults.chance(LATE) { of_faults.uniform(0.2..0.9) * span } else { 0.0 };
            (CLOCK_DRIFT, late, of_faults.chance(LOST))
        } else {
            (0.0, 0.0, false)
        };
        let (before, speed_before) = (world.time, world.motion.speed);
        world.go_on(stamp.as_s() * (1.0 + drift) + late);
        let waited = world.time - before;
        let edges = [0, 1].map(|at| world.tachometers[at].read(waited, world.time));
        let wheels = channels.report(world.time, edges);
        let gradient = world.line[0].at(world.motion.place - 0.5 * world.motion.consist.length);
        let gained = (world.motion.speed - speed_before) / waited;
        let speed = world.motion.speed;
        let acceleration = inertial.as_mut().map(|sensor| sensor.read(waited, gained, speed, gradient));
        let zero = *zero.get_or_insert(world.motion.place);
        let mut balise = None;
        let now = world.time;
        world.passed.retain(|passed| match *passed {
            Passed::Missed => {
                diary.write(stamp, LineEventKind::BaliseMissed);
                false
            }
            Passed::Read { at, .. } if at > now => true,
            Passed::Read { place, .. } => {
                balise = Some(Length::from_m(place - zero));
                false
            }
        });
        let real = world.truth(zero);
        diary.note(stamp, now, &real, world.bogie.conduct());
        if lost {
            continue;
        }
        arrived = arrived.or_else(|| world.steering.has_arrived().then_some(now));
        samples.push(LineSample {
            time: stamp,
            wheels,
            effort: world.command.effort,
            acceleration: acceleration.map(Acceleration::from_m_per_s2),
            balise,
        });
        truth.push(real);
        if arrived.is_some_and(|arrived| now - arrived >= WATCHED_S) {
            break;
        }
    }
    let mut energy = world.motion.energy;
    energy.gained_j = world.motion.moving() - begins_with;
    let diameters = radii.map(|radius| Length::from_m(2.0 * radius));
    LineRun { vehicle, samples, truth, events: diary.events, diameters, energy }
}

/// Writes down what happens, when it changes.
struct Diary {
    events: Vec<LineEvent>,
    wheels: [WheelTruth; 2],
    conduct: Conduct,
    fault: Option<(f64, f64)>,
    is_faulty: bool,
}

impl Diary {
    fn new(channels: &Channels) -> Self {
        Self {
            events: Vec::new(),
            wheels: [WheelTruth::Rolling; 2],
            conduct: Conduct::Follows,
            fault: channels.lasts(),
            is_faulty: false,
        }
    }

    fn write(&mut self, time: Timestamp, what: LineEventKind) {
        self.events.push(LineEvent { time, what });
    }

    fn note(&mut self, time: Timestamp, now: f64, real: &LineTruth, conduct: Conduct) {
        for wheelset in [0, 1] {
            let does = real.wheels[wheelset];
            if does != self.wheels[wheelset] {
                self.write(time, LineEventKind::Wheel { wheelset, does });
            }
        }
        self.wheels = real.wheels;
        if conduct != self.conduct {
            match conduct {
                Conduct::DrawnAway(extra) => {
                    let extra = Acceleration::from_m_per_s2(extra);
                    self.write(time, LineEventKind::DrawnAway { extra });
                }
                Conduct::Follows => self.write(time, LineEventKind::FollowsAgain),
                _ => {}
            }
            self.conduct = conduct;
        }
        let is_faulty = self.fault.is_some_and(|(from, to)| from <= now && now < to);
        if is_faulty != self.is_faulty {
            self.is_faulty = is_faulty;
            let what = if is_faulty { LineEventKind::FaultBegins } else { LineEventKind::FaultEnds };
            self.write(time, what);
        }
    }
}
