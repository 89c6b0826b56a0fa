//! Why a number is as it is: the measurements behind it, with the line of the file that tells each.

use std::io::Write;
use std::str::FromStr;

use anyhow::bail;
use footplate_core::calibration::{Direction, FittedPassage, SpeedKey};
use footplate_core::track::Layout;
use footplate_core::{Length, SpeedStep};
use footplate_store::Batch;
use serde_json::{Value, json};

use super::table::approach;

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
        let wrong = || {
            format!(
                "`{text}` names no number; right would be SPEED:14, STOP:8, LAW:up, LAW:down or LENGTH:C14-A4"
            )
        };
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
            bail!("nothing was measured of that: the table without --explain says what there is");
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
                    json!({ "number": listing.title, "measurements": rows })
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

fn hop_rows(layout: &Layout, batch: &Batch, passages: &[&FittedPassage]) -> Vec<Vec<Value>> {
    let hops = passages.windows(2).filter_map(|pair| match pair {
        [from, to] if !to.first => Some((from, to)),
        _ => None,
    });
    hops.map(|(from, to)| {
        let took = (to.passage.window.middle() - from.passage.window.middle()).as_s();
        let poll = from.passage.window.variance_s2() + to.passage.window.variance_s2();
        let surveyed = to.passage.way.map_or(0.0, |way| way.length.as_mm());
        let correction = batch
            .calibration
            .fit
            .correction(&batch.sections, to.key.train, &to.passage)
            .map_or(0.0, Length::as_mm);
        vec![
            json!(batch.runs.get(to.run).map_or(0, |run| run.id.0)),
            json!(layout.sensor_name(from.passage.sensor)),
            json!(layout.sensor_name(to.passage.sensor)),
            json!(to.passage.way.map_or(0, |way| way.missed())),
            rounded(took, 4),
            rounded(poll.sqrt(), 4),
            rounded(surveyed, 0),
            rounded(correction, 1),
            rounded((surveyed + correction) / took, 1),
            rounded(to.late_way.as_mm(), 1),
            json!(if to.suspicious { "suspicious" } else { "used" }),
            place(batch, to.run, to.passage.entry),
        ]
    })
    .collect()
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

fn speeds(layout: &Layout, batch: &Batch, step: SpeedStep) -> Vec<Listing> {
    let keys: Vec<SpeedKey> =
        batch.calibration.fit.speeds.keys().filter(|key| key.step == step).copied().collect();
    keys.into_iter()
        .map(|key| {
            let passages: Vec<&FittedPassage> = batch.calibration.behind(key).collect();
            let speed = batch.calibration.fit.speeds.get(&key);
            let (value, uncertainty) = speed
                .map_or((0.0, 0.0), |speed| (speed.value.as_mm_per_s(), speed.uncertainty.as_mm_per_s()));
            Listing {
                title: format!(
                    "Train {}, step {step}, reached from {}: {value:.1} ± {uncertainty:.1} mm/s",
                    key.train,
                    approach(key.approach)
                ),
                columns: HOP_COLUMNS.to_vec(),
                rows: hop_rows(layout, batch, &passages),
            }
        })
        .collect()
}

fn stops(batch: &Batch, step: SpeedStep) -> Vec<Listing> {
    let tables = batch.calibration.stops.iter().filter(|(_, table)| table.steps.contains_key(&step));
    tables
        .map(|(train, table)| Listing {
            title: format!("Train {train}, stops from step {step}, counted from the command"),
            columns: vec!["run", "from_mm_per_s", "distance_mm", "uncertainty_mm", "time_s", "told_by"],
            rows: table
                .measurements
                .iter()
                .filter(|stop| stop.step == step)
                .map(|stop| {
                    vec![
                        json!(batch.runs.get(stop.run).map_or(0, |run| run.id.0)),
                        rounded(stop.speed[0].as_mm_per_s(), 1),
                        rounded(stop.distance.length().as_mm(), 0),
                        rounded(stop.uncertainty.as_mm(), 0),
                        stop.time.map_or(Value::Null, |time| rounded(time.as_s(), 2)),
                        place(batch, stop.run, stop.entry),
                    ]
                })
                .collect(),
        })
        .collect()
}

fn changes(batch: &Batch, direction: Direction) -> Vec<Listing> {
    let laws = batch.calibration.laws.iter().filter(|((_, of), _)| *of == direction);
    laws.map(|((train, _), comparison)| {
        let own = batch
            .calibration
            .transients
            .iter()
            .filter(|change| change.train == *train && change.direction() == direction);
        let rows = own.flat_map(|change| {
            let [from, to] = change.steps;
            change.points.iter().map(move |point| {
                vec![
                    json!(batch.runs.get(change.run).map_or(0, |run| run.id.0)),
                    json!(from.get()),
                    json!(to.get()),
                    rounded(point.since_command, 3),
                    rounded(point.variance.sqrt(), 3),
                    rounded(1e3 * point.way, 1),
                    place(batch, change.run, point.entry),
                ]
            })
        });
        Listing {
            title: format!("Train {train}: {} changes behind its law", comparison.changes),
            columns: vec!["run", "from_step", "to_step", "since_command_s", "poll_s", "way_mm", "told_by"],
            rows: rows.collect(),
        }
    })
    .collect()
}

fn lengths(layout: &Layout, batch: &Batch, from: &str, to: &str) -> anyhow::Result<Vec<Listing>> {
    let hop = layout
        .node_named(from)
        .zip(layout.node_named(to))
        .and_then(|(from, to)| layout.hops_from(from).find(|hop| hop.to == to));
    let Some(hop) = hop else {
        bail!("no way leads from {from} to {to} without another contact between them on {}", layout.name());
    };
    let Some(section) = batch.sections.section(hop.id) else { return Ok(Vec::new()) };
    let passages: Vec<&FittedPassage> = batch.calibration.fit.passages.iter().collect();
    let over = |passage: &FittedPassage| {
        let ways = passage.passage.way.iter().flat_map(|way| way.hops().to_vec());
        ways.into_iter().any(|hop| batch.sections.section(hop) == Some(section))
    };
    let trains = batch.calibration.trains();
    Ok(trains
        .into_iter()
        .filter_map(|train| {
            let correction = batch.calibration.fit.sections.get(&(train, section))?;
            let pairs: Vec<&FittedPassage> = passages
                .windows(2)
                .filter_map(|pair| match pair {
                    [before, after] if after.key.train == train && !after.first && over(after) => {
                        Some([*before, *after])
                    }
                    _ => None,
                })
                .flatten()
                .collect();
            let rows = pairs.chunks(2).flat_map(|pair| hop_rows(layout, batch, pair)).collect();
            Some(Listing {
                title: format!(
                    "Train {train}, {from} to {to}: {:+.1} ± {:.1} mm to add to {:.0} mm",
                    correction.value.as_mm(),
                    correction.uncertainty.as_mm(),
                    hop.length.as_mm()
                ),
                columns: HOP_COLUMNS.to_vec(),
                rows,
            })
        })
        .collect())
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
