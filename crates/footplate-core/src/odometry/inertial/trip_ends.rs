//! What is left of a drifting accelerometer when it is known that the train stood at both ends of a trip.
//!
//! Letters: `t` time since departure, `T` at arrival, `d` and `e` what was read while standing before and after, `r` the speed
//! that is left at arrival when a line from `d` to `e` is taken out, `q` the intensity of the bias's random walk.
//!
//! A bias that walks at random and is known at both ends is a Brownian bridge. Given its integral `r`, its mean at `t` is
//! `6 r t (T − t) / T³`: the whole rest is given back to where the bias was least known. The variance of `r` is `q T³ / 12`, so the
//! rests of many trips tell `q`; what it leaves open of the length of a trip is `q T⁵ / 720` (the even half of the bridge's
//! Fourier series, summed).

use libm::sqrt;

use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// The intensity of the walk before any trip, which counts as one trip (m²/s⁵). Measured with a phone in a metro, of which it is
/// the mean.
const BEFORE_ANY_TRIP: f64 = 5e-4;

/// Takes the drift out of a trip between two stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TripEnds {
    lasted: f64,
    departure: f64,
    arrival: f64,
    rest: f64,
}

impl TripEnds {
    /// A trip of so much time, above zero, with what was read while standing before and after it, and what the readings add up
    /// to in between.
    #[must_use]
    pub fn new(lasted: TimeSpan, [departure, arrival]: [Acceleration; 2], added_up: Speed) -> Self {
        let (lasted, departure, arrival) = (lasted.as_s(), departure.as_m_per_s2(), arrival.as_m_per_s2());
        let rest = added_up.as_m_per_s() - 0.5 * (departure + arrival) * lasted;
        Self { lasted, departure, arrival, rest }
    }

    /// How long the trip lasted.
    #[must_use]
    pub fn lasted(&self) -> TimeSpan {
        TimeSpan::from_s(self.lasted)
    }

    /// The speed that was left at arrival although the train stood.
    #[must_use]
    pub fn rest(&self) -> Speed {
        Speed::from_m_per_s(self.rest)
    }

    /// The acceleration at a time since departure, from what was read.
    #[must_use]
    pub fn acceleration(&self, since: TimeSpan, read: Acceleration) -> Acceleration {
        let (t, end) = (since.as_s(), self.lasted);
        let line = self.departure + (self.arrival - self.departure) * t / end;
        let bridge = 6.0 * self.rest * t * (end - t) / (end * end * end);
        Acceleration::from_m_per_s2(read.as_m_per_s2() - line - bridge)
    }

    /// The speed at a time since departure, from what the readings add up to.
    #[must_use]
    pub fn speed(&self, since: TimeSpan, added_up: Speed) -> Speed {
        let (t, end) = (since.as_s(), self.lasted);
        let line = self.departure * t + (self.arrival - self.departure) * t * t / (2.0 * end);
        let bridge = self.rest * t * t * (3.0 * end - 2.0 * t) / (end * end * end);
        Speed::from_m_per_s(added_up.as_m_per_s() - line - bridge)
    }

    /// The distance at a time since departure, from what those speeds add up to.
    #[must_use]
    pub fn distance(&self, since: TimeSpan, added_up: Length) -> Length {
        let (t, end) = (since.as_s(), self.lasted);
        let line = 0.5 * self.departure * t * t + (self.arrival - self.departure) * t * t * t / (6.0 * end);
        let bridge = self.rest * t * t * t * (end - 0.5 * t) / (end * end * end);
        Length::from_m(added_up.as_m() - line - bridge)
    }
}

/// How fast a bias walks, learnt from the rests of trips.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BiasWalk {
    sum: f64,
    trips: u32,
}

impl Default for BiasWalk {
    fn default() -> Self {
        Self { sum: BEFORE_ANY_TRIP, trips: 1 }
    }
}

impl BiasWalk {
    /// Learns from a trip.
    pub fn take(&mut self, ends: &TripEnds) {
        self.sum += 12.0 * ends.rest * ends.rest / (ends.lasted * ends.lasted * ends.lasted);
        self.trips = self.trips.saturating_add(1);
    }

    /// One standard deviation of the length of a trip that lasted so long.
    #[must_use]
    pub fn length_deviation(&self, lasted: TimeSpan) -> Length {
        let t = lasted.as_s();
        let q = self.sum / f64::from(self.trips);
        Length::from_m(sqrt(q * t * t * t * t * t / 720.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Adds up what a train and a bias do together, a thousandth of a second a step.
    fn added_up(lasted: f64, read: impl Fn(f64) -> f64) -> std::vec::Vec<(TimeSpan, Speed, Length)> {
        let (mut speed, mut distance, step) = (0.0, 0.0, 1e-3);
        (0..=(lasted / step) as u32)
            .map(|n| {
                let t = f64::from(n) * step;
                let point = (TimeSpan::from_s(t), Speed::from_m_per_s(speed), Length::from_m(distance));
                distance += step * (speed + 0.5 * step * read(t));
                speed += step * read(t + 0.5 * step);
                point
            })
            .collect()
    }

    /// Up for 15 s, steady for 20 s, down for 10 s: 15 × 1 = 10 × 1.5 m/s, 112.5 + 300 + 75 m.
    fn train(t: f64) -> f64 {
        if t < 15.0 {
            1.0
        } else if t < 35.0 {
            0.0
        } else {
            -1.5
        }
    }

    #[test]
    fn a_bias_that_changes_in_a_straight_line_leaves_nothing() {
        let points = added_up(45.0, |t| train(t) + 0.05 - 0.004 * t);
        let &(lasted, end, length) = points.last().unwrap();
        let standing = [0.05, 0.05 - 0.004 * 45.0].map(Acceleration::from_m_per_s2);
        let ends = TripEnds::new(lasted, standing, end);
        assert!(ends.rest().as_m_per_s().abs() < 1e-6);
        assert!((ends.distance(lasted, length).as_m() - 487.5).abs() < 0.05);
        let &(since, speed, _) = points.iter().find(|(since, ..)| since.as_s() >= 25.0).unwrap();
        assert!((ends.speed(since, speed).as_m_per_s() - 15.0).abs() < 0.01);
    }

    #[test]
    fn a_bias_that_bulges_leaves_a_rest_that_is_given_back() {
        // The bulge of a bridge, from which they are exact.
        let bulge = |t: f64| 0.1 * t * (45.0 - t) / (22.5 * 22.5);
        let points = added_up(45.0, |t| train(t) + bulge(t));
        let &(lasted, end, length) = points.last().unwrap();
        let ends = TripEnds::new(lasted, [Acceleration::ZERO; 2], end);
        // 2/3 of the height over the whole time.
        assert!((ends.rest().as_m_per_s() - 3.0).abs() < 1e-3);
        assert!((ends.distance(lasted, length).as_m() - 487.5).abs() < 0.05);
        assert!(ends.speed(lasted, end).as_m_per_s().abs() < 1e-12);
        let &(since, speed, distance) = points.iter().find(|(since, ..)| since.as_s() >= 25.0).unwrap();
        assert!((ends.speed(since, speed).as_m_per_s() - 15.0).abs() < 0.01);
        assert!((ends.distance(since, distance).as_m() - 262.5).abs() < 0.05);
        let acceleration =
            ends.acceleration(since, Acceleration::from_m_per_s2(train(25.0) + bulge(since.as_s())));
        assert!(acceleration.as_m_per_s2().abs() < 1e-4);
    }

    #[test]
    fn the_deviation_of_lengths_is_true_for_a_bias_that_walks() {
        // Standing ends pin the walk: subtract the line between them, as they do.
        let mut state = 5_u64;
        let mut draw = || {
            // Sums of twelve even draws less six (splitmix64 below) are normal enough.
            let mut sum = -6.0;
            for _ in 0..12 {
                state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
                let mut z = state;
                z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
                z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
                sum += ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64;
            }
            sum
        };
        let mut walk = BiasWalk::default();
        let mut squared = 0.0;
        let trips = 400;
        for _ in 0..trips {
            let step = 0.1;
            let (mut bias, mut speed, mut distance) = (0.0, 0.0, 0.0);
            for _ in 0..500 {
                distance += step * speed;
                speed += step * bias;
                bias += 0.01 * f64::sqrt(step) * draw();
            }
            let lasted = TimeSpan::from_s(50.0);
            let ends = TripEnds::new(
                lasted,
                [0.0, bias].map(Acceleration::from_m_per_s2),
                Speed::from_m_per_s(speed),
            );
            walk.take(&ends);
            squared += ends.distance(lasted, Length::from_m(distance)).as_m().powi(2) / f64::from(trips);
        }
        let said = walk.length_deviation(TimeSpan::from_s(50.0)).as_m();
        // 0.01² × 50⁵ / 720 = 6.6 m squared.
        assert!((said - 6.59).abs() < 0.7, "said {said}");
        assert!((squared.sqrt() / said - 1.0).abs() < 0.12, "was {}", squared.sqrt());
    }
}
