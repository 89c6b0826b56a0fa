//! One run: train, rails, line and script, step by step, give events and their truth.

use footplate_core::track::Leg;
use footplate_core::{Approach, Event, EventKind, SpeedStep, TimeSpan, Timestamp, TrainId};

use crate::draws::{Draws, Purpose};
use crate::gates::{GateClock, GatePass};
use crate::host::{Host, Notes};
use crate::motor::{Motor, STEP_S};
use crate::path::{Origin, Path};
use crate::poller::{Exchange, Line, Link};
use crate::railway::Railway;
use crate::rolling::Rolling;
use crate::script::{Script, Start};
use crate::sensors::{Faults, Sensors};
use crate::train::Train;
use crate::truth::{Motion, RunTruth, SAMPLE_STEPS};

/// How far past a sensor's node a run starts (chosen: the train is placed by hand).
const START_PAST_MM: core::ops::Range<f64> = 5.0..90.0;
/// When the train closed the sensor that a station remembers from before the run (chosen).
const REMEMBERED_S: core::ops::Range<f64> = -20.0..-2.0;
/// Time between turnout commands before the run (as one team's program waits).
const TURNOUT_PAUSE_S: f64 = 0.15;
/// Largest ratio of a train's speed to its table; the path is laid out for it (chosen: all factors at worst).
const MAX_SPEED_FACTOR: f64 = 1.3;
/// Longest run (chosen: more than any experiment, and its truth still fits into memory).
const MAX_RUN_S: f64 = 86_400.0;
/// Length of the path beyond the distance at that speed (chosen: more than any shoe).
const SPARE_MM: f64 = 1000.0;

/// Everything that a run takes place in and leaves unchanged.
#[derive(Debug, Clone, Copy)]
pub struct World<'w> {
    /// The track, and the circuit of the train.
    pub railway: &'w Railway<'w>,
    /// The link between host and station.
    pub link: &'w Link,
    /// The faults of sensors.
    pub faults: &'w Faults,
    /// The train's number at the station.
    pub train_id: TrainId,
    /// The true train.
    pub train: &'w Train,
}

/// The state that one run passes to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// The host's clock at the start of the run.
    pub clock: Timestamp,
    /// Warmth of the train, from 0 (cold) to 1.
    pub warmth: f64,
}

/// A recorded run and its truth.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedRun {
    /// The train.
    pub train: TrainId,
    /// The step at the start of the run; [`SpeedStep::STAND`] at rest.
    pub running_at: SpeedStep,
    /// Reports and commands, in order of time.
    pub events: Vec<Event>,
    /// Passages of light gates, on the gates' clock.
    pub gates: Vec<GatePass>,
    /// For scorers only.
    pub truth: RunTruth,
}

impl World<'_> {
    /// Simulates a script, the same for the same seed. Also returns the state for the next run.
    pub fn run(&self, script: &Script, conditions: Conditions, seed: u64) -> (SimulatedRun, Conditions) {
        let mut draws = Draws::new(seed, Purpose::Scenario);
        let past_mm = draws.uniform(START_PAST_MM);
        let (sensor, motor, running_at, approach_at_start) = match script.start {
            Start::AtRest { past } => (past, Motor::at_rest(self.train), SpeedStep::STAND, Approach::Below),
            Start::Running { past, step, approach } => {
                (past, Motor::running(self.train, step, approach), step, approach)
            }
        };
        let path = self.path(script, Origin { sensor, past_mm });
        let sensors = self.railway.layout.sensors().map(|(sensor, _)| sensor).collect();
        let mut sensors = Sensors::new(self.faults, sensors, Draws::new(seed, Purpose::Faults));
        let closed_at = draws.uniform(REMEMBERED_S);
        for point in path.sensors.iter().take_while(|point| point.at_mm <= 0.0) {
            sensors.remember(point.what, closed_at, point.at_mm > -self.train.shoe.as_mm());
        }
        let motion_draws = Draws::new(seed, Purpose::Motion);
        let mut rolling = Rolling::new(&path, self.train, motor, conditions.warmth, motion_draws);
        let run_factor = rolling.load().run();
        let mut line = Line::new(self.link, Draws::new(seed, Purpose::Line));
        let gate_clock = GateClock::new(&mut draws);
        let mut gates = Vec::new();
        let turnouts = self.turnouts_thrown(conditions.clock);
        let mut host = Host::new(
            self.train_id,
            (self.link, self.railway.layout),
            conditions.clock,
            &script.orders,
            turnouts,
            draws,
        );

        let steps = (lasts_s(script) / STEP_S) as usize;
        let mut samples = Vec::with_capacity(steps / SAMPLE_STEPS + 1);
        for step in 0..=steps {
            if step % SAMPLE_STEPS == 0 {
                samples.push(rolling.state());
                if host.is_done() && rolling.stays_at_rest() {
                    break;
                }
            }
            let now = step as f64 * STEP_S;
            host.follow_script(now, &rolling, &path, &mut line);
            rolling.advance(now, &mut sensors, |gate, at| gates.push(gate_clock.pass(gate, at)));
            while let Some(exchange) = line.poll_exchange(now + STEP_S) {
                match exchange {
                    Exchange::Sent { command, began, ended } => {
                        let heard = rolling.command(command, ended);
                        host.note_command(command, began, heard);
                    }
                    Exchange::Answered { poll } => {
                        let closed = sensors.read(poll.before, poll.reading, self.link.latched);
                        host.note_poll(poll, &closed);
                    }
                }
            }
        }

        let stalled = rolling.motor().is_stalled();
        let warmth = rolling.load().warmth();
        let spacing = TimeSpan::from_s(STEP_S * SAMPLE_STEPS as f64);
        drop(rolling);
        let motion = Motion { begins: conditions.clock, spacing, samples, path };
        let ended = motion.ends();
        let Notes { events, reports, commands, stops } = host.into_notes();
        let truth = RunTruth { reports, commands, stops, motion, approach_at_start, run_factor, stalled };
        let run = SimulatedRun { train: self.train_id, running_at, events, gates, truth };
        (run, Conditions { clock: ended, warmth })
    }

    fn path(&self, script: &Script, origin: Origin) -> Path {
        let speeds = &self.train.speeds;
        let top = speeds.speed(speeds.highest(), Approach::Below).as_mm_per_s();
        let reach_mm = MAX_SPEED_FACTOR * top * lasts_s(script) + SPARE_MM;
        Path::new(self.railway, origin, reach_mm, script.has_gates)
    }

    /// The commands to the circuit's turnouts before the run.
    fn turnouts_thrown(&self, begins: Timestamp) -> Vec<Event> {
        let count = self.railway.circuit.turnouts().len();
        let event = |(nth, (turnout, leg)): (usize, (_, Leg))| Event {
            time: begins - TimeSpan::from_s(TURNOUT_PAUSE_S * (count - nth) as f64),
            kind: EventKind::Turnout { turnout, curved: leg.is_curved() },
        };
        self.railway.circuit.turnouts().enumerate().map(event).collect()
    }
}

/// The longest duration of a run, in s.
fn lasts_s(script: &Script) -> f64 {
    script.lasts.as_s().clamp(0.0, MAX_RUN_S)
}
