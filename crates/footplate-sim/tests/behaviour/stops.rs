//! Stops vary as given, and a tape reads them to the centimetre.

use footplate_core::{Approach, EventKind, Length, Ratio, Speed, TimeSpan};
use footplate_sim::{LawFamily, Script, SpeedTable, StopScatter, Train, What, When};

use crate::oval::{Yard, oval, seconds, step};

/// The steps of mid speed and of top speed of the trains below.
const MID: u8 = 9;
const TOP: u8 = 14;

/// A train whose speed is linear up to mid speed at step 9, and from there to top speed at step 14.
fn two_speeds(family: LawFamily, seed: u64) -> Train {
    let (mid, top) = (StopScatter::MID_SPEED, StopScatter::TOP_SPEED);
    let low = (0..=MID).map(|step| mid * (f64::from(step) / f64::from(MID)));
    let high = (1..=TOP - MID).map(|step| mid + (top - mid) * (f64::from(step) / f64::from(TOP - MID)));
    let speeds: Vec<Speed> = low.chain(high).collect();
    Train { speeds: SpeedTable::new(&speeds, &speeds), warm_up: Ratio::ZERO, ..Train::draw(seed, family) }
}

fn stop_from(number: u8) -> Script {
    Script::running(1, step(number), Approach::Below, seconds(60))
        .then(When::After(seconds(2)), What::Speed(step(0)))
        .then(When::AtRest, What::Measure)
}

fn mean_and_sd(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt())
}

const RUNS: u64 = 400;
/// Four standard errors of a standard deviation from so many runs.
const MARGIN: f64 = 4.0 / 28.2;

#[test]
fn stops_vary_as_given_under_every_law() {
    let layout = oval();
    for family in LawFamily::ALL {
        let none = Ratio::ZERO;
        let scatter = StopScatter { at_mid: Length::from_mm(3.0), at_top: Length::from_mm(19.0) };
        let train =
            Train { stop_scatter: scatter, run_deviation: none, wander: none, ..two_speeds(family, 4) };
        let mut yard = Yard::new(&layout, train, 4);
        yard.railway.track = footplate_sim::TrueTrack::as_surveyed(&layout);
        for (number, asked) in [(MID, 3.0), (TOP, 19.0)] {
            let distances: Vec<f64> = (0..RUNS)
                .map(|seed| {
                    let truth = yard.run(&stop_from(number), seed).truth;
                    let heard = truth.motion.distance(truth.commands[0].heard);
                    (truth.motion.distance(truth.stops[0].rested) - heard).as_mm()
                })
                .collect();
            let (mean, sd) = mean_and_sd(&distances);
            let expected = yard.train.stopping_distance(step(number), Approach::Below).as_mm();
            assert!(
                (mean - expected).abs() < 1.0 + 4.0 * asked / 20.0,
                "{family}: {mean}, not {expected} mm"
            );
            assert!((sd / asked - 1.0).abs() < MARGIN, "{family}: scatters by {sd} instead of {asked} mm");
        }
    }
}

#[test]
fn a_stop_commanded_on_time_repeats_to_4_mm_at_mid_and_21_mm_at_top_speed() {
    let layout = oval();
    let typical = Train {
        stop_scatter: StopScatter { at_mid: Length::from_mm(3.0), at_top: Length::from_mm(19.0) },
        run_deviation: Ratio::from_percent(0.4),
        command_jitter: TimeSpan::from_ms(4),
        ..two_speeds(LawFamily::Lag, 4)
    };
    let yard = Yard::new(&layout, typical, 4);
    for (number, low, high) in [(MID, 3.0, 5.0), (TOP, 18.0, 24.0)] {
        let distances: Vec<f64> = (0..RUNS)
            .map(|seed| {
                let run = yard.run(&stop_from(number), seed);
                let commanded = run.events[run.truth.commands[0].event].time;
                (run.truth.motion.distance(run.truth.stops[0].rested) - run.truth.motion.distance(commanded))
                    .as_mm()
            })
            .collect();
        let (_, sd) = mean_and_sd(&distances);
        assert!((low..high).contains(&sd), "scatters by {sd} mm");
    }
}

#[test]
fn the_tape_is_read_to_the_centimetre_once_the_train_is_at_rest() {
    let layout = oval();
    let yard = Yard::new(&layout, two_speeds(LawFamily::Constant, 6), 6);
    let mut errors = Vec::new();
    for seed in 0..RUNS {
        let run = yard.run(&stop_from(MID), seed);
        let stop = run.truth.stops[0];
        let written = run.events[stop.event];
        let EventKind::Stopped { offset, .. } = written.kind else { panic!("no stop") };
        assert!((offset.as_mm() / 10.0).fract().abs() < 1e-9, "{offset:?}");
        errors.push((offset - stop.offset).as_mm());
        let pressed = (written.time - stop.rested).as_s();
        assert!((0.2..=0.502).contains(&pressed), "pressed after {pressed} s");
        assert!(run.truth.motion.speed(stop.rested) < Speed::from_mm_per_s(2.0));
        assert_eq!(run.truth.motion.speed(written.time), Speed::ZERO);
    }
    let (mean, sd) = mean_and_sd(&errors);
    // A tape error of 3 mm and marks 10 mm apart: √(3² + 10²/12).
    assert!(mean.abs() < 4.0 * 4.2 / 20.0 && (sd / 4.16 - 1.0).abs() < MARGIN, "{mean} ± {sd} mm");
}
