//! `footplate compare`: what recordings show beside what others published of trains of the same number.

mod markdown;
mod picture;
mod sessions;
mod table;

use std::io::Write;
use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use footplate_core::track::Layout;
use footplate_core::{Approach, TrainId};
use footplate_store::{
    Batch, CheckedFigure, CountedFrom, CrossCheck, Findings, PublishedQuantity, SessionCheck, layout_named,
    read_published_table,
};
use serde_json::{Value, json};

use super::Outcome;
use super::log_file::LogFile;
use super::plot::PictureFile;

/// Compare speeds and stops with tables that others published, or with another session.
///
/// Calibrates from the recordings and sets every published figure of the same train and throttle step beside ours:
/// the difference in percent, and in standard deviations of what teams differ by anyway.
#[derive(Args)]
#[command(after_help = "\
Examples:
  footplate compare testdata/sensor-logs/*.csv --layout track-a --with testdata/published-tables/*.csv
  footplate compare testdata/sensor-logs/choo*.csv --layout track-a --session testdata/sensor-logs/eadanila*.csv")]
pub(crate) struct Arguments {
    /// Sensor logs (CSV), in any of the forms of docs/formats/sensor-log.md.
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// A built-in layout (track-a, track-b, oval-blocks) or a layout file (TOML).
    #[arg(long, value_name = "LAYOUT")]
    layout: String,
    /// Tables of published speeds or stops (CSV), as testdata/published-tables describes them.
    #[arg(long, value_name = "FILE", num_args = 1.., required_unless_present = "session")]
    with: Vec<PathBuf>,
    /// Compare with recordings of another session of the same trains instead (CSV).
    #[arg(long, value_name = "LOG", num_args = 1.., conflicts_with_all = ["with", "plot", "markdown"])]
    session: Vec<PathBuf>,
    /// Only this train; also the train of logs that name none, in their rows or their file name.
    #[arg(long, value_name = "N")]
    train: Option<u16>,
    /// Draw the figures of one train to this file, SVG or PNG by its ending.
    #[arg(long, value_name = "FILE")]
    plot: Option<PictureFile>,
    /// Print the comparison as JSON.
    #[arg(long)]
    json: bool,
    /// Print it as a page of Markdown.
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let layout = layout_named(&self.layout)?.layout;
        let train = self.train.map(TrainId);
        if !self.session.is_empty() {
            return self.compare_sessions(&layout, output);
        }
        let mut figures = Vec::new();
        for path in &self.with {
            figures.extend(read_published_table(path)?);
        }
        figures.retain(|figure| train.is_none_or(|train| train == figure.train));
        let recordings = LogFile::recordings(&self.logs, &layout, train)?;
        let batch = Batch::of_recordings(&layout, &recordings, train)?;
        let check = CrossCheck::of(&Findings::of(&layout, &batch), &figures)?;
        if let Some(plot) = &self.plot {
            let picture = picture::of(&check).with_context(|| {
                format!("{}: a picture is of one train; choose one with --train", plot.path().display())
            })?;
            plot.write(&picture)?;
        }
        if self.json {
            writeln!(output, "{}", serde_json::to_string_pretty(&as_json(&check))?)?;
        } else if self.markdown {
            markdown::write(&check, &markdown::Sources { logs: &self.logs, tables: &self.with }, output)?;
        } else {
            table::write(&check, output)?;
        }
        Ok(Outcome::Done)
    }

    fn compare_sessions(&self, layout: &Layout, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let train = self.train.map(TrainId);
        let batch = |logs: &[PathBuf]| -> anyhow::Result<Batch> {
            let recordings = LogFile::recordings(logs, layout, train)?;
            Ok(Batch::of_recordings(layout, &recordings, train)?)
        };
        let check = SessionCheck::of(&batch(&self.logs)?, &batch(&self.session)?)
            .context("the sessions have no step of a train in common, so there is nothing to compare")?;
        if self.json {
            writeln!(output, "{}", serde_json::to_string_pretty(&sessions::as_json(&check))?)?;
        } else {
            sessions::write(&check, output)?;
        }
        Ok(Outcome::Done)
    }
}

fn as_json(check: &CrossCheck) -> Value {
    let figures = |figures: &[CheckedFigure]| figures.iter().map(figure).collect::<Vec<Value>>();
    json!({
        "speed_spread_percent": check.speed_spread_percent,
        "stop_spread_percent": check.stop_spread_percent,
        "published": check.without_counterpart[0],
        "without_counterpart": check.without_counterpart[1],
        "spread_unknown": check.spread_unknown,
        "speeds_mm_per_s": figures(&check.speeds),
        "stops_mm": figures(&check.stops),
    })
}

fn figure(figure: &CheckedFigure) -> Value {
    json!({
        "train": figure.train, "step": figure.step, "approach": approach(figure.approach),
        "counted_from": counted_from(figure.quantity),
        "ours": figure.ours[0], "uncertainty": figure.ours[1],
        "theirs": figure.theirs, "readings": figure.readings, "team": figure.team, "term": figure.term,
        "difference_percent": figure.difference_percent(), "sigmas": figure.sigmas(), "agrees": figure.agrees(),
    })
}

/// What was left out of a comparison, a sentence each.
fn left_out(check: &CrossCheck) -> Vec<String> {
    let [all, without] = check.without_counterpart;
    let mut sentences = vec![format!(
        "{without} of {all} published figures are of trains or steps that the recordings do not show"
    )];
    if check.spread_unknown > 0 {
        sentences.push(format!(
            "{} of {all} cannot be judged: no two teams measured the same step of a train in that kind of figure, so that how \
             far teams differ is unknown",
            check.spread_unknown
        ));
    }
    sentences
}

const fn approach(approach: Approach) -> &'static str {
    match approach {
        Approach::Below => "below",
        Approach::Above => "above",
        Approach::Unknown => "not stated",
    }
}

const fn counted_from(quantity: PublishedQuantity) -> Option<&'static str> {
    match quantity {
        PublishedQuantity::Speed => None,
        PublishedQuantity::Stop(CountedFrom::Command) => Some("command"),
        PublishedQuantity::Stop(CountedFrom::Gate) => Some("light gate"),
        PublishedQuantity::Stop(CountedFrom::NotStated) => Some("not stated"),
    }
}

const fn verdict(figure: &CheckedFigure, agrees: bool) -> &'static str {
    match (agrees, figure.ours[0] < figure.theirs) {
        (true, _) => "agrees",
        (false, true) => "ours is less",
        (false, false) => "ours is more",
    }
}
