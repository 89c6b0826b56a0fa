//! A scenario run from its first sample to its last: the world goes on, the recorder reads.

use footplate_core::{Acceleration, Length, TimeSpan, Timestamp};

use super::balises::Passed;
use super::consist::DIAMETER_M;
use super::diary::Diary;
use super::faults::{Channels, Fault};
use super::recording::{LineEventKind, LineRun, LineSample, LineTruth};
use super::setup::Setup;
use super::vehicle::{LineVehicle, LineWheelset};
use super::world::World;
use crate::draws::{Draws, Purpose};

/// How long a train is watched that has arrived (s).
const WATCHED_S: f64 = 10.0;
/// How far the clock of a faulty recorder drifts (part of the time).
const CLOCK_DRIFT: f64 = 1e-4;
/// How often it loses a row, and how often it reads one late, by which part of a period.
const LOST: f64 = 2e-3;
const LATE: f64 = 5e-3;
const LATE_BY: (f64, f64) = (0.2, 0.9);

/// How a scenario is recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineConditions {
    /// Pulses per revolution of both tachometers.
    pub teeth: u32,
    /// From one sample to the next.
    pub period: TimeSpan,
    /// Whether the assumed diameters are the true ones.
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

/// Runs what was set up.
pub(crate) fn run(name: &str, setup: &Setup, seed: u64, conditions: LineConditions) -> LineRun {
    let LineConditions { teeth, period, exact_diameters, inertial_sensor } = conditions;
    let teeth = [teeth, setup.other_teeth.unwrap_or(teeth)];
    let wheelset = |at: usize| LineWheelset {
        teeth: teeth[at],
        diameter: Length::from_m(DIAMETER_M),
        diameter_tolerance: setup.diameter_tolerance,
        is_powered: setup.powered[at],
    };
    let wheelsets = [0, 1].map(wheelset);
    let vehicle = LineVehicle::claimed(name, setup, period, wheelsets);

    let mut of_faults = Draws::new(seed, Purpose::Faults);
    let mut channels = Channels::draw(setup.fault, vehicle.counter_modulus, &mut of_faults);
    let clock = (setup.fault == Fault::Clock).then_some(of_faults);
    let mut clock = RecorderClock { period, faults: clock };
    let deviation = setup.marks.map(|marks| Length::from_m(marks.deviation));
    let delay = (setup.command_delay / period.as_s()).round() as usize;
    let is_recorded = |now: f64| !setup.command_lost.is_some_and(|[from, to]| from <= now && now < to);
    let mut efforts = Vec::new();
    let rows = (setup.lasts / period.as_s()).round().max(1.0) as usize + 1;
    let mut world = World::new(setup.clone(), seed, teeth, !exact_diameters, period.as_s());
    let begins_with = world.motion.moving();

    let mut samples = Vec::with_capacity(rows);
    let mut truth: Vec<LineTruth> = Vec::with_capacity(rows);
    let mut diary = Diary::new(&channels);
    let (mut zero, mut arrived) = (None, None);
    for row in 0..rows {
        let reading = clock.read(row);
        let (before, speed_before) = (world.time, world.motion.speed);
        world.go_on(reading.at);
        let (now, speed) = (world.time, world.motion.speed);
        let waited = now - before;
        let edges = [0, 1].map(|at| {
            let mut edges = world.tachometers[at].read(waited, now);
            edges.last = edges.last.map(|last| last / reading.rate);
            edges
        });
        let wheels = channels.report(now, edges);
        let gradient = world.gradient();
        let gained = (speed - speed_before) / waited;
        let sensed = world.inertial_sensor.read(waited, gained, speed, gradient);
        let zero = *zero.get_or_insert(world.motion.place);
        let mut balise = None;
        world.passed.retain(|passed| match *passed {
            Passed::Missed => {
                diary.write(reading.stamp, LineEventKind::BaliseMissed);
                false
            }
            Passed::Read { at, .. } if at > now => true,
            Passed::Read { place, .. } => {
                balise = Some(Length::from_m(place - zero));
                false
            }
        });
        let real = world.truth(zero);
        diary.note(reading.stamp, now, &real, world.bogie.conduct());
        efforts.push(world.command.effort);
        if reading.is_lost {
            continue;
        }
        samples.push(LineSample {
            time: reading.stamp,
            wheels,
            effort: is_recorded(now).then(|| efforts[row.saturating_sub(delay)]),
            acceleration: inertial_sensor.then_some(Acceleration::from_m_per_s2(sensed)),
            balise,
            balise_deviation: deviation.filter(|_| balise.is_some()),
        });
        truth.push(real);
        arrived = arrived.or_else(|| world.steering.has_arrived().then_some(now));
        if arrived.is_some_and(|arrived| now - arrived >= WATCHED_S) {
            break;
        }
    }
    let mut energy = world.motion.energy;
    energy.gained_j = world.motion.moving() - begins_with;
    let diameters = world.motion.wheels.map(|wheel| Length::from_m(2.0 * wheel.radius));
    LineRun { vehicle, samples, truth, events: diary.events, diameters, energy }
}

/// The clock by which the recorder reads.
struct RecorderClock {
    period: TimeSpan,
    /// What goes wrong with it, if anything does.
    faults: Option<Draws>,
}

/// One reading of the recorder.
struct Reading {
    /// What its clock says.
    stamp: Timestamp,
    /// When it really is (s).
    at: f64,
    /// True seconds for each second of its clock.
    rate: f64,
    /// Whether the row never arrives.
    is_lost: bool,
}

impl RecorderClock {
    fn read(&mut self, row: usize) -> Reading {
        let stamp = Timestamp::from_ns(self.period.as_ns() * row as i64);
        // The first row says where distance is zero.
        let Some(faults) = self.faults.as_mut().filter(|_| row > 0) else {
            return Reading { stamp, at: stamp.as_s(), rate: 1.0, is_lost: false };
        };
        let late = if faults.chance(LATE) { faults.uniform(LATE_BY.0..LATE_BY.1) } else { 0.0 };
        let rate = 1.0 + CLOCK_DRIFT;
        let at = (stamp.as_s() + late * self.period.as_s()) * rate;
        Reading { stamp, at, rate, is_lost: faults.chance(LOST) }
    }
}
