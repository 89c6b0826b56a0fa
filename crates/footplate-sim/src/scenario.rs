//! Named experiments: what an operator with a layout would do and record, run after run.

use footplate_core::{Approach, Ratio, SpeedStep, TimeSpan};

use crate::draws::Draws;
use crate::poller::Link;
use crate::script::{Script, What, When};
use crate::sensors::Faults;
use crate::train::Train;

/// Lowest step of an experiment; below it most locomotives creep and stall.
const LOWEST_STEP: u8 = 4;
/// Probability of a missed detection on a clean layout (chosen: once in an hour of running).
const CLEAN_MISSED: f64 = 0.001;

/// A named family of experiments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scenario {
    name: &'static str,
    says: &'static str,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Starts,
    Steady,
    Changes,
    Stops,
    ShortMoves,
    Gates,
    WarmUp,
    Stalls,
    Faults,
    Driving,
    Calibration,
}

const SCENARIOS: [Scenario; 11] = [
    Scenario::new("starts", "from rest at each step from the highest down, 13 s a run, twice", Kind::Starts),
    Scenario::new("steady", "already running, each step from below and from above, 30 s a run", Kind::Steady),
    Scenario::new("changes", "from one step to another and back while running, 45 s a run", Kind::Changes),
    Scenario::new("stops", "stopped at a report, measured with a tape to the centimetre", Kind::Stops),
    Scenario::new(
        "short-moves",
        "stopped before the speed is reached, measured with a tape",
        Kind::ShortMoves,
    ),
    Scenario::new("gates", "already running past two light gates on a clock of their own", Kind::Gates),
    Scenario::new("warm-up", "half an hour at one step, from cold", Kind::WarmUp),
    Scenario::new("stalls", "low steps, at which some starts fail and dirt stops the train", Kind::Stalls),
    Scenario::new("faults", "steady runs with missed, stuck and spurious detections", Kind::Faults),
    Scenario::new(
        "driving",
        "ten minutes of speed changes, stops and starts at random reports",
        Kind::Driving,
    ),
    Scenario::new(
        "calibration",
        "starts, changes and stops of one evening, then ten minutes of driving",
        Kind::Calibration,
    ),
];

impl Scenario {
    const fn new(name: &'static str, says: &'static str, kind: Kind) -> Self {
        Self { name, says, kind }
    }

    /// All scenarios.
    pub const fn all() -> &'static [Self] {
        &SCENARIOS
    }

    /// The scenario with a name.
    pub fn named(name: &str) -> Option<Self> {
        SCENARIOS.into_iter().find(|scenario| scenario.name == name)
    }

    /// Its name on the command line.
    pub const fn name(&self) -> &'static str {
        self.name
    }

    /// Its description, half a sentence.
    pub const fn says(&self) -> &'static str {
        self.says
    }

    /// The link of this scenario.
    pub(crate) fn link(&self, seed: u64) -> Link {
        match self.kind {
            Kind::Gates => Link::first_reports(),
            _ => Link::draw(seed),
        }
    }

    /// The sensor faults of this scenario.
    pub(crate) fn faults(&self) -> Faults {
        let part = Ratio::from_parts;
        match self.kind {
            // Chosen: worse than any sensor of the recordings, of which one in ten misses now and then.
            Kind::Faults => Faults {
                missed: part(0.05),
                stuck: part(0.02),
                spurious_per_minute: 1.0,
                ..Faults::default()
            },
            _ => Faults { missed: part(CLEAN_MISSED), ..Faults::default() },
        }
    }

    /// The train's warmth at the start.
    pub(crate) fn warmth(&self, draws: &mut Draws) -> f64 {
        if self.kind == Kind::WarmUp { 0.0 } else { draws.uniform(0.0..1.0) }
    }

    /// Its runs, in order.
    pub(crate) fn scripts(&self, train: &Train, draws: &mut Draws) -> Vec<Script> {
        let highest = train.speeds.highest().get();
        let steps = || (LOWEST_STEP.min(highest)..=highest).rev();
        match self.kind {
            Kind::Starts => steps().chain(steps()).map(|step| start(step, draws)).collect(),
            Kind::Steady | Kind::Faults => steps()
                .flat_map(|step| [(step, Approach::Below), (step, Approach::Above)])
                .filter(|(step, approach)| *step < highest || *approach == Approach::Below)
                .map(|(step, approach)| running(step, approach, seconds(30), draws))
                .collect(),
            Kind::Changes => steps()
                .flat_map(|step| [change(step, highest, draws), change(step, highest, draws)])
                .collect(),
            Kind::Stops => steps()
                .flat_map(|step| (0..3).map(move |nth| (step, nth)))
                .map(|(step, nth)| {
                    let from = if nth == 2 && step < highest { Some(highest) } else { None };
                    stop(step, from, draws)
                })
                .collect(),
            Kind::ShortMoves => (1..=16).map(|quarters| short_move(quarters, highest, draws)).collect(),
            Kind::Gates => [highest, 11, 8]
                .into_iter()
                .cycle()
                .take(9)
                .map(|step| {
                    let script = running(step.min(highest), Approach::Below, seconds(60), draws);
                    Script { has_gates: true, ..script }
                })
                .collect(),
            Kind::WarmUp => vec![running(10.min(highest), Approach::Below, seconds(1800), draws)],
            Kind::Stalls => (1..=5)
                .cycle()
                .take(15)
                .map(|step| {
                    let pushed = When::After(seconds(25));
                    Script { lasts: seconds(40), ..start(step, draws) }
                        .then(pushed, What::Speed(self::step(step + 1)))
                })
                .collect(),
            Kind::Driving => vec![drive(highest, draws)],
            Kind::Calibration => {
                let mut scripts: Vec<Script> =
                    [highest, 12, 10, 8, 6].map(|step| start(step.min(highest), draws)).into();
                scripts.extend([13, 11, 9, 7, 5].map(|step| change(step.min(highest), highest, draws)));
                scripts.extend([13, 11, 9, 7].map(|step| stop(step.min(highest), None, draws)));
                scripts.extend([10, 8, 6].map(|step| stop(step.min(highest), Some(highest), draws)));
                scripts.push(drive(highest, draws));
                scripts
            }
        }
    }
}

fn step(number: u8) -> SpeedStep {
    SpeedStep::new(number).unwrap_or(SpeedStep::STAND)
}

const fn seconds(whole: i64) -> TimeSpan {
    TimeSpan::from_ms(1000 * whole)
}

/// A random place on the circuit; counted modulo its sensors.
fn anywhere(draws: &mut Draws) -> usize {
    draws.below(1000)
}

const fn on_report(skipped: u32) -> When {
    When::OnReport { skipped, wait: TimeSpan::ZERO }
}

fn running(number: u8, approach: Approach, lasts: TimeSpan, draws: &mut Draws) -> Script {
    Script::running(anywhere(draws), step(number), approach, lasts)
}

/// From rest, at one step.
fn start(number: u8, draws: &mut Draws) -> Script {
    Script::from_rest(anywhere(draws), seconds(13))
        .then(When::After(TimeSpan::ZERO), What::Speed(step(number)))
}

/// Running at a step, then at another, then at the first again: once up and once down.
fn change(number: u8, highest: u8, draws: &mut Draws) -> Script {
    let lowest = LOWEST_STEP.min(highest);
    let others: Vec<u8> = (lowest..=highest).filter(|other| *other != number).collect();
    let other = others.get(draws.below(others.len())).copied().unwrap_or(number);
    running(number, Approach::Below, seconds(45), draws)
        .then(on_report(2 + draws.below(3) as u32), What::Speed(step(other)))
        .then(When::After(TimeSpan::from_s(draws.uniform(8.0..16.0))), What::Speed(step(number)))
}

/// From rest to a step, via a faster one if given; stopped at a report and measured.
fn stop(number: u8, via: Option<u8>, draws: &mut Draws) -> Script {
    let first = via.unwrap_or(number);
    let mut script = Script { lasts: seconds(240), ..start(first, draws) };
    if via.is_some() {
        script = script.then(on_report(4), What::Speed(step(number)));
    }
    script
        .then(on_report(5 + draws.below(5) as u32), What::Speed(SpeedStep::STAND))
        .then(When::AtRest, What::Measure)
}

/// From rest, stopped after some quarters of a second and measured.
fn short_move(quarters: i64, highest: u8, draws: &mut Draws) -> Script {
    Script { lasts: seconds(30), ..start(8.min(highest), draws) }
        .then(When::After(TimeSpan::from_ms(250 * quarters)), What::Speed(SpeedStep::STAND))
        .then(When::AtRest, What::Measure)
}

/// Ten minutes of free driving.
fn drive(highest: u8, draws: &mut Draws) -> Script {
    let lowest = (LOWEST_STEP + 2).min(highest);
    let any = |draws: &mut Draws| step(lowest + draws.below(usize::from(highest - lowest) + 1) as u8);
    let mut script = Script::from_rest(anywhere(draws), seconds(600))
        .then(When::After(seconds(1)), What::Speed(any(draws)));
    // Enough orders for ten minutes at three seconds each.
    for _ in 0..200 {
        let after_stop = When::After(TimeSpan::from_s(draws.uniform(8.0..15.0)));
        let at_report = When::OnReport {
            skipped: draws.below(6) as u32,
            wait: TimeSpan::from_s(draws.uniform(0.0..0.8)),
        };
        script = script.then(at_report, What::Speed(any(draws)));
        if draws.chance(0.15) {
            script = script
                .then(on_report(draws.below(4) as u32), What::Speed(SpeedStep::STAND))
                .then(after_stop, What::Speed(any(draws)));
        }
    }
    script
}
