//! Why a number is as it is: the measurements behind it, with the line of the file that tells each.

use std::io::Write;
use std::str::FromStr;

use anyhow::bail;
use footplate_core::model::report::{Direction, SettledPassage};
use footplate_core::track::{Hop, Layout};
use footplate_core::{Approach, SpeedStep, TimeSpan};
use footplate_store::{Batch, BatchTrain};
use serde_json::{Value, json};

use super::table::approach;
use crate::counted::counted;

/// Which number is asked about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Question {
    Speed(SpeedStep),
    Stop(SpeedStep),
    Law(Direction),
    Length(String, String),
}

impl FromStr for Question {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("`{text}` names no figure: use SPEED:14, STOP:8, LAW:up, LAW:down or LENGTH:C14-A4");
        let (kind, name) = text.split_once(':').ok_or_else(wrong)?;
        let step = || name.parse().ok().and_then(SpeedStep::new).ok_or_else(wrong);
        match (kind.to_ascii_uppercase().as_str(), name) {
            ("SPEED", _) => Ok(Self::Speed(step()?)),
            ("STOP", _) => Ok(Self::Stop(step()?)),
            ("LAW", "up") => Ok(Self::Law(Direction::Up)),
            ("LAW", "down") => Ok(Self::Law(Direction::Down)),
            ("LENGTH", _) => {
                let (from, to) = name.split_once('-').ok_or_else(wrong)?;
                Ok(Self::Length(from.to_owned(), to.to_owned()))
            }
            _ => Err(wrong()),
        }
    }
}

/// A table of measurements: a title, the names of its columns, and rows of cells.
struct Listing {
    title: String,
    columns: Vec<&'static str>,
    rows: Vec<Vec<Value>>,
}

impl Question {
    /// Writes the measurements behind the number.
    ///
    /// # Errors
    /// Nothing was measured of it.
    pub(in crate::commands) fn answer(
        &self,
        layout: &Layout,
        batch: &Batch,
        as_json: bool,
        output: &mut dyn Write,
    ) -> anyhow::Result<()> {
        let listings = match self {
            Self::Speed(step) => speeds(layout, batch, *step),
            Self::Stop(step) => stops(batch, *step),
            Self::Law(direction) => changes(batch, *direction),
            Self::Length(from, to) => lengths(layout, batch, from, to)?,
        };
        if listings.is_empty() {
            bail!("there are no measurements of that: run without --explain to list the figures");
        }
        if as_json {
            let all: Vec<Value> = listings
                .iter()
                .map(|listing| {
                    let rows: Vec<Value> = listing
                        .rows
                        .iter()
                        .map(|row| listing.columns.iter().copied().zip(row.iter().cloned()).collect())
                        .collect();
                    json!({ "number": listing.title, "columns": listing.columns, "measurements": rows })
                })
                .collect();
            writeln!(output, "{}", serde_json::to_string_pretty(&all)?)?;
            return Ok(());
        }
        for (place, listing) in listings.iter().enumerate() {
            if place > 0 {
                writeln!(output)?;
            }
            write_listing(listing, output)?;
        }
        Ok(())
    }
}

fn write_listing(listing: &Listing, output: &mut dyn Write) -> std::io::Result<()> {
    writeln!(output, "{}", listing.title)?;
    let text = |value: &Value| match value {
        Value::String(text) => text.clone(),
        Value::Null => "–".to_owned(),
        other => other.to_string(),
    };
    let cells: Vec<Vec<String>> = listing.rows.iter().map(|row| row.iter().map(text).collect()).collect();
    let width = |column: usize| {
        let widest = cells.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
        widest.unwrap_or(0).max(listing.columns.get(column).map_or(0, |name| name.len()))
    };
    let widths: Vec<usize> = (0..listing.columns.len()).map(width).collect();
    let mut line = |cells: &mut dyn Iterator<Item = &str>| {
        let padded: Vec<String> = cells.zip(&widths).map(|(cell, width)| format!("{cell:>width$}")).collect();
        writeln!(output, "  {}", padded.join("  "))
    };
    line(&mut listing.columns.iter().copied())?;
    for row in &cells {
        line(&mut row.iter().map(String::as_str))?;
    }
    Ok(())
}

fn rounded(value: f64, digits: i32) -> Value {
    let scale = 10_f64.powi(digits);
    json!((value * scale).round() / scale)
}

/// `recording:line`, or the number of an event in the store.
fn place(batch: &Batch, run: usize, entry: usize) -> Value {
    let (Some(of), Some(event)) = (batch.runs.get(run), batch.event(run, entry)) else { return Value::Null };
    match event.stored_as {
        Some(key) => json!(format!("event {key} ({}:{})", of.recording, event.line)),
        None => json!(format!("{}:{}", of.recording, event.line)),
    }
}

/// The hops of stretches, one row each.
fn hop_rows<'p>(
    layout: &Layout,
    batch: &Batch,
    stretches: impl Iterator<Item = &'p [SettledPassage]>,
) -> Vec<Vec<Value>> {
    let hop = |pair: &[SettledPassage]| {
        let [from, to] = pair else { return None };
        let took = (to.passage.window.middle() - from.passage.window.middle()).as_s();
        let poll = from.passage.window.variance_s2() + to.passage.window.variance_s2();
        let surveyed = to.passage.path.map_or(0.0, |path| path.length.as_mm());
        Some(vec![
            json!(batch.runs.get(to.run).map_or(0, |run| run.id.0)),
            json!(layout.sensor_name(from.passage.sensor)),
            json!(layout.sensor_name(to.passage.sensor)),
            json!(to.passage.path.map_or(0, |path| path.missed())),
            rounded(took, 4),
            rounded(poll.sqrt(), 4),
            rounded(surveyed, 0),
            rounded(to.length.as_mm() - surveyed, 1),
            rounded(to.length.as_mm() / took, 1),
            rounded(to.late_length.as_mm(), 1),
            json!(if to.suspicious { "suspicious" } else { "used" }),
            place(batch, to.run, to.passage.entry),
        ])
    };
    stretches.flat_map(|stretch| stretch.windows(2).filter_map(hop).collect::<Vec<_>>()).collect()
}

const HOP_COLUMNS: [&str; 12] = [
    "run",
    "from",
    "to",
    "missed",
    "time_s",
    "poll_s",
    "survey_mm",
    "add_mm",
    "mm_per_s",
    "late_mm",
    "use",
    "told_by",
];

fn stretches(train: &BatchTrain) -> impl Iterator<Item = &[SettledPassage]> {
    train.review.running.stretches.iter().map(Vec::as_slice)
}

fn speeds(layout: &Layout, batch: &Batch, step: SpeedStep) -> Vec<Listing> {
    let listing = |train: &BatchTrain, side: Approach| {
        let is_own = |stretch: &&[SettledPassage]| {
            stretch.first().is_some_and(|first| {
                let drive = first.passage.drive;
                drive.step == step && drive.approach() == side
            })
        };
        let rows = hop_rows(layout, batch, stretches(train).filter(is_own));
        let model = train.replay.fit.model();
        let speed = model.speed(step, side);
        let (value, uncertainty) = (speed.value.as_mm_per_s(), speed.uncertainty.as_mm_per_s());
        (!rows.is_empty()).then(|| Listing {
            title: format!(
                "Train {}, step {step}, reached from {}: {value:.1} ± {uncertainty:.1} mm/s, from {}; listed are those \
                 between which it ran steadily",
                model.train(),
                approach(side),
                counted(speed.count, "report")
            ),
            columns: HOP_COLUMNS.to_vec(),
            rows,
        })
    };
    let sides = [Approach::Below, Approach::Above, Approach::Unknown];
    let of_train = |train| sides.into_iter().filter_map(move |side| listing(train, side));
    batch.trains.iter().flat_map(of_train).collect()
}

fn stops(batch: &Batch, step: SpeedStep) -> Vec<Listing> {
    let listing = |train: &BatchTrain| {
        let own = train.review.stops.iter().filter(|stop| stop.step == step);
        let rows: Vec<Vec<Value>> = own
            .map(|stop| {
                vec![
                    json!(batch.runs.get(stop.run).map_or(0, |run| run.id.0)),
                    rounded(stop.speed.as_mm_per_s(), 1),
                    rounded(stop.distance.length().as_mm(), 0),
                    rounded(stop.uncertainty.as_mm(), 0),
                    stop.time.map_or(Value::Null, |time: TimeSpan| rounded(time.as_s(), 2)),
                    place(batch, stop.run, stop.entry),
                ]
            })
            .collect();
        let model = train.replay.fit.model();
        let stop = model.stop(step, Approach::Below);
        (!rows.is_empty()).then(|| Listing {
            title: format!(
                "Train {}, stops from step {step}: {:.0} ± {:.0} mm; measured with a tape, counted from the command",
                model.train(),
                stop.distance.as_mm(),
                stop.doubt.as_mm()
            ),
            columns: vec!["run", "from_mm_per_s", "distance_mm", "uncertainty_mm", "time_s", "told_by"],
            rows,
        })
    };
    batch.trains.iter().filter_map(listing).collect()
}

fn changes(batch: &Batch, direction: Direction) -> Vec<Listing> {
    let listing = |train: &BatchTrain| {
        let review = &train.review;
        let comparison = review.laws.get(&direction)?;
        let own = review.changes.iter().filter(|change| change.direction() == direction);
        let rows = own.flat_map(|change| {
            let [from, to] = change.steps;
            change.points.iter().map(move |point| {
                vec![
                    json!(batch.runs.get(change.run).map_or(0, |run| run.id.0)),
                    json!(from.get()),
                    json!(to.get()),
                    rounded(point.since_command, 3),
                    rounded(point.variance.sqrt(), 3),
                    rounded(1e3 * point.distance, 1),
                    place(batch, change.run, point.entry),
                ]
            })
        });
        Some(Listing {
            title: format!(
                "Train {}: {} changes behind its law",
                train.replay.fit.model().train(),
                comparison.changes
            ),
            columns: vec!["run", "from_step", "to_step", "since_command_s", "poll_s", "way_mm", "told_by"],
            rows: rows.collect(),
        })
    };
    batch.trains.iter().filter_map(listing).collect()
}

fn lengths(layout: &Layout, batch: &Batch, from: &str, to: &str) -> anyhow::Result<Vec<Listing>> {
    let hop = layout
        .node_named(from)
        .zip(layout.node_named(to))
        .and_then(|(from, to)| layout.hops_from(from).find(|hop| hop.to == to));
    let Some(hop) = hop else {
        bail!("no path leads from {from} to {to} without another sensor between them on {}", layout.name());
    };
    let title = |train: &BatchTrain, hop: &Hop<'_>| {
        let model = train.replay.fit.model();
        let [length, uncertainty] = model.length(&batch.sections, hop);
        format!(
            "Train {}, {from} to {to}: {:+.1} ± {:.1} mm to add to {:.0} mm",
            model.train(),
            (length - hop.length).as_mm(),
            uncertainty.as_mm(),
            hop.length.as_mm()
        )
    };
    let Some(section) = batch.sections.section(hop.id) else { return Ok(Vec::new()) };
    let is_over = |pair: &&[SettledPassage]| {
        let path = pair.last().and_then(|passage| passage.passage.path);
        path.is_some_and(|path| path.hops().iter().any(|hop| batch.sections.section(*hop) == Some(section)))
    };
    let listing = |train: &BatchTrain| {
        let pairs = stretches(train).flat_map(|stretch| stretch.windows(2)).filter(is_over);
        let rows = hop_rows(layout, batch, pairs);
        (!rows.is_empty()).then(|| Listing { title: title(train, &hop), columns: HOP_COLUMNS.to_vec(), rows })
    };
    Ok(batch.trains.iter().filter_map(listing).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn questions_are_read_and_wrong_ones_answered() {
        assert_eq!("SPEED:14".parse(), Ok(Question::Speed(SpeedStep::new(14).unwrap())));
        assert_eq!("speed:8".parse(), Ok(Question::Speed(SpeedStep::new(8).unwrap())));
        assert_eq!("LENGTH:C14-A4".parse(), Ok(Question::Length("C14".into(), "A4".into())));
        for wrong in ["", "SPEED", "SPEED:", "SPEED:200", "LAW:sideways", "LENGTH:C14", "MOOD:14"] {
            let answer = wrong.parse::<Question>().unwrap_err();
            assert!(answer.contains("SPEED:14"), "{answer}");
        }
    }
}
