//! The scenarios by name: what an odometer has to get through.

use super::faults::Fault;
use super::recording::LineRun;
use super::run::{LineConditions, run};
use super::setup::Setup;
use super::{fault_runs, normal_runs, slide_runs};
use crate::draws::{Draws, Purpose};

/// A named family of runs; the seed makes one of it.
#[derive(Debug, Clone, Copy)]
pub struct LineScenario {
    name: &'static str,
    description: &'static str,
    kind: Kind,
}

#[derive(Debug, Clone, Copy)]
enum Kind {
    /// One of its own.
    Own(fn(&mut Draws) -> Setup),
    /// A journey with two stops and this fault.
    Faulty(Fault),
}

const fn own(name: &'static str, description: &'static str, set_up: fn(&mut Draws) -> Setup) -> LineScenario {
    LineScenario { name, description, kind: Kind::Own(set_up) }
}

const fn faulty(name: &'static str, description: &'static str, fault: Fault) -> LineScenario {
    LineScenario { name, description, kind: Kind::Faulty(fault) }
}

const SCENARIOS: [LineScenario; 25] = [
    own(
        "N1",
        "high speed: 16 m/s for 200 s, up to 89, braked to a stop from 575 s on",
        normal_runs::high_speed,
    ),
    own("N2", "metro: stop and go, six stations", normal_runs::metro),
    own("N3", "creeping at 0.2 to 3 m/s with stops", normal_runs::creeping),
    own("N4", "gradients up to 30 mm/m, up and down", normal_runs::hilly),
    own("N5", "reversing, and rolling back before a start uphill", normal_runs::reversing),
    own("N6", "diameters off by up to 1.2 %, and balises every 1.5 km", normal_runs::wrong_diameters),
    own("S1", "one wheelset slides under slide protection, from 37.5 s on", slide_runs::single),
    own("S1b", "one wheelset locks at 37.5 s and stays locked", slide_runs::locked),
    own("S2", "both slide at 5.6 s, touch at 7 s, lock at 12 s, stop at 21 s", slide_runs::both_to_a_lock),
    own("S3", "all wheelsets slide for a minute from 50 m/s under slide protection", slide_runs::long),
    own("S4", "creepage in traction grows on a rail that gets worse; both driven", slide_runs::common_creep),
    own("S5", "both are drawn away together, 0.1 to 3 m/s² beyond the train", slide_runs::drawn_away),
    own("S6", "one or both spin at the start", slide_runs::spin_at_start),
    own("S7", "a slide that ends because the brake is released", slide_runs::released),
    own("S8", "dry rail and leaves in turns, 50 m each, while braking", slide_runs::leaves_in_turns),
    faulty("F1", "a missing tooth on the first wheelset", Fault::MissingTooth),
    faulty("F2", "missed pulses, once in a thousand periods a channel", Fault::MissedPulses),
    faulty("F3", "bursts of interference on one channel or both", Fault::Bursts),
    faulty("F4", "passive sensors: no pulses below 1 to 5 teeth a second, no direction", Fault::DeadWhenSlow),
    faulty("F5", "the second sensor is stuck for 10 to 30 s", Fault::Stuck),
    faulty("F6", "the second sensor is dead from some time on", Fault::DeadSensor),
    faulty("F7", "the second sensor says backward when it goes forward", Fault::SwappedDirection),
    faulty("F8", "running counters of 16 bits only, which wrap", Fault::CountersOnly),
    faulty("F9", "a clock that drifts by 1e-4, lost rows and late ones", Fault::Clock),
    faulty(
        "F10",
        "spikes and drop-outs, each once in a thousand periods a channel",
        Fault::SpikesAndDropouts,
    ),
];

impl LineScenario {
    /// All scenarios.
    pub const fn all() -> &'static [Self] {
        &SCENARIOS
    }

    /// The scenario of a name, in capitals or not.
    pub fn by_name(name: &str) -> Option<Self> {
        SCENARIOS.into_iter().find(|scenario| scenario.name.eq_ignore_ascii_case(name))
    }

    /// Its name on the command line.
    pub const fn name(&self) -> &'static str {
        self.name
    }

    /// What happens in it, in half a sentence.
    pub const fn description(&self) -> &'static str {
        self.description
    }

    /// Runs it. The same seed and conditions give the same bytes on every machine; the same seed under other
    /// conditions is the same train on the same line.
    pub fn run(&self, seed: u64, conditions: LineConditions) -> LineRun {
        self.run_journey(seed, seed, conditions)
    }

    /// Runs it with the wheels of one seed on the journey of another: the same train, later.
    pub fn run_journey(&self, seed: u64, journey: u64, conditions: LineConditions) -> LineRun {
        let mut draws = Draws::new(journey, Purpose::Scenario);
        let setup = match self.kind {
            Kind::Own(set_up) => set_up(&mut draws),
            Kind::Faulty(fault) => fault_runs::two_stops(fault, &mut draws),
        };
        run(self.name, &setup, seed, conditions)
    }
}
