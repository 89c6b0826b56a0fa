//! A model of a train about which everything is known: what an ideal calibration would have found.
//!
//! For scorers, who hold what was learnt against it, and for trains whose maker has published all of it.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use super::model::{Counts, MotionModel, StepUse};
use super::parameters::{Answers, DOWN, HYSTERESIS, START_DELAY, UP, hysteresis_at, speed_at};
use super::segment::{Pace, Segment, Told};
use super::spread::Spread;
use super::unknowns::Columns;
use crate::ids::{SpeedStep, TrainId};
use crate::linalg::NormalEquations;
use crate::time::TimeSpan;
use crate::units::{Length, Speed};

/// What is known counts as known to this (m, s or m/s): the laws of a model do not bend any closer.
const KNOWN_TO: f64 = 1e-3;
/// Rounds in which the equations, straight but for the products of speeds and delays, are solved.
const ROUNDS: usize = 4;

/// Everything that tells how a train moves. Ways as the train feels them, spans from when a command left the line.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownMotion {
    /// The train.
    pub train: TrainId,
    /// Steady speeds from below and from above, from step 1 on.
    pub speeds: Vec<[Speed; 2]>,
    /// Until a running train begins to speed up, and to slow down.
    pub delays: [TimeSpan; 2],
    /// Until a train at rest begins to move.
    pub start_delay: TimeSpan,
    /// Changes of speed between steps (0 for rest): the step before, the step after, and by how much farther the train
    /// has got, once it is steady or at rest, than if it had changed at once when the command left. Of a stop that is
    /// the way to rest; of a start it is negative.
    pub changes: Vec<(SpeedStep, SpeedStep, Length)>,
    /// By [section](crate::calibration::SectionIndex), how much longer than surveyed it is, as the train feels it.
    pub sections: Vec<(usize, Length)>,
    /// How far stops scatter against what trains usually do: 4 mm from 0.39 m/s, 21 mm from 0.61 m/s.
    pub scatter_scale: f64,
}

impl MotionModel {
    /// The model that knows all of it. Laws are bent as far as a model's laws can be to agree with the changes given.
    #[must_use]
    pub fn from_known(known: &KnownMotion) -> Self {
        let count = known.speeds.len().min(usize::from(SpeedStep::HIGHEST));
        let highest = SpeedStep::new(count as u8).unwrap_or(SpeedStep::STAND);
        let mut model = Self::unknown(known.train, highest);
        for _ in 0..ROUNDS {
            let Some(values) = model.solved(known, count) else { break };
            model.values = values;
        }
        model.spread = Spread::certain(count);
        model.sections = known
            .sections
            .iter()
            .map(|(section, by)| (*section, (by.as_m(), KNOWN_TO * KNOWN_TO)))
            .collect::<BTreeMap<_, _>>();
        model.scatter_scale = known.scatter_scale;
        for step in 1..=highest.get() {
            let Some(step) = SpeedStep::new(step) else { continue };
            model.note_use(step, StepUse::Moves);
        }
        for counts in &mut model.counts {
            *counts = [Counts { contacts: u32::MAX, stops: u32::MAX }; 2];
        }
        model
    }

    fn solved(&self, known: &KnownMotion, count: usize) -> Option<Vec<f64>> {
        let columns = Columns::of(&[], count);
        let mut equations = NormalEquations::new(columns.all);
        let sections = crate::calibration::SectionIndex::none();
        super::priors::priors(&columns, &[], &sections, &self.values, count).add_to(&mut equations);
        let tight = KNOWN_TO * KNOWN_TO;
        for (index, [below, above]) in known.speeds.iter().take(count).enumerate() {
            let (step, speed) = (index + 1, below.as_m_per_s().max(KNOWN_TO));
            equations.add(&[(speed_at(step), 1.0)], libm::log(speed), tight / (speed * speed));
            let full = (above.as_m_per_s() - speed) / Answers::hysteresis_part(speed);
            equations.add(&[(HYSTERESIS, 1.0), (hysteresis_at(step, count), 1.0)], full, tight);
        }
        let [up, down] = known.delays;
        for (column, delay) in [(UP, up), (DOWN, down), (START_DELAY, known.start_delay)] {
            equations.add(&[(column, 1.0)], delay.as_s(), tight);
        }
        for (from, to, displacement) in &known.changes {
            let of = |answers: &Answers<'_>| displacement_of(answers, *from, *to);
            let here = of(&self.answers());
            let slopes = self.spread.slopes(&self.values, self.steps(), of);
            let straight: f64 = slopes
                .iter()
                .map(|(place, slope)| slope * self.values.get(*place).copied().unwrap_or(0.0))
                .sum();
            equations.add(&slopes, displacement.as_m() - here + straight, tight);
        }
        equations.values()
    }
}

/// How much farther a train has got by a change than if it had changed at once (m).
fn displacement_of(answers: &Answers<'_>, from: SpeedStep, to: SpeedStep) -> f64 {
    let told = Told { sent: 0.0, from: from.get(), to: to.get(), at_rest: from == SpeedStep::STAND };
    let speed = answers.speed(usize::from(from.get()), false);
    let segment = Segment::of(&told, answers, Pace::steady(speed));
    let added = if to == SpeedStep::STAND { segment.way_to_rest() } else { segment.displacement() };
    (speed - segment.to) * segment.begins + added
}
