//! Two wheelsets and a virtual sensor, fused: a sliding wheelset costs nothing once its slide is detected, and the
//! covariance matches the errors.

use std::ops::Range;

use footplate_core::odometry::paper::{
    FederatedFilter, Fusion, Manoeuvre, ManoeuvreSettings, MeasuredSpeed, Sharing,
};

use crate::counted_run::{FILTER_VARIANCE, FIRST_SPEED, PERIOD, Run, SEEDS, SERVICE_BRAKE, Score, score};

/// When the second wheelset slides (periods), and its relative speed.
const SLIDING: Range<usize> = 11_520..11_720;
const CREEPAGE: f64 = 0.8;

fn fused(run: &Run, fusion: Fusion, slides: bool) -> Score {
    let variance = FILTER_VARIANCE * run.quantum * run.quantum;
    let mut manoeuvre = Manoeuvre::new(ManoeuvreSettings::recommended());
    let first = MeasuredSpeed { speed: FIRST_SPEED, variance };
    let mut filter = FederatedFilter::starting_at(fusion, first);
    score(run, |period, [first, mut second]| {
        let sliding = slides && SLIDING.contains(&period);
        if sliding {
            second *= CREEPAGE;
        }
        let trusted = [true, !sliding];
        let shares = Sharing::PAPER.shares([first, second, 0.0], trusted);
        let [first, second] = [first, second].map(|speed| MeasuredSpeed { speed, variance });
        filter.step(&manoeuvre.next_step(PERIOD), [first, second, MeasuredSpeed::MISSING], shares);
        manoeuvre.learn(filter.master().state[1], true);
        (filter.master().state, Some(*filter.master()))
    })
}

#[test]
fn a_detected_slide_costs_nothing_and_the_printed_method_loses_metres_per_second() {
    for teeth in [80.0, 200.0] {
        for seed in SEEDS {
            let run = Run::new(teeth, SERVICE_BRAKE, seed);
            for fusion in [Fusion::Reset, Fusion::CovarianceIntersection] {
                let [rolling, sliding] = [false, true].map(|slides| fused(&run, fusion, slides));
                assert!(
                    sliding.rms < rolling.rms + 0.001,
                    "{fusion:?}, seed {seed}: {rolling:?} {sliding:?}"
                );
                assert!(sliding.braking < 0.2, "{fusion:?}, seed {seed}: {sliding:?}");
            }
            // Half of a fifth of 89 m/s: the shares have no effect.
            let literal = fused(&run, Fusion::Literal, true);
            assert!(literal.braking > 8.0, "seed {seed}: {literal:?}");
        }
    }
}

#[test]
fn the_stated_covariance_is_not_too_small() {
    for teeth in [80.0, 100.0, 200.0] {
        for fusion in [Fusion::Reset, Fusion::CovarianceIntersection] {
            let scores: Vec<Score> =
                SEEDS.map(|seed| fused(&Run::new(teeth, SERVICE_BRAKE, seed), fusion, false)).collect();
            for score in &scores {
                assert!(score.rms < 0.04 && score.onset < 0.15, "{fusion:?}, {teeth} teeth: {score:?}");
                // Both count the same pulses: at equal diameters the second wheelset may add no information, or, half
                // a pulse apart, almost as much as the first.
                assert!((0.1..1.0).contains(&score.nees), "{fusion:?}, {teeth} teeth: {score:?}");
                assert!(score.inside > 0.97, "{fusion:?}, {teeth} teeth: {score:?}");
            }
        }
    }
}
