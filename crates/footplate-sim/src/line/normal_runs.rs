//! Runs in which every wheel rolls: what an odometer meets nearly all of its life.

use super::creep_force::Film;
use super::gradients::Gradients;
use super::kinds::Kind;
use super::plan::Handle::{At, Keep};
use super::plan::{Stage, Until};
use super::setup::Setup;
use crate::draws::Draws;

/// How much longer the line is than any run on it (m).
const LINE_M: f64 = 60_000.0;
/// The steepest gradient of a high-speed line, and of a metro (m/m).
const HIGH_SPEED_GRADIENT: f64 = 0.012;
const METRO_GRADIENT: f64 = 0.02;

/// Dry, or now and then damp: still far from any limit.
fn base(draws: &mut Draws) -> Film {
    Film::DRY.with_friction(draws.uniform(0.42..0.55))
}

/// N1: the published normal run.
pub(crate) fn high_speed(draws: &mut Draws) -> Setup {
    let stages = vec![
        Stage::new(Keep(16.0), Until::Time(200.0)),
        Stage::new(At(draws.uniform(0.85..1.0)), Until::Faster(88.5)),
        Stage::new(Keep(89.0), Until::Time(575.0)),
        Stage::new(At(-draws.uniform(0.58..0.66)), Until::Slower(0.0)),
        Stage::new(At(-0.5), Until::Time(1e9)),
    ];
    let line = Gradients::draw(HIGH_SPEED_GRADIENT, LINE_M, draws);
    Setup { base: base(draws), ..Setup::new(Kind::HighSpeed, 16.0, stages, 775.0) }
        .with_gradients(line, HIGH_SPEED_GRADIENT)
}

/// N2: a metro from station to station.
pub(crate) fn metro(draws: &mut Draws) -> Setup {
    let mut stages = vec![Stage::new(At(-0.5), Until::Time(draws.uniform(3.0..8.0)))];
    for _ in 0..6 {
        let fast = draws.uniform(13.0..22.0);
        stages.extend([
            Stage::new(At(draws.uniform(0.7..1.0)), Until::Faster(fast)),
            Stage::new(Keep(fast), Until::For(draws.uniform(5.0..20.0))),
            Stage::new(At(0.0), Until::For(draws.uniform(2.0..12.0))),
            Stage::new(At(-draws.uniform(0.6..0.85)), Until::Slower(2.0)),
            Stage::new(At(-0.35), Until::Slower(0.0)),
            Stage::new(At(-0.5), Until::For(draws.uniform(12.0..25.0))),
        ]);
    }
    stages.push(Stage::new(At(-0.5), Until::Time(1e9)));
    let line = Gradients::draw(METRO_GRADIENT, LINE_M, draws);
    Setup { base: base(draws), ..Setup::new(Kind::Metro, 0.0, stages, 600.0) }
        .with_gradients(line, METRO_GRADIENT)
}

/// N3: shunting and creeping.
pub(crate) fn creeping(draws: &mut Draws) -> Setup {
    let mut stages = vec![Stage::new(At(-0.5), Until::Time(5.0))];
    for _ in 0..8 {
        let speed = 0.2 * libm::exp(draws.uniform(0.0..1.0) * libm::log(15.0));
        stages.push(Stage::new(Keep(speed), Until::For(draws.uniform(15.0..35.0))));
        if draws.chance(0.4) {
            stages.push(Stage::new(At(-0.3), Until::For(draws.uniform(5.0..15.0))));
        }
    }
    stages.push(Stage::new(At(-0.4), Until::Time(1e9)));
    Setup { base: base(draws), ..Setup::new(Kind::Suburban, 0.0, stages, 270.0) }
}

/// N4: up and down steep gradients.
pub(crate) fn hilly(draws: &mut Draws) -> Setup {
    const STEEPEST: f64 = 0.03;
    let speed = draws.uniform(15.0..25.0);
    let mut stages = Vec::new();
    for _ in 0..5 {
        let next = draws.uniform(10.0..30.0);
        stages.push(Stage::new(Keep(next), Until::For(draws.uniform(40.0..70.0))));
        stages.push(Stage::new(At(0.0), Until::For(draws.uniform(5.0..20.0))));
    }
    stages.push(Stage::new(At(-0.7), Until::Slower(0.0)));
    stages.push(Stage::new(At(-0.7), Until::Time(1e9)));
    let mut sections = vec![(-1000.0, 0.0)];
    let mut place = draws.uniform(100.0..500.0);
    let mut sign = if draws.chance(0.5) { 1.0 } else { -1.0 };
    while place < 20_000.0 {
        sections.push((place, sign * draws.uniform(0.02..STEEPEST)));
        place += draws.uniform(700.0..1500.0);
        sign = -sign;
    }
    Setup { base: base(draws), ..Setup::new(Kind::Suburban, speed, stages, 430.0) }
        .with_gradients(Gradients::given(&sections), STEEPEST)
}

/// N5: forward, back, and a start uphill for which the brake is released too early.
pub(crate) fn reversing(draws: &mut Draws) -> Setup {
    const STEEPEST: f64 = 0.025;
    let hold = |seconds: f64| Stage::new(At(-0.5), Until::For(seconds));
    let (forward, back) = (draws.uniform(5.0..9.0), draws.uniform(3.0..6.0));
    let stages = vec![
        hold(4.0),
        Stage::new(At(0.6), Until::Faster(forward)),
        Stage::new(Keep(forward), Until::For(draws.uniform(10.0..25.0))),
        Stage::new(At(-0.6), Until::Slower(0.0)),
        hold(6.0),
        Stage::new(At(0.5), Until::Faster(back)).backwards(),
        Stage::new(Keep(back), Until::For(draws.uniform(8.0..15.0))).backwards(),
        Stage::new(At(-0.5), Until::Slower(0.0)).backwards(),
        hold(6.0),
        // Rolls back before traction takes over.
        Stage::new(At(0.0), Until::For(draws.uniform(2.5..5.0))),
        Stage::new(At(0.8), Until::For(6.0)),
        Stage::new(Keep(forward), Until::For(25.0)),
        Stage::new(At(-0.6), Until::Slower(0.0)),
        Stage::new(At(-0.6), Until::Time(1e9)),
    ];
    let uphill = draws.uniform(0.015..STEEPEST);
    Setup { base: base(draws), ..Setup::new(Kind::Suburban, 0.0, stages, 180.0) }
        .with_gradients(Gradients::given(&[(-2000.0, uphill)]), STEEPEST)
}

/// N6: wheels that were measured badly, and balises to find that out.
pub(crate) fn wrong_diameters(draws: &mut Draws) -> Setup {
    let stages = vec![
        Stage::new(Keep(draws.uniform(28.0..36.0)), Until::Time(120.0)),
        Stage::new(Keep(draws.uniform(45.0..55.0)), Until::Time(260.0)),
        Stage::new(Keep(draws.uniform(30.0..40.0)), Until::Time(370.0)),
        Stage::new(At(-draws.uniform(0.5..0.7)), Until::Slower(0.0)),
        Stage::new(At(-0.5), Until::Time(1e9)),
    ];
    let line = Gradients::draw(HIGH_SPEED_GRADIENT, LINE_M, draws);
    let setup = Setup::new(Kind::HighSpeed, 30.0, stages, 470.0);
    Setup { base: base(draws), diameter_tolerance: 0.012, has_balises: true, ..setup }
        .with_gradients(line, HIGH_SPEED_GRADIENT)
}
