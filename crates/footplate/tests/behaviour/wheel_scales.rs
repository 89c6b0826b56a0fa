//! Wheel diameters are learnt on simulated runs over balises, with creepage, curves of speed and a reader that is late; the
//! truth says when wheels roll, so that nothing but the learning is on trial.

use footplate_core::Length;
use footplate_core::odometry::diameter::{BaliseAccuracy, PairVerdict, WheelDiameters};
use footplate_core::odometry::wheels::{Axle, Wheelset};
use footplate_core::odometry::{BaliseLink, BaliseVerdict, DistanceInterval};
use footplate_sim::line::{LineConditions, LineRun, LineScenario, WheelTruth};

/// Commands below this are little effort.
const LITTLE_EFFORT: f64 = 0.1;

fn wheelsets(run: &LineRun) -> [Wheelset; 2] {
    run.vehicle.wheelsets.map(|wheelset| Wheelset {
        teeth: wheelset.teeth,
        diameter: wheelset.diameter,
        diameter_tolerance: wheelset.diameter_tolerance,
        axle: if wheelset.is_powered { Axle::Powered } else { Axle::Trailing },
    })
}

/// The true scales: the way of each tread over the way that its pulses say.
fn true_scales(run: &LineRun) -> [f64; 2] {
    let t = run.vehicle.period.as_s();
    [0, 1].map(|wheel| {
        let pairs = run.truth.windows(2);
        let ways = pairs.map(|pair| {
            0.5 * t * (pair[0].wheel_speeds[wheel].as_m_per_s() + pair[1].wheel_speeds[wheel].as_m_per_s())
        });
        let pulses: i64 = run.samples.iter().skip(1).filter_map(|sample| sample.wheels[wheel].pulses).sum();
        ways.sum::<f64>() / (pulses as f64 * wheelsets(run)[wheel].pulse_pitch().as_m())
    })
}

#[test]
fn diameters_that_are_off_are_found_while_the_train_runs() {
    let scenario = LineScenario::by_name("N6").unwrap();
    let (mut before, mut after, mut squared, mut count) = (0.0_f64, 0.0_f64, 0.0, 0.0);
    let (mut accepted, mut refused, mut widths) = (0, 0, 0.0);
    for seed in 0..30 {
        let conditions =
            LineConditions { teeth: [80, 100, 200][seed as usize % 3], ..LineConditions::default() };
        let run = scenario.run(seed, conditions);
        let truth = true_scales(&run);
        let pitches = wheelsets(&run).map(|wheelset| wheelset.pulse_pitch());
        let mut learner = WheelDiameters::new(wheelsets(&run), BaliseAccuracy::default());
        let mut counted = [Length::ZERO; 2];
        for (sample, at) in run.samples.iter().zip(&run.truth).skip(1) {
            let mut rolling = [false; 2];
            for wheel in 0..2 {
                if let Some(pulses) = sample.wheels[wheel].pulses {
                    counted[wheel] += pitches[wheel] * pulses as f64;
                    rolling[wheel] = at.wheels[wheel] == WheelTruth::Rolling;
                }
            }
            learner.roll(sample.time, counted, rolling, sample.effort.unwrap_or(0.0).abs() < LITTLE_EFFORT);
            if let Some(place) = sample.balise {
                match learner.pass(sample.time, place) {
                    PairVerdict::Accepted => accepted += 1,
                    PairVerdict::Refused { .. } => refused += 1,
                    _ => {}
                }
            }
            for (interval, truth) in learner.intervals().iter().zip(truth) {
                assert!(interval.holds(truth), "seed {seed}: {truth} is not within {interval:?}");
            }
        }
        for (known, truth) in learner.scales().iter().zip(truth) {
            let error = known.estimate.value - truth;
            before = before.max((1.0 - truth).abs());
            after = after.max(error.abs());
            squared += (error / known.estimate.uncertainty).powi(2);
            widths += known.interval.high - known.interval.low;
            count += 1.0;
        }
    }
    eprintln!(
        "N6, 30 seeds: {accepted} pairs accepted, {refused} refused; scales off by {:.2} % at most before and {:.3} % after; \
         mean square {:.2} in deviations; intervals {:.2} % wide",
        100.0 * before,
        100.0 * after,
        squared / count,
        100.0 * widths / count,
    );
    assert_eq!(refused, 0);
    assert!(before > 0.01 && after < 0.0015, "{after}");
    // Ten pairs in a row share nine balises, whose errors cancel and are counted twice: below 1.
    assert!((0.05..1.2).contains(&(squared / count)), "the deviation is not true: {}", squared / count);
}

#[test]
fn bounds_that_balises_narrow_hold_the_truth() {
    let scenario = LineScenario::by_name("N6").unwrap();
    for seed in 0..30 {
        let run = scenario.run(seed, LineConditions::default());
        let mut link = BaliseLink::new(BaliseAccuracy::default());
        let [wheelset, _] = wheelsets(&run);
        let mut now = DistanceInterval { estimate: Length::ZERO, low: Length::ZERO, high: Length::ZERO };
        let mut widest = Length::ZERO;
        for (sample, truth) in run.samples.iter().zip(&run.truth).skip(1) {
            let pulses = sample.wheels[0].pulses.unwrap_or_default() as f64;
            let ran = wheelset.pulse_pitch() * pulses;
            // The diameter within its tolerance, and creepage of a wheel that rolls.
            let off = ran * (wheelset.diameter_tolerance + 0.01) + wheelset.pulse_pitch() * 0.01;
            now = DistanceInterval {
                estimate: now.estimate + ran,
                low: now.low + ran - off,
                high: now.high + ran + off,
            };
            if let Some(place) = sample.balise {
                let BaliseVerdict::Accepted(narrowed) = link.pass(place, ran, &now) else {
                    panic!("seed {seed}: a right balise at {place:?} was refused within {now:?}");
                };
                now = narrowed;
                widest = widest.max(now.high - now.low);
                assert!(
                    (now.estimate - truth.distance).abs().as_m() < 4.0,
                    "seed {seed}: {now:?}, {truth:?}"
                );
            }
            let low = now.low - wheelset.pulse_pitch();
            assert!(
                low <= truth.distance && truth.distance <= now.high + wheelset.pulse_pitch(),
                "seed {seed}"
            );
        }
        assert!(widest.as_m() < 11.0, "{widest:?}");
    }
}
