//! What is timed as rolling, sliding and correcting is that.

use footplate_bench::odometry::{Load, Round, Run};
use footplate_core::odometry::{Mode, OdometrySettings};

/// Parts of a round, the second one, that the odometer spends in a mode.
fn part(load: Load, mode: Mode) -> f64 {
    let round = Round::new(load);
    let periods = round.periods().len();
    let mut run = Run::new(round, OdometrySettings::recommended());
    let modes: Vec<Mode> = (0..2 * periods).map(|_| run.step().mode).collect();
    modes.iter().skip(periods).filter(|seen| **seen == mode).count() as f64 / periods as f64
}

#[test]
fn each_load_is_what_it_is_called() {
    assert_eq!(part(Load::Rolling, Mode::Normal), 1.0);
    // The train slows down for two thirds of a round.
    for (load, mode) in [(Load::OneSlides, Mode::OneSlip), (Load::BothSlide, Mode::Correction)] {
        let part = part(load, mode);
        assert!((0.5..0.8).contains(&part), "{load:?} is {mode:?} in {part} of the periods");
    }
}
