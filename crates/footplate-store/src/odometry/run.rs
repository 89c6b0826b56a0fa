//! One run of a train through the odometer.

use footplate_core::odometry::diameter::WheelScale;
use footplate_core::odometry::wheels::{Period, Vehicle, VehicleError, Wheelset};
use footplate_core::odometry::{
    AccuracyMonitor, ImplausibleClaims, MotionEstimate, Odometer, OdometrySettings, PlacedValue,
    ReadingAmounts,
};
use footplate_core::{Estimate, Length};

use super::counted_distances::DistanceCounter;
use super::detection::{FlagWatch, SlipWatch};
use super::placed_run::PlacedRun;
use super::rival::{Rival, RivalOdometer};
use super::score::{Claim, OdometryScore, Scorer};
use super::summary::RunSummary;
use crate::tachometer::Truth;

/// Which method of estimation is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preset {
    /// The published algorithm, read so that its printed figures come out.
    Paper,
    /// The published algorithm to the letter.
    Literal,
    /// What is best on every scenario.
    Recommended,
}

impl Preset {
    /// Those that tables compare, in their order.
    pub const ALL: [Self; 2] = [Self::Paper, Self::Recommended];

    /// Those that a run of this preset scores: a published one and the recommended one.
    #[must_use]
    pub const fn scored(self) -> [Self; 2] {
        match self {
            Self::Literal => [Self::Literal, Self::Recommended],
            Self::Paper | Self::Recommended => Self::ALL,
        }
    }

    /// What it is called on the command line and in files.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Literal => "literal",
            Self::Recommended => "recommended",
        }
    }

    /// How an odometer of this preset works.
    #[must_use]
    pub fn settings(self) -> OdometrySettings {
        match self {
            Self::Paper => OdometrySettings::paper(),
            Self::Literal => OdometrySettings::literal(),
            Self::Recommended => OdometrySettings::recommended(),
        }
    }
}

/// Deviations beyond which a learnt diameter is clearly another than claimed.
const CLEARLY: f64 = 3.0;

/// What is known before a run begins.
#[derive(Debug, Clone, Copy)]
pub struct RunContext {
    /// The train.
    pub vehicle: Vehicle,
    /// Which estimate is wanted.
    pub preset: Preset,
    /// Whether estimates are compared with the truth, and with what others would make of the same counts.
    pub score: bool,
    /// Probability of the confidence interval.
    pub confidence: f64,
}

impl RunContext {
    /// The preset, with the confidence interval of 99.99 %.
    #[must_use]
    pub fn new(vehicle: Vehicle, preset: Preset, score: bool) -> Self {
        Self { vehicle, preset, score, confidence: preset.settings().confidence }
    }

    fn settings(&self, preset: Preset) -> OdometrySettings {
        OdometrySettings { confidence: self.confidence, ..preset.settings() }
    }
}

/// One run of a train through the odometer.
#[derive(Debug, Clone)]
pub struct OdometryRun {
    odometer: Odometer,
    summary: RunSummary,
    monitor: AccuracyMonitor,
    amounts: ReadingAmounts,
    scoring: Option<Box<Scoring>>,
    context: RunContext,
    /// From the first place of stated accuracy on.
    placed: Option<Box<PlacedRun>>,
}

/// How good each estimate of a run was, or of several.
#[derive(Debug, Clone)]
pub struct RunScores {
    presets: [Scorer; 2],
    rivals: [Scorer; 3],
}

#[derive(Debug, Clone)]
struct Scoring {
    preset: Preset,
    /// The odometer of the other preset.
    other: Odometer,
    counter: DistanceCounter,
    rivals: [RivalOdometer; 3],
    slip: SlipWatch,
    flags: [FlagWatch; 2],
    scores: RunScores,
}

impl OdometryRun {
    /// A run that has not begun.
    ///
    /// # Errors
    /// The first value of the vehicle that no railway has.
    pub fn new(context: &RunContext) -> Result<Self, VehicleError> {
        let odometer = Odometer::new(context.vehicle, context.settings(context.preset))?;
        let scoring = if context.score { Some(Box::new(Scoring::new(context)?)) } else { None };
        let context = *context;
        let (summary, monitor, amounts) = Default::default();
        Ok(Self { odometer, summary, monitor, amounts, scoring, context, placed: None })
    }

    /// Takes in the readings of one period. The truth is for the score only.
    #[inline]
    pub fn step(&mut self, period: &Period, truth: impl FnOnce() -> Truth) -> MotionEstimate {
        let mut estimate = self.odometer.step(period);
        if self.placed.is_some() || period.balise_deviation.is_some() {
            estimate = self.place(period, &estimate);
        }
        let before = self.summary.last.map_or(Length::ZERO, |last| last.distance);
        self.amounts = ReadingAmounts {
            travelled: self.amounts.travelled + (estimate.distance - before).abs(),
            over: estimate.over,
            under: estimate.under,
        };
        self.summary.see(&estimate, self.monitor.take(self.amounts));
        if let Some(scoring) = &mut self.scoring {
            scoring.see(period, &estimate, &truth());
        }
        estimate
    }

    #[cold]
    fn place(&mut self, period: &Period, estimate: &MotionEstimate) -> MotionEstimate {
        let vehicle = self.context.vehicle;
        let new = || Box::new(PlacedRun::new(&vehicle, estimate.distance));
        self.placed.get_or_insert_with(new).step(period, estimate)
    }

    /// True over stated diameter of each wheelset, as far as known places say.
    #[must_use]
    pub fn wheel_scales(&self) -> [Option<PlacedValue>; 2] {
        if let Some(placed) = &self.placed {
            return placed.scales();
        }
        let learnt = self.odometer.diameters();
        let value = |scale: WheelScale| {
            let Estimate { value, uncertainty, count, .. } = scale.estimate;
            (count > 0).then_some(PlacedValue { value, deviation: uncertainty })
        };
        learnt.map_or([None; 2], |scales| scales.map(value))
    }

    /// How many places of stated accuracy were passed, and how many of those that are remembered are wrong.
    #[must_use]
    pub fn places_passed_and_wrong(&self) -> Option<[usize; 2]> {
        self.placed.as_ref().map(|placed| placed.passed_and_wrong())
    }

    /// What it comes to up to now.
    #[must_use]
    pub fn summary(&self) -> &RunSummary {
        &self.summary
    }

    /// Claims of the vehicle file that the run contradicts.
    #[must_use]
    pub fn implausible_claims(&self) -> ImplausibleClaims {
        let claims = self.odometer.implausible_claims();
        let Some(placed) = &self.placed else { return claims };
        let beyond = |scale: Option<PlacedValue>, wheelset: Wheelset| {
            let PlacedValue { value, deviation } = scale?;
            let is_clear = (value - 1.0).abs() - CLEARLY * deviation > wheelset.diameter_tolerance;
            is_clear.then_some(value)
        };
        let ([one, other], [first, second]) = (placed.scales(), self.context.vehicle.wheelsets);
        ImplausibleClaims { diameters: [beyond(one, first), beyond(other, second)], ..claims }
    }

    /// How good its estimates were, if that was asked for.
    #[must_use]
    pub fn scores(&self) -> Option<&RunScores> {
        self.scoring.as_ref().map(|scoring| &scoring.scores)
    }
}

impl Scoring {
    fn new(context: &RunContext) -> Result<Self, VehicleError> {
        let RunContext { vehicle, preset, .. } = context;
        let other = match preset {
            Preset::Paper | Preset::Literal => Preset::Recommended,
            Preset::Recommended => Preset::Paper,
        };
        let counter = DistanceCounter::new(vehicle);
        Ok(Self {
            preset: *preset,
            other: Odometer::new(*vehicle, context.settings(other))?,
            rivals: Rival::ALL.map(|rival| RivalOdometer::new(rival, vehicle)),
            slip: SlipWatch::new(counter.pitches()),
            flags: [FlagWatch::default(); 2],
            counter,
            scores: RunScores { presets: Default::default(), rivals: Default::default() },
        })
    }

    fn see(&mut self, period: &Period, estimate: &MotionEstimate, truth: &Truth) {
        let other = self.other.step(period);
        let estimates = match self.preset {
            Preset::Paper | Preset::Literal => [estimate, &other],
            Preset::Recommended => [&other, estimate],
        };
        let counted = self.counter.count(period);
        let slip = self.slip.see(period.time, &counted, truth);
        for ((scorer, flags), estimate) in self.scores.presets.iter_mut().zip(&mut self.flags).zip(estimates)
        {
            flags.see(period.time, slip, estimate.wheels);
            scorer.see(&claim(estimate), truth);
            scorer.set_detect_delay(flags.delay_s());
        }
        for (scorer, rival) in self.scores.rivals.iter_mut().zip(&mut self.rivals) {
            scorer.see(&rival.step(&counted), truth);
        }
    }
}

impl RunScores {
    /// That of an estimate of ours.
    #[must_use]
    pub fn preset(&self, preset: Preset) -> OdometryScore {
        match (preset, &self.presets) {
            (Preset::Paper | Preset::Literal, [scorer, _]) | (Preset::Recommended, [_, scorer]) => {
                scorer.score()
            }
        }
    }

    /// Those of what others would make of the same counts.
    pub fn rivals(&self) -> impl Iterator<Item = (Rival, OdometryScore)> {
        Rival::ALL.into_iter().zip(self.rivals.iter().map(Scorer::score))
    }

    /// Adds those of another run.
    pub fn merge(&mut self, other: &Self) {
        let ours = self.presets.iter_mut().chain(&mut self.rivals);
        for (scorer, other) in ours.zip(other.presets.iter().chain(&other.rivals)) {
            scorer.merge(other);
        }
    }
}

pub(super) fn claim(estimate: &MotionEstimate) -> Claim {
    Claim {
        speed: estimate.speed,
        distance: estimate.distance,
        speed_bounds: Some([estimate.guaranteed.speed_low, estimate.guaranteed.speed_high]),
        distance_bounds: Some([estimate.guaranteed.distance_low, estimate.guaranteed.distance_high]),
        likely_speed_bounds: Some([estimate.confidence.speed_low, estimate.confidence.speed_high]),
        likely_distance_bounds: Some([estimate.confidence.distance_low, estimate.confidence.distance_high]),
    }
}
