//! `footplate measure stop`: adds a place of rest measured with a tape, and shows what that changes.

use std::io::Write;
use std::path::PathBuf;
use std::str::FromStr;

use anyhow::{Context, bail};
use clap::Args;
use footplate_core::model::StopForecast;
use footplate_core::model::report::TapedStop;
use footplate_core::track::Layout;
use footplate_core::{Approach, SpeedStep, TimeSpan, TrainId};
use footplate_store::{Batch, EventKey, RecordingKey, Store, layout_named};
use serde_json::{Value, json};

use super::stopped_run::StoppedRun;
use super::stops_picture::measured_stops;
use crate::clock::{LATEST, now};
use crate::commands::Outcome;
use crate::commands::plot::PictureFile;
use crate::error_text::error_text;
use crate::standard_error::say;

/// Beyond this many standard deviations from what the model expects a reading is pointed out: one in 300 by chance.
const REMARKABLE: f64 = 3.0;

/// Add where a train came to rest, measured from the sensor that it passed last to its pickup shoe.
///
/// The measurement belongs to the last stop of the train in the store. It is an event like any other: `footplate
/// store exclude` takes it out again.
#[derive(Args)]
#[command(after_help = "\
Examples:
  footplate measure stop --store railway.db --train 24 --at C13+120mm
  footplate measure stop --store railway.db --train 24 --at E12+1310mm --took 3.4s
  footplate measure stop --store railway.db --train 24 --at C13+120mm --plot stops.png")]
pub(super) struct Arguments {
    /// The store of the session, or of the recordings that were imported.
    #[arg(long, value_name = "FILE")]
    store: PathBuf,
    /// The train.
    #[arg(long, value_name = "N")]
    train: u16,
    /// The sensor that it passed last, and the distance from there to the leading end of its pickup shoe.
    #[arg(long, value_name = "PLACE")]
    at: String,
    /// How long it took from the command to rest, by a watch.
    #[arg(long, value_name = "TIME")]
    took: Option<Seconds>,
    /// The layout, if it is none of the built-in ones: the file that the recording was made with.
    #[arg(long, value_name = "LAYOUT")]
    layout: Option<String>,
    /// The recording that the stop is in, if not the last one of the train.
    #[arg(long, value_name = "N")]
    recording: Option<i64>,
    /// Draw all stops that were measured of the train to this file, SVG or PNG by its ending.
    #[arg(long, value_name = "FILE")]
    plot: Option<PictureFile>,
    /// Write JSON.
    #[arg(long)]
    json: bool,
}

/// A time as a person reads it off a watch.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Seconds(TimeSpan);

impl FromStr for Seconds {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let seconds = text.trim().trim_end_matches('s').trim_end().parse::<f64>();
        let seconds = seconds.ok().filter(|seconds| (0.1..=15.0).contains(seconds));
        let right = "write the seconds from the command until the train was at rest, from 0.1s to 15s, such as \
             3.4s";
        seconds.map(|seconds| Self(TimeSpan::from_s(seconds))).ok_or_else(|| right.to_owned())
    }
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let train = TrainId(self.train);
        let mut store = Store::open(&self.store)?;
        let stopped = StoppedRun::find(&store, train, self.recording.map(RecordingKey))?;
        let layout = self.layout_of(&stopped)?;
        let at = layout.landmark(&self.at)?;
        let event = stopped.entry(&layout, train, at, self.took.map(|took| took.0))?;
        let before = known(&layout, &store, train, stopped.from(), None);
        store.append(stopped.run.key, &[event], now())?;
        let key = last_event(&store, &stopped)?;
        let after = known(&layout, &store, train, stopped.from(), Some(key));
        let measured =
            MeasuredStop { arguments: &self, layout: &layout, stopped: &stopped, key, before, after };
        if self.json {
            writeln!(output, "{}", measured.value())?;
        } else {
            measured.write(output)?;
        }
        // The stop is stored by now: an error would invite a second try, which stores it twice.
        let drawn = self
            .plot
            .as_ref()
            .map_or(Ok(()), |plot| plot.write(&measured_stops(&layout, &store, train, stopped.from())?));
        if let Err(error) = drawn {
            say!(
                "the stop is stored as event {key}, do not add it again; its picture failed: {}; draw it with --plot at the next \
                 stop",
                error_text(&error)
            );
            return Ok(Outcome::FallsShort);
        }
        Ok(Outcome::Done)
    }

    fn layout_of(&self, stopped: &StoppedRun) -> anyhow::Result<Layout> {
        let name = &stopped.recording.layout;
        let layout = match &self.layout {
            Some(given) => layout_named(given)?.layout,
            None => {
                layout_named(name)
                    .with_context(|| {
                        format!("the recording is of the layout {name}: give its file with --layout FILE")
                    })?
                    .layout
            }
        };
        if layout.name() != name {
            bail!("the recording is of the layout {name}, not of {}", layout.name());
        }
        Ok(layout)
    }
}

/// What is known of stops from a step.
struct Known {
    /// By the motion model.
    stop: StopForecast,
    /// The stop that was measured now, once it is stored and can be counted from its command.
    this: Option<TapedStop>,
}

/// What the store shows of stops of a train from a step, and of the one that is stored as `key`.
fn known(
    layout: &Layout,
    store: &Store,
    train: TrainId,
    from: SpeedStep,
    key: Option<EventKey>,
) -> Option<Known> {
    let batch = Batch::of_store(layout, store, LATEST, Some(train)).ok()?;
    let train = batch.trains.first()?;
    let model = train.replay.fit.model();
    let is_known = [Approach::Below, Approach::Above].iter().any(|side| model.speed(from, *side).count > 0);
    let stored_as = |stop: &TapedStop| batch.event(stop.run, stop.entry).and_then(|event| event.stored_as);
    let is_this = |stop: &&TapedStop| key.is_some_and(|key| stored_as(stop) == Some(key.0));
    let this = train.review.stops.iter().find(is_this).copied();
    is_known.then(|| Known { stop: model.stop(from, Approach::Below), this })
}

fn last_event(store: &Store, stopped: &StoppedRun) -> anyhow::Result<EventKey> {
    let runs = store.runs(stopped.recording.key, LATEST)?;
    let run = runs.iter().find(|run| run.key == stopped.run.key);
    let last = run.and_then(|run| run.events.last());
    last.map(|stored| stored.key).context("the run has gone from the store")
}

/// What was done, for people and programs.
struct MeasuredStop<'a> {
    arguments: &'a Arguments,
    layout: &'a Layout,
    stopped: &'a StoppedRun,
    key: EventKey,
    before: Option<Known>,
    after: Option<Known>,
}

impl MeasuredStop<'_> {
    fn write(&self, output: &mut dyn Write) -> std::io::Result<()> {
        let Self { arguments: Arguments { train, at, .. }, stopped, key, .. } = self;
        let (run, recording, from) = (stopped.run.id, stopped.recording.key, stopped.from());
        writeln!(
            output,
            "event {key}: train {train} at rest at {at}, stopped from step {from} (recording \
             {recording}, run {run})"
        )?;
        let Some(after) = &self.after else {
            return writeln!(
                output,
                "stored; it is used for stops from step {from} once the speed at step {from} is known: \
                 run the train past two sensors at that step"
            );
        };
        let shown = |known: &Known| {
            let StopForecast { distance, doubt, .. } = known.stop;
            format!("{:.0} ± {:.0} mm", distance.as_mm(), doubt.as_mm())
        };
        let before = self.before.as_ref().map_or_else(String::new, |before| shown(before) + " -> ");
        writeln!(output, "stop from step {from}: {before}{}, {} measured", shown(after), after.stop.count)?;
        if let Some(sigmas) = self.remarkable() {
            writeln!(
                output,
                "this one is {sigmas:.0} standard deviations from what the model expected; if the tape was misread: footplate store \
                 exclude {key} --reason \"misread\" --store {}",
                self.arguments.store.display()
            )?;
        }
        Ok(())
    }

    /// How far the reading is from what the model expected before it, if that is far.
    fn remarkable(&self) -> Option<f64> {
        let StopForecast { distance, doubt, scatter, .. } = self.before.as_ref()?.stop;
        let this = self.after.as_ref()?.this?;
        let variance = doubt.as_m().powi(2) + scatter.as_m().powi(2) + this.uncertainty.as_m().powi(2);
        let sigmas = (this.distance.length() - distance).as_m().abs() / variance.sqrt();
        (sigmas > REMARKABLE).then_some(sigmas)
    }

    fn value(&self) -> Value {
        let known = |known: &Option<Known>| {
            known.as_ref().map(|known| {
                json!({
                    "distance_mm": known.stop.distance.as_mm(),
                    "uncertainty_mm": known.stop.doubt.as_mm(),
                    "measurements": known.stop.count,
                })
            })
        };
        json!({
            "event": self.key.0,
            "recording": self.stopped.recording.key.0,
            "run": self.stopped.run.id.0,
            "train": self.arguments.train,
            "layout": self.layout.name(),
            "at": self.arguments.at,
            "from_step": self.stopped.from().get(),
            "before": known(&self.before),
            "after": known(&self.after),
            "sigmas_from_expected": self.remarkable(),
        })
    }
}
