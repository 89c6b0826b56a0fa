//! `footplate store show`: what is in a store, as of today or any other date.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;

use anyhow::{Context, bail};
use clap::Args;
use footplate_core::track::Layout;
use footplate_core::{EventKind, SensorId, Timestamp, TrainId};
use footplate_store::{
    Batch, Findings, RecordingKey, SensorNames, Store, StoredEvent, StoredRecording, StoredRun, layout_named,
};
use serde_json::{Value, json};

use crate::clock::{LATEST, Moment, local, now, rfc3339};
use crate::commands::Outcome;
use crate::commands::calibrate::draw_calibration;
use crate::commands::plot::PictureFile;
use crate::counted::counted;

/// Show what is in the store, and look whether the file is sound.
#[derive(Args)]
#[command(after_help = "\
Examples:
  footplate store show --recording 3 --events --as-of 2026-11-20
  footplate store show --plot train24.svg --train 24")]
pub(super) struct Arguments {
    /// The runs of this recording.
    #[arg(long, value_name = "N")]
    recording: Option<i64>,
    /// Every event of the recording as well.
    #[arg(long, requires = "recording")]
    events: bool,
    /// As it was at this date.
    #[arg(long, value_name = "DATE")]
    as_of: Option<Moment>,
    /// Draw what the whole store says of a train, speeds and stops by step, to this file, SVG or PNG by its ending.
    #[arg(long, value_name = "FILE", conflicts_with = "recording")]
    plot: Option<PictureFile>,
    /// The train that is drawn, if there are several.
    #[arg(long, value_name = "N", requires = "plot")]
    train: Option<u16>,
    /// The layout of the recordings that are drawn, if they are of several or it is a file.
    #[arg(long, value_name = "LAYOUT", requires = "plot")]
    layout: Option<String>,
    /// Write JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self, path: &Path, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let store = Store::open_to_read(path)?;
        store.check()?;
        let as_of = self.as_of.map_or(LATEST, |moment| moment.0);
        let recordings = store.recordings(as_of)?;
        if let Some(plot) = &self.plot {
            let layout = self.layout_drawn(&recordings)?;
            let batch = Batch::of_store(&layout, &store, as_of, self.train.map(TrainId))?;
            draw_calibration(&Findings::of(&layout, &batch), plot)?;
        }
        let Some(key) = self.recording.map(RecordingKey) else {
            if self.json {
                let list: Vec<Value> = recordings.iter().map(recording_value).collect();
                let date = rfc3339(self.as_of.map_or_else(now, |moment| moment.0));
                let list = json!({ "store": path, "as_of": date, "recordings": list });
                writeln!(output, "{list:#}")?;
            } else {
                write_list(path, &store, &recordings, output)?;
            }
            return Ok(Outcome::Done);
        };
        let runs = store.runs(key, as_of)?;
        let Some(recording) = recordings.iter().find(|recording| recording.key == key) else {
            bail!("recording {key} was not in the store yet on {}", local(as_of));
        };
        // The layout may be a file that is not here; its sensors then go by their numbers.
        let layout = layout_named(&recording.layout).ok().map(|file| file.layout);
        let names = layout.as_ref().map(|layout| layout as &dyn SensorNames);
        if self.json {
            let mut value = recording_value(recording);
            value["runs"] = runs.iter().map(|run| run_value(run, self.events, names)).collect();
            writeln!(output, "{value:#}")?;
        } else {
            write_runs(recording, &runs, output)?;
            if self.events {
                write_events(&runs, names, output)?;
            }
        }
        Ok(Outcome::Done)
    }

    /// The layout that the recordings are of: the only one, unless it is named.
    fn layout_drawn(&self, recordings: &[StoredRecording]) -> anyhow::Result<Layout> {
        if let Some(named) = &self.layout {
            return Ok(layout_named(named)?.layout);
        }
        let layouts: BTreeSet<&str> = recordings.iter().map(|recording| recording.layout.as_str()).collect();
        match layouts.iter().copied().collect::<Vec<_>>().as_slice() {
            [] => bail!("the store held no recording, so there is nothing to draw"),
            [only] => Ok(layout_named(only)
                .with_context(|| {
                    format!("the recordings are of the layout {only}: give its file with --layout FILE")
                })?
                .layout),
            several => bail!(
                "a picture is of one layout, and the recordings are of {}; choose one with --layout",
                several.join(", ")
            ),
        }
    }
}

fn write_list(
    path: &Path,
    store: &Store,
    recordings: &[StoredRecording],
    output: &mut dyn Write,
) -> std::io::Result<()> {
    let sum = |count: fn(&StoredRecording) -> u64| recordings.iter().map(count).sum::<u64>();
    let counts = [
        counted(recordings.len(), "recording"),
        counted(sum(|recording| recording.runs), "run"),
        counted(sum(|recording| recording.events), "event"),
    ];
    let excluded = sum(|recording| recording.excluded);
    writeln!(output, "{} is sound: {}, {excluded} excluded", path.display(), counts.join(", "))?;
    if let Some(cut) = store.cut_commit() {
        writeln!(output, "{cut}; `footplate store salvage` brings over what can be read of it")?;
    }
    if recordings.is_empty() {
        return Ok(());
    }
    writeln!(
        output,
        "\nrecording  stored               runs   events  excluded  layout        form           name"
    )?;
    for recording in recordings {
        writeln!(
            output,
            "{:>9}  {}  {:>4}  {:>7}  {:>8}  {:<12}  {:<13}  {}",
            recording.key,
            local(recording.stored_at),
            recording.runs,
            recording.events,
            recording.excluded,
            recording.layout,
            recording.form,
            recording.name
        )?;
    }
    Ok(())
}

fn write_runs(
    recording: &StoredRecording,
    runs: &[StoredRun],
    output: &mut dyn Write,
) -> std::io::Result<()> {
    let StoredRecording { key, name, form, layout, .. } = recording;
    writeln!(output, "recording {key}: {name}, {form} on {layout}, stored {}", local(recording.stored_at))?;
    writeln!(output, "\n  run  events         excluded  lasts       at its beginning")?;
    for run in runs {
        let numbers = match (run.events.first(), run.events.last()) {
            (Some(first), Some(last)) => format!("{}-{}", first.key, last.key),
            _ => "none".to_owned(),
        };
        let excluded = run.events.iter().filter(|stored| stored.is_excluded()).count();
        let trains: Vec<String> = run
            .trains
            .iter()
            .map(|at_start| format!("train {} at step {}", at_start.train, at_start.step))
            .collect();
        let lasts = lasts(run);
        writeln!(
            output,
            "{:>5}  {numbers:<13}  {excluded:>8}  {lasts:>8.3} s  {}",
            run.id,
            trains.join(", ")
        )?;
    }
    Ok(())
}

/// From the first event to the last, in seconds.
fn lasts(run: &StoredRun) -> f64 {
    match (run.events.first(), run.events.last()) {
        (Some(first), Some(last)) => (last.raw.event.time - first.raw.event.time).as_s(),
        _ => 0.0,
    }
}

fn write_events(
    runs: &[StoredRun],
    names: Option<&dyn SensorNames>,
    output: &mut dyn Write,
) -> std::io::Result<()> {
    writeln!(output, "\n  event    run          time  what")?;
    for run in runs {
        for stored in &run.events {
            let time = (stored.raw.event.time - Timestamp::ZERO).as_s();
            write!(output, "{:>7}  {:>5}  {time:>10.3} s  ", stored.key, run.id)?;
            write!(output, "{}", words(stored.raw.event.kind, names))?;
            match &stored.mark {
                Some(mark) if stored.is_excluded() => {
                    writeln!(output, "; excluded {}: {}", local(mark.made_at), mark.reason)?;
                }
                _ => writeln!(output)?,
            }
        }
    }
    Ok(())
}

/// An event as people read it.
pub(in crate::commands) fn words(kind: EventKind, names: Option<&dyn SensorNames>) -> String {
    match kind {
        EventKind::Sensor(report) => format!("sensor {}", sensor_name(report.sensor, names)),
        EventKind::Freed(report) => format!("block {} free", sensor_name(report.sensor, names)),
        EventKind::Speed { train, step } => format!("train {train} to step {step}"),
        EventKind::Reverse { train } => format!("train {train} reversed"),
        EventKind::Turnout { turnout, curved } => {
            format!("turnout {turnout} {}", if curved { "curved" } else { "straight" })
        }
        EventKind::Stopped { train, landmark, offset } => {
            let landmark = sensor_name(landmark, names);
            format!("train {train} stopped {:.0} mm past {landmark}", offset.as_mm())
        }
    }
}

fn sensor_name(sensor: SensorId, names: Option<&dyn SensorNames>) -> String {
    names.and_then(|names| names.name_of(sensor)).unwrap_or_else(|| sensor.to_string())
}

fn recording_value(recording: &StoredRecording) -> Value {
    json!({
        "recording": recording.key.0,
        "name": recording.name,
        "form": recording.form,
        "layout": recording.layout,
        "stored_at": rfc3339(recording.stored_at),
        "run_count": recording.runs,
        "event_count": recording.events,
        "excluded_count": recording.excluded,
    })
}

fn run_value(run: &StoredRun, with_events: bool, names: Option<&dyn SensorNames>) -> Value {
    let trains = run.trains.iter().map(|at_start| json!({ "train": at_start.train, "step": at_start.step }));
    let mut value = json!({
        "run": run.id,
        "began_at": run.began_at.map(rfc3339),
        "trains": trains.collect::<Value>(),
        "event_count": run.events.len(),
        "gate_passes": run.gates.len(),
    });
    if with_events {
        value["events"] = run.events.iter().map(|stored| event_value(stored, names)).collect();
    }
    value
}

fn event_value(stored: &StoredEvent, names: Option<&dyn SensorNames>) -> Value {
    json!({
        "event": stored.key.0,
        "line": stored.raw.line,
        "t_s": (stored.raw.event.time - Timestamp::ZERO).as_s(),
        "what": words(stored.raw.event.kind, names),
        "excluded": stored.mark.as_ref().filter(|_| stored.is_excluded()).map(|mark| &mark.reason),
    })
}
