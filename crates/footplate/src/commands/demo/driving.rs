//! The second half: a train is driven to places drawn from the seed, and the truth is looked up.

use std::collections::BTreeMap;

use footplate_core::control::{Driver, Finished, Notice, Order, OrderId, PlannedStop, Refusal, StopOrder};
use footplate_core::model::survey::SectionIndex;
use footplate_core::track::{Landmark, Layout};
use footplate_core::tracking::{DueContact, PassedContact, TrackContext};
use footplate_core::{Approach, Length, SpeedStep, TimeSpan, Timestamp, TrainId};

use super::beginning::TourBeginning;
use super::calibrating::{Calibrated, usable};
use super::outcome::{MadeStop, signed};
use super::stage::Stage;
use super::targets::{Dice, steps_to_stop_from, target_ahead};
use crate::commands::drive::NoticeFormatter;
use crate::commands::written_layout::WrittenLayout;
use crate::dashboard::{Alarm, TrainPassed, TrainTask};
use crate::recorded::{Input, Recorded};

/// Targets that may be refused before no more are tried.
const TRIES: usize = 40;
/// After so long on the railway's clock a stop is not coming any more: a lap at a crawl takes less.
const PATIENCE: TimeSpan = TimeSpan::from_ms(180_000);
/// So long after the driver says that a train stands the truth is looked up.
const STANDS: TimeSpan = TimeSpan::from_ms(2_500);

/// A tour of one train.
pub(super) struct Tour<'l> {
    layout: &'l Layout,
    sections: SectionIndex,
    train: TrainId,
    driver: Recorded<Driver>,
    /// What was passed last, for the picture.
    passed: String,
    next: Option<DueContact>,
    planned: Option<PlannedStop>,
}

impl<'l> Tour<'l> {
    pub(super) fn new(
        stage: &mut Stage<'_, '_, '_>,
        on: &'l WrittenLayout,
        train: TrainId,
        known: &Calibrated,
    ) -> anyhow::Result<Self> {
        let layout = &on.layout;
        let beginning = TourBeginning::new(on, known);
        let scribe = stage.begin_machine(TourBeginning::KIND, &beginning)?;
        let driver = Recorded::new(beginning.driver(layout), scribe);
        let sections = SectionIndex::of(layout);
        Ok(Self { layout, sections, train, driver, passed: String::new(), next: None, planned: None })
    }

    /// Makes so many stops.
    pub(super) fn run(
        mut self,
        stage: &mut Stage<'_, '_, '_>,
        known: &Calibrated,
        stops: usize,
        dice: &mut Dice,
    ) -> anyhow::Result<()> {
        let steps = steps_to_stop_from(dice, &usable(&known.fit), stops);
        for step in steps {
            if stage.is_broken() {
                break;
            }
            let Some((order, target)) = self.ask(stage.now(), step, dice) else {
                stage.screen.mishap(self.train, &format!("nowhere to stop from step {step}"))?;
                continue;
            };
            let name = self.layout.display(target).to_string();
            self.planned = None;
            match self.carry_out(stage, order, target, step)? {
                Some(finished) => {
                    let stop = self.truth(stage, target, &name, step, finished);
                    match stop {
                        Some(stop) => stage.stopped(stop)?,
                        None => stage.screen.mishap(self.train, &format!("did not stop at {name}"))?,
                    }
                }
                None => stage.screen.mishap(self.train, &format!("did not stop at {name}"))?,
            }
        }
        self.driver.end(stage.now());
        Ok(())
    }

    fn order(&mut self, now: Timestamp, order: Order) -> Result<OrderId, Refusal> {
        self.driver.ask(now, &Input::Order(order), |driver| driver.order(now, order))
    }

    /// Orders a stop from a step, at a place that is far enough.
    fn ask(&mut self, now: Timestamp, step: SpeedStep, dice: &mut Dice) -> Option<(OrderId, Landmark)> {
        let at = self.driver.machine().locate(self.train, now)?.at;
        let model = self.driver.machine().model(self.train)?;
        // To speed up takes about as long as to stop, and an even run before the stop makes it better.
        let mut least = at.way + model.stop(step, Approach::Below).distance * 2.5;
        for _ in 0..TRIES {
            let context = TrackContext {
                layout: self.layout,
                sections: &self.sections,
                turnouts: self.driver.machine().turnouts(),
            };
            let target = target_ahead(dice, context, at.node, least)?;
            let order = StopOrder { step: Some(step), ..StopOrder::at(self.train, target) };
            match self.order(now, Order::Stop(order)) {
                Ok(id) => return Some((id, target)),
                Err(Refusal::TooNear { beyond, .. }) => {
                    let again = StopOrder { next_round: true, ..order };
                    if let Ok(id) = self.order(now, Order::Stop(again)) {
                        return Some((id, target));
                    }
                    least += beyond * 0.5;
                }
                Err(_) => {}
            }
        }
        None
    }

    /// Drives until the order is carried out.
    fn carry_out(
        &mut self,
        stage: &mut Stage<'_, '_, '_>,
        order: OrderId,
        target: Landmark,
        step: SpeedStep,
    ) -> anyhow::Result<Option<Finished>> {
        let name = self.layout.display(target).to_string();
        let until = stage.now() + PATIENCE;
        let mut finished: Option<Finished> = None;
        stage.works(self.train, "drives", "");
        loop {
            let now = stage.now();
            if let Some(done) = finished
                && now >= done.time + STANDS
            {
                return Ok(Some(done));
            }
            if now > until || stage.is_broken() {
                return Ok(None);
            }
            for notice in stage.go_on(&mut self.driver)? {
                if let (Some(showing), Some(alarm)) =
                    (&mut stage.showing, Alarm::of_notice(self.layout, &notice))
                {
                    let formatter = NoticeFormatter { driver: self.driver.machine(), began: Timestamp::ZERO };
                    showing.alarm(now, &alarm.said(&formatter.line(&notice).unwrap_or_default()));
                }
                match notice {
                    Notice::Done(done) if done.order == order => finished = Some(done),
                    Notice::GivenUp { order: of, why, .. } if of == order => {
                        stage.screen.mishap(self.train, &format!("gave up {name}: {why}"))?;
                        return Ok(None);
                    }
                    Notice::Lost { .. } => {
                        stage.screen.mishap(self.train, "is lost")?;
                        return Ok(None);
                    }
                    Notice::Planned(planned) => self.planned = Some(planned),
                    Notice::Passed { train, passed, next } => {
                        if let Some(showing) = &mut stage.showing {
                            showing.passed(TrainPassed { train, passed, next });
                        }
                        self.pass(passed, next);
                    }
                    Notice::Overshoots { by, .. } => {
                        stage.screen.mishap(
                            self.train,
                            &format!("is too late for {name}: {:.0} mm beyond", by.as_mm()),
                        )?;
                    }
                    Notice::Unexplained { sensor, .. } => {
                        let sensor = self.layout.sensor_name(sensor);
                        stage.screen.mishap(
                            self.train,
                            &format!(
                                "{sensor} reported, but it cannot have passed \
                                                          there"
                            ),
                        )?;
                    }
                    _ => {}
                }
            }
            let now = stage.now();
            if let Some(showing) = &mut stage.showing {
                let promise = self.planned.map(|planned| planned.promise);
                let task = TrainTask {
                    text: format!("stop {} at {name} from step {step}", self.train),
                    target: Some(target),
                    promise: promise.map(|promise| [promise.median, promise.low, promise.high]),
                };
                showing.driver(self.driver.machine(), &BTreeMap::from([(self.train, task)]), now);
            }
            let detail = self.detail(stage.now(), &name, step, finished.is_some());
            stage.shows(self.train, &detail, None);
        }
    }

    fn pass(&mut self, passed: PassedContact, next: Option<DueContact>) {
        let sensor = self.layout.sensor_name(passed.sensor);
        self.passed = match (passed.late, passed.short) {
            (Some([late, _]), Some(short)) => {
                format!("{sensor} {:+.0} ms {} mm", late.as_ms(), signed(short))
            }
            _ => sensor.to_owned(),
        };
        self.next = next;
    }

    fn detail(&self, now: Timestamp, target: &str, step: SpeedStep, stands: bool) -> String {
        let promise = self.planned.map_or_else(String::new, |planned| {
            format!("{} … {} mm", signed(planned.promise.low), signed(planned.promise.high))
        });
        let next = match (&self.next, &self.planned) {
            _ if stands => "stands".to_owned(),
            (_, Some(planned)) if planned.leaves > now && (planned.leaves - now).as_s() < 1.5 => {
                format!("stops in {:.2} s", (planned.leaves - now).as_s())
            }
            (Some(due), _) if due.time > now => {
                format!("{} in {:.1} s", self.layout.sensor_name(due.sensor), (due.time - now).as_s())
            }
            _ => String::new(),
        };
        format!("to {target:<10} from step {step:<3} {promise:<15} {next:<16} {}", self.passed)
    }

    /// Where the train really stands, against the target.
    fn truth(
        &self,
        stage: &Stage<'_, '_, '_>,
        target: Landmark,
        name: &str,
        step: SpeedStep,
        finished: Finished,
    ) -> Option<MadeStop> {
        let sensor = self.layout.sensor_at(target.node)?;
        let past = stage.railway.world().truth().past(self.train, sensor)?;
        let promise = finished.promise?;
        let stood = Landmark { node: target.node, offset: Length::from_mm(past.as_mm().round()) };
        Some(MadeStop {
            train: self.train,
            target: name.to_owned(),
            step,
            rest: self.layout.display(stood).to_string(),
            error: past - target.offset,
            promised: [promise.low, promise.high],
            believed: finished.achieved.and_then(|achieved| achieved.error),
        })
    }
}
