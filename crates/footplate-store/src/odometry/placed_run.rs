//! The distance of a run by places of stated accuracy, and the wheel scales that follow.

use footplate_core::Length;
use footplate_core::odometry::wheels::{Period, Vehicle};
use footplate_core::odometry::{Mode, MotionBounds, MotionEstimate, PlacedValue, StatedPlaces, WheelState};

use super::counted_distances::DistanceCounter;

/// How far a place with a bound may have moved the reckoned distance (m). Chosen: beyond what such places are off.
const MOVED_M: f64 = 5.0;
/// How far the train went by the odometer while a wheelset rolled, and how far that wheelset turned (m).
#[derive(Debug, Clone, Copy, Default)]
struct RolledDistance {
    by_odometer: f64,
    turned: f64,
}

/// What places of stated accuracy say of one run.
#[derive(Debug, Clone)]
pub(super) struct PlacedRun {
    places: StatedPlaces,
    counter: DistanceCounter,
    rolled: [RolledDistance; 2],
    /// The reckoned distance of the period before, and how far off it may be by the present slide (m).
    before: Length,
    slide: f64,
    latest: Option<MotionEstimate>,
}

impl PlacedRun {
    /// Begins with the first place.
    pub(super) fn new(vehicle: &Vehicle, before: Length) -> Self {
        let tolerances = vehicle.wheelsets.map(|wheelset| wheelset.diameter_tolerance);
        Self {
            places: StatedPlaces::new(tolerances.into_iter().fold(0.0, f64::max)),
            counter: DistanceCounter::new(vehicle),
            rolled: [RolledDistance::default(); 2],
            before,
            slide: 0.0,
            latest: None,
        }
    }

    /// Takes in a period and what the odometer made of it without the place; the estimate with all places.
    pub(super) fn step(&mut self, period: &Period, estimate: &MotionEstimate) -> MotionEstimate {
        let counted = self.counter.count(period);
        let ran = (estimate.distance - self.before).as_m();
        self.before = estimate.distance;
        for ((rolled, distance), state) in self.rolled.iter_mut().zip(counted.distances).zip(estimate.wheels)
        {
            if let (Some(distance), WheelState::Rolling) = (distance, state) {
                rolled.by_odometer += ran;
                rolled.turned += distance.as_m();
            }
        }
        self.slide(estimate, counted.span.map_or(0.0, footplate_core::TimeSpan::as_s));
        match (period.balise, period.balise_deviation) {
            (Some(place), Some(deviation)) => {
                self.places.slid(Length::from_m(self.slide));
                self.slide = 0.0;
                // It was passed at any time of the period.
                let middle = estimate.distance - Length::from_m(0.5 * ran);
                let deviation = Length::from_m(libm::hypot(deviation.as_m(), ran / 12.0_f64.sqrt()));
                self.places.pass(middle, place, deviation);
            }
            (Some(_), None) => self.places.slid(Length::from_m(MOVED_M)),
            _ => {}
        }
        let placed = self.placed(estimate);
        self.latest = Some(placed);
        placed
    }

    /// While no wheelset tells the speed, the distance is as uncertain as the speed for as long.
    fn slide(&mut self, estimate: &MotionEstimate, seconds: f64) {
        if matches!(estimate.mode, Mode::Correction | Mode::Ambiguous) {
            self.slide += estimate.speed_deviation.as_m_per_s() * seconds;
        }
    }

    fn placed(&self, estimate: &MotionEstimate) -> MotionEstimate {
        let PlacedValue { value, .. } = self.places.distance(estimate.distance);
        // A place that may be anywhere with a probability of some per cent says nothing of what holds in 99.99 %: the interval
        // is that of the wheels alone.
        let MotionBounds { distance_low, distance_high, .. } = estimate.confidence;
        let distance = Length::from_m(value).max(distance_low).min(distance_high);
        // By so much more the estimate may be too long or too short; the amounts never decrease.
        let moved = distance - estimate.distance;
        let [over, under] = self.latest.map_or([Length::ZERO; 2], |latest| [latest.over, latest.under]);
        MotionEstimate {
            distance,
            over: (estimate.over + moved).max(over),
            under: (estimate.under - moved).max(under),
            ..*estimate
        }
    }

    /// True over stated diameter of each wheelset that has rolled.
    pub(super) fn scales(&self) -> [Option<PlacedValue>; 2] {
        let PlacedValue { value, deviation } = self.places.scale();
        self.rolled.map(|RolledDistance { by_odometer, turned }| {
            let ratio = by_odometer / turned;
            (ratio.is_finite() && ratio > 0.0)
                .then_some(PlacedValue { value: value * ratio, deviation: deviation * ratio })
        })
    }

    /// How many places were passed, and how many of those that are remembered are wrong.
    pub(super) fn passed_and_wrong(&self) -> [usize; 2] {
        self.places.passed_and_wrong()
    }
}
