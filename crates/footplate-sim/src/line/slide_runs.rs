//! Runs in which wheels slip, slide and lock.

use super::bogie::Conduct;
use super::consist::Placement;
use super::creep_force::Film;
use super::kinds::Kind;
use super::plan::Handle::{At, Keep};
use super::plan::{Stage, Until};
use super::setup::{Lay, Setup};
use super::vehicle::LOOSE_BRAKE_TOLERANCE;
use crate::draws::Draws;

/// Longer than any run (m).
const FAR_M: f64 = 20_000.0;
/// Friction grows so much with each wheelset on a film that lasts, on one that is worn off by a train, and on a thin one.
const LASTING: f64 = 1.0;
const WORN: f64 = 1.3;
const THIN: f64 = 2.0;

fn stop(effort: f64) -> [Stage; 2] {
    [Stage::new(At(effort), Until::Slower(0.0)), Stage::new(At(-0.5), Until::Time(1e9))]
}

fn film(at: f64, length: f64, film: Film, cleaning: f64) -> Lay {
    Lay { at, ahead: 0.0, length, onset: 0.0, film, cleaning }
}

/// When the wheelset of S1 and S1b begins to slide (s).
const SINGLE_SLIDE_S: f64 = 37.5;

/// A brake application from 36 s on, and a thin film under the first wheelset from 37.5 s on.
fn single_slide(length: f64, draws: &mut Draws) -> Setup {
    let speed = draws.uniform(20.0..24.0);
    let effort = -draws.uniform(0.55..0.7);
    let mut stages = vec![
        Stage::new(Keep(speed), Until::Time(35.0)),
        Stage::new(At(effort), Until::Slower(draws.uniform(5.0..7.0))),
        Stage::new(Keep(6.0), Until::For(15.0)),
    ];
    stages.extend(stop(-0.5));
    let low = Film::LOW.with_friction(draws.uniform(0.025..0.045));
    let films = vec![film(SINGLE_SLIDE_S, length, low, THIN)];
    Setup { films, brake_tolerance: LOOSE_BRAKE_TOLERANCE, ..Setup::new(Kind::Suburban, speed, stages, 95.0) }
}

/// S1: the first wheelset takes the film off the rail for all others.
pub(crate) fn single(draws: &mut Draws) -> Setup {
    single_slide(draws.uniform(120.0..220.0), draws)
}

/// S1b: the same without slide protection on that wheelset; it locks until the brake is released.
pub(crate) fn locked(draws: &mut Draws) -> Setup {
    let mut setup = single_slide(FAR_M, draws);
    // The film ends where the brake is released.
    setup.films.push(film(62.0, FAR_M, Film::DRY, LASTING));
    Setup { protected: [false, true], ..setup }
}

/// How much later everything in S2 happens than on its published time line (s), so that an odometer has seen the train
/// roll.
const LEAD_S: f64 = 5.0;

/// S2: the converter of a bogie loses its wheels on a slippery rail at 0.6 s, lets go for a moment at 1.7 s (they touch
/// at 2.0), loses them again slowly, and hands over at 7 s to a friction brake that locks them; the train goes on with
/// what the rail gives and stands at 16 s.
pub(crate) fn both_to_a_lock(draws: &mut Draws) -> Setup {
    let speed = 5.45;
    let stages = vec![
        Stage::new(Keep(speed), Until::Time(LEAD_S - 0.6)),
        Stage::new(At(-0.305), Until::Slower(0.0)),
        Stage::new(At(-0.4), Until::Time(1e9)),
    ];
    let low = Film::LOW.with_friction(draws.uniform(0.05..0.055));
    let mut jitter = |time: f64| LEAD_S + time + draws.uniform(-0.05..0.05);
    let bogie = vec![
        (jitter(0.6), Conduct::Falling(1.7)),
        (jitter(1.7), Conduct::Released),
        (jitter(2.15), Conduct::Falling(0.68)),
        (jitter(7.0), Conduct::Held(1.0)),
    ];
    let lay = Lay { ahead: -200.0, ..film(0.0, FAR_M, low, LASTING) };
    Setup {
        powered: [true; 2],
        placement: Placement::OneBogie,
        films: vec![lay],
        bogie,
        ..Setup::new(Kind::Suburban, speed, stages, LEAD_S + 25.0)
    }
}

/// S3: a full brake on a rail that carries half of it.
pub(crate) fn long(draws: &mut Draws) -> Setup {
    let begins = draws.uniform(9.0..11.0);
    let mut stages = vec![
        Stage::new(Keep(50.0), Until::Time(begins)),
        Stage::new(At(-draws.uniform(0.85..1.0)), Until::Time(begins + 60.0)),
        Stage::new(Keep(18.0), Until::For(12.0)),
    ];
    stages.extend(stop(-0.45));
    let low = Film::LOW.with_friction(draws.uniform(0.06..0.068));
    let lay = Lay { ahead: -300.0, ..film(begins - 1.0, FAR_M, low, LASTING) };
    let clean = Lay { ahead: -300.0, ..film(begins + 62.0, FAR_M, Film::DRY, LASTING) };
    let setup = Setup::new(Kind::HighSpeed, 50.0, stages, begins + 115.0);
    Setup { powered: [true, false], films: vec![lay, clean], ..setup }
}

/// S4: a train accelerates on a wet rail that gets worse.
pub(crate) fn common_creep(draws: &mut Draws) -> Setup {
    let speed = draws.uniform(8.0..12.0);
    let mut stages = vec![
        Stage::new(Keep(speed), Until::Time(10.0)),
        Stage::new(At(draws.uniform(0.58..0.7)), Until::Time(60.0)),
        Stage::new(Keep(30.0), Until::Time(75.0)),
    ];
    stages.extend(stop(-0.5));
    let worse = Film::WET.with_friction(draws.uniform(0.115..0.125));
    let lay = Lay { ahead: 50.0, onset: draws.uniform(500.0..700.0), ..film(10.0, FAR_M, worse, LASTING) };
    Setup {
        powered: [true; 2],
        placement: Placement::OneBogie,
        base: Film::WET,
        films: vec![lay],
        ..Setup::new(Kind::Suburban, speed, stages, 145.0)
    }
}

/// S5: the converter of the measured bogie takes its wheels away from the train, evenly and together.
pub(crate) fn drawn_away(draws: &mut Draws) -> Setup {
    let speed = draws.uniform(35.0..45.0);
    let extra = 0.1 * libm::exp(draws.uniform(0.0..1.0) * libm::log(30.0));
    let mut stages = vec![
        Stage::new(Keep(speed), Until::Time(10.0)),
        Stage::new(At(-0.5), Until::Time(35.0)),
        Stage::new(Keep(25.0), Until::Time(50.0)),
    ];
    stages.extend(stop(-0.6));
    let low = Film::LOW.with_friction(draws.uniform(0.05..0.08));
    let begins = draws.uniform(14.0..16.0);
    let bogie = vec![(begins, Conduct::DrawnAway(extra)), (begins + 15.0, Conduct::Follows)];
    Setup {
        placement: Placement::OneBogie,
        films: vec![film(11.0, 1000.0, low, WORN)],
        bogie,
        brake_tolerance: LOOSE_BRAKE_TOLERANCE,
        ..Setup::new(Kind::HighSpeed, speed, stages, 100.0)
    }
}

/// S6: a start on a slippery spot, with one driven wheelset on it or two.
pub(crate) fn spin_at_start(draws: &mut Draws) -> Setup {
    let both = draws.chance(0.5);
    let speed = draws.uniform(10.0..14.0);
    let mut stages = vec![
        Stage::new(At(-0.5), Until::Time(5.0)),
        Stage::new(At(draws.uniform(0.85..1.0)), Until::Faster(speed)),
        Stage::new(Keep(speed), Until::For(15.0)),
    ];
    stages.extend(stop(-0.6));
    let low = Film::LOW.with_friction(draws.uniform(0.05..0.08));
    let spot = Lay { ahead: -60.0, ..film(0.0, 60.0 + draws.uniform(20.0..60.0), low, WORN) };
    Setup {
        powered: [true, both],
        placement: if both { Placement::OneBogie } else { Placement::TwoCars },
        films: vec![spot],
        ..Setup::new(Kind::Suburban, 0.0, stages, 75.0)
    }
}

/// S7: braked hard on a slippery rail, and let go while the wheels slide.
pub(crate) fn released(draws: &mut Draws) -> Setup {
    let speed = draws.uniform(18.0..24.0);
    let ends = draws.uniform(13.5..15.5);
    let mut stages = vec![
        Stage::new(Keep(speed), Until::Time(8.0)),
        Stage::new(At(-draws.uniform(0.75..0.95)), Until::Time(ends)),
        Stage::new(At(0.0), Until::For(12.0)),
        Stage::new(Keep(12.0), Until::Time(40.0)),
    ];
    stages.extend(stop(-0.3));
    let low = Film::LOW.with_friction(draws.uniform(0.035..0.055));
    let lay = Lay { ahead: -150.0, ..film(8.0, 430.0, low, LASTING) };
    Setup { films: vec![lay], ..Setup::new(Kind::Suburban, speed, stages, 90.0) }
}

/// S8: leaves under every other tree.
pub(crate) fn leaves_in_turns(draws: &mut Draws) -> Setup {
    let speed = draws.uniform(23.0..27.0);
    let mut stages = vec![Stage::new(Keep(speed), Until::Time(8.0))];
    stages.extend(stop(-draws.uniform(0.65..0.85)));
    let leaves = Film::LEAVES.with_friction(draws.uniform(0.025..0.04));
    let films = (0..20)
        .map(|at| Lay { ahead: 20.0 + 100.0 * f64::from(at), ..film(8.0, 50.0, leaves, 1.05) })
        .collect();
    Setup { powered: [true, false], films, ..Setup::new(Kind::Suburban, speed, stages, 70.0) }
}
