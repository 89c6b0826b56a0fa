//! Finds the longest period of which all gaps are whole multiples, but for an offset common to all.
//!
//! Letters: `g` gap, `f` trial frequency, `c(f) = |mean e^(2πi g f)|` how well gaps line up (Rayleigh's
//! statistic, 1 for perfectly). Trial frequencies are evenly spaced, so the phasor of each gap turns by the same
//! angle from one trial to the next: a multiplication instead of a sine and a cosine.
#![expect(clippy::indexing_slicing, reason = "indices stay below the named capacities")]

use core::f64::consts::TAU;

/// Most gaps that are searched.
pub(super) const MOST_GAPS: usize = 96;
/// Longer gaps would need a finer search for nothing.
pub(super) const LONGEST_GAP_S: f64 = 2.0;
/// Trial periods reach from one module polled alone (13.8 ms on the wire) to a slow host with 31 modules.
pub(super) const SHORTEST_PERIOD_S: f64 = 0.012;
const LONGEST_PERIOD_S: f64 = 0.3;
/// Trial frequencies advance by this part of a cycle at the longest gap.
const PHASE_STEP: f64 = 0.15;
/// Gaps line up when `c` reaches this; random ones of eight reach 0.95 once in 1400 trials.
pub(super) const LINED_UP: f64 = 0.95;
/// A longer period is preferred when it lines up this nearly as well as the best.
const NEARLY: f64 = 0.985;
/// The best trial is at most half a step from its top, where at least this part of it is seen.
const SEEN_BESIDE_TOP: f64 = 0.9;
/// A trial this high is on the flank of a hill that may be as high as the best, ...
const ON_A_FLANK: f64 = 0.8;

/// Trials from the longest period to the shortest.
const TRIALS: usize =
    (LONGEST_GAP_S / PHASE_STEP * (1.0 / SHORTEST_PERIOD_S - 1.0 / LONGEST_PERIOD_S)) as usize + 2;
/// Phasors that are turned together: two registers of the narrowest vector units.
const LANES: usize = 8;
const BLOCKS: usize = MOST_GAPS / LANES;

type Lanes = [f32; LANES];

/// The longest period at which the gaps line up, in seconds; at most [`MOST_GAPS`] of them, each below
/// [`LONGEST_GAP_S`].
pub(super) fn longest_aligned_period(gaps: &[f64]) -> Option<f64> {
    let gaps = gaps.get(..MOST_GAPS).unwrap_or(gaps);
    let longest_gap = gaps.iter().fold(SHORTEST_PERIOD_S, |longest, gap| longest.max(*gap));
    let (first, step) = (1.0 / LONGEST_PERIOD_S, PHASE_STEP / longest_gap);
    let trials = (((1.0 / SHORTEST_PERIOD_S - first) / step) as usize).min(TRIALS - 1) + 1;
    let mut heights = [0.0_f32; TRIALS];
    let mut phasors = Phasors::new(gaps, first, step);
    let mut best = 0.0_f32;
    for height in &mut heights[..trials] {
        *height = phasors.sum() / gaps.len() as f32;
        best = best.max(*height);
        phasors.turn();
    }
    let best = f64::from(best);
    if best < LINED_UP * SEEN_BESIDE_TOP {
        return None;
    }
    // The regression climbs to the top of each hill; the first (longest) that is nearly as high as the highest.
    heights[..trials].iter().enumerate().find_map(|(place, height)| {
        if f64::from(*height) < best * ON_A_FLANK {
            return None;
        }
        let top = PollRegression::of(gaps, 1.0 / (first + step * place as f64)).period;
        let height = alignment(gaps, top).0;
        (height >= LINED_UP && height >= best * NEARLY).then_some(top)
    })
}

/// The phasors of all gaps at one trial frequency, and what they turn by to the next.
struct Phasors {
    re: [Lanes; BLOCKS],
    im: [Lanes; BLOCKS],
    turn_re: [Lanes; BLOCKS],
    turn_im: [Lanes; BLOCKS],
    blocks: usize,
}

impl Phasors {
    fn new(gaps: &[f64], frequency: f64, step: f64) -> Self {
        let none = [[0.0; LANES]; BLOCKS];
        let mut phasors =
            Self { re: none, im: none, turn_re: none, turn_im: none, blocks: gaps.len().div_ceil(LANES) };
        // What is left of the last block stays 0 and adds nothing.
        for (place, gap) in gaps.iter().enumerate() {
            let (block, lane) = (place / LANES, place % LANES);
            let (sin, cos) = libm::sincos(TAU * gap * frequency);
            (phasors.re[block][lane], phasors.im[block][lane]) = (cos as f32, sin as f32);
            let (sin, cos) = libm::sincos(TAU * gap * step);
            (phasors.turn_re[block][lane], phasors.turn_im[block][lane]) = (cos as f32, sin as f32);
        }
        phasors
    }

    /// Length of the sum of all phasors.
    fn sum(&self) -> f32 {
        let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
        for block in 0..self.blocks {
            for lane in 0..LANES {
                x[lane] += self.re[block][lane];
                y[lane] += self.im[block][lane];
            }
        }
        let (x, y): (f32, f32) = (x.iter().sum(), y.iter().sum());
        libm::sqrtf(x * x + y * y)
    }

    /// On to the next trial.
    fn turn(&mut self) {
        for block in 0..self.blocks {
            for lane in 0..LANES {
                let (re, im) = (self.re[block][lane], self.im[block][lane]);
                let (turn_re, turn_im) = (self.turn_re[block][lane], self.turn_im[block][lane]);
                self.re[block][lane] = re * turn_re - im * turn_im;
                self.im[block][lane] = re * turn_im + im * turn_re;
            }
        }
    }
}

/// The straight line of gaps over their number of periods, in seconds: `gap = offset + n · period`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PollRegression {
    /// From poll to poll.
    pub(super) period: f64,
    /// The additional length of the first period after a report.
    pub(super) offset: f64,
    /// Standard deviation of a gap about the line.
    pub(super) jitter: f64,
    /// Standard error of the period.
    pub(super) uncertainty: f64,
}

impl PollRegression {
    /// Fits the line to at least three gaps, with a rough period that counts their periods correctly.
    pub(super) fn of(gaps: &[f64], rough: f64) -> Self {
        let count = gaps.len() as f64;
        let offset = alignment(gaps, rough).1 * rough;
        let periods = |gap: f64| libm::round((gap - offset) / rough);
        let mean_n = gaps.iter().map(|g| periods(*g)).sum::<f64>() / count;
        let mean_g = gaps.iter().sum::<f64>() / count;
        let (mut nn, mut ng) = (0.0, 0.0);
        for gap in gaps {
            let n = periods(*gap) - mean_n;
            nn += n * n;
            ng += n * (gap - mean_g);
        }
        if nn <= 0.0 {
            return Self { period: rough, offset, jitter: 0.0, uncertainty: rough };
        }
        let period = ng / nn;
        let offset = mean_g - period * mean_n;
        let squares: f64 = gaps.iter().map(|g| g - offset - period * periods(*g)).map(|e| e * e).sum();
        let jitter = libm::sqrt(squares / (count - 2.0));
        Self { period, offset, jitter, uncertainty: jitter / libm::sqrt(nn) }
    }
}

/// How well gaps line up at a period (1 for perfectly), and the mean phase in cycles.
pub(super) fn alignment(gaps: &[f64], period: f64) -> (f64, f64) {
    let (mut x, mut y) = (0.0, 0.0);
    for gap in gaps {
        let (sin, cos) = libm::sincos(TAU * (gap / period));
        x += cos;
        y += sin;
    }
    (libm::hypot(x, y) / gaps.len() as f64, libm::atan2(y, x) / TAU)
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    /// Gaps of so many periods, far from regular, each a little off.
    fn gaps(count: i64, period: f64, offset: f64) -> Vec<f64> {
        let periods = |i: i64| (3 + (i * i * 7 + i) % 23) as f64;
        let off = |i: i64| 0.000_1 * ((i * 37 % 11) as f64 - 5.0) / 5.0;
        (1..=count).map(|i| offset + period * periods(i) + off(i)).collect()
    }

    #[test]
    fn rotated_phasors_equal_computed_ones_at_every_trial() {
        // The height after many turns is that of sines and cosines taken there at once.
        let gaps = gaps(45, 0.0614, 0.004);
        let (first, step) = (1.0 / LONGEST_PERIOD_S, 0.05);
        let mut phasors = Phasors::new(&gaps, first, step);
        for turns in 0..TRIALS {
            if turns % 100 == 0 {
                let right = alignment(&gaps, 1.0 / (first + step * turns as f64)).0;
                let found = f64::from(phasors.sum()) / gaps.len() as f64;
                assert!((found - right).abs() < 1e-3, "after {turns} turns: {found} instead of {right}");
            }
            phasors.turn();
        }
    }

    #[test]
    fn the_longest_period_is_found_over_the_whole_range() {
        for tenths_of_ms in (130..=900).step_by(7) {
            let period = f64::from(tenths_of_ms) * 1e-4;
            for count in [8, 16, 61, 96] {
                let gaps: Vec<f64> =
                    gaps(count, period, 0.0).into_iter().filter(|gap| *gap < LONGEST_GAP_S).collect();
                let found = longest_aligned_period(&gaps).unwrap();
                assert!((found - period).abs() < 1e-4, "{found} instead of {period} in {count}");
            }
        }
    }

    #[test]
    fn strange_gaps_have_no_period_or_one_that_is_a_number() {
        for gap in [0.0, -1.0, 1e-300, 5.0, f64::INFINITY, f64::NAN] {
            let found = longest_aligned_period(&[gap; 200]);
            assert!(found.is_none_or(f64::is_finite), "{gap}: {found:?}");
        }
        assert_eq!(longest_aligned_period(&[]), None);
    }
}
