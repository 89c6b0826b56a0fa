//! The journey on which sensors fail: from a stop up to line speed, to another stop, and on.

use super::faults::Fault;
use super::gradients::Gradients;
use super::kinds::Kind;
use super::plan::Handle::{At, Keep};
use super::plan::{Stage, Until};
use super::setup::Setup;
use crate::draws::Draws;

/// The steepest gradient (m/m).
const STEEPEST: f64 = 0.01;

/// Two starts and two stops on a dry rail, and one fault.
pub(crate) fn two_stops(fault: Fault, draws: &mut Draws) -> Setup {
    let mut stages = vec![Stage::new(At(-0.5), Until::Time(5.0))];
    for _ in 0..2 {
        let speed = draws.uniform(18.0..30.0);
        stages.extend([
            Stage::new(At(draws.uniform(0.7..1.0)), Until::Faster(speed)),
            Stage::new(Keep(speed), Until::For(draws.uniform(25.0..40.0))),
            Stage::new(At(-draws.uniform(0.5..0.7)), Until::Slower(1.5)),
            Stage::new(At(-0.3), Until::Slower(0.0)),
            Stage::new(At(-0.5), Until::For(draws.uniform(8.0..15.0))),
        ]);
    }
    stages.push(Stage::new(At(-0.5), Until::Time(1e9)));
    let line = Gradients::draw(STEEPEST, 10_000.0, draws);
    Setup { fault, ..Setup::new(Kind::Suburban, 0.0, stages, 330.0) }.with_gradients(line, STEEPEST)
}
