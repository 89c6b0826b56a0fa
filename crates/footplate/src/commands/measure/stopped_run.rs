//! The run at whose end a train stands now, and whether a tape laid there can be right.

use anyhow::{Context, bail};
use footplate_core::link::PollTimingEstimator;
use footplate_core::model::Passage;
use footplate_core::model::report::{MeasuredStop, RunPassages};
use footplate_core::track::{Landmark, Layout};
use footplate_core::{Event, EventKind, Length, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_store::{RecordingKey, Run, Store, StoredRecording, StoredRun};

use crate::clock::{LATEST, now};

/// A person who reads a tape does so at least this long after the train was commanded to stop; a reading without a watch
/// is dated so late that its date is not taken for the time of the stop.
const TAPE_LATER: TimeSpan = TimeSpan::from_ms(60_000);
/// The layout is surveyed to the centimetre: a train may stand this far beyond the next sensor by the survey before it
/// has closed it.
const SURVEY: Length = Length::from_m(0.03);

/// A run at whose end a train was commanded to stop.
pub(super) struct StoppedRun {
    pub(super) recording: StoredRecording,
    pub(super) run: StoredRun,
    /// When the train was commanded, and the step it was stopped from.
    commanded: Timestamp,
    from: SpeedStep,
}

impl StoppedRun {
    /// The last run in which the train was commanded anything, of one recording or of all.
    pub(super) fn find(store: &Store, train: TrainId, of: Option<RecordingKey>) -> anyhow::Result<Self> {
        let recordings = store.recordings(LATEST)?;
        if let Some(key) = of
            && recordings.iter().all(|recording| recording.key != key)
        {
            bail!("there is no recording {key}; `footplate store show` lists them");
        }
        for recording in recordings.into_iter().rev().filter(|one| of.is_none_or(|key| one.key == key)) {
            for run in store.runs(recording.key, LATEST)?.into_iter().rev() {
                if let Some((commanded, from)) = last_command(&run.accepted(), train)? {
                    return Ok(Self { recording, run, commanded, from });
                }
            }
        }
        bail!(
            "train {train} was not commanded in any run of {}, so none of its stops can be measured; \
             drive it first with --store, or import a recording of it",
            of.map_or_else(|| store.path().display().to_string(), |key| format!("recording {key}"))
        )
    }

    pub(super) fn from(&self) -> SpeedStep {
        self.from
    }

    /// The entry that says where the train stands, `took` after the command if somebody watched; or why it cannot stand
    /// there.
    pub(super) fn entry(
        &self,
        layout: &Layout,
        train: TrainId,
        at: Landmark,
        took: Option<TimeSpan>,
    ) -> anyhow::Result<Event> {
        if self.run.accepted().reported_train().is_none() {
            bail!(
                "other trains moved in run {}, too, and its reports do not say which train they are of, so a stop of train \
                 {train} in it cannot be used; drive train {train} alone and measure its next stop",
                self.run.id
            );
        }
        let landmark = sensor_of(layout, at)?;
        let event =
            Event { time: self.time(took), kind: EventKind::Stopped { train, landmark, offset: at.offset } };
        self.object(layout, train, at, event)?;
        Ok(event)
    }

    fn time(&self, took: Option<TimeSpan>) -> Timestamp {
        if let Some(took) = took {
            return self.commanded + took;
        }
        let latest = self.run.events.last().map_or(self.commanded, |stored| stored.raw.event.time);
        let since =
            self.run.began_at.map_or(Timestamp::ZERO, |began_at| Timestamp::ZERO + (now() - began_at));
        latest.max(since).max(self.commanded + TAPE_LATER)
    }

    /// Why the train cannot stand there, by what it passed in the run.
    fn object(&self, layout: &Layout, train: TrainId, at: Landmark, event: Event) -> anyhow::Result<()> {
        let run = self.run.accepted();
        let starts = run.trains.iter().find(|at_start| at_start.train == train);
        let begins = starts.map_or(SpeedStep::STAND, |at_start| at_start.step);
        let events: Vec<Event> = run.events.iter().map(|raw| raw.event).chain([event]).collect();
        let timing = PollTimingEstimator::default();
        let entries = events.iter().map(|event| (event, false));
        let read = RunPassages::read(layout, train, begins, 0, entries, &timing);
        let stop: &MeasuredStop = read.stops.last().context("the run has no stop of this train")?;
        let before = read.passages.iter().rposition(|passage| passage.window.until <= stop.commanded);
        let Some(before) = before else {
            bail!(
                "train {train} had passed no sensor in this run before its stop command, so its \
                 stopping distance is unknown"
            );
        };
        let passed = read.passages.get(before..).unwrap_or_default();
        let name = |passage: &Passage| layout.sensor_name(passage.sensor).to_owned();
        let here = layout.node_name(at.node);
        if passed.iter().all(|passage| passage.node != at.node) {
            let last = passed.last().map(name).unwrap_or_default();
            bail!(
                "train {train} was not reported at {here} while it stopped; lay the tape from {last}, \
                 the sensor it passed last"
            );
        }
        check_offset(layout, at)
    }
}

/// When a run's train was commanded to stop last and from which step; an error if it has been commanded to go on since.
fn last_command(run: &Run, train: TrainId) -> anyhow::Result<Option<(Timestamp, SpeedStep)>> {
    let starts = run.trains.iter().find(|at_start| at_start.train == train);
    let mut step = starts.map_or(SpeedStep::STAND, |at_start| at_start.step);
    let mut stopped = None;
    let mut commanded = false;
    for raw in &run.events {
        if let EventKind::Speed { train: of, step: to } = raw.event.kind
            && of == train
        {
            commanded = true;
            if to != SpeedStep::STAND {
                stopped = None;
            } else if step != SpeedStep::STAND {
                stopped = Some((raw.event.time, step));
            }
            step = to;
        }
    }
    if commanded && stopped.is_none() {
        bail!(
            "train {train} was last commanded to step {step}, in run {}: measure a stop while the train \
             is at rest, before the next command",
            run.id
        );
    }
    Ok(stopped)
}

fn sensor_of(layout: &Layout, at: Landmark) -> anyhow::Result<SensorId> {
    let name = layout.node_name(at.node);
    let sensor = layout.sensors().find(|(_, node)| *node == at.node);
    let Some((sensor, _)) = sensor else {
        bail!("{name} is not a sensor; lay the tape from the sensor that the train passed last");
    };
    Ok(sensor)
}

fn check_offset(layout: &Layout, at: Landmark) -> anyhow::Result<()> {
    let name = layout.node_name(at.node);
    let next = layout
        .hops_from(at.node)
        .map(|hop| (hop.length, layout.node_name(hop.to)))
        .max_by(|one, other| one.0.as_m().total_cmp(&other.0.as_m()));
    match next {
        Some((length, next)) if at.offset > length + SURVEY => bail!(
            "{:.0} mm past {name} lies beyond {next}, the next sensor {:.0} mm on; measure from the \
             sensor that the train passed last",
            at.offset.as_mm(),
            length.as_mm()
        ),
        _ if at.offset < Length::ZERO - SURVEY => bail!(
            "the train passed {name} and cannot stand {:.0} mm short of it; write C13+120mm for 120 mm past C13",
            -at.offset.as_mm()
        ),
        _ => Ok(()),
    }
}
