//! Random draws that are the same on every machine and in every release.
//!
//! The stream is ChaCha8, whose output is fixed by its definition. The distributions are written here with `libm`: a
//! library's sampler may change its values in a new version, and a platform's logarithm its last bit, but a seed in a
//! test or a bug report must mean one world for ever.

use core::f64::consts::TAU;
use core::ops::Range;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// The purpose of a stream. Streams of one seed are independent: a further draw in one part of the world changes no
/// other part.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Purpose {
    /// The parameters of a train.
    Train = 1,
    /// True lengths, sensor offsets, curves and dirt.
    Track = 2,
    /// Variation from run to run: deviation, wander, stiction, spread of stops.
    Motion = 3,
    /// The station's line: phase, jitter, delays.
    Line = 4,
    /// Missed, spurious and stuck sensors.
    Faults = 5,
    /// The choices of a scenario, and manual measurements.
    Scenario = 6,
    /// A living layout: its trains, turnouts and operators.
    Living = 7,
    /// Physics outside the usual ranges: see `PhysicsRange`.
    Physics = 8,
    /// What decoders report of their trains.
    Decoders = 9,
}

/// One stream of draws.
#[derive(Debug, Clone)]
pub(crate) struct Draws(ChaCha8Rng);

impl Draws {
    /// The stream of a seed for one purpose.
    pub(crate) fn new(seed: u64, purpose: Purpose) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(purpose as u64);
        Self(generator)
    }

    /// A whole number of 64 random bits, to seed another stream.
    pub(crate) fn seed(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// A further stream for the same purpose.
    pub(crate) fn split(&mut self) -> Self {
        Self(ChaCha8Rng::seed_from_u64(self.seed()))
    }

    /// Uniform on `[0, 1)`, with the 53 bits a double can hold.
    fn unit(&mut self) -> f64 {
        const SPACING: f64 = 1.0 / (1_u64 << 53) as f64;
        (self.0.next_u64() >> 11) as f64 * SPACING
    }

    /// Uniform on the range.
    pub(crate) fn uniform(&mut self, range: Range<f64>) -> f64 {
        range.start + (range.end - range.start) * self.unit()
    }

    /// Normal with the mean and standard deviation given (Box and Muller, 1958).
    pub(crate) fn normal(&mut self, mean: f64, sd: f64) -> f64 {
        // 1 - u lies in (0, 1], where the logarithm is finite.
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.unit()));
        mean + sd * radius * libm::cos(TAU * self.unit())
    }

    /// Normal, truncated to `sds` standard deviations, for parameters of plausible trains and tracks.
    pub(crate) fn normal_within(&mut self, mean: f64, sd: f64, sds: f64) -> f64 {
        loop {
            let deviation = self.normal(0.0, 1.0);
            if deviation.abs() <= sds {
                return mean + sd * deviation;
            }
        }
    }

    /// The waiting time to the next event of a Poisson process with `rate` events per unit; infinite for a rate of 0.
    pub(crate) fn waiting(&mut self, rate: f64) -> f64 {
        if rate > 0.0 { -libm::log(1.0 - self.unit()) / rate } else { f64::INFINITY }
    }

    /// `true` with the probability given.
    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// A whole number below `count`; 0 if there is none.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn purposes_do_not_share_draws() {
        let first = Draws::new(7, Purpose::Train).seed();
        assert_eq!(first, Draws::new(7, Purpose::Train).seed());
        assert_ne!(first, Draws::new(7, Purpose::Track).seed());
        assert_ne!(first, Draws::new(8, Purpose::Train).seed());
    }

    #[test]
    fn normal_draws_have_the_moments_asked_for() {
        let mut draws = Draws::new(1, Purpose::Motion);
        let n = 100_000;
        let (mut sum, mut squares, mut beyond) = (0.0, 0.0, 0);
        for _ in 0..n {
            let x = draws.normal(3.0, 2.0);
            sum += x;
            squares += (x - 3.0) * (x - 3.0);
            beyond += usize::from((x - 3.0).abs() > 2.0 * 1.959_964);
        }
        // Four standard errors of a mean, a variance and a proportion of n draws.
        assert!((sum / f64::from(n) - 3.0).abs() < 4.0 * 2.0 / 316.0);
        assert!((squares / f64::from(n) / 4.0 - 1.0).abs() < 4.0 * 1.414 / 316.0);
        assert!((beyond as f64 / f64::from(n) - 0.05).abs() < 4.0 * 0.218 / 316.0);
    }

    #[test]
    fn waiting_times_have_the_mean_of_their_rate() {
        let mut draws = Draws::new(2, Purpose::Faults);
        let mean = (0..50_000).map(|_| draws.waiting(0.5)).sum::<f64>() / 50_000.0;
        assert!((mean - 2.0).abs() < 4.0 * 2.0 / 223.6);
        assert!(draws.waiting(0.0).is_infinite());
    }
}
