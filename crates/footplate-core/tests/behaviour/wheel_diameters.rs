//! Wheel diameters are learnt from balises, the truth never leaves its interval, and a wrong balise corrupts nothing.

use footplate_core::odometry::diameter::{BaliseAccuracy, PairVerdict, WheelDiameters, WheelScale};
use footplate_core::odometry::wheels::{Axle, Wheelset};
use footplate_core::{Length, Timestamp};
use proptest::prelude::*;

use crate::draw::Draw;

const ASSUMED_M: f64 = 0.86;
const TEETH: u32 = 80;

fn wheelset(tolerance: f64) -> Wheelset {
    Wheelset {
        teeth: TEETH,
        diameter: Length::from_m(ASSUMED_M),
        diameter_tolerance: tolerance,
        axle: Axle::Powered,
    }
}

fn diameters(tolerance: f64) -> WheelDiameters {
    WheelDiameters::new([wheelset(tolerance); 2], BaliseAccuracy::default())
}

/// Two wheels on rails: their counts over a distance, by true scales and creepage.
struct Rails {
    scales: [f64; 2],
    /// Relative creepage of each wheel over the next distance.
    creepage: [f64; 2],
    place_m: f64,
    turned_m: [f64; 2],
    time_s: f64,
}

impl Rails {
    fn new(scales: [f64; 2]) -> Self {
        Self { scales, creepage: [0.0; 2], place_m: 0.0, turned_m: [0.0; 2], time_s: 0.0 }
    }

    fn now(&self) -> Timestamp {
        Timestamp::from_s(self.time_s)
    }

    fn counted(&self) -> [Length; 2] {
        let assumed_pitch = core::f64::consts::PI * ASSUMED_M / f64::from(TEETH);
        let counted = |turned: f64, scale: f64| {
            // A larger wheel turns less; whole pulses only.
            Length::from_m((turned / (assumed_pitch * scale)).floor() * assumed_pitch)
        };
        let ([first_turned, second_turned], [first_scale, second_scale]) = (self.turned_m, self.scales);
        [counted(first_turned, first_scale), counted(second_turned, second_scale)]
    }

    /// Rolls a distance in periods of a metre.
    fn roll(&mut self, learner: &mut WheelDiameters, distance_m: f64, little_effort: bool) {
        self.run(learner, distance_m, [true; 2], little_effort);
    }

    fn run(
        &mut self,
        learner: &mut WheelDiameters,
        distance_m: f64,
        rolling: [bool; 2],
        little_effort: bool,
    ) {
        let periods = distance_m.abs().ceil().max(1.0);
        for _ in 0..periods as usize {
            let distance = distance_m / periods;
            self.place_m += distance;
            self.time_s += 0.05;
            for (turned, creepage) in self.turned_m.iter_mut().zip(self.creepage) {
                *turned += distance * (1.0 + creepage);
            }
            learner.roll(self.now(), self.counted(), rolling, little_effort);
        }
    }

    fn pass(&self, learner: &mut WheelDiameters, error_m: f64) -> PairVerdict {
        learner.pass(self.now(), Length::from_m(self.place_m + error_m))
    }
}

fn errors([first, second]: [WheelScale; 2], [first_truth, second_truth]: [f64; 2]) -> [f64; 2] {
    [first.estimate.value - first_truth, second.estimate.value - second_truth]
}

/// Three pairs of 1.5 km with balises displaced by 0.5 m, with a creepage, 300 times: the largest error of a scale,
/// and the mean square of the errors in standard deviations.
fn after_three_pairs(creepage: f64) -> (f64, f64) {
    let mut draw = Draw::new(3);
    let (mut worst, mut squared) = (0.0_f64, 0.0);
    let runs = 300;
    for run in 0..runs {
        let sign = if run % 2 == 0 { 1.0 } else { -1.0 };
        let truth = [1.0 + sign * 0.015, 1.0 - sign * 0.002];
        let mut rails = Rails::new(truth);
        let mut learner = diameters(0.02);
        rails.pass(&mut learner, 0.5 * draw.normal());
        for _ in 0..3 {
            rails.creepage = [creepage * draw.normal(), creepage * draw.normal()];
            rails.roll(&mut learner, 1500.0, false);
            assert_eq!(rails.pass(&mut learner, 0.5 * draw.normal()), PairVerdict::Accepted);
        }
        let known = learner.scales();
        for (error, known) in errors(known, truth).into_iter().zip(known) {
            worst = worst.max(error.abs());
            squared += (error / known.estimate.uncertainty).powi(2) / f64::from(2 * runs);
        }
    }
    (worst, squared)
}

#[test]
fn one_and_a_half_per_cent_are_a_tenth_of_a_per_cent_after_three_pairs() {
    let (worst, _) = after_three_pairs(0.0);
    assert!(worst < 1e-3, "off by {worst}");
}

#[test]
fn the_deviation_of_a_scale_is_true() {
    let (_, squared) = after_three_pairs(3e-4);
    // 1 if exact; below it because neighbouring pairs share a balise, whose error cancels and is counted twice.
    assert!((0.3..1.2).contains(&squared), "mean squared standardised error {squared}");
}

#[test]
fn learnt_diameters_are_applied_in_steps() {
    let mut rails = Rails::new([1.015, 1.015]);
    let mut learner = diameters(0.02);
    rails.pass(&mut learner, 0.0);
    let mut scale = 1.0;
    for _ in 0..3 {
        rails.roll(&mut learner, 1500.0, false);
        rails.pass(&mut learner, 0.0);
        let [WheelScale { estimate, interval }, _] = learner.scales();
        let next = estimate.value;
        // Further only where keeping the old scale is impossible.
        assert!((next - scale).abs() < 0.0076 || next - interval.low < 1e-12, "from {scale} to {next}");
        scale = next;
    }
    assert!((scale - 1.015).abs() < 1e-4);
}

#[test]
fn a_wrong_balise_is_rejected_with_its_numbers_and_corrupts_nothing() {
    let truth = [1.008, 1.006];
    let mut rails = Rails::new(truth);
    let mut learner = diameters(0.012);
    rails.pass(&mut learner, 0.3);
    rails.roll(&mut learner, 1500.0, false);
    rails.pass(&mut learner, -0.4);
    let before = learner.scales();

    rails.roll(&mut learner, 1500.0, false);
    let verdict = rails.pass(&mut learner, 60.0);
    let PairVerdict::Refused { said, low, high } = verdict else { panic!("{verdict:?}") };
    assert!((said.as_m() - 1560.4).abs() < 1e-6);
    assert!(low.as_m() < 1500.0 && 1500.0 < high.as_m() && high < said, "{low:?} to {high:?}");
    let widened = learner.scales();
    for (was, is) in before.iter().zip(&widened) {
        assert_eq!(was.estimate.value.to_bits(), is.estimate.value.to_bits());
        assert!(was.interval.low >= is.interval.low && was.interval.high <= is.interval.high);
    }

    // The next balise is paired with the one before the wrong one.
    rails.roll(&mut learner, 1500.0, false);
    assert_eq!(rails.pass(&mut learner, 0.2), PairVerdict::Accepted);
    assert!(errors(learner.scales(), truth).iter().all(|error| error.abs() < 5e-4));
}

#[test]
fn the_first_balise_may_be_the_wrong_one() {
    let truth = [0.995, 1.001];
    let mut rails = Rails::new(truth);
    let mut learner = diameters(0.012);
    rails.pass(&mut learner, -200.0);
    rails.roll(&mut learner, 1500.0, false);
    assert!(matches!(rails.pass(&mut learner, 0.0), PairVerdict::Refused { .. }));
    rails.roll(&mut learner, 1500.0, false);
    assert_eq!(rails.pass(&mut learner, 0.0), PairVerdict::Accepted);
    assert!(errors(learner.scales(), truth).iter().all(|error| error.abs() < 5e-4));
}

#[test]
fn a_wheelset_that_slid_learns_nothing_and_the_other_does() {
    let truth = [1.007, 1.004];
    let mut rails = Rails::new(truth);
    let mut learner = diameters(0.012);
    rails.pass(&mut learner, 0.0);
    rails.roll(&mut learner, 700.0, false);
    rails.creepage = [0.0, -0.3];
    rails.run(&mut learner, 100.0, [true, false], false);
    rails.creepage = [0.0; 2];
    rails.roll(&mut learner, 700.0, false);
    assert_eq!(rails.pass(&mut learner, 0.0), PairVerdict::Accepted);
    let [first, second] = learner.scales();
    assert!((first.estimate.value - 1.007).abs() < 1e-3);
    assert_eq!((second.estimate.value, second.estimate.count), (1.0, 0));

    rails.run(&mut learner, 500.0, [false, false], false);
    assert_eq!(rails.pass(&mut learner, 0.0), PairVerdict::Disturbed);
}

#[test]
fn axles_learn_their_ratio_without_any_balise() {
    let truth = [1.006, 0.999];
    let mut rails = Rails::new(truth);
    let mut learner = diameters(0.012);
    rails.roll(&mut learner, 3000.0, true);
    let [first, second] = learner.scales();
    let ratio = first.estimate.value / second.estimate.value;
    assert!((ratio - truth[0] / truth[1]).abs() < 2e-4, "{ratio}");
    // Their common part is as uncertain as before: uniform over the tolerance, less what the ratio contributes.
    assert!(first.estimate.uncertainty > 0.004);

    // One wheelset pairs balises, and both scales are known.
    rails.pass(&mut learner, 0.0);
    rails.run(&mut learner, 1500.0, [true, false], false);
    assert_eq!(rails.pass(&mut learner, 0.0), PairVerdict::Accepted);
    assert!(errors(learner.scales(), truth).iter().all(|error| error.abs() < 5e-4));
}

#[test]
fn balises_of_one_group_do_not_end_a_pair() {
    let mut rails = Rails::new([1.006, 1.006]);
    let mut learner = diameters(0.012);
    rails.pass(&mut learner, 0.0);
    for _ in 0..20 {
        rails.roll(&mut learner, 3.0, false);
        assert_eq!(rails.pass(&mut learner, 0.4), PairVerdict::TooNear);
    }
    rails.roll(&mut learner, 1440.0, false);
    assert_eq!(rails.pass(&mut learner, 0.0), PairVerdict::Accepted);
    assert!((learner.diameters()[0].value.as_m() - 1.006 * ASSUMED_M).abs() < 1e-3);
}

#[test]
fn pairs_form_in_both_directions() {
    let truth = [1.006, 0.996];
    let mut rails = Rails::new(truth);
    let mut learner = diameters(0.012);
    rails.roll(&mut learner, 2000.0, false);
    rails.pass(&mut learner, 0.0);
    rails.roll(&mut learner, -1500.0, false);
    assert_eq!(rails.pass(&mut learner, 0.0), PairVerdict::Accepted);
    // Both were passed at the end of their periods, in either direction: a period of a metre in 1500.
    assert!(errors(learner.scales(), truth).iter().all(|error| error.abs() < 1e-3));

    // As far away as counted, but on the other side.
    rails.roll(&mut learner, 1000.0, false);
    let verdict = rails.pass(&mut learner, -2000.0);
    assert!(matches!(verdict, PairVerdict::Refused { said, .. } if said.as_m() < -999.0), "{verdict:?}");
}

#[test]
fn a_later_run_continues_from_the_last() {
    let mut rails = Rails::new([1.01, 1.008]);
    let mut learner = diameters(0.012);
    for _ in 0..5 {
        rails.roll(&mut learner, 1500.0, false);
        rails.pass(&mut learner, 0.0);
    }
    let kept = learner.scales();
    let resumed =
        WheelDiameters::resume([wheelset(0.012); 2], BaliseAccuracy::default(), kept).unwrap().scales();
    for (kept, resumed) in kept.iter().zip(&resumed) {
        assert!((kept.estimate.value - resumed.estimate.value).abs() < 1e-15);
        assert_eq!(
            (kept.estimate.count, kept.estimate.date),
            (resumed.estimate.count, resumed.estimate.date)
        );
        assert_eq!(kept.interval, resumed.interval);
    }

    let error = WheelDiameters::resume([wheelset(0.005); 2], BaliseAccuracy::default(), kept).unwrap_err();
    assert_eq!(error.wheelset, 1);
    assert!(error.to_string().contains("between 0.995 and 1.005"), "{error}");
}

#[derive(Debug, Clone)]
enum Leg {
    Roll { distance: f64, creepage: [f64; 2], little_effort: bool },
    Slide { distance: f64, creepage: f64, wheel: usize },
    Balise { error: f64 },
    WrongBalise,
}

fn legs() -> impl Strategy<Value = Vec<Leg>> {
    let creep = || -0.003..0.003_f64;
    let leg = prop_oneof![
        3 => (1.0..2000.0_f64, creep(), creep(), any::<bool>()).prop_map(|(distance, first, second, little_effort)| {
            Leg::Roll { distance, creepage: [first, second], little_effort }
        }),
        1 => (1.0..300.0_f64, -0.9..0.9_f64, 0..2usize)
            .prop_map(|(distance, creepage, wheel)| Leg::Slide { distance, creepage, wheel }),
        4 => (-2.5..2.5_f64).prop_map(|error| Leg::Balise { error }),
        1 => Just(Leg::WrongBalise),
    ];
    prop::collection::vec(leg, 1..25)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]
    /// Whatever is run, slid and passed: the truth stays inside the interval, and the estimate with it.
    #[test]
    fn the_truth_is_always_inside_the_interval(
        truth in prop::array::uniform2(0.981..1.019_f64),
        legs in legs(),
    ) {
        let mut rails = Rails::new(truth);
        let mut learner = diameters(0.02);
        let mut wrong = 0.0;
        for leg in legs {
            match leg {
                Leg::Roll { distance, creepage, little_effort } => {
                    rails.creepage = creepage;
                    rails.roll(&mut learner, distance, little_effort);
                }
                Leg::Slide { distance, creepage, wheel } => {
                    rails.creepage = [0.0; 2];
                    rails.creepage[wheel] = creepage;
                    let rolling = [wheel != 0, wheel != 1];
                    rails.run(&mut learner, distance, rolling, false);
                }
                Leg::Balise { error } => {
                    rails.pass(&mut learner, error);
                }
                Leg::WrongBalise => {
                    // Displaced so far, each further than the one before, that neither the truth nor another error
                    // explains it.
                    wrong += 1.0;
                    rails.pass(&mut learner, wrong * 100_000.0);
                }
            }
            for (known, truth) in learner.scales().iter().zip(truth) {
                prop_assert!(known.interval.holds(truth), "{truth} is not within {:?}", known.interval);
                prop_assert!(known.interval.holds(known.estimate.value));
                prop_assert!(known.estimate.uncertainty > 0.0);
            }
        }
    }

    /// Impossible values are rejected or ignored, and learning continues as before.
    #[test]
    fn non_finite_input_corrupts_nothing(
        places in prop::collection::vec(prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-1e300), Just(1e300)], 1..5),
    ) {
        let truth = [1.003, 0.998];
        let mut rails = Rails::new(truth);
        let mut learner = diameters(0.012);
        for place in places {
            learner.pass(rails.now(), Length::from_m(place));
            rails.roll(&mut learner, 10.0, false);
        }
        for _ in 0..3 {
            rails.roll(&mut learner, 1500.0, false);
            rails.pass(&mut learner, 0.0);
        }
        prop_assert!(errors(learner.scales(), truth).iter().all(|error| error.abs() < 5e-4));
    }
}
