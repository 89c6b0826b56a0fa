//! The speed that a decoder reports of its own train: a measurement, once sensors have shown what its numbers mean.
//!
//! A decoder reports `n = round(k v)`, up to a second late. Its owner has set the scale `k`. Between two sensors passed at one steady
//! speed `v` is known without any report, and so `ln k = ln n − ln v`. The error of `n` is uniform over one unit, and the same
//! whenever the decoder reports the same number: all hops with one number are one measurement of `k`.

use alloc::collections::BTreeMap;

use crate::ids::NodeId;
use crate::linalg::Gaussian;
use crate::link::DetectionWindow;
use crate::time::{TimeSpan, Timestamp};

/// A report is at most this late (chosen; no source states it).
pub(super) const LATEST: TimeSpan = TimeSpan::from_ms(1_500);
/// One standard deviation of ln of a scale however often it was measured: back EMF is not exactly proportional (chosen).
const LEAST_DEVIATION: f64 = 0.003;
/// One standard deviation of ln of a train's speed on one place of its run over that on average (curves), and for how many reports it
/// is about the same (chosen by how well places are known).
const LOCAL: f64 = 0.01;
const ALIKE: f64 = 4.0;
/// Nothing is used before ln of the scale is known to this standard deviation, from this many hops.
const KNOWN: f64 = 0.01;
const LEAST_HOPS: u32 = 3;
/// A hop contradicts the scale beyond this many standard deviations ...
const GATE: f64 = 4.0;
/// ... or if numbers on it differ by more than this, and this part of them: trains are up to 5 % slower in curves.
const MOST_APART: f64 = 2.0;
const MOST_APART_PART: f64 = 0.08;
/// So many contradictions, less the hops that agreed, and a decoder is not trusted any more (chosen).
const DISTRUSTED_AFTER: u8 = 4;
/// The highest numbers of either kind of report: they stand for all speeds above, too.
const TOPS: [u16; 2] = [255, 511];
/// A train has stalled that has reported 0 for this long ...
const STALLED_AFTER: TimeSpan = TimeSpan::from_s(1.0);
/// ... where at least this number was to be expected.
const LEAST_EXPECTED: f64 = 3.0;

/// Numbers that a decoder reported at one steady speed.
#[derive(Debug, Clone, Copy, Default)]
struct Numbers {
    sum: f64,
    count: f64,
    /// The lowest and the highest.
    range: Option<(u16, u16)>,
}

impl Numbers {
    fn take(&mut self, number: u16) {
        let (low, high) = self.range.unwrap_or((number, number));
        self.range = Some((low.min(number), high.max(number)));
        (self.sum, self.count) = (self.sum + f64::from(number), self.count + 1.0);
    }

    fn mean(&self) -> f64 {
        self.sum / self.count
    }

    /// The variance of ln of their mean over that of the whole run, because a train is not as fast everywhere.
    fn local_variance(&self) -> f64 {
        LOCAL * LOCAL / (self.count / ALIKE).max(1.0)
    }

    /// Whether they are further apart than those of one steady speed can be.
    fn are_apart(&self) -> bool {
        self.range
            .is_some_and(|(low, high)| f64::from(high - low) > MOST_APART + MOST_APART_PART * f64::from(high))
    }
}

/// What a decoder has reported in this session.
#[derive(Debug, Clone, Default)]
pub(super) struct ReportedSpeed {
    /// ln of the scale by each number, and the variance that the sensors have left.
    scales: BTreeMap<u16, Gaussian>,
    hops: u32,
    contradictions: u8,
    /// Since the speed is steady, and since the last sensor.
    run: Numbers,
    hop: Numbers,
    /// The last sensor that reported the train.
    passed: Option<(NodeId, DetectionWindow)>,
    /// Whether it has reported one of [`TOPS`] since its speed was steady.
    is_off_scale: bool,
    zero_since: Option<Timestamp>,
}

impl ReportedSpeed {
    /// The speed is not steady.
    pub(super) fn forget_run(&mut self) {
        (self.run, self.hop) = (Numbers::default(), Numbers::default());
        (self.zero_since, self.is_off_scale) = (None, false);
    }

    /// The last sensor that reported the train, and when.
    pub(super) const fn last_passed(&self) -> Option<(NodeId, DetectionWindow)> {
        self.passed
    }

    /// It reports 0 at a speed (m/s) that it should have. Returns whether the train has stalled.
    pub(super) fn take_zero(&mut self, now: Timestamp, speed: f64) -> bool {
        let zero_since = *self.zero_since.get_or_insert(now);
        let expected = self.known_scale().map_or(0.0, |scale| libm::exp(scale.mean)) * speed;
        now - zero_since >= STALLED_AFTER && expected >= LEAST_EXPECTED
    }

    /// It reports any other number.
    pub(super) fn take(&mut self, now: Timestamp, number: u16) {
        self.zero_since = None;
        self.is_off_scale |= TOPS.contains(&number);
        self.run.take(number);
        if self.passed.is_some_and(|(_, window)| now - window.until >= LATEST) {
            self.hop.take(number);
        }
    }

    const fn is_trusted(&self) -> bool {
        self.contradictions < DISTRUSTED_AFTER
    }

    /// ln of the scale (numbers per m/s).
    fn scale(&self) -> Option<Gaussian> {
        let (mut weight, mut sum) = (0.0, 0.0);
        for (number, scale) in &self.scales {
            let own = 1.0 / (scale.variance + rounding(f64::from(*number)));
            (weight, sum) = (weight + own, sum + own * scale.mean);
        }
        let variance = 1.0 / weight + LEAST_DEVIATION * LEAST_DEVIATION;
        (weight > 0.0).then(|| Gaussian { mean: sum / weight, variance })
    }

    fn known_scale(&self) -> Option<Gaussian> {
        let is_known = |scale: &Gaussian| self.hops >= LEAST_HOPS && scale.variance <= KNOWN * KNOWN;
        self.scale().filter(is_known).filter(|_| self.is_trusted())
    }

    /// ln of the speed (m/s) of this run. However many numbers there are, they share one rounding.
    pub(super) fn ln_speed(&self) -> Option<Gaussian> {
        let (scale, mean) = (self.known_scale()?, self.run.mean());
        let variance = scale.variance + rounding(mean) + self.run.local_variance();
        (!self.is_off_scale).then(|| Gaussian { mean: libm::log(mean) - scale.mean, variance })
    }

    /// A sensor reported the train; `ln_speed`: of the hop before, if it was run at a steady speed. Returns whether its decoder is not
    /// trusted any more from now on.
    pub(super) fn pass(&mut self, node: NodeId, window: DetectionWindow, ln_speed: Option<Gaussian>) -> bool {
        let stands = self.zero_since.is_some_and(|since| window.after - since >= LATEST);
        let is_too_much =
            if stands { self.contradict() } else { ln_speed.is_some_and(|speed| self.learn(speed)) };
        (self.passed, self.hop) = (Some((node, window)), Numbers::default());
        is_too_much
    }

    /// Reports contradict a sensor. Returns whether once too often.
    fn contradict(&mut self) -> bool {
        let was_trusted = self.is_trusted();
        self.contradictions += u8::from(was_trusted);
        was_trusted && !self.is_trusted()
    }

    /// A hop was run at a steady speed, of which sensors know ln. Returns whether it was one contradiction too many.
    fn learn(&mut self, ln_speed: Gaussian) -> bool {
        let hop = self.hop;
        if hop.range.is_none() || self.is_off_scale || !self.is_trusted() {
            return false;
        }
        let mean = libm::log(hop.mean()) - ln_speed.mean;
        let variance = ln_speed.variance + hop.local_variance();
        let is_outlier = self.scale().is_some_and(|scale| {
            let off = mean - scale.mean;
            off * off > GATE * GATE * (scale.variance + variance + rounding(hop.mean()))
        });
        if is_outlier || hop.are_apart() {
            return self.contradict();
        }
        self.contradictions = self.contradictions.saturating_sub(1);
        self.hops = self.hops.saturating_add(1);
        // Not negative, and at most the highest number.
        let number = libm::round(hop.mean()) as u16;
        let known = self.scales.entry(number).or_insert(Gaussian { mean, variance: f64::INFINITY });
        let gain = 1.0 / (1.0 + variance / known.variance);
        known.mean += gain * (mean - known.mean);
        known.variance = gain * variance;
        false
    }
}

/// Variance of ln of a number that was rounded: uniform over one unit.
fn rounding(number: f64) -> f64 {
    1.0 / (12.0 * number * number)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hops at a speed (m/s), known to 0.2 %, on which the decoder reported these numbers.
    fn learn(reported: &mut ReportedSpeed, speed: f64, numbers: &[u16], hops: usize) -> bool {
        (0..hops).fold(false, |_, _| {
            reported.hop = Numbers::default();
            (0..400).for_each(|nth| reported.hop.take(numbers[nth % numbers.len()]));
            reported.learn(Gaussian { mean: libm::log(speed), variance: 0.002 * 0.002 })
        })
    }

    #[test]
    fn equal_numbers_are_one_measurement_of_the_scale_and_others_are_more() {
        let mut reported = ReportedSpeed::default();
        learn(&mut reported, 0.2, &[63], 2);
        assert_eq!(reported.known_scale(), None, "two hops are not enough");
        learn(&mut reported, 0.2, &[63], 100);
        // 1/(√12 63) = 0.458 %, and 0.3 % at least: 0.548 %.
        let one = reported.known_scale().unwrap();
        assert!((libm::exp(one.mean) - 315.0).abs() < 0.1, "{one:?}");
        assert!((0.00547..0.00550).contains(&libm::sqrt(one.variance)), "{one:?}");
        // Twice as fast, twice the number: half its rounding. 1/√(1/0.458² + 1/0.229²) = 0.205 %, and 0.3 %: 0.363 %.
        learn(&mut reported, 0.4, &[126], 100);
        let two = reported.known_scale().unwrap();
        assert!((0.00362..0.00366).contains(&libm::sqrt(two.variance)), "{two:?}");
    }

    #[test]
    fn a_decoder_that_contradicts_sensors_is_not_trusted_any_more() {
        let mut reported = ReportedSpeed::default();
        assert!(!learn(&mut reported, 0.2, &[63, 64], 5));
        // The same number at twice the speed, and numbers that are far apart.
        assert!(!learn(&mut reported, 0.4, &[63], 2));
        assert!(reported.known_scale().is_some());
        assert!(!learn(&mut reported, 0.2, &[20, 90], 1));
        assert!(learn(&mut reported, 0.4, &[63], 1), "the fourth, said once");
        assert!(!learn(&mut reported, 0.4, &[63], 1));
        assert_eq!(reported.known_scale(), None);
    }

    /// Two measurements of one number's scale, weighed by their inverse variances.
    #[test]
    fn hops_at_one_number_are_weighed_by_their_variances() {
        let mut reported = ReportedSpeed::default();
        for (speed, deviation) in [(0.200, 0.004), (0.202, 0.002)] {
            reported.hop = Numbers::default();
            (0..400).for_each(|_| reported.hop.take(63));
            assert!(!reported.learn(Gaussian { mean: libm::log(speed), variance: deviation * deviation }));
        }
        let local = reported.hop.local_variance();
        let [one, other] = [0.004, 0.002].map(|deviation: f64| 1.0 / (deviation * deviation + local));
        let scales = [0.200, 0.202].map(|speed| libm::log(63.0 / speed));
        let known = reported.scales[&63];
        let mean = (one * scales[0] + other * scales[1]) / (one + other);
        assert!((known.mean - mean).abs() < 1e-12, "{known:?}, not {mean}");
        assert!((known.variance * (one + other) - 1.0).abs() < 1e-9, "{known:?}");
    }

    #[test]
    fn numbers_of_one_speed_are_within_two_and_8_per_cent() {
        let apart = |low, high| {
            let mut numbers = Numbers::default();
            [high, low, high].into_iter().for_each(|number| numbers.take(number));
            numbers.are_apart()
        };
        // 8 % of 50 are 4, of 100 are 8.
        assert_eq!([apart(44, 50), apart(43, 50)], [false, true]);
        assert_eq!([apart(90, 100), apart(89, 100)], [false, true]);
    }

    #[test]
    fn a_speed_is_its_number_over_the_scale_unless_the_number_stands_for_all_above() {
        let mut reported = ReportedSpeed::default();
        learn(&mut reported, 0.2, &[63], 100);
        let at = Timestamp::from_s(10.0);
        (0..16).for_each(|_| reported.take(at, 126));
        let speed = reported.ln_speed().unwrap();
        assert!((libm::exp(speed.mean) - 0.4).abs() < 1e-3, "{speed:?}");
        // The scale is known to 0.548 %, a number of 126 is rounded by 0.229 %, and 16 reports are four places of 1 % each: 0.5 %.
        assert!((libm::sqrt(speed.variance) - 0.007_764).abs() < 2e-5, "{}", libm::sqrt(speed.variance));
        reported.take(at, 255);
        assert_eq!(reported.ln_speed(), None, "255 is any speed above, too");
        reported.forget_run();
        reported.take(at, 126);
        assert!(reported.ln_speed().is_some());
    }

    #[test]
    fn numbers_count_for_a_hop_a_second_and_a_half_after_its_first_sensor() {
        let at = Timestamp::from_s;
        let window = |from, until| DetectionWindow { after: at(from), until: at(until) };
        let mut reported = ReportedSpeed::default();
        reported.take(at(1.0), 20);
        assert!(!reported.pass(NodeId(3), window(1.9, 2.0), None));
        assert_eq!(reported.last_passed(), Some((NodeId(3), window(1.9, 2.0))));
        // 20 was before the sensor, 90 may be of before; only 63 is of this hop.
        for (time, number) in [(3.4, 90), (3.5, 63), (9.0, 63)] {
            reported.take(at(time), number);
        }
        assert_eq!(reported.hop.range, Some((63, 63)));
        let speed = Gaussian { mean: libm::log(0.2), variance: 1e-6 };
        assert!(!reported.pass(NodeId(4), window(9.9, 10.0), Some(speed)));
        assert_eq!((reported.hops, reported.contradictions, reported.hop.range), (1, 0, None));
        // It reports 0 for a second and a half, and then a sensor reports it: three of four contradictions.
        for (count, node) in (1..=3).zip(5..) {
            reported.take_zero(at(20.0), 0.0);
            assert!(!reported.pass(NodeId(node), window(21.5, 21.6), None));
            assert_eq!(reported.contradictions, count);
        }
        reported.take(at(22.0), 63);
        reported.take_zero(at(22.5), 0.0);
        assert!(!reported.pass(NodeId(8), window(23.9, 24.0), None));
        assert_eq!(reported.contradictions, 3, "1.4 s are too short to tell");
        reported.take_zero(at(24.0), 0.0);
        assert!(reported.pass(NodeId(9), window(25.9, 26.0), None), "once too often");
        assert!(!reported.pass(NodeId(9), window(27.9, 28.0), None), "said once");
    }

    #[test]
    fn a_train_that_reports_zero_for_a_second_has_stalled_if_it_should_report_three() {
        let mut reported = ReportedSpeed::default();
        learn(&mut reported, 0.2, &[63, 64], 5);
        let at = |seconds| Timestamp::from_s(100.0 + seconds);
        // The scale is about 315 a m/s: 3 at 9.5 mm/s.
        assert!(!reported.take_zero(at(0.0), 0.1) && !reported.take_zero(at(0.9), 0.1));
        assert!(reported.take_zero(at(1.1), 0.1));
        assert!(!reported.take_zero(at(1.2), 0.008), "2.5 are no stall");
        reported.take(at(1.3), 60);
        assert!(!reported.take_zero(at(1.4), 0.1), "it ran in between");
    }
}
