//! Hours of driving on one simulated railway: everything that a session of `footplate drive` has with a dashboard and a store,
//! and an operator who sends each train to one random place after the other.
//!
//! The operator helps trains as a person would: places one that cannot be located, and switches the power on. After a
//! collision, a derailment or an overrun the session ends, and the next one begins where the trains were at first.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use anyhow::ensure;
use footplate_core::control::{LinkNews, TrainLengths};
use footplate_core::model::MotionModel;
use footplate_core::track::{Landmark, Layout};
use footplate_core::{Command, Length, NodeId, TimeSpan, Timestamp, TrainId};
use footplate_eval::seeds::Choice;
use footplate_eval::testbed::PreparedTrains;
use footplate_eval::traffic::{Asked, LENGTHS, set_out};
use footplate_store::Store;
use footplate_wire::marklin_serial::{Interface, Settings};
use footplate_wire::{CommandError, LinkNotice};

use super::beginning::DriveBeginning;
use super::script_runner::ScriptRunner;
use super::session_message::SessionMessage;
use super::trains::{KnownTrains, Sources};
use super::truth::{GroundTruth, StartOdometers};
use crate::commands::written_layout::WrittenLayout;
use crate::dashboard::{Alarm, Board, Painter};
use crate::layout_check::LayoutWatch;
use crate::link::{Link as _, SimulatedLink, Speed, StationKind, module_count};
use crate::recorded::{Input, Recorded};
use crate::runtime::{Attendant, Ended, Runtime, Wish};
use crate::session_journal::WhenFull;

/// How often the operator looks at the railway.
const LOOK: TimeSpan = TimeSpan::from_ms(5_000);
/// An operator comes this long after an alarm.
const HELP_AFTER: TimeSpan = TimeSpan::from_ms(20_000);
/// An order whose end is not heard of by then is given again: the longest wait for a train is shorter.
const GIVEN_AGAIN_AFTER: TimeSpan = TimeSpan::from_ms(900_000);

/// What an hour of driving came to.
#[derive(Debug, Clone, Default)]
pub(crate) struct DrivenHour {
    /// Track time since the beginning, at its end.
    pub(crate) until: TimeSpan,
    /// How far beyond its target each train really came to rest.
    pub(crate) errors: Vec<Length>,
    /// Of these, those inside the interval that was promised.
    pub(crate) kept: usize,
    /// Orders that were refused or given up.
    pub(crate) refused: usize,
    /// Times that the operator helped.
    pub(crate) helped: usize,
    /// Collisions, derailments and overruns.
    pub(crate) incidents: usize,
    /// The length of all that control keeps, written out, in bytes.
    pub(crate) state_bytes: usize,
    /// The size of the store, in bytes.
    pub(crate) store_bytes: u64,
}

/// A railway that is driven for hours.
pub(crate) struct LongDrive<'l> {
    written: &'l WrittenLayout,
    prepared: PreparedTrains<'l>,
    choice: Choice,
    store: &'l Path,
    driven: TimeSpan,
    /// When the next part is reported.
    due: TimeSpan,
    hour: DrivenHour,
}

impl<'l> LongDrive<'l> {
    /// Draws the trains of a seed, calibrates them, and keeps their models in a store.
    ///
    /// # Errors
    /// There is no room for the trains, or the store cannot be written.
    pub(crate) fn new(
        written: &'l WrittenLayout,
        seed: u64,
        trains: usize,
        budget: TimeSpan,
        store: &'l Path,
    ) -> anyhow::Result<Self> {
        let asked = Asked { trains, time: TimeSpan::ZERO, budget, by_blocks: false };
        let (prepared, choice) = set_out(&written.layout, seed, asked)?;
        let models: Vec<MotionModel> = prepared.models.values().cloned().collect();
        KnownTrains::keep(store, &written.layout, &models)?;
        let (driven, due) = (TimeSpan::ZERO, TimeSpan::ZERO);
        Ok(Self { written, prepared, choice, store, driven, due, hour: DrivenHour::default() })
    }

    /// Drives for so long, and reports each `part` of it.
    ///
    /// # Errors
    /// The session or the store fails, or `report` does.
    pub(crate) fn drive(
        mut self,
        time: TimeSpan,
        part: TimeSpan,
        mut report: impl FnMut(&DrivenHour) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        self.due = part;
        while self.driven < time {
            self.session(time, part, &mut report)?;
        }
        Ok(())
    }

    /// Drives until the time is over or trains came to grief.
    fn session(
        &mut self,
        time: TimeSpan,
        part: TimeSpan,
        report: &mut impl FnMut(&DrivenHour) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let layout = &self.written.layout;
        let mut link = SimulatedLink::new(self.prepared.line.station.clone(), Speed::Unpaced);
        let began = link.now();
        let incidents = link.station().world().incidents().len();
        let session = Interface::new(began, Settings::with_cts(module_count(layout)))?;
        let beginning = self.beginning()?;
        let mut journal = beginning.journal(self.store, layout, began, WhenFull::Wait)?;
        let mut operator = Operator::new(began);
        operator.board.follow_journal(journal.written());
        let scribe = journal.scribe();
        let mut script_runner = Recorded::new(beginning.script_runner()?, scribe);
        let mut watch = LayoutWatch::new(layout, self.prepared.models.len(), Some(&mut journal));
        let mut runtime = Runtime::new(&mut link, session, Some(&mut watch), None);
        let mut start_odometers = StartOdometers::default();
        let mut sent: BTreeMap<TrainId, Timestamp> = BTreeMap::new();
        let trains: Vec<TrainId> = self.prepared.models.keys().copied().collect();
        for train in &trains {
            operator.lines.extend(placed(&**runtime.link(), layout, *train));
            operator.lines.push(lengths(*train));
        }
        // A journey would first look for a train that is not placed yet.
        for train in &trains {
            operator.lines.extend(self.send(*train, began, &mut sent));
        }
        let mut since = began;
        loop {
            let now = runtime.link().now();
            operator.looks = now + LOOK;
            let ending = runtime.run(&mut script_runner, &mut operator)?;
            ensure!(matches!(ending, Ended::Finished), "the session ended: {ending}");
            let now = runtime.link().now();
            for message in std::mem::take(&mut operator.for_scoring) {
                let Some((order, error)) = start_odometers.score(&**runtime.link(), layout, &message) else {
                    continue;
                };
                match error {
                    Some(error) if order.refused.is_none() => {
                        let is_kept = order
                            .promise
                            .is_some_and(|promise| (promise.low..=promise.high).contains(&error));
                        self.hour.kept += usize::from(is_kept);
                        self.hour.errors.push(error);
                    }
                    _ => self.hour.refused += usize::from(order.refused.is_some()),
                }
                if let Some(train) = order.train {
                    operator.lines.extend(self.send(train, now, &mut sent));
                }
            }
            let moves = |train: TrainId| {
                let truth = runtime.link().station().world().truth().train(train);
                truth.is_some_and(|truth| truth.at_rest_since.is_none())
            };
            for train in operator.due(now, moves) {
                self.hour.helped += 1;
                operator.lines.push("power on".to_owned());
                if let Some(train) = train {
                    operator.lines.extend(placed(&**runtime.link(), layout, train));
                    operator.lines.extend(self.send(train, now, &mut sent));
                }
            }
            for train in &trains {
                if sent.get(train).is_none_or(|at| now - *at >= GIVEN_AGAIN_AFTER) {
                    operator.lines.extend(self.send(*train, now, &mut sent));
                }
            }
            self.driven += now - since;
            since = now;
            let came = runtime.link().station().world().incidents().len() - incidents;
            if self.driven >= self.due {
                self.due += part;
                self.hour.until = self.driven;
                self.hour.state_bytes = format!("{:?}", script_runner.machine()).len();
                self.hour.store_bytes = Store::open_to_read(self.store)?.size()?;
                report(&self.hour)?;
                self.hour = DrivenHour::default();
            }
            self.hour.incidents += came;
            if came > 0 || self.driven >= time {
                break;
            }
        }
        let at = runtime.link().now();
        let closing = runtime.close();
        drop(runtime);
        let mut script_runner: ScriptRunner =
            if closing.is_complete() { script_runner.end(at) } else { script_runner.into_machine() };
        // The journal is written out before the models that were fitted to it.
        drop(journal);
        KnownTrains::keep(self.store, layout, &script_runner.learnt())
    }

    /// What the session begins with: the models of the store, and the fits to its events.
    fn beginning(&self) -> anyhow::Result<DriveBeginning> {
        let layout = &self.written.layout;
        let mut store = Store::open_or_create(self.store)?;
        store.check()?;
        let named = self.prepared.models.keys().map(|train| (*train, None)).collect();
        let station = StationKind::default();
        let known =
            KnownTrains::gather(layout, Sources { files: &[], store: Some(&mut store), named, station })?;
        let learnt = (known.models.into_values().collect(), known.fits);
        Ok(DriveBeginning::line_by_line(self.written, &self.prepared.turnouts, learnt).of_a_person())
    }

    /// The line that sends a train to a random place.
    fn send(
        &mut self,
        train: TrainId,
        now: Timestamp,
        sent: &mut BTreeMap<TrainId, Timestamp>,
    ) -> Option<String> {
        let layout = &self.written.layout;
        let sensors: Vec<NodeId> = layout.sensors().map(|(_, node)| node).collect();
        let node = self.choice.of(&sensors).copied()?;
        let ahead = layout.outgoing(node).edges().next().and_then(|edge| layout.edge(edge));
        let longest = ahead.map_or(0.0, |edge| edge.length.as_mm());
        let offset = Length::from_mm(self.choice.between(0.0, longest).round());
        let target = layout.display(Landmark { node, offset });
        sent.insert(train, now);
        Some(format!("go {train} to {target}"))
    }
}

/// The operator of a session, and what its pages show. Pictures are drawn by track time: by the clock of the computer they would
/// take the more of it, the slower it simulates.
struct Operator {
    board: Arc<Board>,
    painter: Painter,
    /// When the next look at the railway is due.
    looks: Timestamp,
    /// Lines that the operator has entered.
    lines: Vec<String>,
    news: Vec<LinkNews>,
    /// Messages that are scored against the truth before time moves on.
    for_scoring: Vec<SessionMessage>,
    /// Alarms that need an operator, with their trains, and when they came.
    calls: Vec<(Timestamp, Option<TrainId>)>,
}

impl Operator {
    fn new(looks: Timestamp) -> Self {
        let board = Board::new(0);
        let painter = Painter::new(&board);
        let (lines, news, for_scoring, calls) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { board, painter, looks, lines, news, for_scoring, calls }
    }

    /// Takes the calls that an operator attends to now: a train that moves cannot be placed.
    fn due(&mut self, now: Timestamp, moves: impl Fn(TrainId) -> bool) -> Vec<Option<TrainId>> {
        let is_due =
            |at: Timestamp, train: Option<TrainId>| now - at >= HELP_AFTER && !train.is_some_and(&moves);
        self.calls.extract_if(.., |(at, train)| is_due(*at, *train)).map(|(_, train)| train).collect()
    }

    fn alarm(&mut self, now: Timestamp, alarm: &Alarm) {
        self.painter.alarm(now, alarm);
        let train = alarm.train();
        if alarm.needs_operator() && !self.calls.iter().any(|(_, called)| *called == train) {
            self.calls.push((now, train));
        }
    }
}

impl Attendant<Recorded<ScriptRunner>> for Operator {
    fn hear(&mut self, now: Timestamp, notice: SessionMessage) {
        match notice {
            SessionMessage::Line { text, .. } => self.board.say((now - Timestamp::ZERO).as_s(), &text),
            SessionMessage::Passed(passed) => self.painter.passed(passed),
            SessionMessage::Alarm(alarm) => self.alarm(now, &alarm),
            SessionMessage::Begun(_) | SessionMessage::Ended(_) => self.for_scoring.push(notice),
            SessionMessage::Placed(_) | SessionMessage::Over => {}
        }
    }

    fn hear_of_line(&mut self, now: Timestamp, notice: &LinkNotice) {
        self.news.extend(notice.news());
        if let Some(alarm) = Alarm::of_line(notice) {
            self.alarm(now, &alarm);
        }
    }

    fn hear_of_refusal(&mut self, now: Timestamp, command: Command, error: CommandError) {
        self.alarm(now, &Alarm::not_sent(&format!("{command}: {error}")));
    }

    fn attend(&mut self, now: Timestamp, script_runner: &mut Recorded<ScriptRunner>) -> Wish {
        for news in self.news.drain(..) {
            script_runner.handle_word(now, &Input::Link(news));
        }
        for line in self.lines.drain(..) {
            script_runner.handle_word(now, &Input::Line(line));
        }
        let looks = now >= self.looks;
        if looks {
            script_runner.machine().show(&mut self.painter, now);
        }
        if looks || !self.for_scoring.is_empty() { Wish::Finish } else { Wish::GoOn }
    }
}

/// The line that says where a train really is.
fn placed(truth: &dyn GroundTruth, layout: &Layout, train: TrainId) -> Option<String> {
    let whereabouts = truth.whereabouts(layout, train)?;
    Some(format!("place {train} at {}", whereabouts.place()?))
}

fn lengths(train: TrainId) -> String {
    let TrainLengths { overhang, pickup } = LENGTHS;
    format!("length {train} pickup {}mm overhang {}mm", pickup.as_mm(), overhang.as_mm())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What `simulate long --hours 24` shows for a day, in minutes. The bounds are of `docs/trust.md`.
    #[test]
    fn what_is_kept_does_not_grow_and_the_store_grows_by_less_than_a_megabyte_an_hour() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = folder.path().join("railway.db");
        let written = WrittenLayout::named("track-a").expect("built in");
        let minutes = |minutes: f64| TimeSpan::from_s(60.0 * minutes);
        let long = LongDrive::new(&written, 1, 2, minutes(2.0), &store).expect("room for two trains");
        let mut parts: Vec<DrivenHour> = Vec::new();
        let keep = |part: &DrivenHour| {
            parts.push(part.clone());
            Ok(())
        };
        long.drive(minutes(24.0), minutes(6.0), keep).expect("driven");
        let [_, second, _, last] = &parts[..] else { panic!("{} parts", parts.len()) };
        let errors: Vec<Length> = parts.iter().flat_map(|part| part.errors.iter().copied()).collect();
        assert!(errors.len() >= 40, "{} arrivals", errors.len());
        assert_eq!(parts.iter().map(|part| part.incidents).sum::<usize>(), 0);
        assert!(errors.iter().all(|error| error.abs() < Length::from_mm(100.0)), "{errors:?}");
        let state = last.state_bytes as f64 / second.state_bytes as f64;
        assert!(state < 1.05, "{} to {} bytes", second.state_bytes, last.state_bytes);
        let hours = (last.until - second.until).as_s() / 3_600.0;
        let grown = (last.store_bytes - second.store_bytes) as f64 / hours;
        assert!(grown < 1e6, "{grown:.0} bytes an hour");
    }
}
