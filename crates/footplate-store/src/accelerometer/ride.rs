//! A whole recording of an accelerometer, walked: when the train stood, and the hops in between.
//!
//! Twice: the first time with the axis that changes most, to see departures, from which follows which direction is forward; the
//! second time along that.

use footplate_core::odometry::inertial::{
    AxisAlignment, BlockAverage, DriftLimits, ForwardAxis, HighPassRestorer, Standing, StandstillDetector,
    StandstillThresholds, Trip, TripRecorder,
};
use footplate_core::{Acceleration, TimeSpan, Timestamp};

use super::recording::{AccelerometerRecording, SensorForm, mean};

/// Within this time a phone forgets a steady acceleration (s): the median of 20 stops of three trips
/// (docs/theory/inertial.md).
const FORGETS_WITHIN_S: f64 = 7.0;
/// Readings are averaged over this time to find the axis of the train's own changes of speed (s): longer than any
/// shaking, shorter than any acceleration.
const SLOW_S: f64 = 2.0;

/// A time in which the train stood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandingStretch {
    /// It came to rest ...
    pub from: Timestamp,
    /// ... and left, or the recording ended.
    pub to: Timestamp,
    /// Whether the recording ended while it stood.
    pub open: bool,
}

/// What a recording of an accelerometer comes to.
#[derive(Debug, Clone)]
pub struct AccelerometerRide {
    /// Which direction is forward; `None` where no departure was seen.
    pub forward: Option<ForwardAxis>,
    /// The times in which the train stood, in order, as they are known afterwards.
    pub standing: Vec<StandingStretch>,
    /// The runs from stop to stop.
    pub hops: Vec<Trip>,
    /// From which time on it is known whether the train stands.
    pub known_from: Option<Timestamp>,
    /// What was said as it happened: the time and whether the train stood.
    pub(super) live: Vec<(Timestamp, bool)>,
}

impl AccelerometerRide {
    /// Walks a recording.
    pub fn walk(recording: &AccelerometerRecording, thresholds: StandstillThresholds) -> Self {
        let forward = Self::forward(recording, thresholds);
        let axis = forward.unwrap_or_else(|| liveliest(recording));
        let mut recorder = TripRecorder::with_thresholds(drift(recording.form), thresholds);
        let mut ride =
            Self { forward, standing: Vec::new(), hops: Vec::new(), known_from: None, live: Vec::new() };
        let mut was = Standing::Unknown;
        along(recording, axis, |block| {
            ride.hops.extend(recorder.take(block));
            let standing = recorder.detector().standing();
            match (was, standing) {
                (Standing::Unknown | Standing::LeftAt(_), Standing::Since(from)) => {
                    ride.standing.push(StandingStretch { from, to: from, open: true });
                }
                (Standing::Since(_), Standing::LeftAt(left)) => {
                    if let Some(last) = ride.standing.last_mut() {
                        *last = StandingStretch { to: left.max(last.from), open: false, ..*last };
                    }
                }
                _ => {}
            }
            was = standing;
            ride.known_from = ride.known_from.or((standing != Standing::Unknown).then_some(block.end));
            ride.live.push((block.end, matches!(standing, Standing::Since(_))));
        });
        if let (Some(last), Some((end, _))) = (ride.standing.last_mut(), ride.live.last())
            && last.open
        {
            last.to = *end;
        }
        ride
    }

    fn forward(recording: &AccelerometerRecording, thresholds: StandstillThresholds) -> Option<ForwardAxis> {
        if recording.form == SensorForm::Along {
            return Some(ForwardAxis { direction: [1.0, 0.0, 0.0], departures: 0 });
        }
        let mut detector = StandstillDetector::with_thresholds(drift(recording.form), thresholds);
        let mut alignment = AxisAlignment::default();
        along(recording, liveliest(recording), |block| {
            detector.take(block);
            alignment.take(&detector);
        });
        alignment.forward()
    }
}

fn drift(form: SensorForm) -> DriftLimits {
    match form {
        SensorForm::WithoutGravity => DriftLimits::restored(),
        SensorForm::WithGravity | SensorForm::Along => DriftLimits::steady(),
    }
}

/// Gives every block of a recording to `take`, with the acceleration along an axis.
fn along(
    recording: &AccelerometerRecording,
    axis: ForwardAxis,
    mut take: impl FnMut(footplate_core::odometry::inertial::AccelerationBlock),
) {
    let forgets = if recording.form == SensorForm::WithoutGravity { FORGETS_WITHIN_S } else { 0.0 };
    let mut restorer = HighPassRestorer::new(TimeSpan::from_s(forgets));
    // Gravity is no acceleration of the train.
    let level = if recording.form == SensorForm::WithGravity { mean(&recording.readings) } else { [0.0; 3] };
    let mut average = BlockAverage::default();
    let mut latest = None;
    for (time, axes) in &recording.readings {
        let [x, y, z] = *axes;
        let [level_x, level_y, level_z] = level;
        let axes = [x - level_x, y - level_y, z - level_z].map(Acceleration::from_m_per_s2);
        let span = latest.map_or(TimeSpan::ZERO, |latest| *time - latest);
        latest = Some(*time);
        let restored = restorer.restore(span, axis.along(axes));
        if let Some(block) = average.take(*time, axes, restored) {
            take(block);
        }
    }
}

/// The axis that changes most over seconds, which is more nearly along the track than the others.
fn liveliest(recording: &AccelerometerRecording) -> ForwardAxis {
    let level = mean(&recording.readings);
    let mut squares = [0.0; 3];
    let (mut sum, mut count, mut start) = ([0.0; 3], 0.0_f64, None);
    for (time, axes) in &recording.readings {
        for ((sum, axis), level) in sum.iter_mut().zip(axes).zip(level) {
            *sum += axis - level;
        }
        count += 1.0;
        let begun = *start.get_or_insert(*time);
        if (*time - begun).as_s() >= SLOW_S {
            for (square, sum) in squares.iter_mut().zip(sum) {
                *square += (sum / count) * (sum / count);
            }
            (sum, count, start) = ([0.0; 3], 0.0, None);
        }
    }
    let [x, y, z] = squares;
    let direction = if x >= y && x >= z {
        [1.0, 0.0, 0.0]
    } else if y >= z {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    ForwardAxis { direction, departures: 0 }
}
