//! Scores of odometers on a random world, phase by phase.

use footplate_core::odometry::Odometer;
use footplate_core::odometry::wheels::VehicleError;
use footplate_core::{Length, Speed, TimeSpan, Timestamp};
use footplate_sim::line::{LineEventKind, LineRun, LineTruth, WheelTruth};

use super::counted_distances::DistanceCounter;
use super::oracle::{Oracle, hindsight};
use super::rival::{Rival, RivalOdometer};
use super::run::{Preset, claim};
use super::score::{Claim, OdometryScore, Scorer};
use super::simulated::{simulated_rows, simulated_vehicle};
use super::worst_moment::{WorstMoment, WorstWatch};
use crate::tachometer::Truth;

/// How long a train counts as rolling *again* after a slip (s): as long as the slowest odometer took to trust its wheels.
const AGAIN_S: f64 = 20.0;
/// The width of an interval is normal up to this times the median of normal running.
const NORMAL_WIDTH: f64 = 1.5;
/// Both roll again when they have for so long (s).
const COHERENT_S: f64 = 3.0;
/// Shorter slips of both do not count for the time until the width is normal again (s).
const BOTH_FOR_S: f64 = 1.0;

/// What the train and its wheels do in truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WheelPhase {
    /// Both wheelsets roll, and have for a while.
    Rolling,
    /// One slips, slides or is locked.
    OneSlips,
    /// Both do.
    BothSlip,
    /// Both roll, and one slipped shortly before.
    RollingAgain,
    /// The train is at rest.
    Standing,
}

impl WheelPhase {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 5] =
        [Self::Rolling, Self::OneSlips, Self::BothSlip, Self::RollingAgain, Self::Standing];

    /// Its name in files.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::Rolling => "rolling",
            Self::OneSlips => "one_slips",
            Self::BothSlip => "both_slip",
            Self::RollingAgain => "rolling_again",
            Self::Standing => "standing",
        }
    }

    /// Its name in tables.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::Rolling => "rolling",
            Self::OneSlips => "one slips",
            Self::BothSlip => "both slip",
            Self::RollingAgain => "rolling again",
            Self::Standing => "standing",
        }
    }
}

/// An odometer on a world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WorldOdometer {
    /// The preset that is recommended.
    Recommended,
    /// The published algorithm.
    Paper,
    /// The mean of both counts.
    RawMean,
    /// The larger count.
    RawMax,
    /// One that knows which wheelset slips, and which sensor is wrong, and when.
    Oracle,
    /// One that knows the truth but while both slip, and then the mean acceleration, in hindsight.
    Hindsight,
}

impl WorldOdometer {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 6] =
        [Self::Recommended, Self::Paper, Self::RawMean, Self::RawMax, Self::Oracle, Self::Hindsight];

    /// Its name in files.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::Recommended => "recommended",
            Self::Paper => "paper",
            Self::RawMean => "raw_mean",
            Self::RawMax => "raw_max",
            Self::Oracle => "oracle",
            Self::Hindsight => "hindsight",
        }
    }
}

/// Scores of every odometer in every phase, on one world or on many.
#[derive(Debug, Clone, Default)]
pub struct WorldScores {
    phases: [[Scorer; 6]; 5],
    whole: [Scorer; 6],
    /// Widths of the intervals of the recommended preset in normal running (m/s): of the stated confidence, and guaranteed.
    widths: [Vec<f32>; 2],
    normal_after_s: Vec<f32>,
    left_distance: u64,
    runs: u64,
    worst: Option<WorstMoment>,
}

impl WorldScores {
    /// Runs every odometer on a simulated run.
    ///
    /// # Errors
    /// The first value of the vehicle that no railway has.
    pub fn of(run: &LineRun) -> Result<Self, VehicleError> {
        let vehicle = simulated_vehicle(&run.vehicle)?.vehicle;
        let mut counter = DistanceCounter::new(&vehicle);
        let mut ours = Odometer::new(vehicle, Preset::Recommended.settings())?;
        let mut paper = Odometer::new(vehicle, Preset::Paper.settings())?;
        let mut rivals = [Rival::RawMean, Rival::RawMax].map(|rival| RivalOdometer::new(rival, &vehicle));
        let mut oracle = Oracle::new(counter.pitches());
        let mut phases = PhaseWatch::default();
        let mut scores = Self { runs: 1, ..Self::default() };
        let mut seen = Vec::with_capacity(run.samples.len());
        let mut events = run.events.iter().peekable();
        let mut is_faulty = false;
        let mut worst = WorstWatch::default();
        let mut distance = Length::ZERO;
        for ((((period, known), sample), truth), in_hindsight) in
            simulated_rows(run).zip(&run.samples).zip(&run.truth).zip(hindsight(run))
        {
            while let Some(event) = events.next_if(|event| event.time <= period.time) {
                match event.what {
                    LineEventKind::FaultBegins => is_faulty = true,
                    LineEventKind::FaultEnds => is_faulty = false,
                    _ => {}
                }
            }
            let phase = phases.see(period.time, truth);
            let estimate = ours.step(&period);
            let counted = counter.count(&period);
            let moved = truth.distance - distance;
            distance = truth.distance;
            let [first, second] = truth.wheels.map(|does| does == WheelTruth::Rolling);
            let claims = [
                claim(&estimate),
                claim(&paper.step(&period)),
                rivals[0].step(&counted),
                rivals[1].step(&counted),
                oracle.step(&counted, [first, second && !is_faulty], moved),
                Claim::plain(Speed::from_m_per_s(in_hindsight), truth.distance),
            ];
            let of_speed = Truth { distance: None, ..known };
            for ((claim, whole), in_phase) in
                claims.iter().zip(&mut scores.whole).zip(&mut scores.phases[phase as usize])
            {
                whole.see(claim, &known);
                in_phase.see(claim, &of_speed);
            }
            let faulty_count = sample.wheels[1].pulses.filter(|_| is_faulty);
            worst.see(&estimate, truth, phase, period.effort, faulty_count);
            let width = |bounds: [f64; 2]| (bounds[1] - bounds[0]) as f32;
            let likely = estimate.confidence;
            let sure = estimate.guaranteed;
            let width_of = width([likely.speed_low.as_m_per_s(), likely.speed_high.as_m_per_s()]);
            if phase == WheelPhase::Rolling {
                let [of_likely, of_sure] = &mut scores.widths;
                of_likely.push(width_of);
                of_sure.push(width([sure.speed_low.as_m_per_s(), sure.speed_high.as_m_per_s()]));
            }
            seen.push(Moment { time: period.time, phase, width: width_of });
        }
        let inside = scores.whole[0].score().distance_inside_pct;
        scores.left_distance = u64::from(inside.is_some_and(|pct| pct < 100.0));
        scores.worst = worst.worst;
        scores.normal_after_s = back_to_normal(&seen, median(&scores.widths[0]));
        Ok(scores)
    }

    /// Adds the scores of another world.
    pub fn merge(&mut self, other: &Self) {
        for (mine, others) in self.phases.iter_mut().zip(&other.phases) {
            mine.iter_mut().zip(others).for_each(|(mine, other)| mine.merge(other));
        }
        self.whole.iter_mut().zip(&other.whole).for_each(|(mine, other)| mine.merge(other));
        self.widths.iter_mut().zip(&other.widths).for_each(|(mine, other)| mine.extend(other));
        self.normal_after_s.extend(&other.normal_after_s);
        self.left_distance += other.left_distance;
        self.runs += other.runs;
        if other
            .worst
            .is_some_and(|worst| self.worst.is_none_or(|mine| worst.error_m_s.abs() > mine.error_m_s.abs()))
        {
            self.worst = other.worst;
        }
    }

    /// The score of an odometer in a phase; distances are not scored by phase.
    #[must_use]
    pub fn in_phase(&self, phase: WheelPhase, odometer: WorldOdometer) -> OdometryScore {
        self.phases[phase as usize][odometer as usize].score()
    }

    /// The score of an odometer over all phases.
    #[must_use]
    pub fn whole(&self, odometer: WorldOdometer) -> OdometryScore {
        self.whole[odometer as usize].score()
    }

    /// Number of worlds, and of those in which the distance left its guaranteed interval.
    #[must_use]
    pub fn runs_and_left(&self) -> [u64; 2] {
        [self.runs, self.left_distance]
    }

    /// Median widths of the speed intervals in normal running (m/s): of the stated confidence, and guaranteed.
    #[must_use]
    pub fn normal_widths(&self) -> [Option<f64>; 2] {
        [median(&self.widths[0]), median(&self.widths[1])]
    }

    /// Time from the end of a slip of both until the width is normal: the median (s), and the share (%) of times no longer than
    /// `within`. A time that the run does not show counts as longer.
    #[must_use]
    pub fn normal_again(&self, within: TimeSpan) -> Option<[f64; 2]> {
        let soon = self.normal_after_s.iter().filter(|after| f64::from(**after) <= within.as_s()).count();
        Some([median(&self.normal_after_s)?, 100.0 * soon as f64 / self.normal_after_s.len() as f64])
    }

    /// The largest speed error of the recommended preset.
    #[must_use]
    pub const fn worst(&self) -> Option<WorstMoment> {
        self.worst
    }
}

/// Tells phases apart.
#[derive(Debug, Default)]
struct PhaseWatch {
    slipped: Option<Timestamp>,
}

impl PhaseWatch {
    fn see(&mut self, time: Timestamp, truth: &LineTruth) -> WheelPhase {
        let slipping = truth.wheels.iter().filter(|does| **does != WheelTruth::Rolling).count();
        if slipping > 0 {
            self.slipped = Some(time);
        }
        let again = self.slipped.is_some_and(|slipped| (time - slipped).as_s() < AGAIN_S);
        match slipping {
            0 if truth.speed.as_m_per_s() == 0.0 => WheelPhase::Standing,
            0 if again => WheelPhase::RollingAgain,
            0 => WheelPhase::Rolling,
            1 => WheelPhase::OneSlips,
            _ => WheelPhase::BothSlip,
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Moment {
    time: Timestamp,
    phase: WheelPhase,
    width: f32,
}

/// Time from each slip of both until the width is normal; infinite if the next slip or the end of the run comes first. Only where both
/// rolled for [`COHERENT_S`] then: a wheel that touches the train's speed between two slides does not roll again, nor does one that
/// was locked until the train stood.
fn back_to_normal(seen: &[Moment], normal: Option<f64>) -> Vec<f32> {
    let Some(normal) = normal else { return Vec::new() };
    let (mut both_since, mut rolls_since) = (None, None::<Timestamp>);
    let mut normal_after = f32::INFINITY;
    let mut found = Vec::new();
    for moment in seen {
        let rolls = matches!(moment.phase, WheelPhase::Rolling | WheelPhase::RollingAgain);
        if !rolls && let Some(since) = rolls_since.take() {
            if (moment.time - since).as_s() >= COHERENT_S {
                found.push(normal_after);
            }
            normal_after = f32::INFINITY;
        }
        match moment.phase {
            WheelPhase::BothSlip => {
                both_since.get_or_insert(moment.time);
            }
            // Time counts from when both roll.
            WheelPhase::OneSlips => {}
            WheelPhase::Standing => both_since = None,
            WheelPhase::Rolling | WheelPhase::RollingAgain => {
                if let Some(since) = both_since.take()
                    && (moment.time - since).as_s() >= BOTH_FOR_S
                {
                    rolls_since = Some(moment.time);
                }
                if let Some(since) = rolls_since
                    && normal_after.is_infinite()
                    && f64::from(moment.width) <= NORMAL_WIDTH * normal
                {
                    normal_after = (moment.time - since).as_s() as f32;
                }
            }
        }
    }
    if let (Some(since), Some(last)) = (rolls_since, seen.last())
        && (last.time - since).as_s() >= COHERENT_S
    {
        found.push(normal_after);
    }
    found
}

fn median(values: &[f32]) -> Option<f64> {
    let mut values = values.to_vec();
    values.sort_unstable_by(f32::total_cmp);
    values.get(values.len() / 2).map(|middle| f64::from(*middle))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(phases: &[(WheelPhase, f32, usize)]) -> Vec<Moment> {
        let each =
            phases.iter().flat_map(|&(phase, width, times)| std::iter::repeat_n((phase, width), times));
        let at = |(row, (phase, width)): (usize, (WheelPhase, f32))| Moment {
            time: Timestamp::ZERO + TimeSpan::from_ms(100 * row as i64),
            phase,
            width,
        };
        each.enumerate().map(at).collect()
    }

    #[test]
    fn the_time_until_the_interval_is_normal_begins_when_both_roll() {
        use WheelPhase::{BothSlip, OneSlips, Rolling, RollingAgain, Standing};
        let seen = moments(&[
            (Rolling, 0.5, 10),
            (BothSlip, 3.0, 20),
            (OneSlips, 3.0, 10),
            (RollingAgain, 2.0, 15),
            (RollingAgain, 0.7, 50),
            // Too short to count.
            (BothSlip, 3.0, 5),
            (RollingAgain, 2.0, 40),
            // They do not roll again but touch the train's speed, and then they stand.
            (BothSlip, 3.0, 15),
            (RollingAgain, 0.5, 20),
            (BothSlip, 3.0, 15),
            (Standing, 0.5, 50),
            (Rolling, 0.5, 50),
            // It stays wide.
            (BothSlip, 3.0, 15),
            (RollingAgain, 2.0, 40),
        ]);
        assert_eq!(back_to_normal(&seen, Some(0.5)), [1.5, f32::INFINITY]);
    }
}
