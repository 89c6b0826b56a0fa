//! An evening's recording: one train, one link, the runs of one scenario, with pauses between them.

use footplate_core::{TimeSpan, Timestamp, TrainId};

use crate::draws::{Draws, Purpose};
use crate::law::LawFamily;
use crate::load::warmth_after;
use crate::poller::Link;
use crate::railway::Railway;
use crate::run::{Conditions, SimulatedRun, World};
use crate::scenario::Scenario;
use crate::sensors::Faults;
use crate::train::Train;

/// Duration of a pause between two runs (chosen).
const PAUSE_S: core::ops::Range<f64> = 5.0..60.0;
/// Initial reading of the host's clock (chosen: time for the turnouts thrown before the run).
const NEW_CLOCK_S: core::ops::Range<f64> = 5.0..40.0;
/// Probability that the program, and its clock, is restarted between two runs (measured: 3 times in 50).
const CLOCK_RESTARTS: f64 = 0.06;
/// Step of cooling during pauses.
const COOLING_STEP_S: f64 = 0.1;

/// The recording of one train in one scenario, with its truth.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedRecording {
    /// The train's number at the station.
    pub train_id: TrainId,
    /// The true train.
    pub train: Train,
    /// The link that the host used.
    pub link: Link,
    /// The faults of the sensors.
    pub faults: Faults,
    /// The runs, in order.
    pub runs: Vec<SimulatedRun>,
}

impl SimulatedRecording {
    /// Draws a train with a law and simulates a scenario; the same for the same seed.
    pub fn draw(
        railway: &Railway<'_>,
        scenario: Scenario,
        train_id: TrainId,
        law: LawFamily,
        seed: u64,
    ) -> Self {
        let train = Train::draw(seed, law);
        let (link, faults) = (scenario.link(seed), scenario.faults());
        let mut draws = Draws::new(seed, Purpose::Scenario);
        let world = World { railway, link: &link, faults: &faults, train_id, train: &train };
        let mut warmth = scenario.warmth(&mut draws);
        let mut clock = Timestamp::ZERO;
        let mut runs = Vec::new();
        for script in scenario.scripts(&train, &mut draws) {
            let is_new = clock == Timestamp::ZERO || draws.chance(CLOCK_RESTARTS);
            let pause = draws.uniform(PAUSE_S);
            clock = if is_new {
                Timestamp::from_s(draws.uniform(NEW_CLOCK_S))
            } else {
                clock + TimeSpan::from_s(pause)
            };
            for _ in 0..(pause / COOLING_STEP_S) as usize {
                warmth = warmth_after(&train, warmth, false, COOLING_STEP_S);
            }
            let (run, after) = world.run(&script, Conditions { clock, warmth }, draws.seed());
            runs.push(run);
            Conditions { clock, warmth } = after;
        }
        Self { train_id, train, link, faults, runs }
    }
}
