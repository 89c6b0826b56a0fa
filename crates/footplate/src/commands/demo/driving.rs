//! The second half of the demo: drives a train to places drawn from the seed and compares its stops with the truth.

use std::collections::BTreeMap;

use footplate_core::control::{Driver, Finished, Notice, Order, OrderId, PlannedStop, Refusal, StopOrder};
use footplate_core::model::MotionModel;
use footplate_core::model::survey::SectionIndex;
use footplate_core::track::{Landmark, Layout, Leg};
use footplate_core::tracking::{DueSensor, Locator, PassedSensor, TrackContext};
use footplate_core::{Approach, Length, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};
use footplate_eval::seeds::Choice;
use serde::{Deserialize, Serialize};

use super::calibrating::{Calibrated, usable};
use super::outcome::{MadeStop, signed};
use super::running_demo::Demo;
use super::targets::{steps_for_stops, target_ahead};
use crate::commands::drive::NoticeFormatter;
use crate::commands::written_layout::WrittenLayout;
use crate::dashboard::{Alarm, TrainPassed, TrainTask};
use crate::recorded::{Input, Listener, Recorded};

/// Refused targets after which a stop is skipped.
const MAX_REFUSALS: usize = 40;
/// Simulated time after which a stop has failed: a lap at creep speed takes less.
const STOP_TIMEOUT: TimeSpan = TimeSpan::from_ms(180_000);
/// The time from the driver's report of standstill to the reading of the true position.
const SETTLING_TIME: TimeSpan = TimeSpan::from_ms(2_500);

/// The stops of one train.
pub(super) struct Tour<'l> {
    layout: &'l Layout,
    sections: SectionIndex,
    train: TrainId,
    driver: Recorded<Driver>,
    /// The last detection, for display.
    passed: String,
    next: Option<DueSensor>,
    planned: Option<PlannedStop>,
}

impl<'l> Tour<'l> {
    pub(super) fn new(
        demo: &mut Demo<'_, '_, '_>,
        written: &'l WrittenLayout,
        train: TrainId,
        known: &Calibrated,
    ) -> anyhow::Result<Self> {
        let layout = &written.layout;
        let beginning = TourBeginning::new(written, known);
        let scribe = demo.begin_machine(TourBeginning::KIND, &beginning)?;
        let driver = Recorded::new(beginning.driver(layout), scribe);
        let sections = SectionIndex::of(layout);
        Ok(Self { layout, sections, train, driver, passed: String::new(), next: None, planned: None })
    }

    /// Makes one stop from each of `stops` steps.
    pub(super) fn run(
        mut self,
        demo: &mut Demo<'_, '_, '_>,
        known: &Calibrated,
        stops: usize,
        choice: &mut Choice,
    ) -> anyhow::Result<()> {
        let steps = steps_for_stops(choice, &usable(&known.fit), stops);
        for step in steps {
            if demo.is_broken() {
                break;
            }
            let Some((order, target)) = self.ask(demo.now(), step, choice) else {
                demo.screen.fault(self.train, &format!("nowhere to stop from step {step}"))?;
                continue;
            };
            let name = self.layout.display(target).to_string();
            self.planned = None;
            match self.carry_out(demo, order, target, step)? {
                Some(finished) => {
                    let stop = self.truth(demo, target, &name, step, finished);
                    match stop {
                        Some(stop) => demo.stopped(stop)?,
                        None => demo.screen.fault(self.train, &format!("did not stop at {name}"))?,
                    }
                }
                None => demo.screen.fault(self.train, &format!("did not stop at {name}"))?,
            }
        }
        self.driver.end(demo.now());
        Ok(())
    }

    fn order(&mut self, now: Timestamp, order: Order) -> Result<OrderId, Refusal> {
        self.driver.ask(now, &Input::Order(order), |driver| driver.order(now, order))
    }

    /// Orders a stop from a step, at a place far enough ahead.
    fn ask(&mut self, now: Timestamp, step: SpeedStep, choice: &mut Choice) -> Option<(OrderId, Landmark)> {
        let at = self.driver.machine().locate(self.train, now)?.at;
        let model = self.driver.machine().model(self.train)?;
        // Acceleration takes about as long as braking, and a steady run before the stop makes it more accurate: hence
        // 2.5 stopping distances.
        let mut least = at.distance + model.stop(step, Approach::Below).distance * 2.5;
        for _ in 0..MAX_REFUSALS {
            let context = TrackContext {
                layout: self.layout,
                sections: &self.sections,
                turnouts: self.driver.machine().turnouts(),
            };
            let target = target_ahead(choice, context, at.node, least)?;
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

    /// Drives until the train is at rest; `None` if the stop failed.
    fn carry_out(
        &mut self,
        demo: &mut Demo<'_, '_, '_>,
        order: OrderId,
        target: Landmark,
        step: SpeedStep,
    ) -> anyhow::Result<Option<Finished>> {
        let name = self.layout.display(target).to_string();
        let until = demo.now() + STOP_TIMEOUT;
        let mut finished: Option<Finished> = None;
        demo.set_active(self.train, "drives", "");
        loop {
            let now = demo.now();
            if let Some(done) = finished
                && now >= done.time + SETTLING_TIME
            {
                return Ok(Some(done));
            }
            if now > until || demo.is_broken() {
                return Ok(None);
            }
            for notice in demo.advance(&mut self.driver)? {
                if let (Some(dashboard_view), Some(alarm)) =
                    (&mut demo.dashboard_view, Alarm::of_notice(self.layout, &notice))
                {
                    let formatter = NoticeFormatter { driver: self.driver.machine(), began: Timestamp::ZERO };
                    dashboard_view.alarm(now, &alarm.said(&formatter.line(&notice).unwrap_or_default()));
                }
                match notice {
                    Notice::Done(done) if done.order == order => finished = Some(done),
                    Notice::GivenUp { order: of, why, .. } if of == order => {
                        demo.screen.fault(self.train, &format!("gave up {name}: {why}"))?;
                        return Ok(None);
                    }
                    Notice::Lost { .. } => {
                        demo.screen.fault(self.train, "is lost")?;
                        return Ok(None);
                    }
                    Notice::Planned(planned) => self.planned = Some(planned),
                    Notice::Passed { train, passed, next } => {
                        if let Some(dashboard_view) = &mut demo.dashboard_view {
                            dashboard_view.passed(TrainPassed { train, passed, next });
                        }
                        self.pass(passed, next);
                    }
                    Notice::Overshoots { by, .. } => {
                        demo.screen.fault(
                            self.train,
                            &format!("is too late for {name}: {:.0} mm beyond", by.as_mm()),
                        )?;
                    }
                    Notice::Unexplained { sensor, .. } => {
                        let sensor = self.layout.sensor_name(sensor);
                        demo.screen.fault(
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
            let now = demo.now();
            if let Some(dashboard_view) = &mut demo.dashboard_view {
                let promise = self.planned.map(|planned| planned.promise);
                let task = TrainTask {
                    text: format!("stop {} at {name} from step {step}", self.train),
                    target: Some(target),
                    promise: promise.map(|promise| [promise.median, promise.low, promise.high]),
                };
                dashboard_view.driver(self.driver.machine(), &BTreeMap::from([(self.train, task)]), now);
            }
            let detail = self.detail(demo.now(), &name, step, finished.is_some());
            demo.set_detail(self.train, &detail, None);
        }
    }

    fn pass(&mut self, passed: PassedSensor, next: Option<DueSensor>) {
        let sensor = self.layout.sensor_name(passed.sensor);
        self.passed = match (passed.late, passed.short) {
            (Some([late, _]), Some(short)) => {
                format!("{sensor} {:+.0} ms {} mm", late.as_ms(), signed(short))
            }
            _ => sensor.to_owned(),
        };
        self.next = next;
    }

    fn detail(&self, now: Timestamp, target: &str, step: SpeedStep, at_rest: bool) -> String {
        let promise = self.planned.map_or_else(String::new, |planned| {
            format!("{} … {} mm", signed(planned.promise.low), signed(planned.promise.high))
        });
        let next = match (&self.next, &self.planned) {
            _ if at_rest => "at rest".to_owned(),
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

    /// The stop with the true place of rest.
    fn truth(
        &self,
        demo: &Demo<'_, '_, '_>,
        target: Landmark,
        name: &str,
        step: SpeedStep,
        finished: Finished,
    ) -> Option<MadeStop> {
        let sensor = self.layout.sensor_at(target.node)?;
        let past = demo.railway.world().truth().past(self.train, sensor)?;
        let promise = finished.promise?;
        let was_at = Landmark { node: target.node, offset: Length::from_mm(past.as_mm().round()) };
        Some(MadeStop {
            train: self.train,
            target: name.to_owned(),
            step,
            rest: self.layout.display(was_at).to_string(),
            error: past - target.offset,
            promised: [promise.low, promise.high],
            estimated_error: finished.achieved.and_then(|achieved| achieved.error),
        })
    }
}

/// Everything that the driver of a calibrated train is built from.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct TourBeginning {
    /// The text of the layout file.
    pub(crate) layout: String,
    turnouts: Vec<(TurnoutId, Leg)>,
    model: MotionModel,
    /// The located train.
    locator: Locator,
    /// As in the other machines: the demo has only a simulated railway.
    #[serde(default)]
    is_simulated: bool,
}

impl TourBeginning {
    /// The kind of this machine in a store.
    pub(crate) const KIND: &'static str = "tour";

    pub(super) fn new(written: &WrittenLayout, known: &Calibrated) -> Self {
        Self {
            layout: written.text.clone(),
            turnouts: written.legs(&known.turnouts),
            model: known.fit.model().clone(),
            locator: known.locator.clone(),
            is_simulated: true,
        }
    }

    /// Builds the driver; `layout` is the one in the text.
    pub(crate) fn driver(self, layout: &Layout) -> Driver {
        let mut driver = Driver::new(layout.clone(), self.turnouts.into_iter().collect());
        driver.add_located(self.model, self.locator);
        driver
    }
}

impl Listener for Driver {
    fn handle_word(&mut self, now: Timestamp, word: &Input) {
        if let Input::Order(order) = word {
            // An order that was refused live is refused in a replay, too.
            let _ = self.order(now, *order);
        }
    }
}
