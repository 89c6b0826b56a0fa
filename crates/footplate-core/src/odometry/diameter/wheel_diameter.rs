//! Learns the true diameters of two measured wheelsets, from balises at known distances and from each other.
//!
//! Two results side by side. The *estimate* is the scale with its standard deviation ([`ScaleFilter`]). The *interval* is what
//! remains possible if the diameter was within its tolerance, no balise is off by more than its bound and no rolling wheel
//! creeps more than its allowance ([`ScaleInterval`]). A balise that the interval excludes is refused with its numbers and
//! changes neither.

use core::fmt;

use libm::{log, sqrt};

use super::balise_passage::{BaliseAccuracy, PairedDistance, Passage, distances};
use super::scale_filter::ScaleFilter;
use super::scale_interval::{AgreedBeyond, ScaleInterval};
use crate::estimate::Estimate;
use crate::odometry::wheels::Wheelset;
use crate::time::Timestamp;
use crate::units::Length;

/// Least distance of balises that tell a diameter (m): half a metre in it is half a per cent.
const NEAREST_PAIR_M: f64 = 100.0;
/// Least distance that both wheelsets roll before they are compared (m): a pulse is then 0.02 %.
const COMPARED_DISTANCE_M: f64 = 200.0;
/// Standard deviation of the difference of two wheelsets that roll with little effort, from creepage and cone. Chosen: a
/// third of what a curve does to one of them (0.1 %).
const COMPARED_DEVIATION: f64 = 3e-4;
/// Standard deviation of the mean creepage of a rolling wheel between two balises. Chosen: the lower end of normal traction and
/// braking (0.1 to 1 %), because most of a distance is neither.
const CREEPAGE_DEVIATION: f64 = 3e-4;
/// The scale changes by no more than this part in a kilometre: thirty times the fastest wear (0.3 mm in 10 000 km).
const CHANGES_PER_KM: f64 = 1e-6;
/// Distance after which the uncertainty of the scales grows by a step (m). Chosen: so rare that it costs nothing.
const GROWS_EVERY_M: f64 = 100.0;
/// Variance of the phase within a pulse at one end of a distance, in squared pulses: uniform over one pulse.
const PULSE_VARIANCE: f64 = 1.0 / 12.0;

/// The learnt scale of one wheelset, to be kept from run to run.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WheelScale {
    /// True over stated diameter.
    pub estimate: Estimate,
    /// Its bounds, as long as the assumptions hold.
    pub interval: ScaleInterval,
}

/// The result of a balise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PairVerdict {
    /// There is no balise before it to pair it with.
    First,
    /// It is too near to the one before.
    TooNear,
    /// Both wheelsets slipped, slid or were not counted since the one before.
    Disturbed,
    /// It has changed the scales.
    Accepted,
    /// Its distance from the one before is impossible.
    Refused {
        /// The stated distance between the two balises, negative if the wheels turned backwards.
        said: Length,
        /// The least distance by the wheels ...
        low: Length,
        /// ... and the largest, with the bounds of both balises.
        high: Length,
    },
}

/// The scales of two wheelsets. Fixed memory.
#[derive(Debug, Clone)]
pub struct WheelDiameters {
    wheelsets: [Wheelset; 2],
    balise: BaliseAccuracy,
    filter: ScaleFilter,
    intervals: [ScaleInterval; 2],
    /// What pairs of balises say that contradict the tolerances.
    beyond: [AgreedBeyond; 2],
    counts: [u32; 2],
    dates: [Timestamp; 2],
    /// The latest balise that agreed with the one before it.
    trusted: Option<Passage>,
    /// A later one that did not. It is right if the next agrees with it.
    disputed: Option<Passage>,
    /// For each wheelset the first balise of those that agreed since which it has rolled.
    origins: [Option<Passage>; 2],
    /// Where both began to roll with little effort.
    comparing_from: Option<[Length; 2]>,
    /// Whether the axles were compared since the latest pair; the pair then says nothing new about their ratio.
    compared: bool,
    counted: [Length; 2],
    counted_before: [Length; 2],
    grown_at: [Length; 2],
}

impl WheelDiameters {
    /// Starts from stated diameters and their tolerances.
    #[must_use]
    pub fn new(wheelsets: [Wheelset; 2], balise: BaliseAccuracy) -> Self {
        // The standard deviation of a uniform distribution within the tolerance.
        let deviations = wheelsets.map(|wheelset| wheelset.diameter_tolerance / sqrt(3.0));
        Self {
            wheelsets,
            balise,
            filter: ScaleFilter::new([1.0; 2], deviations),
            intervals: wheelsets.map(|wheelset| ScaleInterval::of_tolerance(wheelset.diameter_tolerance)),
            beyond: [AgreedBeyond::default(); 2],
            counts: [0; 2],
            dates: [Timestamp::ZERO; 2],
            trusted: None,
            disputed: None,
            origins: [None; 2],
            comparing_from: None,
            compared: false,
            counted: [Length::ZERO; 2],
            counted_before: [Length::ZERO; 2],
            grown_at: [Length::ZERO; 2],
        }
    }

    /// Continues with the scales that an earlier run of the same wheelsets learnt.
    ///
    /// # Errors
    /// The first scale that these wheelsets cannot have.
    pub fn resume(
        wheelsets: [Wheelset; 2],
        balise: BaliseAccuracy,
        known: [WheelScale; 2],
    ) -> Result<Self, ForeignScale> {
        let mut resumed = Self::new(wheelsets, balise);
        for ((wheel, known), interval) in known.iter().enumerate().zip(&mut resumed.intervals) {
            let Estimate { value, uncertainty, .. } = known.estimate;
            let both = interval.meet(known.interval);
            *interval = match both {
                Some(both) if both.holds(value) && uncertainty > 0.0 && uncertainty.is_finite() => both,
                _ => return Err(ForeignScale { wheelset: wheel + 1, known: *known, possible: *interval }),
            };
        }
        resumed.filter = ScaleFilter::new(
            known.map(|known| known.estimate.value),
            known.map(|known| known.estimate.uncertainty / known.estimate.value),
        );
        resumed.counts = known.map(|known| known.estimate.count);
        resumed.dates = known.map(|known| known.estimate.date);
        Ok(resumed)
    }

    /// Takes in what was counted by the end of a period.
    ///
    /// `counted` are the distances since the start by pulses and stated diameters, negative backwards; `rolling` whether each
    /// wheelset was counted and neither slipped nor slid in this period; `little_effort` whether the train coasted or
    /// nearly so.
    pub fn roll(&mut self, time: Timestamp, counted: [Length; 2], rolling: [bool; 2], little_effort: bool) {
        self.grow(counted);
        if rolling != [true; 2] {
            let Self { trusted, disputed, origins: [first, second], .. } = self;
            for passage in [trusted, disputed, first, second].into_iter().flatten() {
                for (rolled, rolling) in passage.rolled.iter_mut().zip(rolling) {
                    *rolled &= rolling;
                }
            }
        }
        if rolling != [true; 2] || !little_effort {
            self.comparing_from = None;
            return;
        }
        let Some(from) = self.comparing_from else {
            self.comparing_from = Some(counted);
            return;
        };
        let [first, second] = distances(from, counted);
        if first.min(second).as_m() >= COMPARED_DISTANCE_M {
            self.comparing_from = Some(counted);
            self.compare(time, [first, second]);
        }
    }

    /// Takes in a balise that was passed in the period that [`roll`](Self::roll) has just taken in, and the place it says.
    pub fn pass(&mut self, time: Timestamp, place: Length) -> PairVerdict {
        if !place.is_finite() {
            return PairVerdict::Refused { said: place, low: Length::ZERO, high: Length::ZERO };
        }
        let [first, second] = distances(self.counted_before, self.counted).map(|distance| distance * 0.5);
        let [first_before, second_before] = self.counted_before;
        let [first_now, second_now] = self.counted;
        let here = Passage {
            place,
            counted: [(first_before + first_now) * 0.5, (second_before + second_now) * 0.5],
            within: [first, second],
            rolled: [true; 2],
        };
        if let Some(latest) = self.disputed.or(self.trusted) {
            self.note_beyond(&latest, &here);
        }
        let mut refusal = None;
        for before in [self.trusted, self.disputed].into_iter().flatten() {
            match self.pair(time, &before, &here) {
                verdict @ PairVerdict::Refused { .. } => refusal = refusal.or(Some(verdict)),
                PairVerdict::Accepted => return self.trust(here, PairVerdict::Accepted),
                PairVerdict::Disturbed => return self.trust(here, PairVerdict::Disturbed),
                nothing_learnt => return nothing_learnt,
            }
        }
        match refusal {
            Some(verdict) => {
                self.disputed = Some(here);
                verdict
            }
            None => self.trust(here, PairVerdict::First),
        }
    }

    /// Notes what a pair allows where no diameter within the tolerance does.
    fn note_beyond(&mut self, from: &Passage, to: &Passage) {
        let off = 2.0 * self.balise.bound;
        let each = self.beyond.iter_mut().zip(&self.wheelsets).zip(from.distances_to(to));
        for ((beyond, wheelset), distance) in each {
            if !distance.rolled || distance.counted.as_m() < NEAREST_PAIR_M {
                continue;
            }
            let tolerated = ScaleInterval::of_tolerance(wheelset.diameter_tolerance);
            let allowed = distance.allows(off, wheelset.pulse_pitch());
            beyond.take(allowed.filter(|allowed| tolerated.meet(*allowed).is_none()));
        }
    }

    /// True over stated diameter of each wheelset that several balises agree on, where that is beyond its tolerance.
    #[must_use]
    pub fn beyond_tolerance(&self) -> [Option<f64>; 2] {
        self.beyond.map(AgreedBeyond::scale)
    }

    fn trust(&mut self, here: Passage, verdict: PairVerdict) -> PairVerdict {
        self.trusted = Some(here);
        self.disputed = None;
        verdict
    }

    /// True over stated diameter of each wheelset, with bounds.
    #[must_use]
    pub fn scales(&self) -> [WheelScale; 2] {
        let [first, second] = self.filter.scales();
        let [first_count, second_count] = self.counts;
        let [first_date, second_date] = self.dates;
        let [first_interval, second_interval] = self.intervals;
        let scale = |(value, uncertainty), count, date, interval| WheelScale {
            estimate: Estimate { value, uncertainty, count, date },
            interval,
        };
        [
            scale(first, first_count, first_date, first_interval),
            scale(second, second_count, second_date, second_interval),
        ]
    }

    /// The bounds of both scales, which the distance bounds need in every period.
    #[must_use]
    pub fn intervals(&self) -> [ScaleInterval; 2] {
        self.intervals
    }

    /// The diameters themselves.
    #[must_use]
    pub fn diameters(&self) -> [Estimate<Length>; 2] {
        let [first, second] = self.scales();
        let [first_wheel, second_wheel] = self.wheelsets;
        [
            first.estimate.scaled(|scale| first_wheel.diameter * scale),
            second.estimate.scaled(|scale| second_wheel.diameter * scale),
        ]
    }

    /// Lets the uncertainty grow with the distance, in steps that every period can afford.
    fn grow(&mut self, counted: [Length; 2]) {
        self.counted_before = self.counted;
        self.counted = counted;
        let [first, second] = distances(self.grown_at, counted);
        let distance = first.max(second).as_m();
        if distance >= GROWS_EVERY_M {
            self.grown_at = counted;
            self.filter.wander(distance / 1000.0);
            self.widen(distance);
        }
    }

    fn widen(&mut self, distance_m: f64) {
        for (interval, wheelset) in self.intervals.iter_mut().zip(&self.wheelsets) {
            let widened = interval.widened(CHANGES_PER_KM * distance_m / 1000.0);
            let possible = ScaleInterval::of_tolerance(wheelset.diameter_tolerance);
            *interval = widened.meet(possible).unwrap_or(possible);
        }
    }

    /// Learns the ratio of the scales from distances that both wheelsets rolled.
    fn compare(&mut self, time: Timestamp, [first, second]: [Length; 2]) {
        let [first_pulse, second_pulse] = self.wheelsets.map(|wheelset| wheelset.pulse_pitch());
        let pulses = pulse_variance(first_pulse / first) + pulse_variance(second_pulse / second);
        let variance = COMPARED_DEVIATION * COMPARED_DEVIATION + pulses;
        self.filter.measure([1.0, -1.0], log(second / first), variance);
        self.settle(time, [true; 2]);
        self.compared = true;
    }

    fn pair(&mut self, time: Timestamp, from: &Passage, to: &Passage) -> PairVerdict {
        if from.rolled == [false; 2] {
            return PairVerdict::Disturbed;
        }
        let distances = from.distances_to(to);
        let near =
            |distance: &PairedDistance| distance.counted.max(distance.said.abs()).as_m() < NEAREST_PAIR_M;
        if distances.iter().filter(|distance| distance.rolled).all(near) {
            return PairVerdict::TooNear;
        }
        let off = 2.0 * self.balise.bound;
        let mut met = self.intervals;
        for ((interval, wheelset), distance) in met.iter_mut().zip(&self.wheelsets).zip(&distances) {
            let pulse = wheelset.pulse_pitch();
            match distance.allows(off, pulse).and_then(|pair| interval.meet(pair)) {
                _ if !distance.rolled => {}
                Some(both) => *interval = both,
                None => {
                    let [low, high] = distance.possible(*interval, off, pulse);
                    return PairVerdict::Refused { said: distance.said, low, high };
                }
            }
        }
        self.intervals = met;
        self.lengthen(from, to);
        // In advance, for the distance until the next step.
        self.widen(GROWS_EVERY_M);
        self.learn(&distances);
        self.settle(time, from.rolled);
        PairVerdict::Accepted
    }

    /// Pairs a balise with the first since which each wheelset has rolled: the longer the distance, the less the balises leave open.
    fn lengthen(&mut self, from: &Passage, to: &Passage) {
        let off = 2.0 * self.balise.bound;
        let each = self.origins.iter_mut().zip(&mut self.intervals).zip(&self.wheelsets);
        for (wheel, ((origin, interval), wheelset)) in each.enumerate() {
            let has_rolled = |passage: &Passage| passage.rolled.get(wheel) == Some(&true);
            if !origin.as_ref().is_some_and(has_rolled) {
                *origin = Some(*from).filter(has_rolled);
            }
            let Some(distance) = origin.and_then(|origin| origin.distances_to(to).into_iter().nth(wheel))
            else {
                continue;
            };
            // The scale has changed between the two.
            let changed = CHANGES_PER_KM * distance.counted.as_m() / 1000.0;
            let allowed =
                distance.allows(off, wheelset.pulse_pitch()).map(|allowed| allowed.widened(changed));
            // Where nothing is left, the balises agree in pairs and not over all: one bound was broken by little. Pairs win.
            *interval = allowed.and_then(|allowed| interval.meet(allowed)).unwrap_or(*interval);
        }
    }

    /// Gives a pair to the filter. The error of the balises is the same for both wheelsets and is not counted twice.
    fn learn(&mut self, [one, other]: &[PairedDistance; 2]) {
        let [first_pulse, second_pulse] = self.wheelsets.map(|wheelset| wheelset.pulse_pitch());
        let (said, first, second) = (one.said, one.counted, other.counted);
        // Each end of the pair has its own error, and is at any time of its period: even over the distance of the period.
        let (balise, periods) = (self.balise.deviation / said, one.within / said);
        let balises = 2.0 * balise * balise + periods * periods / 3.0;
        let own = |pulse: Length, distance: Length| {
            CREEPAGE_DEVIATION * CREEPAGE_DEVIATION + pulse_variance(pulse / distance)
        };
        let (of_first, of_second) = (own(first_pulse, first), own(second_pulse, second));
        match [one.rolled, other.rolled] {
            [true, true] => {
                let mean = 0.5 * (log(said / first) + log(said / second));
                self.filter.measure([0.5, 0.5], mean, balises + 0.25 * (of_first + of_second));
                if !self.compared {
                    self.filter.measure([1.0, -1.0], log(second / first), of_first + of_second);
                }
            }
            [true, false] => self.filter.measure([1.0, 0.0], log(said / first), balises + of_first),
            [false, true] => self.filter.measure([0.0, 1.0], log(said / second), balises + of_second),
            [false, false] => {}
        }
        self.compared = false;
    }

    fn settle(&mut self, time: Timestamp, learnt: [bool; 2]) {
        self.filter.hold_within(self.intervals.map(|interval| (interval.low, interval.high)));
        for ((count, date), learnt) in self.counts.iter_mut().zip(&mut self.dates).zip(learnt) {
            if learnt {
                *count = count.saturating_add(1);
                *date = time;
            }
        }
    }
}

/// Uncertainty of the logarithm of a distance by the pulses at both ends.
fn pulse_variance(pulse_over_distance: f64) -> f64 {
    2.0 * PULSE_VARIANCE * pulse_over_distance * pulse_over_distance
}

/// A scale that belongs to another wheelset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForeignScale {
    /// Which wheelset it was given for, counted from 1.
    pub wheelset: usize,
    /// What was given.
    pub known: WheelScale,
    /// What the tolerance of the diameter allows.
    pub possible: ScaleInterval,
}

impl fmt::Display for ForeignScale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { wheelset, known: WheelScale { estimate, interval }, possible } = self;
        write!(
            f,
            "the scale known of wheelset {wheelset} is {} ± {} and between {} and {}; it should be a number between {} \
             and {}, with an uncertainty above 0: if the wheelset was changed, start without a known scale",
            estimate.value, estimate.uncertainty, interval.low, interval.high, possible.low, possible.high
        )
    }
}

impl core::error::Error for ForeignScale {}
