//! What others make of the same counts, to hold our estimates against.

use footplate_core::odometry::wheels::Vehicle;
use footplate_core::{Length, Speed, TimeSpan};

use super::counted_distances::CountedDistances;
use super::score::Claim;

/// Time constant with which plain software smooths a wheel speed (s): five periods of 50 ms, a usual choice.
const SMOOTHED_OVER: TimeSpan = TimeSpan::from_ms(250);

/// A method of odometry that knows nothing of slip and slide.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Rival {
    /// The mean of both counts of the period.
    RawMean,
    /// The larger count of the period.
    RawMax,
    /// The mean of the counts that are there, smoothed.
    WheelsOnly,
}

impl Rival {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 3] = [Self::RawMean, Self::RawMax, Self::WheelsOnly];

    /// What it is called in files.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::RawMean => "raw_mean",
            Self::RawMax => "raw_max",
            Self::WheelsOnly => "wheels_only",
        }
    }

    /// What people call it.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::RawMean => "raw mean",
            Self::RawMax => "raw max",
            Self::WheelsOnly => "wheels only",
        }
    }

    /// How far the train went in a period by these counts, if there is any.
    fn distance(self, distances: [Option<Length>; 2]) -> Option<Length> {
        match distances {
            [Some(one), Some(other)] if self == Self::RawMax => {
                Some(if other.abs() > one.abs() { other } else { one })
            }
            [Some(one), Some(other)] => Some((one + other) * 0.5),
            [one, other] => one.or(other),
        }
    }
}

/// A rival at work.
#[derive(Debug, Clone)]
pub(super) struct RivalOdometer {
    rival: Rival,
    period: TimeSpan,
    speed: Speed,
    distance: Length,
}

impl RivalOdometer {
    pub(super) fn new(rival: Rival, vehicle: &Vehicle) -> Self {
        Self { rival, period: vehicle.period, speed: Speed::ZERO, distance: Length::ZERO }
    }

    /// Takes in a period. Without a count the speed is held; the distance of the first period is before the beginning.
    pub(super) fn step(&mut self, counted: &CountedDistances) -> Claim {
        let span = counted.span.unwrap_or(self.period);
        let distance = self.rival.distance(counted.distances);
        if let Some(distance) = distance {
            let speed = Speed::from_m_per_s(distance.as_m() / span.as_s());
            self.speed = match self.rival {
                Rival::WheelsOnly => {
                    let share = span.as_s() / (span + SMOOTHED_OVER).as_s();
                    self.speed + (speed - self.speed) * share
                }
                _ => speed,
            };
        }
        if counted.span.is_some() {
            self.distance += distance.unwrap_or(self.speed * span);
        }
        Claim::plain(self.speed, self.distance)
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::Timestamp;
    use footplate_core::odometry::wheels::Period;

    use super::super::counted_distances::DistanceCounter;
    use super::*;
    use crate::vehicle_file::default_vehicle;

    fn run(rival: Rival, periods: &[[i64; 2]]) -> Claim {
        let vehicle = default_vehicle().unwrap().vehicle;
        let mut counter = DistanceCounter::new(&vehicle);
        let mut odometer = RivalOdometer::new(rival, &vehicle);
        let mut last = None;
        for (at, pulses) in periods.iter().enumerate() {
            let time = Timestamp::ZERO + TimeSpan::from_ms(50 * at as i64);
            last = Some(odometer.step(&counter.count(&Period::with_pulses(time, *pulses))));
        }
        last.unwrap()
    }

    #[test]
    fn the_mean_and_the_maximum_are_what_they_say() {
        // 80 teeth on 0.86 m: 33.772 mm a pulse; the second period counts 20 and 30.
        let mean = run(Rival::RawMean, &[[5, 5], [20, 30]]);
        assert!((mean.distance.as_mm() - 25.0 * 33.772).abs() < 0.01);
        assert!((mean.speed.as_m_per_s() - 25.0 * 0.033_772 / 0.05).abs() < 0.001);
        let max = run(Rival::RawMax, &[[5, 5], [20, 30]]);
        assert!((max.distance.as_mm() - 30.0 * 33.772).abs() < 0.01);
    }

    #[test]
    fn the_smoothed_speed_comes_to_that_of_the_wheels() {
        let steady = run(Rival::WheelsOnly, &[[20, 20]; 100]);
        assert!((steady.speed.as_m_per_s() - 20.0 * 0.033_772 / 0.05).abs() < 0.001);
        let first = run(Rival::WheelsOnly, &[[0, 0], [60, 60]]);
        // A sixth of the step after one period: 0.05 / (0.05 + 0.25).
        assert!((first.speed.as_m_per_s() - 60.0 * 0.033_772 / 0.05 / 6.0).abs() < 0.001);
    }
}
