//! The hypotheses and their transition rates: the stated priors of the odometer.

use super::lanes::Lanes;
use super::scene::Scene;

/// What the wheelsets and their sensors are doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Hypothesis {
    /// Both wheelsets roll.
    BothRoll,
    /// The first slips or slides, the second rolls.
    FirstSlips,
    /// The second slips or slides, the first rolls.
    SecondSlips,
    /// Both slip or slide independently.
    BothSlip,
    /// Both creep alike and steadily, as on ice with slide control.
    BothCreep,
    /// The train is at rest.
    Standstill,
    /// The sensor of the first is dead or wrong, the second rolls.
    FirstDead,
    /// The sensor of the second is dead or wrong, the first rolls.
    SecondDead,
}

/// All of them, in the order of their probabilities.
pub const HYPOTHESES: [Hypothesis; 8] = [
    Hypothesis::BothRoll,
    Hypothesis::FirstSlips,
    Hypothesis::SecondSlips,
    Hypothesis::BothSlip,
    Hypothesis::BothCreep,
    Hypothesis::Standstill,
    Hypothesis::FirstDead,
    Hypothesis::SecondDead,
];

/// Slips and slides of one wheelset that begin in a second with no effort, and that full effort adds (1/s): one in
/// a hundred seconds of hard braking on the rails of autumn.
const ONE_SLIPS: (f64, f64) = (1e-4, 1e-2);
/// The same of both at once.
const BOTH_SLIP: (f64, f64) = (5e-5, 3e-3);
/// The same of both alike, without a slide before that shows it.
const BOTH_CREEP: (f64, f64) = (2e-7, 2e-5);
/// Of that, what is left where the wheelsets are braked independently.
const INDEPENDENT: f64 = 0.3;
/// Sensors that fail (1/s): one in 300 hours.
const SENSOR_FAILS: f64 = 1e-6;
/// The same of one that was found dead and has not counted since, and how often it is dead again when another hypothesis ends.
const STAYS_DEAD: f64 = 0.1;
/// How often each hypothesis ends (1/s): slides last seconds, steady creep and dead sensors longer.
const ENDS: Lanes = Lanes([0.0, 0.5, 0.5, 0.4, 0.15, 0.2, 0.02, 0.02]);
/// What follows when another hypothesis than "both roll" ends; the rest stays with it.
const FOLLOWS: Lanes = Lanes([0.58, 0.12, 0.12, 0.09, 0.04, 0.05, 1e-5, 1e-5]);
/// A train at rest ends a run of both wheels this often (1/s), where its speed allows.
const STOPS: f64 = 0.5;
/// Effort that counts where none is recorded.
const UNKNOWN_EFFORT: f64 = 0.4;

/// Probability that hypotheses other than "both roll" end within the period, and that each begins after "both roll" or
/// after another that ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Transitions {
    pub(super) ends: Lanes,
    pub(super) after_rolling: Lanes,
    pub(super) after_others: Lanes,
}

/// The transitions of a period of `t` seconds; which sensors were `found_dead`.
pub(super) fn transitions(scene: &Scene, found_dead: [bool; 2], t: f64) -> Transitions {
    let effort = if scene.commanded.is_some() { scene.brake + scene.traction } else { UNKNOWN_EFFORT };
    let possible = if scene.slide || scene.slip { 1.0 } else { 1e-3 };
    let rate = |(least, added): (f64, f64)| possible * (least + added * effort) * t;
    let one = rate(ONE_SLIPS);
    let alike = rate(BOTH_CREEP) * if scene.independent { INDEPENDENT } else { 1.0 };
    let [first_dead, second_dead] = found_dead.map(|found| t * if found { STAYS_DEAD } else { SENSOR_FAILS });
    let begins = [0.0, one, one, rate(BOTH_SLIP), alike, STOPS * t, first_dead, second_dead];
    let mut follows = FOLLOWS;
    let [.., of_first, of_second] = &mut follows.0;
    for (share, found) in [of_first, of_second].into_iter().zip(found_dead) {
        *share = if found { STAYS_DEAD } else { *share };
    }
    Transitions { ends: ENDS * t, after_rolling: Lanes(begins), after_others: follows }
}
