//! What a person would record in an evening: one train, one link, the runs of one scenario, pauses between them.

use footplate_core::{TimeSpan, Timestamp, TrainId};

use crate::contacts::Faults;
use crate::draws::{Draws, Purpose};
use crate::law::LawFamily;
use crate::load::warmth_after;
use crate::poller::Link;
use crate::railway::Railway;
use crate::run::{Conditions, SimulatedRun, World};
use crate::scenario::Scenario;
use crate::train::Train;

/// How long a person takes between two runs (chosen).
const PAUSE_S: core::ops::Range<f64> = 5.0..60.0;
/// What the host's clock shows when it is new (chosen: long enough for turnouts thrown before the run).
const NEW_CLOCK_S: core::ops::Range<f64> = 5.0..40.0;
/// How often the program, and with it the clock, is started anew between two runs (measured: 3 times in 50).
const CLOCK_RESTARTS: f64 = 0.06;
/// Pauses are cooled through in steps of this.
const COOLING_STEP_S: f64 = 0.1;

/// What was recorded of one train in one scenario, and everything that is true of it.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedRecording {
    /// What the station calls the train.
    pub train_id: TrainId,
    /// The train as it is.
    pub train: Train,
    /// How the host read its sensors.
    pub link: Link,
    /// What went wrong with contacts, and how often.
    pub faults: Faults,
    /// The runs, in order.
    pub runs: Vec<SimulatedRun>,
}

impl SimulatedRecording {
    /// Draws a train that obeys a law and lets it go through a scenario; the same for the same seed.
    #[must_use]
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
