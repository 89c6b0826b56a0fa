//! The active alarms of a session: one for each cause, until the cause is resolved or the operator ends it.
//!
//! An alarm is state, not news: a lesser alarm of the same cause never replaces it, and time alone resolves it only if
//! what it reports would have happened again.

use std::collections::BTreeMap;

use footplate_core::control::Driver;
use footplate_core::{SensorId, TimeSpan, Timestamp, TrainId};
use serde::Serialize;

use super::alarm::{Alarm, Cause, Grade, Resolution};

/// The driver answers an alarm with commands: its state is judged from this time on.
const SETTLING_TIME: TimeSpan = TimeSpan::from_ms(1_000);
/// A fault that has not recurred for this time is over: several polls of every sensor, and a round of most layouts.
const QUIET_TIME: TimeSpan = TimeSpan::from_s(60.0);
/// The most active alarms; beyond it, the oldest of the least grade is dropped.
const MAX_ALARMS: usize = 64;

/// An alarm whose cause is not resolved.
#[derive(Debug, Clone, Serialize)]
pub(super) struct ActiveAlarm {
    /// Consecutive in a session.
    pub(super) id: u64,
    /// When it began, in seconds since the session began.
    since_s: f64,
    /// How often it was raised.
    count: u32,
    #[serde(flatten)]
    pub(super) alarm: Alarm,
    #[serde(skip)]
    cause: Cause,
    /// When it was raised last.
    #[serde(skip)]
    raised: Timestamp,
}

/// The active alarms, in the order in which they began.
#[derive(Debug, Default)]
pub(super) struct AlarmList {
    active: Vec<ActiveAlarm>,
    next: u64,
    /// The last detection of each train, and by each sensor.
    detected: BTreeMap<TrainId, Timestamp>,
    reported: BTreeMap<SensorId, Timestamp>,
}

impl AlarmList {
    /// Adds an alarm, `t_s` seconds after the session began; returns its number. An alarm of the same cause keeps its
    /// number, and its text if that is more severe.
    pub(super) fn raise(&mut self, now: Timestamp, t_s: f64, alarm: &Alarm) -> u64 {
        let cause = alarm.cause();
        if let Some(active) = self.active.iter_mut().find(|active| active.cause == cause) {
            active.count += 1;
            active.raised = now;
            if alarm.severity() >= active.alarm.severity() {
                active.alarm = alarm.clone();
            }
            return active.id;
        }
        let id = self.next;
        self.next += 1;
        self.active.push(ActiveAlarm {
            id,
            since_s: t_s,
            count: 1,
            alarm: alarm.clone(),
            cause,
            raised: now,
        });
        if self.active.len() > MAX_ALARMS
            && let Some(least) = self.active.iter().map(|active| active.alarm.severity()).min()
            && let Some(place) = self.active.iter().position(|active| active.alarm.severity() == least)
        {
            self.active.remove(place);
        }
        id
    }

    /// Removes the alarms that a message of the kind `over` resolves; returns how many.
    pub(super) fn resolve(&mut self, over: &Alarm) -> usize {
        let before = self.active.len();
        self.active.retain(|active| !over.resolves(&active.alarm));
        before - self.active.len()
    }

    /// Removes an alarm for the operator; `None` if it is not active.
    pub(super) fn end(&mut self, id: u64) -> Option<ActiveAlarm> {
        let place = self.active.iter().position(|active| active.id == id)?;
        Some(self.active.remove(place))
    }

    /// Notes a detection of a train.
    pub(super) fn detect(&mut self, train: TrainId, sensor: SensorId, at: Timestamp) {
        self.detected.insert(train, at);
        self.reported.insert(sensor, at);
    }

    /// Removes the alarms whose cause is resolved, and returns them. `is_in_danger` tells whether the watchdog distrusts a train: it
    /// is being recovered, or needs the operator.
    pub(super) fn settle(
        &mut self,
        now: Timestamp,
        driver: &Driver,
        is_in_danger: impl Fn(TrainId) -> bool,
    ) -> Vec<ActiveAlarm> {
        let (detected, reported) = (&self.detected, &self.reported);
        let is_resolved = |active: &mut ActiveAlarm| {
            let ActiveAlarm { alarm, raised, .. } = active;
            let is_located = |train| driver.locate(train, now).is_some();
            let has_settled = now >= *raised + SETTLING_TIME;
            has_settled
                && match (alarm.resolution(), alarm.train) {
                    (Resolution::Located, Some(train)) => is_located(train) && !is_in_danger(train),
                    (Resolution::Runs, Some(train)) => is_located(train) && driver.commanded(train).get() > 0,
                    (Resolution::Detected, Some(train)) => detected.get(&train).is_some_and(|at| at > raised),
                    (Resolution::Reported(sensor), _) => reported.get(&sensor).is_some_and(|at| at > raised),
                    (Resolution::AtRest, Some(train)) => driver.is_at_rest(train, now),
                    (Resolution::Thrown { turnout, curved }, _) => {
                        driver.turnouts().get(turnout).is_some_and(|leg| leg.is_curved() != curved)
                    }
                    (Resolution::Quiet, _) => now >= *raised + QUIET_TIME,
                    _ => false,
                }
        };
        self.active.extract_if(.., is_resolved).collect()
    }

    /// The active alarms, the most severe first, and of the same severity the newest first.
    pub(super) fn ranked(&self) -> Vec<ActiveAlarm> {
        let mut ranked: Vec<ActiveAlarm> = self.active.iter().rev().cloned().collect();
        ranked.sort_by_key(|active| std::cmp::Reverse(active.alarm.severity()));
        ranked
    }

    /// One line for the prompt: the most severe alarm, and how many others there are; `None` without alarms.
    pub(super) fn summary(&self) -> Option<String> {
        let ranked = self.ranked();
        let (first, others) = ranked.split_first()?;
        let mark = if first.alarm.grade == Grade::Danger { "ALARM" } else { "warning" };
        let more = if others.is_empty() { String::new() } else { format!(" (and {} more)", others.len()) };
        Some(format!("{mark}: {}{more}", first.alarm.text()))
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::Length;
    use footplate_core::control::{Notice, Outcome};
    use footplate_core::model::MotionModel;
    use footplate_core::track::{Layout, TurnoutStates};
    use footplate_store::layout_named;

    use super::*;

    const TRAIN: TrainId = TrainId(24);

    fn layout() -> Layout {
        layout_named("track-a").expect("built in").layout
    }

    fn alarm(notice: &Notice) -> Alarm {
        Alarm::of_notice(&layout(), notice).expect("an alarm").said("said")
    }

    fn at(seconds: f64) -> Timestamp {
        Timestamp::from_s(seconds)
    }

    fn whats(list: &AlarmList) -> Vec<&'static str> {
        list.ranked().iter().map(|active| active.alarm.what).collect()
    }

    #[test]
    fn a_lesser_alarm_of_the_same_cause_never_replaces_a_greater_one() {
        let mut list = AlarmList::default();
        let needs = list.raise(at(1.0), 1.0, &alarm(&Notice::NeedsOperator { train: TRAIN, while_it: "x" }));
        let lost = list.raise(at(2.0), 2.0, &alarm(&Notice::Lost { train: TRAIN }));
        list.raise(at(3.0), 3.0, &alarm(&Notice::ReservedAsUnknown { train: TRAIN }));
        assert_eq!((needs, whats(&list)), (lost, vec!["needs-person"]));
        assert_eq!(list.ranked()[0].count, 3);
        // Another train and another cause are alarms of their own; dangers come first.
        list.raise(at(4.0), 4.0, &alarm(&Notice::Unexplained { sensor: SensorId(3), time: at(4.0) }));
        list.raise(at(5.0), 5.0, &alarm(&Notice::Lost { train: TrainId(58) }));
        assert_eq!(whats(&list), ["needs-person", "lost", "unexplained"]);
        assert!(
            list.summary().is_some_and(|line| line == "ALARM: said (and 2 more)"),
            "{:?}",
            list.summary()
        );
    }

    #[test]
    fn a_lost_train_stays_an_alarm_until_it_is_located_and_not_held_by_the_watchdog() {
        let mut driver = Driver::new(layout(), TurnoutStates::default());
        let model = MotionModel::unknown(TRAIN, footplate_core::SpeedStep::new(14).expect("a step"));
        driver.add_train(model);
        let mut list = AlarmList::default();
        list.raise(at(1.0), 1.0, &alarm(&Notice::Lost { train: TRAIN }));
        assert!(list.settle(at(4_000.0), &driver, |_| false).is_empty(), "an hour does not locate a train");
        let node = driver.layout().node_named("C13").expect("a sensor");
        let place = footplate_core::tracking::PathPoint { node, distance: Length::ZERO };
        driver.place(at(4_000.0), TRAIN, place, Length::from_mm(10.0));
        assert!(list.settle(at(4_001.0), &driver, |_| true).is_empty(), "the watchdog still distrusts it");
        assert_eq!(list.settle(at(4_001.0), &driver, |_| false).len(), 1);
        assert!(list.ranked().is_empty());
    }

    #[test]
    fn news_resolve_the_alarms_that_they_are_about_and_no_other() {
        let mut list = AlarmList::default();
        list.raise(at(1.0), 1.0, &alarm(&Notice::Lost { train: TRAIN }));
        list.raise(at(1.0), 1.0, &alarm(&Notice::SensorStuck { sensor: SensorId(3) }));
        list.raise(at(1.0), 1.0, &alarm(&Notice::PowerOff { train: TRAIN }));
        let recovered = Notice::Recovered { train: TRAIN, outcome: Outcome::AsBefore, took: TimeSpan::ZERO };
        assert_eq!(list.resolve(&alarm(&recovered)), 1);
        assert_eq!(list.resolve(&alarm(&Notice::SensorRestored { sensor: SensorId(4) })), 0);
        assert_eq!(list.resolve(&alarm(&Notice::SensorRestored { sensor: SensorId(3) })), 1);
        assert_eq!(whats(&list), ["power-off"]);
        assert_eq!(list.resolve(&alarm(&Notice::PowerOn)), 1);
    }

    #[test]
    fn a_fault_that_may_recur_is_over_once_it_has_not_for_a_while() {
        let driver = Driver::new(layout(), TurnoutStates::default());
        let mut list = AlarmList::default();
        let spurious = alarm(&Notice::Unexplained { sensor: SensorId(3), time: at(0.0) });
        list.raise(at(0.0), 0.0, &spurious);
        list.raise(at(50.0), 50.0, &spurious);
        assert!(list.settle(at(100.0), &driver, |_| false).is_empty());
        assert_eq!(list.settle(at(110.0), &driver, |_| false).len(), 1);
        let id = list.raise(at(120.0), 120.0, &spurious);
        assert!(list.end(id).is_some() && list.end(id).is_none(), "the operator ends it once");
    }
}
