//! One odometer on one train for days: the run of a scenario again and again, each from where the one before ended.

use anyhow::ensure;
use footplate_core::odometry::MotionEstimate;
use footplate_core::odometry::wheels::{Period, WheelReading};
use footplate_core::{Length, Speed, TimeSpan, Timestamp};
use footplate_sim::line::{LineConditions, LineScenario, LineTruth};
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
    rows: Vec<(Period, Truth)>,
    odometer: OdometryRun,
}

impl OdometerHours {
    /// Draws the train and its run from a seed.
    ///
    /// # Errors
    /// The run begins or ends at speed, or the vehicle is one that no railway has.
    pub(super) fn new(scenario: LineScenario, seed: u64) -> anyhow::Result<Self> {
        let run = scenario.run(seed, LineConditions::default());
        let at_rest = |truth: Option<&LineTruth>| truth.is_some_and(|truth| truth.speed == Speed::ZERO);
        ensure!(
            at_rest(run.truth.first()) && at_rest(run.truth.last()),
            "a run of {0} begins or ends at speed, so that another one cannot follow it: choose one between two stops, such as N2",
            scenario.name()
        );
        let vehicle = simulated_vehicle(&run.vehicle)?.vehicle;
        let odometer = OdometryRun::new(&RunContext::new(vehicle, Preset::Recommended, false))?;
        Ok(Self { rows: simulated_rows(&run).collect(), odometer })
    }

    /// Goes on for so long, and reports each `part` of it.
    ///
    /// # Errors
    /// Those of `report`.
    pub(super) fn run(
        mut self,
        time: TimeSpan,
        part: TimeSpan,
        mut report: impl FnMut(&OdometerHour) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let rows = std::mem::take(&mut self.rows);
        let Some((last, last_truth)) = rows.last() else { return Ok(()) };
        // The first row of a repetition is the last one of the repetition before: counters are read once at each moment.
        let lasts = last.time - Timestamp::ZERO;
        let leads = last_truth.distance.unwrap_or_default();
        let mut hour = OdometerHour::after(TimeSpan::ZERO);
        let (mut waited, mut ahead) = (TimeSpan::ZERO, Length::ZERO);
        let (mut error, mut place) = (Length::ZERO, Length::ZERO);
        let mut is_first = true;
        while waited < time {
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

/// A period of a later repetition.
fn later(period: &Period, by: TimeSpan, ahead: Length) -> Period {
    let wheels = period.wheels.map(|wheel| {
        let last_edge = wheel.last_edge.map(|edge| edge + by);
        WheelReading { last_edge, ..wheel }
    });
    Period { time: period.time + by, wheels, balise: period.balise.map(|place| place + ahead), ..*period }
}
