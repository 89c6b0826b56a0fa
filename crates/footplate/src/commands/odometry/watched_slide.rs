//! A simulated full-size train that is watched while it slips and slides: the counts of its wheels through the real odometer, period
//! by period, with the truth beside them.
//!
//! The truth comes from the simulator and is drawn and scored; the odometer never sees it.

use footplate_core::odometry::wheels::Period;
use footplate_core::odometry::{Mode, MotionEstimate, WheelState};
use footplate_core::{Length, Speed, TimeSpan, Timestamp};
use footplate_sim::line::{LineConditions, LineScenario};
use footplate_store::Truth;
use footplate_store::odometry::{OdometryRun, Preset, RunContext, simulated_rows, simulated_vehicle};
use serde::Serialize;
use serde_json::{Map, Value};

use super::run_series::WheelSpeeds;
use super::walked::leaves_bounds;

/// A run that is gone through as time goes on.
pub(crate) struct WatchedSlide {
    scenario: LineScenario,
    seed: u64,
    vehicle: String,
    rows: Vec<(Period, Truth)>,
    next: usize,
    odometry: OdometryRun,
    wheels: WheelSpeeds,
    begin: Timestamp,
    /// The true distance where that of the odometer is 0.
    origin: Option<Length>,
}

/// What is about to be seen.
#[derive(Debug, Serialize)]
pub(crate) struct SlideOpening {
    scenario: &'static str,
    description: &'static str,
    seed: u64,
    vehicle: String,
    duration_s: f64,
}

/// One period. Speeds in m/s, distances in m.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct SlideRow {
    t_s: f64,
    speed: f64,
    confidence_speed_low: f64,
    confidence_speed_high: f64,
    guaranteed_speed_low: f64,
    guaranteed_speed_high: f64,
    true_speed: Option<f64>,
    /// How fast each wheel turned, as the mean of five periods; nothing where it was not counted.
    wheels: [Option<f64>; 2],
    states: [WheelState; 2],
    mode: Mode,
    /// The distance less the true one, and its confidence interval less the true one.
    beyond: Option<f64>,
    confidence_beyond_low: Option<f64>,
    confidence_beyond_high: Option<f64>,
}

impl WatchedSlide {
    /// A run of a scenario, simulated whole before anything is seen of it.
    ///
    /// # Errors
    /// The simulated train is none that an odometer takes: a mistake of ours.
    pub(crate) fn new(scenario: LineScenario, seed: u64) -> anyhow::Result<Self> {
        let run = scenario.run(seed, LineConditions::default());
        let file = simulated_vehicle(&run.vehicle)?;
        let context = RunContext::new(file.vehicle, Preset::Recommended, true);
        let rows: Vec<(Period, Truth)> = simulated_rows(&run).collect();
        Ok(Self {
            scenario,
            seed,
            vehicle: file.name,
            begin: rows.first().map_or(Timestamp::ZERO, |(period, _)| period.time),
            rows,
            next: 0,
            odometry: OdometryRun::new(&context)?,
            wheels: WheelSpeeds::new(&file.vehicle),
            origin: None,
        })
    }

    pub(crate) fn opening(&self) -> SlideOpening {
        let last = self.rows.last().map_or(self.begin, |(period, _)| period.time);
        SlideOpening {
            scenario: self.scenario.name(),
            description: self.scenario.description(),
            seed: self.seed,
            vehicle: self.vehicle.clone(),
            duration_s: (last - self.begin).as_s(),
        }
    }

    /// Goes on to a time of the run: the periods since, at most so many of the newest, and how many more there were. The
    /// odometer walks all of them.
    pub(crate) fn go_on(&mut self, until: TimeSpan, most: usize) -> (Vec<SlideRow>, usize) {
        let mut seen = Vec::new();
        while let Some((period, truth)) = self.rows.get(self.next)
            && period.time - self.begin <= until
        {
            let estimate = self.odometry.step(period, || *truth);
            let wheels = self.wheels.see(period);
            let gone = truth.distance.map(|distance| distance - *self.origin.get_or_insert(distance));
            seen.push(row(period.time - self.begin, &estimate, truth.speed, gone, wheels));
            self.next += 1;
        }
        let left_out = seen.len().saturating_sub(most);
        seen.drain(..left_out);
        (seen, left_out)
    }

    pub(crate) fn is_over(&self) -> bool {
        self.next >= self.rows.len()
    }

    /// How good the odometer was, by the names of docs/formats/odometry-result.md, and whether its bounds held.
    pub(crate) fn score(&self) -> Value {
        let Some(scores) = self.odometry.scores() else { return Value::Null };
        let score = scores.preset(Preset::Recommended);
        let figures = score.figures().map(|(name, figure)| (name.to_owned(), figure.into()));
        let mut form: Map<String, Value> = figures.into_iter().collect();
        form.insert("holds".to_owned(), (!leaves_bounds(&score)).into());
        form.into()
    }
}

fn row(
    since: TimeSpan,
    estimate: &MotionEstimate,
    true_speed: Option<Speed>,
    gone: Option<Length>,
    wheels: [f64; 2],
) -> SlideRow {
    let beyond = |distance: Length| gone.map(|gone| thousandths((distance - gone).as_m()));
    SlideRow {
        t_s: thousandths(since.as_s()),
        speed: thousandths(estimate.speed.as_m_per_s()),
        confidence_speed_low: thousandths(estimate.confidence.speed_low.as_m_per_s()),
        confidence_speed_high: thousandths(estimate.confidence.speed_high.as_m_per_s()),
        guaranteed_speed_low: thousandths(estimate.guaranteed.speed_low.as_m_per_s()),
        guaranteed_speed_high: thousandths(estimate.guaranteed.speed_high.as_m_per_s()),
        true_speed: true_speed.map(|speed| thousandths(speed.as_m_per_s())),
        wheels: wheels.map(|speed| speed.is_finite().then(|| thousandths(speed))),
        states: estimate.wheels,
        mode: estimate.mode,
        beyond: beyond(estimate.distance),
        confidence_beyond_low: beyond(estimate.confidence.distance_low),
        confidence_beyond_high: beyond(estimate.confidence.distance_high),
    }
}

/// Less than a pixel.
fn thousandths(value: f64) -> f64 {
    (1e3 * value).round() / 1e3 + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slide(name: &str) -> WatchedSlide {
        WatchedSlide::new(LineScenario::by_name(name).unwrap(), 7).unwrap()
    }

    #[test]
    fn however_often_somebody_looks_the_same_is_seen() {
        let (mut often, mut once) = (slide("S2"), slide("S2"));
        let until = TimeSpan::from_s(15.0);
        let often: Vec<SlideRow> = (0..=150)
            .flat_map(|tenths| often.go_on(TimeSpan::from_s(0.1 * f64::from(tenths)), 100).0)
            .collect();
        assert!(often.len() > 290, "{} periods of 50 ms", often.len());
        assert_eq!(often, once.go_on(until, usize::MAX).0);
    }

    #[test]
    fn who_was_away_sees_the_newest_and_how_many_are_gone() {
        let mut slide = slide("S2");
        let (rows, gone) = slide.go_on(TimeSpan::from_s(10.0), 50);
        assert_eq!((rows.len(), gone), (50, 151), "201 periods of 50 ms in ten seconds");
        assert!((rows.last().unwrap().t_s - 10.0).abs() < 0.051);
        slide.go_on(TimeSpan::from_s(1e4), 50);
        assert!(slide.is_over());
        assert_eq!(slide.score()["holds"], true);
    }

    #[test]
    fn both_wheels_lag_behind_the_train_while_they_slide() {
        let mut slide = slide("S2");
        let (rows, _) = slide.go_on(TimeSpan::from_s(18.0), usize::MAX);
        // The scenario locks both from 12 s on: wheels stand, the train does not.
        let locked = rows.iter().rfind(|row| row.t_s < 15.0).unwrap();
        assert!(locked.true_speed.unwrap() > 1.0, "{locked:?}");
        assert!(
            locked.wheels.iter().all(|wheel| wheel.unwrap() < 0.5 * locked.true_speed.unwrap()),
            "{locked:?}"
        );
        assert!(
            locked.guaranteed_speed_low <= locked.true_speed.unwrap()
                && locked.true_speed.unwrap() <= locked.guaranteed_speed_high
        );
    }
}
