//! One run as the lines and marks of its charts.

mod decimated;
mod wheel_speeds;

use std::collections::BTreeMap;

use footplate_core::odometry::wheels::{Period, Vehicle};
use footplate_core::odometry::{Mode, MotionEstimate, WheelState};
use footplate_core::{Acceleration, Length, Speed, TimeSpan, Timestamp};
use footplate_store::Truth;
use serde::Serialize;

use decimated::{Decimated, Shape};
pub(super) use wheel_speeds::WheelSpeeds;

/// Most points of a line (chosen: several a pixel of any screen, so that zooming in a few times shows more).
pub(super) const MOST_POINTS: usize = 4000;

/// What each line is called and how it is drawn where there are more rows than points.
const LINES: [(&str, Shape); 21] = [
    ("speed_m_s", Shape::Line),
    ("confidence_speed_low_m_s", Shape::Low),
    ("confidence_speed_high_m_s", Shape::High),
    ("guaranteed_speed_low_m_s", Shape::Low),
    ("guaranteed_speed_high_m_s", Shape::High),
    ("true_speed_m_s", Shape::Line),
    ("wheel_1_m_s", Shape::Line),
    ("wheel_2_m_s", Shape::Line),
    ("share_1", Shape::Line),
    // Shares lie one upon the other: what is left to 1 is that of the virtual sensor.
    ("share_1_and_2", Shape::Line),
    // The distance less the true one, and its bounds less the true one.
    ("error_m", Shape::Line),
    ("confidence_error_low_m", Shape::Low),
    ("confidence_error_high_m", Shape::High),
    ("guaranteed_error_low_m", Shape::Low),
    ("guaranteed_error_high_m", Shape::High),
    ("width_m", Shape::High),
    ("over_m", Shape::High),
    ("under_m", Shape::High),
    ("accel_m_s2", Shape::Line),
    ("measured_accel_m_s2", Shape::Line),
    ("effort", Shape::Line),
];

/// Modes and states of a wheelset, the one that matters most last.
const MODES: [&str; 5] = ["normal", "one_slip", "degraded", "correction", "ambiguous"];
const WHEELS: [&str; 4] = ["rolling", "spin", "slide", "excluded"];
const MARKS: [(&str, &[&str]); 3] = [("wheel_1", &WHEELS), ("wheel_2", &WHEELS), ("mode", &MODES)];

/// One run as the lines and marks of its charts.
#[derive(Debug, Clone)]
pub(super) struct RunSeries {
    wheels: WheelSpeeds,
    begin: Option<Timestamp>,
    last: Timestamp,
    /// Of the charts: it stands still where that of the recording goes back.
    elapsed: TimeSpan,
    /// The true distance where that of the odometer is 0.
    origin: Option<Length>,
    rows: Decimated<{ LINES.len() }, { MARKS.len() }>,
}

/// What charts read.
#[derive(Debug, Serialize)]
pub(super) struct SeriesForm {
    /// The first `t_s`; times are counted from it.
    begin_s: f64,
    time_s: Vec<f64>,
    /// By name, those that have any value.
    lines: BTreeMap<&'static str, Vec<Option<f64>>>,
    /// From, to and what: every stretch that is neither rolling nor normal.
    marks: BTreeMap<&'static str, Vec<(f64, f64, &'static str)>>,
}

impl SeriesForm {
    /// The values of a line, one a time, if it has any.
    pub(super) fn line(&self, name: &str) -> Option<&[Option<f64>]> {
        self.lines.get(name).map(Vec::as_slice)
    }

    /// Since the first period (s).
    pub(super) fn times(&self) -> impl Iterator<Item = f64> + '_ {
        self.time_s.iter().copied()
    }
}

impl RunSeries {
    /// A run that has not begun, for lines of at most so many points.
    pub(super) fn new(vehicle: &Vehicle, most_points: usize) -> Self {
        Self {
            wheels: WheelSpeeds::new(vehicle),
            begin: None,
            last: Timestamp::ZERO,
            elapsed: TimeSpan::ZERO,
            origin: None,
            rows: Decimated::new(most_points),
        }
    }

    /// Takes in a row: what was read, what became of it, and what is true.
    pub(super) fn push(&mut self, period: &Period, estimate: &MotionEstimate, truth: &Truth) {
        if self.begin.is_some() {
            self.elapsed += (period.time - self.last).max(TimeSpan::ZERO);
        }
        self.begin.get_or_insert(period.time);
        self.last = period.time;
        let wheels = self.wheels.see(period);
        let gone = truth.distance.map(|distance| distance - *self.origin.get_or_insert(distance));
        let beyond = |distance: Length| gone.map_or(f64::NAN, |gone| (distance - gone).as_m());
        let [first, second, _] = estimate.shares;
        let (confidence, guaranteed) = (&estimate.confidence, &estimate.guaranteed);
        let columns = [
            estimate.speed.as_m_per_s(),
            confidence.speed_low.as_m_per_s(),
            confidence.speed_high.as_m_per_s(),
            guaranteed.speed_low.as_m_per_s(),
            guaranteed.speed_high.as_m_per_s(),
            truth.speed.map_or(f64::NAN, Speed::as_m_per_s),
            wheels[0],
            wheels[1],
            first,
            first + second,
            beyond(estimate.distance),
            beyond(confidence.distance_low),
            beyond(confidence.distance_high),
            beyond(guaranteed.distance_low),
            beyond(guaranteed.distance_high),
            (confidence.distance_high - confidence.distance_low).as_m(),
            estimate.over.as_m(),
            estimate.under.as_m(),
            estimate.acceleration.as_m_per_s2(),
            period.acceleration.map_or(f64::NAN, Acceleration::as_m_per_s2),
            period.effort.unwrap_or(f64::NAN),
        ];
        let [one, other] = estimate.wheels.map(wheel_rank);
        self.rows.push(self.elapsed.as_s(), columns, [one, other, mode_rank(estimate.mode)]);
    }

    /// What charts read, in at most so many points a line.
    pub(super) fn form(&self, most_points: usize) -> SeriesForm {
        let rows = self.rows.thinned(most_points);
        let lines = LINES.iter().enumerate().map(|(place, (name, shape))| {
            let values: Vec<_> =
                rows.column(place, *shape).map(|value| value.map(|value| rounded(value, *shape))).collect();
            (*name, values)
        });
        let marks = MARKS.iter().enumerate().map(|(place, (name, words))| {
            let stretches = rows.stretches(place).into_iter().filter_map(|stretch| {
                let word = words.get(usize::from(stretch.mark))?;
                Some((rounded(stretch.from, Shape::Line), rounded(stretch.to, Shape::Line), *word))
            });
            (*name, stretches.collect())
        });
        SeriesForm {
            begin_s: self.begin.unwrap_or_default().as_s(),
            time_s: rows.times().map(|time| rounded(time, Shape::Line)).collect(),
            lines: lines.filter(|(_, values)| values.iter().any(Option::is_some)).collect(),
            marks: marks.collect(),
        }
    }
}

/// To a thousandth, which is less than a pixel; bounds outwards.
fn rounded(value: f64, shape: Shape) -> f64 {
    let thousandths = 1e3 * value;
    let whole = match shape {
        Shape::Line => thousandths.round(),
        Shape::Low => thousandths.floor(),
        Shape::High => thousandths.ceil(),
    };
    whole / 1e3 + 0.0
}

const fn wheel_rank(state: WheelState) -> u8 {
    match state {
        WheelState::Rolling => 0,
        WheelState::Spin => 1,
        WheelState::Slide => 2,
        WheelState::Excluded => 3,
    }
}

const fn mode_rank(mode: Mode) -> u8 {
    match mode {
        Mode::Normal => 0,
        Mode::OneSlip => 1,
        Mode::Degraded => 2,
        Mode::Correction => 3,
        Mode::Ambiguous => 4,
    }
}
