//! Plans an arrival at a place at a time: the step to stop from, and the motion until then.
//!
//! Letters: `D` distance to the target, `T` time until the train shall be at rest there, `k` the step to stop from,
//! with stopping distance `d` and stopping time `t`, `s` the time of steady running at that step before the stop.
//! From its present state, the train is brought over `D − d − v s` in `T − t − s` to the speed `v` of the step: with
//! minimum jerk if all its speeds can be held, otherwise by two changes of speed with a steady run between them. If
//! zones limit both, it runs at one speed outside the zones and at their limits within.

use alloc::vec::Vec;

use crate::control::drive::driven_train::DrivenTrain;
use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::kinematics::{MinimumJerk, Motion, SpeedLaw, Transit};
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::{PathPoint, TrackContext};
use crate::units::{Length, Speed};

use super::zoned_transit::{SlowPart, ZonedTransit};

/// Steady running before the stop: the model's uncertainty of a stop holds for a settled speed.
pub(super) const STEADY: TimeSpan = TimeSpan::from_ms(2000);
/// A change of speed takes this part of the time, ...
const CHANGE_PART: f64 = 0.3;
/// ... but at least as long as a change by several steps, and at most as long as still looks smooth (s).
const CHANGE: [f64; 2] = [2.0, 6.0];
/// Part of the speed range kept as a reserve at either end, for corrections.
const RESERVE: f64 = 0.03;
/// The ratio of successive times in a search for the earliest or latest.
const TIME_FACTOR: f64 = 1.01;
/// A train slows down this far (m) before a zone: 2.3 standard deviations of 10 mm of its position, and the distance
/// run while a command waits for 66 ms.
const ENTRY_MARGIN: f64 = 0.05;
/// It accelerates this far (m) behind a zone, after this delay (s): the poll on the line, and the decoder.
const EXIT_MARGIN: f64 = 0.025;
const EXIT_DELAY: f64 = 0.3;
/// Lowest speed planned for a running train: slower wheels stall on dirt.
pub(super) const CREEP_SPEED: Speed = Speed::from_mm_per_s(60.0);
/// Shortest change of speed (s).
const MIN_CHANGE: f64 = 0.1;
/// Points at which the acceleration of a motion is checked.
const SAMPLES: u32 = 12;
/// Longest plan (s).
const MAX_DURATION: f64 = 900.0;

/// Where a plan starts: time (s from now), distance before the target (m) and speed (m/s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Beginning {
    pub(super) after: f64,
    pub(super) left: f64,
    pub(super) speed: f64,
}

/// A step to stop from, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FinalStep {
    pub(super) step: SpeedStep,
    speed: f64,
    stop_distance: f64,
    stop_time: f64,
}

/// The motion until the stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Profile {
    MinimumJerk(MinimumJerk),
    Transit(Transit),
    Zoned(ZonedTransit),
}

impl Profile {
    pub(super) const fn motion(&self) -> &dyn Motion {
        match self {
            Self::MinimumJerk(motion) => motion,
            Self::Transit(motion) => motion,
            Self::Zoned(motion) => motion,
        }
    }
}

/// A planned arrival.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ArrivalPlan {
    pub(super) begins: Beginning,
    pub(super) profile: Profile,
    pub(super) last: FinalStep,
}

/// How a train shall run until its stop, for comparison with how it runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArrivalProfile {
    plan: ArrivalPlan,
    begins: Timestamp,
}

impl ArrivalProfile {
    pub(super) const fn new(plan: ArrivalPlan, begins: Timestamp) -> Self {
        Self { plan, begins }
    }

    /// When the train follows it; before, the train starts.
    pub const fn begins(&self) -> Timestamp {
        self.begins
    }

    /// When the train runs steadily at the step that it will stop from.
    pub fn ends(&self) -> Timestamp {
        self.begins + self.plan.profile.motion().duration()
    }

    /// The step that it will stop from.
    pub const fn last_step(&self) -> SpeedStep {
        self.plan.last.step
    }

    /// Whether it is the motion with minimum jerk; otherwise it keeps a speed between two changes.
    pub const fn has_least_jerk(&self) -> bool {
        matches!(self.plan.profile, Profile::MinimumJerk(_))
    }

    /// The planned distance before the target at a time, in the train's path length, and the planned speed.
    pub fn at(&self, time: Timestamp) -> (Length, Speed) {
        let state = self.plan.profile.motion().state_at(time - self.begins);
        (Length::from_m(self.plan.begins.left) - state.distance, state.speed)
    }
}

/// What an arrival can be planned with: the range of speeds (m/s), and the steps to stop from.
#[derive(Debug, Clone)]
pub(super) struct ArrivalOptions {
    pub(super) speeds: [f64; 2],
    /// Accelerations up and down (m/s²).
    pub(super) rates: [f64; 2],
    pub(super) last: Vec<FinalStep>,
    /// Slower steps with less precise stops, for zones that reach to the target.
    pub(super) slower: Vec<FinalStep>,
    /// Speed limits of zones, by distance before the target (m).
    pub(super) slow: Vec<SlowPart>,
}

impl ArrivalOptions {
    /// The plan that is at rest at the target after a time (s from now).
    pub(super) fn plan(&self, begins: Beginning, within: f64) -> Option<ArrivalPlan> {
        // The plan with the smallest change of speed is the smoothest.
        let change = |plan: &ArrivalPlan| {
            let mean = plan.profile.motion().distance() / plan.profile.motion().duration();
            (mean.as_m_per_s() - plan.last.speed).abs()
        };
        let smoothest = |last: &[FinalStep]| {
            let plans = last.iter().filter_map(|last| self.plan_from(begins, within, *last));
            plans.min_by(|one, other| change(one).total_cmp(&change(other)))
        };
        smoothest(&self.last).or_else(|| smoothest(&self.slower))
    }

    fn plan_from(&self, begins: Beginning, within: f64, last: FinalStep) -> Option<ArrivalPlan> {
        let distance = begins.left - last.stop_distance - last.speed * STEADY.as_s();
        let time = within - begins.after - last.stop_time - STEADY.as_s();
        if distance <= 0.0 || time <= 0.0 {
            return None;
        }
        let [slowest, fastest] = [self.speeds[0].min(begins.speed), self.speeds[1].max(begins.speed)];
        let slow: Vec<SlowPart> = self.slow.iter().map(|part| part.before(begins.left)).collect();
        // The train stops from its last step, and runs at it before: no zone there may limit it.
        if slow.iter().any(|part| part.to > distance && part.from < begins.left && part.speed < last.speed) {
            return None;
        }
        let can_be_held = |speed: Speed| (slowest..=fastest).contains(&speed.as_m_per_s());
        let (length, span) = (Length::from_m(distance), TimeSpan::from_s(time));
        let [from, to] = [begins.speed, last.speed].map(Speed::from_m_per_s);
        let smooth = MinimumJerk::new(length, from, to, span);
        let is_slow_enough = |motion: &dyn Motion| slow.iter().all(|part| part.allows(motion));
        let can_be_followed = |motion: &dyn Motion| is_slow_enough(motion) && self.can_be_followed(motion);
        if smooth.speeds().into_iter().all(can_be_held) && can_be_followed(&smooth) {
            return Some(ArrivalPlan { begins, profile: Profile::MinimumJerk(smooth), last });
        }
        let change = (CHANGE_PART * time).clamp(CHANGE[0], CHANGE[1]).min(0.5 * time);
        let law = SpeedLaw::Smooth;
        let kept = Transit::new(length, [from, to], span, law, TimeSpan::from_s(change));
        let kept = kept.filter(|kept| can_be_held(kept.kept()) && can_be_followed(kept));
        let profile = kept.map(Profile::Transit).or_else(|| {
            let ends = [begins.speed, last.speed];
            let speeds = [slowest, fastest];
            let zoned = (!slow.is_empty()).then(|| ZonedTransit::new(distance, ends, time, speeds, &slow));
            zoned.flatten().map(Profile::Zoned)
        })?;
        Some(ArrivalPlan { begins, profile, last })
    }

    /// Whether the train can accelerate and decelerate as a motion does.
    fn can_be_followed(&self, motion: &dyn Motion) -> bool {
        let interval = motion.duration().as_s() / f64::from(SAMPLES);
        let speed =
            |sample: u32| motion.state_at(TimeSpan::from_s(interval * f64::from(sample))).speed.as_m_per_s();
        let [up, down] = self.rates.map(|rate| rate * interval);
        (0..SAMPLES).all(|sample| (-down..=up).contains(&(speed(sample + 1) - speed(sample))))
    }

    /// The shortest time (s) with a plan; `None` if there is none.
    pub(super) fn shortest_time(&self, begins: impl Fn(f64) -> Option<Beginning>) -> Option<f64> {
        times(1.0).find(|within| begins(*within).and_then(|begins| self.plan(begins, *within)).is_some())
    }

    /// The longest time (s) with a plan, from a time that has one.
    pub(super) fn longest_time(&self, from: f64, begins: impl Fn(f64) -> Option<Beginning>) -> f64 {
        let fits = |within: f64| begins(within).and_then(|begins| self.plan(begins, within)).is_some();
        times(from).take_while(|within| fits(*within)).last().unwrap_or(from)
    }
}

fn times(from: f64) -> impl Iterator<Item = f64> {
    core::iter::successors(Some(from), |within| Some(within * TIME_FACTOR))
        .take_while(|within| *within < MAX_DURATION)
}

impl DrivenTrain {
    /// What an arrival of this train can be planned with.
    pub(super) fn options(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        at: PathPoint,
        usable: &[SpeedStep],
        slowest: Speed,
    ) -> ArrivalOptions {
        let speed = |step: &SpeedStep| self.model.steady_speed(*step, Approach::Below).as_m_per_s();
        let ends = [usable.first(), usable.last()].map(|step| step.map_or(0.0, speed));
        let rest_times = self.model.standing_times();
        let stop_from = |step: SpeedStep| {
            let stop = self.model.stop(step, Approach::Below);
            FinalStep {
                step,
                speed: speed(&step),
                stop_distance: stop.distance.as_m(),
                stop_time: rest_times.after(speed(&step)),
            }
        };
        let last: Vec<FinalStep> = self.precise_steps(usable).into_iter().map(stop_from).collect();
        let slow = self.slow_parts(context, now, at);
        let least = last.iter().map(|last| last.speed).fold(f64::INFINITY, f64::min);
        let is_slower =
            |step: &SpeedStep| !slow.is_empty() && (CREEP_SPEED.as_m_per_s()..least).contains(&speed(step));
        let slower = usable.iter().copied().filter(is_slower).map(stop_from).collect();
        // A zone slower than the usual minimum lowers it.
        let slowest = slow.iter().map(|part| part.speed).fold(slowest.as_m_per_s(), f64::min);
        let [low, high] = ends;
        // From the slowest step to the fastest, and back, lags included.
        let (first, top) = (usable.first(), usable.last());
        let rate = |from: Option<&SpeedStep>, to: Option<&SpeedStep>| {
            let takes = from.zip(to).map_or(0.0, |(from, to)| self.model.settles_within(*from, *to).as_s());
            (high - low) / takes.max(MIN_CHANGE)
        };
        let rates = [rate(first, top), rate(top, first)];
        let speeds = [(low * (1.0 + RESERVE)).max(slowest), high * (1.0 - RESERVE)];
        ArrivalOptions { speeds, rates, last, slower, slow }
    }

    /// The zones on the path to a target, with the speed of the fastest step within each limit, by distance before
    /// the target (m).
    fn slow_parts(&self, context: TrackContext<'_>, now: Timestamp, at: PathPoint) -> Vec<SlowPart> {
        let restricted = self.restricted_until(context, now, at);
        let [ahead, behind] = self.reach.map(Length::as_m);
        let parts = restricted.into_iter().map(|(stretch, step)| {
            let speed = self.model.steady_speed(step, Approach::Below).as_m_per_s();
            SlowPart {
                from: at.distance.as_m() - (stretch.from - ahead - ENTRY_MARGIN),
                to: at.distance.as_m() - (stretch.to + behind + EXIT_MARGIN + speed * EXIT_DELAY),
                speed: speed * (1.0 - RESERVE),
            }
        });
        parts.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options() -> ArrivalOptions {
        let step = SpeedStep::new(6).expect("a step");
        let last = FinalStep { step, speed: 0.25, stop_distance: 0.15, stop_time: 1.2 };
        ArrivalOptions {
            speeds: [0.05, 0.5],
            rates: [0.15, 0.15],
            last: alloc::vec![last],
            slower: Vec::new(),
            slow: Vec::new(),
        }
    }

    #[test]
    fn a_plan_ends_where_the_stop_begins() {
        let begins = Beginning { after: 0.5, left: 4.0, speed: 0.2 };
        let plan = options().plan(begins, 15.0).expect("0.28 m/s on the distance");
        let end = plan.profile.motion().state_at(plan.profile.motion().duration());
        // 4 m less the stop and two seconds of 0.25 m/s; 15 s less 0.5, 1.2 and 2.
        assert!((end.distance.as_m() - (4.0 - 0.15 - 0.5)).abs() < 1e-9);
        assert!((plan.profile.motion().duration().as_s() - 11.3).abs() < 1e-9);
        assert!((end.speed.as_m_per_s() - 0.25).abs() < 1e-9);
    }

    #[test]
    fn a_zone_on_the_path_delays_the_earliest_arrival() {
        let begins = |_: f64| Some(Beginning { after: 0.0, left: 4.0, speed: 0.2 });
        // From 2.5 m to 1.5 m before the target.
        let slow = SlowPart { from: 2.5, to: 1.5, speed: 0.15 };
        let (free, zoned) = (options(), ArrivalOptions { slow: alloc::vec![slow], ..options() });
        let [before, soonest] =
            [&free, &zoned].map(|options| options.shortest_time(begins).expect("some time"));
        // One metre takes 6.7 s at 150 mm/s and 2 s at 500 mm/s; two more changes of speed add to that.
        assert!(soonest > before + 3.0 && soonest < before + 8.0, "{soonest} after {before}");
        let plan = zoned.plan(begins(0.0).expect("a state"), 1.1 * soonest).expect("time enough");
        let motion = plan.profile.motion();
        for tenth in 0..(10.0 * motion.duration().as_s()) as u32 {
            let state = motion.state_at(TimeSpan::from_s(0.1 * f64::from(tenth)));
            let left = 4.0 - state.distance.as_m();
            assert!(!(1.51..2.49).contains(&left) || state.speed.as_m_per_s() < 0.151, "{state:?}");
        }
        // A stop from 250 mm/s is not planned where the limit is 150 mm/s.
        let at_the_end =
            ArrivalOptions { slow: alloc::vec![SlowPart { from: 0.3, to: -1.0, speed: 0.15 }], ..options() };
        assert!(at_the_end.shortest_time(begins).is_none());
        // A slower step stops less precisely, but within the limit.
        let creeping = FinalStep { speed: 0.12, stop_distance: 0.05, stop_time: 0.8, ..at_the_end.last[0] };
        let with_slower_step = ArrivalOptions { slower: alloc::vec![creeping], ..at_the_end };
        let soonest = with_slower_step.shortest_time(begins).expect("some time");
        assert_eq!(
            with_slower_step.plan(begins(0.0).expect("a state"), soonest).map(|plan| plan.last),
            Some(creeping)
        );
    }

    #[test]
    fn no_plan_changes_speed_faster_than_the_train_can() {
        // A short distance: with unlimited acceleration the last step would be reached at once.
        let begins = Beginning { after: 3.0, left: 1.1, speed: 0.12 };
        let sluggish = ArrivalOptions { rates: [0.08, 0.08], ..options() };
        let brisk = ArrivalOptions { rates: [10.0, 10.0], ..options() };
        let [earlier, later] = [brisk, sluggish.clone()]
            .map(|options| options.shortest_time(|_| Some(begins)).expect("some time"));
        assert!(later > earlier + 0.4, "{later} after {earlier}");
        let plan = sluggish.plan(begins, later).expect("a plan");
        let motion = plan.profile.motion();
        let speed = |tenth: u32| motion.state_at(TimeSpan::from_s(0.1 * f64::from(tenth))).speed.as_m_per_s();
        let tenths = (10.0 * motion.duration().as_s()) as u32;
        assert!((1..tenths).all(|tenth| (speed(tenth) - speed(tenth - 1)).abs() < 0.1 * 0.1));
    }

    #[test]
    fn impossible_times_are_rejected_and_the_possible_range_is_known() {
        let begins = |_: f64| Some(Beginning { after: 0.0, left: 4.0, speed: 0.2 });
        let (options, now) = (options(), begins(0.0).expect("a state"));
        assert!(options.plan(now, 8.0).is_none(), "4 m in 8 s are 0.5 m/s from end to end");
        let soonest = options.shortest_time(begins).expect("some time");
        assert!(soonest > 9.0 && soonest < 14.0, "{soonest}");
        assert!(options.plan(now, soonest).is_some() && options.plan(now, soonest * 0.98).is_none());
        let latest = options.longest_time(soonest, begins);
        // At 0.05 m/s nearly all the distance takes 70 s.
        assert!(latest > 30.0 && latest < 75.0, "{latest}");
        assert!(options.plan(now, latest * 1.03).is_none());
    }
}
