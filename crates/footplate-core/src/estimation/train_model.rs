//! One train as it is known: its speeds, lengths and laws, and where it is in the run under way.

use super::belief::{Belief, C, Command, Due, Hop, U, Unmodelled};
use super::contact_scatter::ContactScatter;
use super::forecast::{Forecast, Phase};
use super::law_memory::LawMemory;
use super::polls::Polls;
use super::predictor::{Hit, Verdict};
use super::speed_watch::{SpeedWatch, WatchedSpeed};
use super::way_memory::WayMemory;
use crate::calibration::{
    Direction, DriftTest, Drive, Expected, Familiarity, LawFamily, LengthTable, Passage, PassageTracker,
    SectionIndex, SpeedTable,
};
use crate::estimate::Estimate;
use crate::event::Approach;
use crate::ids::{SensorId, SpeedStep, TrainId};
use crate::latency::UniformNormal;
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Layout, Reach};
use crate::units::Speed;

/// Random walk of ln speed of a train on one step, per √s: 0.3 % over a lap of half a minute.
const WANDER: f64 = 0.000_5;
/// Part of a way covered while changing speed by which no law is true.
const LAW_ERROR: f64 = 0.08;
/// A report that one forecast in this many allows is no longer believed.
const GATE: f64 = 1e-5;
/// What is thought of the speed (as ln) when the gate opens again or a drift was found.
const REOPENED: f64 = 0.05;
/// A train told to stand is asymptotically at this speed (m/s), so that its logarithm exists.
const STANDING_SPEED: f64 = 1e-4;
/// Above this doubt of ln speed the first hop sets the speed instead of correcting it: the forecast is too
/// far from linear in it.
const TOO_DOUBTFUL: f64 = 0.2;

/// One train as it is known.
#[derive(Debug, Clone)]
pub struct TrainModel {
    train: TrainId,
    speeds: SpeedTable,
    lengths: LengthTable,
    laws: LawMemory,
    drift: DriftTest,
    scatter: ContactScatter,
    watch: SpeedWatch,
    ways: WayMemory,
    run: RunState,
}

/// The run under way.
#[derive(Debug, Clone, Copy)]
struct RunState {
    beliefs: [Belief; LawFamily::LIVE.len()],
    /// The belief that explains the reports best.
    best: usize,
    /// Whether the time of the last contact is known.
    placed: bool,
    command: Option<Command>,
    drive: Drive,
    expected: Expected,
    /// Hops run at the settled speed of the step.
    settled_hops: u32,
    rejected: bool,
    date: Timestamp,
}

impl TrainModel {
    /// Nothing known of the train.
    #[must_use]
    pub fn new(train: TrainId) -> Self {
        let speeds = SpeedTable::default();
        let laws = LawMemory::default();
        let drive = Drive { step: SpeedStep::STAND, from: SpeedStep::STAND, commanded: None };
        let run = RunState {
            beliefs: laws.beliefs(Direction::Up),
            best: 0,
            placed: false,
            command: None,
            drive,
            expected: speeds.expected(drive.step, drive.approach()),
            settled_hops: 0,
            rejected: false,
            date: Timestamp::ZERO,
        };
        Self {
            train,
            speeds,
            lengths: LengthTable::default(),
            laws,
            drift: DriftTest::default(),
            scatter: ContactScatter::default(),
            watch: SpeedWatch::default(),
            ways: WayMemory::default(),
            run,
        }
    }

    /// The train.
    #[must_use]
    pub const fn train(&self) -> TrainId {
        self.train
    }

    /// Its steady speeds as learnt from finished runs.
    #[must_use]
    pub const fn speeds(&self) -> &SpeedTable {
        &self.speeds
    }

    /// Its steady speeds with all that makes them uncertain: the survey's scale, which no timing narrows, is in
    /// it.
    pub fn calibrated_speeds<'s>(
        &'s self,
        sections: &'s SectionIndex,
    ) -> impl Iterator<Item = (SpeedStep, Approach, Estimate<Speed>)> + 's {
        let scale = sections.scale_variance(self.lengths.known());
        self.speeds.speeds().map(move |(step, approach, speed)| {
            let shared = speed.value.as_m_per_s() * libm::sqrt(scale);
            let uncertainty = libm::hypot(speed.uncertainty.as_m_per_s(), shared);
            (step, approach, Estimate { uncertainty: Speed::from_m_per_s(uncertainty), ..speed })
        })
    }

    /// The same, to take over a calibration.
    pub const fn speeds_mut(&mut self) -> &mut SpeedTable {
        &mut self.speeds
    }

    /// The speed of a step as plain running averages see it.
    #[must_use]
    pub fn watched_speed(&self, step: SpeedStep) -> Option<WatchedSpeed> {
        self.watch.step(step)
    }

    /// How near the test for a lasting drift is to an alarm, 0 to 1.
    #[must_use]
    pub fn drift_level(&self) -> f64 {
        self.drift.level()
    }

    /// Its corrections of surveyed lengths.
    #[must_use]
    pub const fn lengths(&self) -> &LengthTable {
        &self.lengths
    }

    /// The same, to take over a calibration.
    pub const fn lengths_mut(&mut self) -> &mut LengthTable {
        &mut self.lengths
    }

    /// The laws by which it changes speed.
    #[must_use]
    pub const fn laws(&self) -> &LawMemory {
        &self.laws
    }

    /// The same, to take over a calibration.
    pub const fn laws_mut(&mut self) -> &mut LawMemory {
        &mut self.laws
    }

    /// The steady speed of the step as the run under way has shown it up to the last contact, the table's word
    /// included. `None` before the first hop at a settled speed. The count is of such hops.
    #[must_use]
    pub fn running_speed(&self) -> Option<Estimate<Speed>> {
        if self.run.settled_hops == 0 {
            return None;
        }
        let best = self.best();
        let speed = libm::exp(best.x[U]);
        Some(Estimate {
            value: Speed::from_m_per_s(speed),
            uncertainty: Speed::from_m_per_s(speed * libm::sqrt(best.p[U][U])),
            count: self.run.settled_hops,
            date: self.run.date,
        })
    }

    pub(super) fn begin_run(&mut self, step: SpeedStep) {
        self.run.drive = Drive { step, from: step, commanded: None };
        self.run.placed = false;
        self.run.command = None;
        self.run.settled_hops = 0;
        self.run.rejected = false;
        self.expect(step, Approach::Unknown);
    }

    pub(super) fn end_run(&mut self) {
        self.learn_speed();
        self.run.placed = false;
    }

    /// The train was told another step.
    pub(super) fn command(&mut self, drive: Drive) {
        let sent = drive.commanded.map_or(0.0, Timestamp::as_s);
        let from = if drive.from == SpeedStep::STAND { 0.0 } else { self.speed_at(sent) };
        self.learn_speed();
        let direction = Direction::of(drive);
        let best = self.best();
        let mut beliefs = self.laws.beliefs(direction);
        for belief in &mut beliefs {
            belief.appear(best.x[C], best.p[C][C]);
        }
        self.run.beliefs = beliefs;
        self.run.best = self.laws.best(direction);
        self.run.drive = drive;
        self.run.command = Some(Command { sent, from });
        self.run.settled_hops = 0;
        self.expect(drive.step, drive.approach());
    }

    /// Expects the speed of a step from what the table says.
    fn expect(&mut self, step: SpeedStep, approach: Approach) {
        self.run.expected = self.speeds.expected(step, approach);
        let (ln_speed, variance) = if step == SpeedStep::STAND {
            (libm::log(STANDING_SPEED), 0.0)
        } else {
            (self.run.expected.ln_speed, self.run.expected.variance)
        };
        for belief in &mut self.run.beliefs {
            belief.expect_speed(ln_speed, variance);
        }
    }

    fn best(&self) -> &Belief {
        let [first, ..] = &self.run.beliefs;
        self.run.beliefs.get(self.run.best).unwrap_or(first)
    }

    fn speed_at(&self, time: f64) -> f64 {
        let best = self.best();
        self.run.command.map_or(libm::exp(best.x[U]), |command| best.transition(command).speed_at(time))
    }

    /// What the run showed of the speed of its step goes into the table.
    fn learn_speed(&mut self) {
        if self.run.settled_hops == 0 || self.run.drive.step == SpeedStep::STAND {
            return;
        }
        let (drive, expected, date) = (self.run.drive, self.run.expected, self.run.date);
        let best = self.best();
        let (ln_speed, variance) = (best.x[U], best.p[U][U]);
        self.speeds.learn(drive.step, drive.approach(), expected, ln_speed, variance, date);
        self.run.settled_hops = 0;
    }

    /// The train passed a contact; `prior` are lengths it has not met before.
    pub(super) fn pass(
        &mut self,
        layout: &Layout,
        sections: &SectionIndex,
        passage: Passage,
        polls: Polls,
        prior: &[(usize, f64, f64)],
    ) -> Hit {
        for (section, by, variance) in prior {
            self.lengths.set(*section, *by, *variance);
        }
        self.run.date = passage.window.until;
        let named = passage.way.as_ref().and_then(|way| self.ways.named(layout, way));
        let hit = |forecast, verdict, drift| Hit { passage, forecast, named, verdict, drift };
        let Some(way) = passage.way.filter(|_| self.run.placed) else {
            self.place(&passage);
            return hit(None, Verdict::First, None);
        };
        let ahead = self.way_ahead(sections, &way);
        let Some(due) = self.best().due(self.run.command, ahead.hop, DOUBT) else {
            // By all that is known the train stops short of it, so there was no forecast.
            self.place(&passage);
            return hit(None, Verdict::First, None);
        };
        let forecast = self.forecast_of(passage.sensor, &way, &due, polls);
        // Judged by what was known before the hit.
        let stated = self.foreseeable(forecast);
        let late = passage.window.middle().as_s() - due.time;
        let probability = forecast.probability_by(passage.window.until);
        let too_wild = probability.min(1.0 - probability) < GATE;
        self.ways.remember(layout, &way, self.run.drive.step);
        if !due.changing && self.too_doubtful() {
            self.set_speed(&passage, &ahead);
            return hit(stated, Verdict::Learnt, None);
        }
        if too_wild {
            let reopened = self.run.rejected;
            self.run.rejected = !reopened;
            if reopened && !due.changing {
                self.reopen();
                self.set_speed(&passage, &ahead);
            } else {
                self.place(&passage);
            }
            let verdict = if reopened { Verdict::Reopened } else { Verdict::Rejected };
            return hit(stated, verdict, None);
        }
        self.run.rejected = false;
        let noise = passage.window.variance_s2() + self.scatter.variance_s2(due.speed);
        let drift = if due.changing {
            self.arrive_changing(&ahead, passage.window.middle().as_s(), noise, polls.period);
            None
        } else {
            self.run.settled_hops += 1;
            let took = passage.window.middle().as_s() - self.best().x[C];
            self.watch.take(self.run.drive.step, ahead.hop.length / took);
            let drift = self.drift.take(late / libm::sqrt(due.variance + noise));
            self.scatter.take(late, due.variance + passage.window.variance_s2(), due.speed);
            self.arrive(self.run.best, &due, &ahead, late, noise, true);
            drift
        };
        if drift.is_some() {
            self.reopen();
        }
        hit(stated, Verdict::Learnt, drift)
    }

    /// A forecast counts as one when something like the step was ever measured or the run has shown its speed.
    fn foreseeable(&self, forecast: Forecast) -> Option<Forecast> {
        let known = self.run.expected.familiarity > Familiarity::Unseen || self.run.settled_hops > 0;
        (known || forecast.phase == Phase::Change).then_some(forecast)
    }

    fn too_doubtful(&self) -> bool {
        self.best().p[U][U] > TOO_DOUBTFUL * TOO_DOUBTFUL
    }

    fn place(&mut self, passage: &Passage) {
        let (time, variance) = (passage.window.middle().as_s(), passage.window.variance_s2());
        for belief in &mut self.run.beliefs {
            belief.appear(time, variance);
        }
        self.run.placed = true;
    }

    /// The first settled hop at a step of which too little is known gives its speed outright.
    fn set_speed(&mut self, passage: &Passage, ahead: &Ahead) {
        let best = self.best();
        let noise = passage.window.variance_s2();
        let now = passage.window.middle().as_s();
        let took = now - best.x[C];
        if took <= 0.0 {
            return self.place(passage);
        }
        let variance = (best.p[C][C] + noise) / (took * took)
            + ahead.hop.variance / (ahead.hop.length * ahead.hop.length);
        let ln_speed = libm::log(ahead.hop.length / took);
        for belief in &mut self.run.beliefs {
            belief.appear(now, noise);
            belief.expect_speed(ln_speed, variance);
            // A contact that was really later makes the speed lower.
            belief.p[C][U] = -noise / took;
            belief.p[U][C] = -noise / took;
        }
        self.run.settled_hops += 1;
    }

    /// The speed is learnt anew because forecasts go wrong.
    fn reopen(&mut self) {
        let drive = self.run.drive;
        self.speeds.doubt(drive.step, drive.approach(), REOPENED);
        for belief in &mut self.run.beliefs {
            let (ln_speed, variance) = (belief.x[U], belief.p[U][U]);
            belief.expect_speed(ln_speed, variance + REOPENED * REOPENED);
        }
    }

    /// While the speed changes every law is put to the test; the best then speaks for the train.
    fn arrive_changing(&mut self, ahead: &Ahead, time: f64, noise: f64, period: TimeSpan) {
        let (best, direction) = (self.run.best, Direction::of(self.run.drive));
        for place in 0..self.run.beliefs.len() {
            let Some(belief) = self.run.beliefs.get(place).copied() else { continue };
            let Some(due) = belief.due(self.run.command, ahead.hop, DOUBT) else { continue };
            self.laws.weigh(direction, place, self.spread(&due, period).density(time - due.time));
            let (due, late) = belief.due_in_hindsight(due, self.run.command, ahead.hop, DOUBT, time, noise);
            self.arrive(place, &due, ahead, late, noise, place == best);
        }
        for (place, belief) in self.run.beliefs.iter().enumerate() {
            self.laws.keep(direction, place, belief);
        }
        self.run.best = self.laws.best(direction);
    }

    fn arrive(&mut self, place: usize, due: &Due, ahead: &Ahead, late: f64, noise: f64, with_lengths: bool) {
        let Some(belief) = self.run.beliefs.get_mut(place) else { return };
        let correction = belief.arrive(due, late, noise);
        if with_lengths && ahead.hop.variance > 0.0 {
            for section in ahead.sections() {
                let Some((by, variance)) = self.lengths.get(section) else { continue };
                let part = variance / ahead.hop.variance;
                let left = (variance - part * part * correction.explained).max(0.0);
                self.lengths.set(section, by + part * correction.by, left);
            }
        }
    }

    fn way_ahead(&self, sections: &SectionIndex, way: &Reach) -> Ahead {
        let mut ahead =
            Ahead { hop: Hop { length: way.length.as_m(), variance: 0.0 }, sections: [None; MOST_SECTIONS] };
        for (slot, hop) in ahead.sections.iter_mut().zip(way.hops()) {
            *slot = sections.section(*hop);
            if let Some((by, variance)) = slot.and_then(|section| self.lengths.get(section)) {
                ahead.hop.length += by;
                ahead.hop.variance += variance;
            }
        }
        // A correction cannot turn a way into nothing, however short the survey has it.
        ahead.hop.length = ahead.hop.length.max(SHORTEST_WAY_M);
        ahead
    }

    fn forecast_of(&self, sensor: SensorId, way: &Reach, due: &Due, polls: Polls) -> Forecast {
        let phase = if due.changing {
            Phase::Change
        } else if self.ways.has_passed(way, self.run.drive.step) {
            Phase::Steady
        } else {
            Phase::FirstLap
        };
        let contact = Timestamp::from_s(due.time);
        let time = contact + TimeSpan::from_ns(polls.period.as_ns() / 2);
        Forecast {
            sensor,
            time,
            report: polls.rhythm.and_then(|rhythm| rhythm.poll_after(contact)).unwrap_or(time),
            spread: self.spread(due, polls.period),
            speed: Speed::from_m_per_s(due.speed),
            phase,
        }
    }

    /// The forecast for the contact named next, from the state as it stands.
    pub(super) fn forecast(
        &self,
        layout: &Layout,
        sections: &SectionIndex,
        tracker: &PassageTracker,
    ) -> Option<Forecast> {
        let from = tracker.at().filter(|_| self.run.placed)?;
        let way = self.ways.likely_way(layout, from, tracker.turnouts())?;
        let ahead = self.way_ahead(sections, &way);
        let due = self.best().due(self.run.command, ahead.hop, DOUBT)?;
        let polls = Polls::of(tracker.timing());
        self.foreseeable(self.forecast_of(way.sensor?, &way, &due, polls))
    }

    fn spread(&self, due: &Due, period: TimeSpan) -> UniformNormal {
        let deviation = libm::sqrt(due.variance + self.scatter.variance_s2(due.speed));
        UniformNormal { deviation, width: period.as_s() }
    }
}

/// Stretches of a way: one, and one more for each contact that may stay silent.
const MOST_SECTIONS: usize = crate::track::MAX_MISSED + 1;
/// The shortest way between two contacts that is believed (m); shorter ones cannot be told from one contact.
const SHORTEST_WAY_M: f64 = 0.01;
const DOUBT: Unmodelled = Unmodelled { wander: WANDER, law_error: LAW_ERROR };

/// The way to a contact as this train knows it.
#[derive(Debug, Clone, Copy)]
struct Ahead {
    hop: Hop,
    sections: [Option<usize>; MOST_SECTIONS],
}

impl Ahead {
    fn sections(&self) -> impl Iterator<Item = usize> {
        self.sections.into_iter().flatten()
    }
}
