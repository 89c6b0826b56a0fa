//! How a train comes to rest at a place at a time: from which step it stops, and how it runs until then.
//!
//! Letters: `D` the way to the target, `T` the time until it shall stand there, `k` the step from which it stops, whose
//! stopping way `d` and time `t` are known well, `s` the time for which it runs steadily at that step before. From its state
//! now the train is brought to `D − d − v s` in `T − t − s`, so that it is there at the speed `v` of the step: by the motion
//! with minimum jerk if that asks for no speed that it cannot hold, else by two changes of speed and a steady run between
//! them. Where zones on the way allow less than either asks for, it runs at one speed wherever they do not.

use alloc::vec::Vec;

use crate::control::drive::driven_train::DrivenTrain;
use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::kinematics::{MinimumJerk, Motion, SpeedLaw, Transit};
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::{TrackContext, WayPoint};
use crate::units::{Length, Speed};

use super::zoned_transit::{SlowPart, ZonedTransit};

/// A stop is as sure as the model says when it is made from a speed that has settled.
pub(super) const STEADY: TimeSpan = TimeSpan::from_ms(2000);
/// A change of speed on the way takes this part of it, ...
const CHANGE_PART: f64 = 0.3;
/// ... at least as long as a train needs for some steps, and no longer than what anybody would call smooth (s).
const CHANGE: [f64; 2] = [2.0, 6.0];
/// Who runs as fast, or as slowly, as it can has nothing left to catch up with, or to fall back.
const RESERVE: f64 = 0.03;
/// Times that are tried one after the other are longer by this part: nobody cares for less.
const NEXT_TIME: f64 = 1.01;
/// A train is slowed down so much (m) before it comes to a zone: it is believed to be where it is to 10 mm, one standard
/// deviation, of which 2.3 are allowed for, and a command may wait for 66 ms.
const SOONER: f64 = 0.05;
/// It is let go so much (m) behind a zone, and gets faster after so long (s): the poll on the line, and what decoders take.
const SURELY: f64 = 0.025;
const FELT: f64 = 0.3;
/// A running train is not made slower than this: wheels that creep stick on dirt.
pub(super) const CREEPING: Speed = Speed::from_mm_per_s(60.0);
/// No change of speed takes less (s).
const LEAST_CHANGE: f64 = 0.1;
/// A motion is looked at so often when it is asked whether a train can follow it.
const LOOKS: u32 = 12;
/// Nobody plans for longer (s).
const LONGEST: f64 = 900.0;

/// Where a train begins to follow a plan: when (s from now), where (m before the target) and how fast (m/s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Beginning {
    pub(super) after: f64,
    pub(super) left: f64,
    pub(super) speed: f64,
}

/// A step to stop from, in plain numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FinalStep {
    pub(super) step: SpeedStep,
    speed: f64,
    stop_way: f64,
    stop_time: f64,
}

/// The motion on the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Profile {
    LeastJerk(MinimumJerk),
    Kept(Transit),
    Zoned(ZonedTransit),
}

impl Profile {
    pub(super) const fn motion(&self) -> &dyn Motion {
        match self {
            Self::LeastJerk(motion) => motion,
            Self::Kept(motion) => motion,
            Self::Zoned(motion) => motion,
        }
    }
}

/// A plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ArrivalPlan {
    pub(super) begins: Beginning,
    pub(super) profile: Profile,
    pub(super) last: FinalStep,
}

/// How a train that shall be somewhere in time should run until it stops, for whoever compares it with how it runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArrivalProfile {
    plan: ArrivalPlan,
    begins: Timestamp,
}

impl ArrivalProfile {
    pub(super) const fn new(plan: ArrivalPlan, begins: Timestamp) -> Self {
        Self { plan, begins }
    }

    /// From when it is followed; before, the train starts.
    #[must_use]
    pub const fn begins(&self) -> Timestamp {
        self.begins
    }

    /// When the train is steady at the step from which it will stop.
    #[must_use]
    pub fn ends(&self) -> Timestamp {
        self.begins + self.plan.profile.motion().duration()
    }

    /// The step from which it will stop.
    #[must_use]
    pub const fn last_step(&self) -> SpeedStep {
        self.plan.last.step
    }

    /// Whether it is the motion with minimum jerk; otherwise a speed is kept between two changes.
    #[must_use]
    pub const fn has_least_jerk(&self) -> bool {
        matches!(self.plan.profile, Profile::LeastJerk(_))
    }

    /// How far before the target the train should be at a time (in lengths as it feels them), and how fast.
    #[must_use]
    pub fn at(&self, time: Timestamp) -> (Length, Speed) {
        let state = self.plan.profile.motion().state_at(time - self.begins);
        (Length::from_m(self.plan.begins.left) - state.distance, state.speed)
    }
}

/// The speeds that a train can be held at (m/s) and the steps that it may stop from.
#[derive(Debug, Clone)]
pub(super) struct Means {
    pub(super) speeds: [f64; 2],
    /// How fast it gets faster, and slower (m/s²).
    pub(super) rates: [f64; 2],
    pub(super) last: Vec<FinalStep>,
    /// Slower ones, from which it stops less surely: for zones that reach to the target.
    pub(super) slower: Vec<FinalStep>,
    /// Where zones allow less, as m before the target.
    pub(super) slow: Vec<SlowPart>,
}

impl Means {
    /// The plan that stands at the target after a time (s from now).
    pub(super) fn plan(&self, begins: Beginning, within: f64) -> Option<ArrivalPlan> {
        // The least change of speed on the way is the smoothest.
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
        let way = begins.left - last.stop_way - last.speed * STEADY.as_s();
        let time = within - begins.after - last.stop_time - STEADY.as_s();
        if way <= 0.0 || time <= 0.0 {
            return None;
        }
        let [slowest, fastest] = [self.speeds[0].min(begins.speed), self.speeds[1].max(begins.speed)];
        let slow: Vec<SlowPart> = self.slow.iter().map(|part| part.before(begins.left)).collect();
        // It stops from its last step, and runs at that before.
        if slow.iter().any(|part| part.to > way && part.from < begins.left && part.speed < last.speed) {
            return None;
        }
        let is_held = |speed: Speed| (slowest..=fastest).contains(&speed.as_m_per_s());
        let (length, span) = (Length::from_m(way), TimeSpan::from_s(time));
        let [from, to] = [begins.speed, last.speed].map(Speed::from_m_per_s);
        let smooth = MinimumJerk::new(length, from, to, span);
        let is_slow_enough = |motion: &dyn Motion| slow.iter().all(|part| part.allows(motion));
        let is_followed = |motion: &dyn Motion| is_slow_enough(motion) && self.is_followed(motion);
        if smooth.speeds().into_iter().all(is_held) && is_followed(&smooth) {
            return Some(ArrivalPlan { begins, profile: Profile::LeastJerk(smooth), last });
        }
        let change = (CHANGE_PART * time).clamp(CHANGE[0], CHANGE[1]).min(0.5 * time);
        let law = SpeedLaw::Smooth;
        let kept = Transit::new(length, [from, to], span, law, TimeSpan::from_s(change));
        let kept = kept.filter(|kept| is_held(kept.kept()) && is_followed(kept));
        let profile = kept.map(Profile::Kept).or_else(|| {
            let ends = [begins.speed, last.speed];
            let speeds = [slowest, fastest];
            let zoned = (!slow.is_empty()).then(|| ZonedTransit::new(way, ends, time, speeds, &slow));
            zoned.flatten().map(Profile::Zoned)
        })?;
        Some(ArrivalPlan { begins, profile, last })
    }

    /// Whether the train gets faster and slower as fast as a motion does.
    fn is_followed(&self, motion: &dyn Motion) -> bool {
        let look = motion.duration().as_s() / f64::from(LOOKS);
        let speed =
            |looks: u32| motion.state_at(TimeSpan::from_s(look * f64::from(looks))).speed.as_m_per_s();
        let [up, down] = self.rates.map(|rate| rate * look);
        (0..LOOKS).all(|looks| (-down..=up).contains(&(speed(looks + 1) - speed(looks))))
    }

    /// The shortest time (s) for which there is a plan; `None` if there is none at all.
    pub(super) fn soonest(&self, begins: impl Fn(f64) -> Option<Beginning>) -> Option<f64> {
        times(1.0).find(|within| begins(*within).and_then(|begins| self.plan(begins, *within)).is_some())
    }

    /// The longest time (s) for which there is a plan, if there is one for a time.
    pub(super) fn latest(&self, from: f64, begins: impl Fn(f64) -> Option<Beginning>) -> f64 {
        let fits = |within: f64| begins(within).and_then(|begins| self.plan(begins, within)).is_some();
        times(from).take_while(|within| fits(*within)).last().unwrap_or(from)
    }
}

fn times(from: f64) -> impl Iterator<Item = f64> {
    core::iter::successors(Some(from), |within| Some(within * NEXT_TIME))
        .take_while(|within| *within < LONGEST)
}

impl DrivenTrain {
    /// What can be planned with: the steps from which it stops surely, and speeds between its slowest and its fastest.
    pub(super) fn means(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        at: WayPoint,
        usable: &[SpeedStep],
        slowest: Speed,
    ) -> Means {
        let speed = |step: &SpeedStep| self.model.steady_speed(*step, Approach::Below).as_m_per_s();
        let ends = [usable.first(), usable.last()].map(|step| step.map_or(0.0, speed));
        let stands = self.model.standing_times();
        let stop_from = |step: SpeedStep| {
            let stop = self.model.stop(step, Approach::Below);
            FinalStep {
                step,
                speed: speed(&step),
                stop_way: stop.distance.as_m(),
                stop_time: stands.after(speed(&step)),
            }
        };
        let last: Vec<FinalStep> = self.precise_steps(usable).into_iter().map(stop_from).collect();
        let slow = self.slow_parts(context, now, at);
        let least = last.iter().map(|last| last.speed).fold(f64::INFINITY, f64::min);
        let is_slower =
            |step: &SpeedStep| !slow.is_empty() && (CREEPING.as_m_per_s()..least).contains(&speed(step));
        let slower = usable.iter().copied().filter(is_slower).map(stop_from).collect();
        // Nobody runs faster through a zone because that were slow elsewhere.
        let slowest = slow.iter().map(|part| part.speed).fold(slowest.as_m_per_s(), f64::min);
        let [low, high] = ends;
        // From its slowest step to its fastest, and back, lags included.
        let (first, top) = (usable.first(), usable.last());
        let rate = |from: Option<&SpeedStep>, to: Option<&SpeedStep>| {
            let takes = from.zip(to).map_or(0.0, |(from, to)| self.model.settles_within(*from, *to).as_s());
            (high - low) / takes.max(LEAST_CHANGE)
        };
        let rates = [rate(first, top), rate(top, first)];
        let speeds = [(low * (1.0 + RESERVE)).max(slowest), high * (1.0 - RESERVE)];
        Means { speeds, rates, last, slower, slow }
    }

    /// Where zones on the way to a target allow less, and what the step that keeps to them runs at, as m before the target.
    fn slow_parts(&self, context: TrackContext<'_>, now: Timestamp, at: WayPoint) -> Vec<SlowPart> {
        let restricted = self.restricted_until(context, now, at);
        let [ahead, behind] = self.reach.map(Length::as_m);
        let parts = restricted.into_iter().map(|(way, step)| {
            let speed = self.model.steady_speed(step, Approach::Below).as_m_per_s();
            SlowPart {
                from: at.way.as_m() - (way.from - ahead - SOONER),
                to: at.way.as_m() - (way.to + behind + SURELY + speed * FELT),
                speed: speed * (1.0 - RESERVE),
            }
        });
        parts.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn means() -> Means {
        let step = SpeedStep::new(6).expect("a step");
        let last = FinalStep { step, speed: 0.25, stop_way: 0.15, stop_time: 1.2 };
        Means {
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
        let plan = means().plan(begins, 15.0).expect("0.28 m/s on the way");
        let end = plan.profile.motion().state_at(plan.profile.motion().duration());
        // 4 m less the stop and two seconds of 0.25 m/s; 15 s less 0.5, 1.2 and 2.
        assert!((end.distance.as_m() - (4.0 - 0.15 - 0.5)).abs() < 1e-9);
        assert!((plan.profile.motion().duration().as_s() - 11.3).abs() < 1e-9);
        assert!((end.speed.as_m_per_s() - 0.25).abs() < 1e-9);
    }

    #[test]
    fn a_zone_on_the_way_is_planned_for_and_makes_the_soonest_later() {
        let begins = |_: f64| Some(Beginning { after: 0.0, left: 4.0, speed: 0.2 });
        // From 2.5 m before the target to 1.5 m before it.
        let slow = SlowPart { from: 2.5, to: 1.5, speed: 0.15 };
        let (free, zoned) = (means(), Means { slow: alloc::vec![slow], ..means() });
        let [before, soonest] = [&free, &zoned].map(|means| means.soonest(begins).expect("some time"));
        // A metre at 150 mm/s takes 6.7 s, at 500 mm/s 2 s; and there are two changes of speed more.
        assert!(soonest > before + 3.0 && soonest < before + 8.0, "{soonest} after {before}");
        let plan = zoned.plan(begins(0.0).expect("a state"), 1.1 * soonest).expect("time enough");
        let motion = plan.profile.motion();
        for tenth in 0..(10.0 * motion.duration().as_s()) as u32 {
            let state = motion.state_at(TimeSpan::from_s(0.1 * f64::from(tenth)));
            let left = 4.0 - state.distance.as_m();
            assert!(!(1.51..2.49).contains(&left) || state.speed.as_m_per_s() < 0.151, "{state:?}");
        }
        // Nobody stops from 250 mm/s where 150 are allowed.
        let at_the_end =
            Means { slow: alloc::vec![SlowPart { from: 0.3, to: -1.0, speed: 0.15 }], ..means() };
        assert!(at_the_end.soonest(begins).is_none());
        // From a slower step it may be less sure, but it is there.
        let crawls = FinalStep { speed: 0.12, stop_way: 0.05, stop_time: 0.8, ..at_the_end.last[0] };
        let patient = Means { slower: alloc::vec![crawls], ..at_the_end };
        let soonest = patient.soonest(begins).expect("some time");
        assert_eq!(patient.plan(begins(0.0).expect("a state"), soonest).map(|plan| plan.last), Some(crawls));
    }

    #[test]
    fn nobody_is_planned_to_change_speed_faster_than_a_train_does() {
        // A short way: without that it would be at its last step in no time.
        let begins = Beginning { after: 3.0, left: 1.1, speed: 0.12 };
        let sluggish = Means { rates: [0.08, 0.08], ..means() };
        let brisk = Means { rates: [10.0, 10.0], ..means() };
        let [earlier, later] =
            [brisk, sluggish.clone()].map(|means| means.soonest(|_| Some(begins)).expect("some time"));
        assert!(later > earlier + 0.4, "{later} after {earlier}");
        let plan = sluggish.plan(begins, later).expect("a plan");
        let motion = plan.profile.motion();
        let speed = |tenth: u32| motion.state_at(TimeSpan::from_s(0.1 * f64::from(tenth))).speed.as_m_per_s();
        let tenths = (10.0 * motion.duration().as_s()) as u32;
        assert!((1..tenths).all(|tenth| (speed(tenth) - speed(tenth - 1)).abs() < 0.1 * 0.1));
    }

    #[test]
    fn what_cannot_be_is_not_planned_and_the_bounds_of_what_can_are_known() {
        let begins = |_: f64| Some(Beginning { after: 0.0, left: 4.0, speed: 0.2 });
        let (means, now) = (means(), begins(0.0).expect("a state"));
        assert!(means.plan(now, 8.0).is_none(), "4 m in 8 s are 0.5 m/s from end to end");
        let soonest = means.soonest(begins).expect("some time");
        assert!(soonest > 9.0 && soonest < 14.0, "{soonest}");
        assert!(means.plan(now, soonest).is_some() && means.plan(now, soonest * 0.98).is_none());
        let latest = means.latest(soonest, begins);
        // At 0.05 m/s nearly all the way that is 70 s.
        assert!(latest > 30.0 && latest < 75.0, "{latest}");
        assert!(means.plan(now, latest * 1.03).is_none());
    }
}
