//! One odometer on one train for days: runs of a scenario, each drawn anew and from where the one before ended.

use anyhow::{bail, ensure};
use footplate_core::odometry::MotionEstimate;
use footplate_core::odometry::wheels::{Period, WheelReading};
use footplate_core::{Length, Speed, TimeSpan, Timestamp};
use footplate_sim::line::{LineConditions, LineScenario, LineTruth, LineVehicle};
use footplate_store::Truth;
use footplate_store::odometry::{OdometryRun, Preset, RunContext, simulated_rows, simulated_vehicle};

/// What the periods of an hour came to.
#[derive(Debug, Clone)]
pub(super) struct OdometerHour {
    /// Time since the beginning, at its end.
    pub(super) until: TimeSpan,
    /// What the train ran in it, forward and backward.
    pub(super) ran: Length,
    /// Whether the true distance never left its confidence interval.
    pub(super) is_inside: bool,
    /// The error of the distance that was counted in it.
    distance_error: Length,
    periods: u32,
    /// Sums over the periods: squares of the error of speed (m²/s²), and widths of its confidence interval (m/s).
    squares: f64,
    widths: f64,
}

impl OdometerHour {
    const fn after(until: TimeSpan) -> Self {
        Self {
            until,
            ran: Length::ZERO,
            is_inside: true,
            distance_error: Length::ZERO,
            periods: 0,
            squares: 0.0,
            widths: 0.0,
        }
    }

    /// The root mean square of the error of speed, in m/s.
    pub(super) fn speed_rms(&self) -> Option<f64> {
        (self.periods > 0).then(|| libm::sqrt(self.squares / f64::from(self.periods)))
    }

    /// The mean width of the confidence interval of speed, in m/s.
    pub(super) fn mean_width(&self) -> Option<f64> {
        (self.periods > 0).then(|| self.widths / f64::from(self.periods))
    }

    /// The error of the distance counted in this hour, as a share of what was run (%).
    pub(super) fn distance_pct(&self) -> Option<f64> {
        (self.ran > Length::ZERO).then(|| 100.0 * (self.distance_error / self.ran).abs())
    }
}

/// An odometer that goes on for hours.
pub(super) struct OdometerHours {
    scenario: LineScenario,
    seed: u64,
    /// The journey that is drawn next.
    journey: u64,
    vehicle: LineVehicle,
    odometer: OdometryRun,
}

/// So many journeys in a row that do not end at rest are no chance.
const TRIES: usize = 100;

impl OdometerHours {
    /// Draws the train from a seed.
    ///
    /// # Errors
    /// The vehicle is one that no railway has.
    pub(super) fn new(scenario: LineScenario, seed: u64) -> anyhow::Result<Self> {
        let vehicle = scenario.run(seed, LineConditions::default()).vehicle;
        let of_file = simulated_vehicle(&vehicle)?.vehicle;
        let odometer = OdometryRun::new(&RunContext::new(of_file, Preset::Recommended, false))?;
        Ok(Self { scenario, seed, journey: seed, vehicle, odometer })
    }

    /// The run from one stop to the next; one that begins or ends at speed is left out.
    fn next_run(&mut self) -> anyhow::Result<Vec<(Period, Truth)>> {
        let name = self.scenario.name();
        let at_rest = |truth: Option<&LineTruth>| truth.is_some_and(|truth| truth.speed == Speed::ZERO);
        for _ in 0..TRIES {
            let run = self.scenario.run_journey(self.seed, self.journey, LineConditions::default());
            self.journey = self.journey.wrapping_add(1);
            ensure!(
                run.vehicle == self.vehicle,
                "each run of {name} is that of another train: choose a scenario with one train, such as N2"
            );
            if at_rest(run.truth.first()) && at_rest(run.truth.last()) {
                return Ok(simulated_rows(&run).collect());
            }
        }
        bail!(
            "a run of {name} begins or ends at speed, so that another one cannot follow it: choose one between two stops, such as N2"
        )
    }

    /// Goes on for so long, and reports each `part` of it.
    ///
    /// # Errors
    /// A run cannot follow the one before, and those of `report`.
    pub(super) fn run(
        mut self,
        time: TimeSpan,
        part: TimeSpan,
        mut report: impl FnMut(&OdometerHour) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let mut hour = OdometerHour::after(TimeSpan::ZERO);
        let (mut waited, mut ahead) = (TimeSpan::ZERO, Length::ZERO);
        let (mut error, mut place) = (Length::ZERO, Length::ZERO);
        let mut is_first = true;
        while waited < time {
            let rows = self.next_run()?;
            let Some((last, last_truth)) = rows.last() else { break };
            let lasts = last.time - Timestamp::ZERO;
            let leads = last_truth.distance.unwrap_or_default();
            // The first row of a run is the last one of the run before: counters are read once at each moment.
            for (period, truth) in rows.iter().skip(usize::from(!is_first)) {
                let period = later(period, waited, ahead);
                let estimate = self.odometer.step(&period, Truth::default);
                let distance = truth.distance.map_or(place, |distance| distance + ahead);
                hour.see(&estimate, truth, distance);
                hour.ran += (distance - place).abs();
                place = distance;
                let now = period.time - Timestamp::ZERO;
                if now >= hour.until + part {
                    let error_now = estimate.distance - distance;
                    (hour.until, hour.distance_error) = (now, error_now - error);
                    error = error_now;
                    report(&hour)?;
                    hour = OdometerHour::after(now);
                }
            }
            (waited, ahead, is_first) = (waited + lasts, ahead + leads, false);
        }
        Ok(())
    }
}

impl OdometerHour {
    fn see(&mut self, estimate: &MotionEstimate, truth: &Truth, distance: Length) {
        let bounds = estimate.confidence;
        self.is_inside &= (bounds.distance_low..=bounds.distance_high).contains(&distance);
        let Some(speed) = truth.speed else { return };
        let off = (estimate.speed - speed).as_m_per_s();
        self.periods += 1;
        self.squares += off * off;
        self.widths += (bounds.speed_high - bounds.speed_low).as_m_per_s();
    }
}

/// A period of a later run.
fn later(period: &Period, by: TimeSpan, ahead: Length) -> Period {
    let wheels = period.wheels.map(|wheel| {
        let last_edge = wheel.last_edge.map(|edge| edge + by);
        WheelReading { last_edge, ..wheel }
    });
    Period { time: period.time + by, wheels, balise: period.balise.map(|place| place + ahead), ..*period }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The time and the length of each of the first runs.
    fn runs(seed: u64) -> Vec<(i64, i64)> {
        let mut hours = OdometerHours::new(LineScenario::by_name("N2").unwrap(), seed).unwrap();
        let of_run = |_| {
            let (last, truth) = hours.next_run().unwrap().pop().unwrap();
            ((last.time - Timestamp::ZERO).as_s() as i64, truth.distance.unwrap().as_m() as i64)
        };
        (0..4).map(of_run).collect()
    }

    #[test]
    fn the_same_train_runs_differently_from_stop_to_stop() {
        let runs = runs(1);
        let different: std::collections::BTreeSet<_> = runs.iter().collect();
        assert_eq!(different.len(), runs.len(), "{runs:?}");
    }
}
