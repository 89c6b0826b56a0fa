//! Holding a speed between those of two steps, compared with the nearest step.

use anyhow::Context;
use footplate_core::control::{Notice, Order, PacedLine, WAIT_LIMIT};
use footplate_core::model::survey::SectionIndex;
use footplate_core::model::{MotionModel, StepUse};
use footplate_core::track::Layout;
use footplate_core::tracking::TrackContext;
use footplate_core::{Length, NodeId, Speed, SpeedStep, TimeSpan, Timestamp, TrainId};

use super::counted::{By, Counted, cut_short, interrupts};
use super::tracked::{LOOK, Odometer, TruePath};
use crate::driving::known;
use crate::seeds::Choice;
use crate::testbed::{LongestCircuit, PreparedTrains, nearest_step, speed, steps};

/// Speeds that are asked for (mm/s).
const SPEEDS: [f64; 2] = [200.0, 450.0];
/// How many of each train.
const SPEEDS_EACH: usize = 2;
/// How long each is held (s).
const HELD_FOR: f64 = 120.0;
/// The longest wait for a train to reach the speed (s).
const PATIENCE: f64 = 60.0;
/// The distance over which a mean speed is taken (mm).
const WINDOW: f64 = 3000.0;
/// The number of samples from the beginning of a window to that of the next.
const EVERY: usize = 5;

/// One speed held by one train.
#[derive(Debug, Clone)]
pub(super) struct Held {
    pub(super) by: By,
    pub(super) train: TrainId,
    /// The speed that was ordered (mm/s).
    pub(super) speed: f64,
    /// The true motion, ...
    pub(super) course: HoldRecord,
    /// ... and the estimated motion at the same times.
    pub(super) estimated: HoldRecord,
    pub(super) seconds: f64,
    pub(super) commands: usize,
    /// Why it failed, if it did.
    pub(super) trouble: Option<String>,
}

/// A motion compared with the ideal one.
#[derive(Debug, Clone, Default)]
pub(super) struct HoldRecord {
    /// Times (s since it began), and how far the train was ahead of the ideal (mm).
    pub(super) ahead: Vec<[f64; 2]>,
    /// When a window began (s), and the error of the mean speed in it (%).
    pub(super) off: Vec<[f64; 2]>,
}

/// Lets one train hold several speeds, with each driver.
pub(super) fn hold(
    layout: &Layout,
    prepared: &PreparedTrains<'_>,
    circuit: &LongestCircuit,
    train: TrainId,
    choice: &mut Choice,
) -> anyhow::Result<Vec<Held>> {
    let model = prepared.models.get(&train).context("a train that was not calibrated")?;
    let [slowest, fastest] = ends(model);
    let mut all = Vec::new();
    for _ in 0..SPEEDS_EACH {
        let speed = choice.between(SPEEDS[0].max(slowest), SPEEDS[1].min(fastest));
        let start = *choice.of(&circuit.nodes).context("a circuit without a sensor")?;
        for by in By::ALL {
            let mut prepared = prepared.clone();
            prepared.put(train, start, Length::from_mm(60.0))?;
            if by == By::Oracle {
                let model = oracle_model(layout, &prepared, circuit, train)?;
                prepared.models.insert(train, model);
            }
            all.push(held(layout, prepared, train, by, speed));
        }
    }
    Ok(all)
}

/// A motion model with the true properties of a train, and the true path lengths of the hops on its circuit.
pub(super) fn oracle_model(
    layout: &Layout,
    prepared: &PreparedTrains<'_>,
    circuit: &LongestCircuit,
    train: TrainId,
) -> anyhow::Result<MotionModel> {
    let sections = SectionIndex::of(layout);
    let context = TrackContext { layout, sections: &sections, turnouts: &prepared.turnouts };
    known(context, prepared.world().truth(), train, &circuit.nodes)
}

/// The speeds of the slowest and the fastest step at which a train moves (mm/s).
fn ends(model: &MotionModel) -> [f64; 2] {
    let moves = |step: &SpeedStep| model.uses(*step) == StepUse::Moves;
    let speeds = || steps(model).filter(moves).map(|step| speed(model, step));
    [speeds().fold(f64::INFINITY, f64::min), speeds().fold(0.0, f64::max)]
}

/// The place from which a train should run at the ordered speed: a distance past a sensor, at a time.
#[derive(Debug, Clone, Copy)]
struct Ideal {
    node: NodeId,
    distance: Length,
    time: Timestamp,
}

fn held(layout: &Layout, mut prepared: PreparedTrains<'_>, train: TrainId, by: By, asked: f64) -> Held {
    let mut held = Held {
        by,
        train,
        speed: asked,
        course: HoldRecord::default(),
        estimated: HoldRecord::default(),
        seconds: 0.0,
        commands: 0,
        trouble: None,
    };
    let began = prepared.line.now();
    let mut counted = match by {
        By::Footplate | By::Oracle => Counted::dispatched(began, prepared.driver()),
        By::Step => Counted::bare(prepared.driver()),
    };
    let Some(model) = prepared.models.get(&train) else { return held };
    let (order, settled) = match by {
        By::Footplate | By::Oracle => (Order::Hold { train, speed: Speed::from_mm_per_s(asked) }, None),
        By::Step => {
            let step = nearest_step(model, steps(model), asked);
            (Order::Speed { train, step }, Some(began + model.settles_within(SpeedStep::STAND, step)))
        }
    };
    if let Err(why) = counted.order(began, order) {
        held.trouble = Some(why.to_string());
        return held;
    }
    let before = prepared.world().incidents().len();
    let mut odometer = Odometer::default();
    let mut estimated: Vec<(Timestamp, f64)> = Vec::new();
    let mut ideal: Option<(Ideal, usize)> = None;
    let mut until = began + TimeSpan::from_s(PATIENCE);
    while prepared.line.now() < until {
        let look = until.min(prepared.line.now() + LOOK);
        let notice = counted.drive(&mut prepared.line, look);
        if let Some((.., why)) = notice.as_ref().and_then(cut_short) {
            held.trouble = Some(why);
            break;
        }
        if notice.as_ref().is_some_and(|notice| interrupts(notice, train)) {
            until = prepared.line.now() + WAIT_LIMIT;
        }
        let found = match notice {
            Some(Notice::Resumed { .. }) => {
                // It begins anew.
                (ideal, until) = (None, prepared.line.now() + TimeSpan::from_s(PATIENCE));
                estimated.clear();
                None
            }
            Some(Notice::Paced(PacedLine { node, way: distance, time, .. })) => {
                Some(Ideal { node, distance, time })
            }
            // The first sensor at a settled speed is the origin, as it is for Footplate.
            Some(Notice::Passed { passed, .. }) if settled.is_some_and(|at| at < passed.window.after) => {
                let node = counted.driver().node_passed(&passed);
                node.map(|node| Ideal { node, distance: Length::ZERO, time: passed.window.middle() })
            }
            Some(_) => None,
            None => {
                let now = prepared.line.now();
                odometer.look(&prepared.line, train);
                let ahead = counted.driver().ahead_of_line(train, now);
                estimated.extend(ahead.map(|ahead| (now, ahead.as_mm())));
                None
            }
        };
        if let (None, Some(found)) = (ideal, found) {
            ideal = Some((found, counted.steps(train)));
            until = prepared.line.now() + TimeSpan::from_s(HELD_FOR);
        }
    }
    held.trouble = prepared.grief_since(before).or_else(|| held.trouble.take());
    let Some((ideal, commands)) = ideal else {
        held.trouble.get_or_insert_with(|| "it never began".to_owned());
        return held;
    };
    held.seconds = (prepared.line.now() - ideal.time).as_s();
    held.commands = counted.steps(train) - commands;
    let path = TruePath::since(layout, &prepared.turnouts, prepared.world().truth(), train, began);
    held.course = HoldRecord::of_path(&path, &odometer, ideal, asked);
    let estimated = estimated.into_iter().map(|(at, ahead)| {
        let since = (at - ideal.time).as_s();
        (since, asked * since + ahead)
    });
    held.estimated = HoldRecord::beside(&estimated.collect::<Vec<_>>(), asked);
    held
}

impl HoldRecord {
    /// The true motion compared with the ideal.
    fn of_path(path: &TruePath, odometer: &Odometer, ideal: Ideal, speed: f64) -> Self {
        // A sensor closes up to a poll before it is reported.
        let near = path.before(ideal.time + LOOK + LOOK).filter(|mark| mark.node == ideal.node);
        let Some(near) = near else { return Self::default() };
        let origin = near.surveyed + ideal.distance.as_mm();
        let looks = odometer.since(ideal.time);
        let looks = looks
            .filter_map(|(at, odometer)| Some(((at - ideal.time).as_s(), path.surveyed(odometer)? - origin)));
        Self::beside(&looks.collect::<Vec<_>>(), speed)
    }

    /// A motion, as distances (mm) at times (s) since it began, compared with a constant speed (mm/s).
    fn beside(looks: &[(f64, f64)], speed: f64) -> Self {
        let ahead = looks.iter().map(|(since, distance)| [*since, distance - speed * since]).collect();
        let mut off = Vec::new();
        for (from, begins) in looks.iter().step_by(EVERY) {
            let ends = looks.partition_point(|(_, distance)| *distance < begins + WINDOW);
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
