//! Trains commanded to run at a speed that none of their steps has, beside the step that comes nearest to it.

use anyhow::Context;
use footplate_core::control::{Notice, Order, PacedLine};
use footplate_core::model::survey::SectionIndex;
use footplate_core::model::{MotionModel, StepUse};
use footplate_core::track::Layout;
use footplate_core::tracking::TrackContext;
use footplate_core::{Approach, Length, NodeId, Speed, SpeedStep, TimeSpan, Timestamp, TrainId};

use super::counted::{Counted, cut_short};
use super::tracked::{LOOK, Odometer, TrueWay};
use crate::driving::known;
use crate::seeds::Choice;
use crate::testbed::{LongestCircuit, PreparedTrains};

/// Speeds that are asked for (mm/s).
const SPEEDS: [f64; 2] = [200.0, 450.0];
/// How many of each train.
const SPEEDS_EACH: usize = 2;
/// How long each is held (s).
const HELD_FOR: f64 = 120.0;
/// A train that has not begun by then does not (s).
const PATIENCE: f64 = 60.0;
/// The way over which a mean speed is taken (mm).
const WINDOW: f64 = 3000.0;
/// Every so many looks a window begins.
const EVERY: usize = 5;

/// Who held it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum By {
    /// The driver, by changing between steps.
    Driver,
    /// The same driver with a model made of the truth: what is left is what no calibration could take away.
    Told,
    /// The nearest step.
    Step,
}

impl By {
    pub(super) const ALL: [Self; 3] = [Self::Driver, Self::Told, Self::Step];

    pub(super) const fn key(self) -> &'static str {
        match self {
            Self::Driver => "footplate",
            Self::Told => "footplate, told the train",
            Self::Step => "nearest step",
        }
    }
}

/// One speed held by one train.
#[derive(Debug, Clone)]
pub(super) struct Held {
    pub(super) by: By,
    pub(super) train: TrainId,
    /// What was asked for (mm/s).
    pub(super) speed: f64,
    /// What it did, ...
    pub(super) course: HoldRecord,
    /// ... and what the driver believed at the same time that it did.
    pub(super) believed: HoldRecord,
    pub(super) seconds: f64,
    pub(super) commands: usize,
    /// What went wrong.
    pub(super) trouble: Option<String>,
}

/// A course beside the ideal.
#[derive(Debug, Clone, Default)]
pub(super) struct HoldRecord {
    /// When the train was looked at (s since it began), and how far ahead of the ideal it was (mm).
    pub(super) ahead: Vec<[f64; 2]>,
    /// When a window began (s), and by how much the mean speed in it was off (%).
    pub(super) off: Vec<[f64; 2]>,
}

/// Everything that one train is asked to hold.
pub(super) fn hold(
    layout: &Layout,
    stage: &PreparedTrains<'_>,
    way: &LongestCircuit,
    train: TrainId,
    choice: &mut Choice,
) -> anyhow::Result<Vec<Held>> {
    let model = stage.models.get(&train).context("a train that was not calibrated")?;
    let [slowest, fastest] = ends(model);
    let mut all = Vec::new();
    for _ in 0..SPEEDS_EACH {
        let speed = choice.between(SPEEDS[0].max(slowest), SPEEDS[1].min(fastest));
        let start = *choice.of(&way.nodes).context("a way without a contact")?;
        for by in By::ALL {
            let mut stage = stage.clone();
            stage.put(train, start, Length::from_mm(60.0))?;
            if by == By::Told {
                let told = told_the_truth(layout, &stage, way, train)?;
                stage.models.insert(train, told);
            }
            all.push(held(layout, stage, train, by, speed));
        }
    }
    Ok(all)
}

/// A model of a train that knows everything about it, and how long the hops on its way feel.
pub(super) fn told_the_truth(
    layout: &Layout,
    stage: &PreparedTrains<'_>,
    way: &LongestCircuit,
    train: TrainId,
) -> anyhow::Result<MotionModel> {
    let sections = SectionIndex::of(layout);
    let context = TrackContext { layout, sections: &sections, turnouts: &stage.turnouts };
    known(context, stage.world().truth(), train, &way.nodes)
}

/// The speeds of the slowest and the fastest step that moves a train (mm/s).
fn ends(model: &MotionModel) -> [f64; 2] {
    let moves = |step: &SpeedStep| model.uses(*step) == StepUse::Moves;
    let speeds = || steps(model).filter(moves).map(|step| speed(model, step));
    [speeds().fold(f64::INFINITY, f64::min), speeds().fold(0.0, f64::max)]
}

pub(super) fn steps(model: &MotionModel) -> impl Iterator<Item = SpeedStep> + use<> {
    (1..=model.highest().get()).filter_map(SpeedStep::new)
}

pub(super) fn speed(model: &MotionModel, step: SpeedStep) -> f64 {
    model.speed(step, Approach::Below).value.as_mm_per_s()
}

/// Where a train should be from a time on, counted from a contact.
#[derive(Debug, Clone, Copy)]
struct Ideal {
    node: NodeId,
    way: Length,
    time: Timestamp,
}

fn held(layout: &Layout, mut stage: PreparedTrains<'_>, train: TrainId, by: By, asked: f64) -> Held {
    let mut held = Held {
        by,
        train,
        speed: asked,
        course: HoldRecord::default(),
        believed: HoldRecord::default(),
        seconds: 0.0,
        commands: 0,
        trouble: None,
    };
    let began = stage.line.now();
    let mut counted = match by {
        By::Driver | By::Told => Counted::dispatched(began, stage.driver()),
        By::Step => Counted::bare(stage.driver()),
    };
    let Some(model) = stage.models.get(&train) else { return held };
    let (order, settled) = match by {
        By::Driver | By::Told => (Order::Hold { train, speed: Speed::from_mm_per_s(asked) }, None),
        By::Step => {
            let off = |step: &SpeedStep| (speed(model, *step) - asked).abs();
            let nearest = steps(model).min_by(|one, other| off(one).total_cmp(&off(other)));
            let step = nearest.unwrap_or(SpeedStep::STAND);
            (Order::Speed { train, step }, Some(began + model.settles_within(SpeedStep::STAND, step)))
        }
    };
    if let Err(why) = counted.order(began, order) {
        held.trouble = Some(why.to_string());
        return held;
    }
    let before = stage.world().incidents().len();
    let mut odometer = Odometer::default();
    let mut believed: Vec<(Timestamp, f64)> = Vec::new();
    let mut ideal: Option<(Ideal, usize)> = None;
    let mut until = began + TimeSpan::from_s(PATIENCE);
    while stage.line.now() < until {
        let look = until.min(stage.line.now() + LOOK);
        let notice = counted.drive(&mut stage.line, look);
        if let Some((.., why)) = notice.as_ref().and_then(cut_short) {
            held.trouble = Some(why);
            break;
        }
        let found = match notice {
            Some(Notice::Paced(PacedLine { node, way, time, .. })) => Some(Ideal { node, way, time }),
            // The first contact at a settled speed begins a line, as the driver's does.
            Some(Notice::Passed { passed, .. }) if settled.is_some_and(|at| at < passed.window.after) => {
                let node = counted.driver().node_passed(&passed);
                node.map(|node| Ideal { node, way: Length::ZERO, time: passed.window.middle() })
            }
            Some(_) => None,
            None => {
                let now = stage.line.now();
                odometer.look(&stage.line, train);
                let ahead = counted.driver().ahead_of_line(train, now);
                believed.extend(ahead.map(|ahead| (now, ahead.as_mm())));
                None
            }
        };
        if let (None, Some(found)) = (ideal, found) {
            ideal = Some((found, counted.steps(train)));
            until = stage.line.now() + TimeSpan::from_s(HELD_FOR);
        }
    }
    if stage.world().incidents().len() > before {
        held.trouble = Some("it came to grief".to_owned());
    }
    let Some((ideal, commands)) = ideal else {
        held.trouble.get_or_insert_with(|| "it never began".to_owned());
        return held;
    };
    held.seconds = (stage.line.now() - ideal.time).as_s();
    held.commands = counted.steps(train) - commands;
    let way = TrueWay::since(layout, &stage.turnouts, stage.world().truth(), train, began);
    held.course = HoldRecord::of_way(&way, &odometer, ideal, asked);
    let believed = believed.into_iter().map(|(at, ahead)| {
        let since = (at - ideal.time).as_s();
        (since, asked * since + ahead)
    });
    held.believed = HoldRecord::beside(&believed.collect::<Vec<_>>(), asked);
    held
}

impl HoldRecord {
    /// What the train did beside what it should have done.
    fn of_way(way: &TrueWay, odometer: &Odometer, ideal: Ideal, speed: f64) -> Self {
        // A contact closes up to a poll before it is reported.
        let near = way.before(ideal.time + LOOK + LOOK).filter(|mark| mark.node == ideal.node);
        let Some(near) = near else { return Self::default() };
        let origin = near.surveyed + ideal.way.as_mm();
        let looks = odometer.since(ideal.time);
        let looks = looks
            .filter_map(|(at, odometer)| Some(((at - ideal.time).as_s(), way.surveyed(odometer)? - origin)));
        Self::beside(&looks.collect::<Vec<_>>(), speed)
    }

    /// A course, as the way (mm) at times (s) since it began, beside the ideal with a speed (mm/s).
    fn beside(looks: &[(f64, f64)], speed: f64) -> Self {
        let ahead = looks.iter().map(|(since, way)| [*since, way - speed * since]).collect();
        let mut off = Vec::new();
        for (from, begins) in looks.iter().step_by(EVERY) {
            let ends = looks.partition_point(|(_, way)| *way < begins + WINDOW);
            let (Some(last), Some(next)) = (looks.get(ends.saturating_sub(1)), looks.get(ends)) else {
                break;
            };
            let part = (begins + WINDOW - last.1) / (next.1 - last.1);
            let took = last.0 + part * (next.0 - last.0) - from;
            off.push([*from, 100.0 * (WINDOW / took / speed - 1.0)]);
        }
        Self { ahead, off }
    }
}
