//! One train of one world: calibrated once, then driven in several sessions, each stop beside its promise.

use std::time::Duration;

use anyhow::Context;
use footplate_core::model::MotionFit;
use footplate_core::model::MotionModel;
use footplate_core::model::survey::SectionIndex;
use footplate_core::track::TurnoutStates;
use footplate_core::{Approach, Length, NodeId, SpeedStep, TimeSpan, Timestamp};
use footplate_sim::{LivingSwitches, TrainTruth, VirtualStation};

use super::timed::Timed;
use super::world::WorldName;
use crate::commands::drive::{DriveBeginning, ScriptRunner, SessionMessage};
use crate::commands::written_layout::WrittenLayout;
use crate::recorded::Input;
use footplate_eval::driving::{Plan, TRAIN};
use footplate_eval::testbed::{VirtualLine, calibrate};

/// Stops are asked for from steps whose true speed is at least this, in mm/s (chosen: slower ones may not move at all).
const SLOWEST_MM_PER_S: f64 = 35.0;
/// A train is looked for by running it at about this speed, in mm/s ...
const SEEKS_AT_MM_PER_S: f64 = 250.0;
/// ... for this long.
const SEEKS_FOR: TimeSpan = TimeSpan::from_ms(12_000);
/// A line of a script that has not ended by then never will: a script waits at most 600 s for a recovery, and may then locate
/// the train and bring it to rest first, each within the same limit.
const PATIENCE: TimeSpan = TimeSpan::from_ms(1_950_000);
/// No train rolls for longer after it was said to have stopped.
const ROLLS_FOR: TimeSpan = TimeSpan::from_ms(15_000);
/// Between two sessions.
const PAUSE: TimeSpan = TimeSpan::from_ms(3_600_000);
/// How far early the start of the early-start world is, and at which step.
const EARLY: Length = Length::from_mm(45.0);
const EARLY_STEP: u8 = 10;

/// How long trains are driven in one world.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    pub(super) sessions: u8,
    pub(super) stops: u16,
    pub(super) budget: TimeSpan,
}

/// One stop that was carried out.
#[derive(Debug, Clone)]
pub(super) struct ScoredStop {
    pub(super) session: u8,
    pub(super) step: SpeedStep,
    /// Where it was to end.
    pub(super) target: String,
    /// How far beyond the target the train really came to rest, in mm.
    pub(super) error: f64,
    /// What was promised of that.
    pub(super) promised: [f64; 2],
}

impl ScoredStop {
    pub(super) fn is_kept(&self) -> bool {
        (self.promised[0]..=self.promised[1]).contains(&self.error)
    }

    pub(super) const fn width(&self) -> f64 {
        self.promised[1] - self.promised[0]
    }
}

/// What came of one world.
#[derive(Debug)]
pub(super) struct ScoredWorld {
    pub(super) name: WorldName,
    pub(super) seed: u64,
    pub(super) stops: Vec<ScoredStop>,
    /// Stops asked for that were refused, or did not end.
    pub(super) failures: Vec<String>,
    pub(super) incidents: Vec<String>,
    /// Sessions in which it was said that the train breaks its promises.
    pub(super) sessions_warned: usize,
    /// Track time of the calibration, in s, and why it ended.
    pub(super) calibration_s: f64,
    pub(super) ending: String,
    /// What the program computed for in all sessions, and at most at once.
    pub(super) taken: Duration,
    pub(super) longest: Duration,
}

/// Drives one world.
pub(super) fn score(
    written: &WrittenLayout,
    name: WorldName,
    seed: u64,
    extent: Extent,
) -> anyhow::Result<ScoredWorld> {
    let layout = &written.layout;
    let switches = LivingSwitches { physics: name.physics(), ..LivingSwitches::well_kept() };
    let station = VirtualStation::draw(layout, seed, &[TRAIN], &switches)?;
    let mut line = VirtualLine::open(station)?;
    let calibrated = calibrate(layout, &mut line, TRAIN, extent.budget);
    let mut scored = ScoredWorld {
        name,
        seed,
        stops: Vec::new(),
        failures: Vec::new(),
        incidents: Vec::new(),
        sessions_warned: 0,
        calibration_s: calibrated.seconds,
        ending: calibrated.ending,
        taken: Duration::ZERO,
        longest: Duration::ZERO,
    };
    let plan = Plan::new(&line, seed);
    let mut learnt = (vec![calibrated.model], vec![calibrated.fit]);
    let mut driven =
        Driven { written, line, plan, turnouts: calibrated.turnouts, is_stuck: false, scored: &mut scored };
    for session in 1..=extent.sessions {
        learnt = driven.session(session, extent.stops, learnt)?;
        if !driven.is_sound() {
            break;
        }
    }
    let incidents = driven.line.station.world.incidents().iter().map(ToString::to_string).collect();
    scored.incidents = incidents;
    Ok(scored)
}

struct Driven<'a, 'l> {
    written: &'l WrittenLayout,
    line: VirtualLine<'l>,
    plan: Plan,
    turnouts: TurnoutStates,
    /// A line of this session never ended: no other will be carried out.
    is_stuck: bool,
    scored: &'a mut ScoredWorld,
}

impl Driven<'_, '_> {
    /// One session, with what was learnt before; returns what the next one goes on from.
    fn session(
        &mut self,
        session: u8,
        stops: u16,
        learnt: (Vec<MotionModel>, Vec<MotionFit>),
    ) -> anyhow::Result<(Vec<MotionModel>, Vec<MotionFit>)> {
        self.line.station.world.begin_session(PAUSE);
        let mut machine = Timed::new(self.begin(learnt.clone())?);
        self.is_stuck = false;
        self.seek(&mut machine);
        let early_at = (self.scored.name == WorldName::EarlyStart && session == 1).then_some(stops / 2);
        for nth in 0..stops {
            if !self.is_sound() {
                break;
            }
            if self.is_stuck {
                self.failed("a stop", "the line before it never ended");
                continue;
            }
            self.stop(&mut machine, session, early_at == Some(nth));
        }
        self.scored.taken += machine.taken;
        self.scored.longest = self.scored.longest.max(machine.longest);
        // What a train in a recovery knew before the session is what a store keeps of it.
        let handed_over = machine.script_runner.handed_over();
        Ok(if handed_over.0.is_empty() { learnt } else { handed_over })
    }

    /// The script runner of a session; what it knows goes through the text that is kept of it.
    fn begin(&self, mut learnt: (Vec<MotionModel>, Vec<MotionFit>)) -> anyhow::Result<ScriptRunner> {
        let sections = SectionIndex::of(&self.written.layout);
        learnt.1.iter_mut().for_each(|fit| fit.begin_session(&sections));
        // A train that a recovery measured again has a model and no fit.
        let fitted = |model: MotionModel| {
            let fit = learnt.1.iter().find(|fit| fit.model().train() == model.train());
            fit.map_or_else(|| model.for_later_session(), |fit| fit.model().clone())
        };
        learnt.0 = learnt.0.into_iter().map(fitted).collect();
        let beginning = DriveBeginning::line_by_line(self.written, &self.turnouts, learnt);
        let text = serde_json::to_string(&beginning).context("what was learnt is kept as text")?;
        let kept: DriveBeginning = serde_json::from_str(&text).context("what was kept is read back")?;
        kept.script_runner()
    }

    fn stop(&mut self, machine: &mut Timed, session: u8, early: bool) {
        let layout = &self.written.layout;
        let steps = if early { SpeedStep::new(EARLY_STEP).into_iter().collect() } else { self.steps() };
        let asked = self.plan.stop(layout, &self.line, &self.turnouts, &steps);
        let Some((node, offset, step)) = asked else { return };
        if early {
            let by = TimeSpan::from_s(EARLY.as_mm() / self.true_speed(step).max(1.0));
            self.line.station.world.advance_next_start(TRAIN, by);
        }
        let offset = Length::from_mm(offset.as_mm().round());
        let order = format!(
            "stop {TRAIN} at {}+{}mm at step {step} next round",
            layout.node_name(node),
            offset.as_mm()
        );
        self.say(machine, &order);
        let until = self.line.now() + PATIENCE;
        let ended = self.drive(
            machine,
            until,
            |message| matches!(message, SessionMessage::Ended(ended) if ended.command == "stop"),
        );
        self.until_at_rest(machine);
        match ended {
            Some(SessionMessage::Ended(ended)) => {
                match (ended.refused, ended.promise, self.beyond(node, offset)) {
                    (None, Some(promise), Some(error)) => {
                        let promised = [promise.low.as_mm(), promise.high.as_mm()];
                        let target = format!("{}+{}mm", layout.node_name(node), offset.as_mm());
                        self.scored.stops.push(ScoredStop { session, step, target, error, promised });
                    }
                    (refused, ..) => {
                        let why = refused.as_deref().unwrap_or("no promise");
                        self.failed(&order, why);
                        if why.contains("enter `power on`") {
                            self.say(machine, "power on");
                        }
                        let unknown = why
                            .split_once("position of turnout ")
                            .and_then(|(_, rest)| rest.split_once(" is unknown"));
                        if let Some((turnout, _)) = unknown {
                            self.say(machine, &format!("turnout {turnout} straight"));
                        }
                        self.seek(machine);
                    }
                }
            }
            _ => {
                self.failed(&order, "not ended in time");
                self.is_stuck = true;
            }
        }
    }

    /// Does what the program asks an operator to do who does not know where a train is: stops it, and then runs it over a sensor.
    fn seek(&mut self, machine: &mut Timed) {
        self.say(machine, &format!("speed {TRAIN} 0"));
        self.until_at_rest(machine);
        if let Some(step) = self.nearest_step(SEEKS_AT_MM_PER_S) {
            self.say(machine, &format!("speed {TRAIN} {step}"));
        }
        let until = self.line.now() + SEEKS_FOR;
        self.drive(machine, until, |_| false);
    }

    fn failed(&mut self, order: &str, why: &str) {
        let at = self.line.now().as_s();
        self.scored.failures.push(format!("{at:.1} s: {order}: {why}"));
    }

    /// How far beyond a place the train really is, in mm.
    fn beyond(&self, node: NodeId, offset: Length) -> Option<f64> {
        let sensor = self.written.layout.sensor_at(node)?;
        let past = self.line.station.world.truth().past(TRAIN, sensor)?;
        Some((past - offset).as_mm())
    }

    fn until_at_rest(&mut self, machine: &mut Timed) {
        let patience = self.line.now() + ROLLS_FOR;
        while self.line.now() < patience && self.truth().is_some_and(|truth| truth.at_rest_since.is_none()) {
            let until = patience.min(self.line.now() + TimeSpan::from_ms(200));
            self.drive(machine, until, |_| false);
        }
    }

    fn say(&self, machine: &mut Timed, line: &str) {
        machine.handle_word(self.line.now(), &Input::Line(line.to_owned()));
    }

    /// Drives on until something is said that is waited for.
    fn drive(
        &mut self,
        machine: &mut Timed,
        until: Timestamp,
        is_waited_for: impl Fn(&SessionMessage) -> bool,
    ) -> Option<SessionMessage> {
        loop {
            let message = self.line.drive_hearing(machine, until, |machine, now, notice| {
                if let Some(news) = notice.news() {
                    machine.handle_word(now, &Input::Link(news));
                }
            })?;
            if matches!(&message, SessionMessage::Alarm(alarm) if alarm.is_of_promises()) {
                self.scored.sessions_warned += 1;
            }
            if is_waited_for(&message) {
                return Some(message);
            }
        }
    }

    fn truth(&self) -> Option<TrainTruth> {
        self.line.station.world.truth().train(TRAIN)
    }

    fn is_sound(&self) -> bool {
        self.truth().is_some_and(|truth| !truth.is_wrecked)
    }

    fn true_speed(&self, step: SpeedStep) -> f64 {
        let engine = self.line.station.world.truth().engine(TRAIN);
        engine.map_or(0.0, |engine| engine.speeds.speed(step, Approach::Below).as_mm_per_s())
    }

    /// All steps that stops are asked for from.
    fn steps(&self) -> Vec<SpeedStep> {
        let all = (1..=SpeedStep::HIGHEST).filter_map(SpeedStep::new);
        let engine = self.line.station.world.truth().engine(TRAIN);
        let highest = engine.map_or(SpeedStep::STAND, |engine| engine.speeds.highest());
        all.filter(|step| *step <= highest && self.true_speed(*step) >= SLOWEST_MM_PER_S).collect()
    }

    fn nearest_step(&self, mm_per_s: f64) -> Option<SpeedStep> {
        let off = |step: &SpeedStep| (self.true_speed(*step) - mm_per_s).abs();
        self.steps().into_iter().min_by(|one, other| off(one).total_cmp(&off(other)))
    }
}
