//! The adaptive motion model follows a train by the pulses of one wheel: the published filter, and the corrected one,
//! at the start of an acceleration.

use footplate_core::odometry::paper::{
    ErrorGrowth, Liveliness, LocalFilter, Manoeuvre, ManoeuvreSettings, MeasuredSpeed,
};

use crate::counted_run::{
    EMERGENCY_BRAKE, FILTER_VARIANCE, FIRST_SPEED, PERIOD, Run, SEEDS, SERVICE_BRAKE, Score,
    VARIANCE_OF_A_COUNT, score,
};

const ANY_JERK: (f64, f64) = (0.0, f64::INFINITY);

fn raw(run: &Run) -> Score {
    score(run, |_, [first, _]| ([first, 0.0], None))
}

fn filtered(run: &Run, settings: ManoeuvreSettings, pulses_squared: f64) -> Score {
    let variance = pulses_squared * run.quantum * run.quantum;
    let mut manoeuvre = Manoeuvre::new(settings);
    let mut filter = LocalFilter::starting_at(MeasuredSpeed { speed: FIRST_SPEED, variance });
    score(run, |_, [speed, _]| {
        filter.predict(&manoeuvre.next_step(PERIOD));
        filter.update(MeasuredSpeed { speed, variance });
        manoeuvre.learn(filter.state[1], true);
        (filter.state, Some(filter))
    })
}

#[test]
fn the_published_filter_loses_an_accelerating_train_and_the_corrected_one_follows_it() {
    let recommended = ManoeuvreSettings::recommended();
    let only_window = ManoeuvreSettings { errors: ErrorGrowth::Decays, jerk: ANY_JERK, ..recommended };
    let mut worst_literal: f64 = 0.0;
    for seed in SEEDS {
        let run = Run::new(80.0, SERVICE_BRAKE, seed);
        let raw = raw(&run);
        let literal = filtered(&run, ManoeuvreSettings::literal(), VARIANCE_OF_A_COUNT);
        assert!(literal.onset > 1.3 * raw.onset, "seed {seed}: {literal:?}, counts alone {raw:?}");
        worst_literal = worst_literal.max(literal.rms / raw.rms);
        let window = filtered(&run, only_window, VARIANCE_OF_A_COUNT);
        assert!(window.onset > 2.0 * raw.onset, "seed {seed}: {window:?}, counts alone {raw:?}");
        let repaired = filtered(&run, recommended, VARIANCE_OF_A_COUNT);
        assert!(repaired.rms < 0.035 && repaired.rms < 0.1 * raw.rms, "seed {seed}: {repaired:?}");
        assert!(repaired.onset < 0.25, "seed {seed}: {repaired:?}");
    }
    assert!(worst_literal > 1.0, "over the whole run {worst_literal} of the error of counts alone");
}

#[test]
fn without_an_upper_bound_the_filter_mistakes_noise_for_manoeuvres() {
    let recommended = ManoeuvreSettings::recommended();
    let (floor, _) = recommended.jerk;
    let unbounded = ManoeuvreSettings { jerk: (floor, f64::INFINITY), ..recommended };
    let fixed = ManoeuvreSettings { liveliness: Liveliness::Fixed, ..recommended };
    for seed in SEEDS {
        let run = Run::new(80.0, SERVICE_BRAKE, seed);
        let [unbounded, bounded, fixed] =
            [unbounded, recommended, fixed].map(|settings| filtered(&run, settings, FILTER_VARIANCE));
        assert!(unbounded.rms > 2.5 * bounded.rms, "seed {seed}: {unbounded:?} {bounded:?}");
        assert!(bounded.rms < 1.25 * fixed.rms, "seed {seed}: {bounded:?} {fixed:?}");
    }
}

#[test]
fn its_covariance_matches_its_errors() {
    for teeth in [80.0, 100.0, 200.0] {
        for seed in SEEDS {
            let run = Run::new(teeth, SERVICE_BRAKE, seed);
            let score = filtered(&run, ManoeuvreSettings::recommended(), FILTER_VARIANCE);
            assert!((0.3..1.5).contains(&score.nees), "{teeth} teeth, seed {seed}: {score:?}");
            assert!((0.93..0.9995).contains(&score.inside), "{teeth} teeth, seed {seed}: {score:?}");
        }
    }
}

#[test]
fn an_emergency_brake_is_followed() {
    for teeth in [80.0, 200.0] {
        for seed in SEEDS {
            let run = Run::new(teeth, EMERGENCY_BRAKE, seed);
            let score = filtered(&run, ManoeuvreSettings::recommended(), FILTER_VARIANCE);
            // A lag of half a second at a change of 1.3 m/s² would give twice this error.
            assert!(score.braking < 0.3, "{teeth} teeth, seed {seed}: {score:?}");
        }
    }
}
