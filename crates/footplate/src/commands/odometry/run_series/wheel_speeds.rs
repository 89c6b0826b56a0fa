//! How fast each wheel turned by what it counted, calm enough for a chart.

use footplate_core::odometry::wheels::{Count, Period, Vehicle};
use footplate_core::{Length, TimeSpan};
use footplate_store::odometry::DistanceCounter;

/// Periods that a speed is the mean of (chosen: a pulse more or less is then a fifth of what it is in one).
const PERIODS: usize = 5;

/// How fast both wheels turned, period by period.
#[derive(Debug, Clone)]
pub(in crate::commands::odometry) struct WheelSpeeds {
    counter: DistanceCounter,
    wheels: [RecentDistances; 2],
}

/// How far a wheel has rolled in the last periods.
#[derive(Debug, Clone, Default)]
struct RecentDistances {
    distances: [Option<(Length, TimeSpan)>; PERIODS],
    next: usize,
    /// For how long it has not been read.
    unread: TimeSpan,
}

impl WheelSpeeds {
    pub(in crate::commands::odometry) fn new(vehicle: &Vehicle) -> Self {
        Self { counter: DistanceCounter::new(vehicle), wheels: Default::default() }
    }

    /// The mean speed of each wheel over this period and those before it (m/s); NaN where it was not counted.
    pub(in crate::commands::odometry) fn see(&mut self, period: &Period) -> [f64; 2] {
        let counted = self.counter.count(period);
        let Some(span) = counted.span else { return [f64::NAN; 2] };
        let mut speeds = [f64::NAN; 2];
        let wheels = self.wheels.iter_mut().zip(counted.distances).zip(period.wheels);
        for (speed, ((recent, distance), reading)) in speeds.iter_mut().zip(wheels) {
            *speed = recent.see(distance, span, matches!(reading.count, Count::Counter(_)));
        }
        speeds
    }
}

impl RecentDistances {
    fn see(&mut self, distance: Option<Length>, span: TimeSpan, is_running: bool) -> f64 {
        // A running counter also tells of the periods in which it was not read; pulses of those are lost.
        let unread = std::mem::take(&mut self.unread);
        let rolled = match distance {
            Some(distance) if is_running => Some((distance, span + unread)),
            Some(distance) => Some((distance, span)),
            None => {
                self.unread = unread + span;
                None
            }
        };
        if let Some(slot) = self.distances.get_mut(self.next) {
            *slot = rolled;
        }
        self.next = (self.next + 1) % PERIODS;
        if rolled.is_none() {
            return f64::NAN;
        }
        let known = || self.distances.iter().flatten();
        let distance: f64 = known().map(|(distance, _)| distance.as_m()).sum();
        let time: f64 = known().map(|(_, span)| span.as_s()).sum();
        distance / time
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::Timestamp;
    use footplate_core::odometry::wheels::WheelReading;
    use footplate_store::default_vehicle;

    use super::*;

    /// Metres a pulse: 0.86 m across, 80 teeth.
    const PITCH: f64 = std::f64::consts::PI * 0.86 / 80.0;

    fn counts(counts: impl IntoIterator<Item = Count>) -> Vec<f64> {
        let mut speeds = WheelSpeeds::new(&default_vehicle().unwrap().vehicle);
        let see = |(row, count)| {
            let mut period = Period::empty(Timestamp::from_ns(50_000_000 * row));
            period.wheels[0] = WheelReading { count, ..WheelReading::MISSING };
            speeds.see(&period)[0]
        };
        (0_i64..).zip(counts).map(see).collect()
    }

    #[test]
    fn a_speed_is_the_mean_of_five_periods() {
        let speeds = counts([0, 10, 20, 10, 20, 10, 20].map(Count::Pulses));
        assert!(speeds[0].is_nan(), "the first row has no period");
        // 10 pulses in 50 ms, then 70 in 250 ms, then 80.
        for (row, pulses_a_second) in [(1, 200.0), (5, 280.0), (6, 320.0)] {
            assert!((speeds[row] - pulses_a_second * PITCH).abs() < 1e-9, "row {row}: {}", speeds[row]);
        }
    }

    #[test]
    fn a_counter_that_was_not_read_for_a_while_ran_no_faster() {
        let missed = [Count::Counter(0), Count::Counter(10), Count::Missing, Count::Counter(30)];
        let speeds = counts(missed);
        assert!(speeds[2].is_nan());
        assert!((speeds[3] - 200.0 * PITCH).abs() < 1e-9, "{}", speeds[3]);
    }
}
