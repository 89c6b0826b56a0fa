//! `footplate layout survey`: estimates the lengths of a layout from the runs of its trains, without a tape.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use footplate_core::model::MotionFit;
use footplate_core::model::survey::{SectionIndex, TrackSurvey};
use footplate_core::track::{Hop, Layout, Survey};
use footplate_core::{HALF_95, Length, TrainId};
use footplate_store::{
    LayoutFile, MotionReplay, Store, StoredModel, layout_named, write_layout, write_whole,
};
use serde_json::{Value, json};

use crate::clock::LATEST;
use crate::commands::Outcome;
use crate::commands::output_files::check_outputs;
use crate::counted::counted;

/// Estimate the lengths of a layout from the runs of its trains.
///
/// Edges may have no length (leave out `mm`), except one that is measured: best a long one between two sensors that
/// every train passes. The runs of `calibrate` and `drive` determine all others.
#[derive(Args)]
#[command(
    after_help = "Example: footplate layout survey attic.toml --store railway.db --out attic-surveyed.toml"
)]
pub(super) struct Arguments {
    /// The layout: a file, or the name of a built-in layout.
    layout: String,
    /// The store with the runs.
    #[arg(long, value_name = "FILE")]
    store: PathBuf,
    /// Write the layout with the estimated lengths to this file; every `--layout` accepts it.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        check_outputs([Path::new(&self.layout), &self.store], &[("--out", self.out.as_deref())])?;
        let file = layout_named(&self.layout)?;
        let layout = &file.layout;
        let fits = fits(layout, &self.store)?;
        let sections = SectionIndex::of(layout);
        let known: Vec<&MotionFit> = fits.iter().collect();
        let survey = TrackSurvey::of(layout, &sections, &known).with_context(|| {
            format!(
                "{}: no train has run on {} yet: calibrate one with `footplate calibrate --link … --store {}`",
                self.store.display(),
                layout.name(),
                self.store.display()
            )
        })?;
        let distances: Vec<Surveyed> = surveyed(layout, &sections, &survey);
        if let Some(path) = &self.out {
            let text = written(&file, &survey, &sections, fits.len())?;
            write_whole(path, text.as_bytes()).with_context(|| format!("writing {}", path.display()))?;
        }
        if self.json {
            let distances = distances.iter().map(|one| {
                json!({ "from": one.from, "to": one.to, "mm": one.length.as_mm(), "uncertainty_mm": one.uncertainty.as_mm() })
            });
            let all = json!({
                "layout": layout.name(), "trains": fits.len(), "scale_uncertainty_percent": 100.0 * survey.scale(),
                "distances": distances.collect::<Vec<Value>>(),
            });
            writeln!(output, "{all:#}")?;
            return Ok(Outcome::Done);
        }
        for Surveyed { from, to, length, uncertainty } in &distances {
            let within = HALF_95 * uncertainty.as_mm();
            writeln!(output, "{from:>8} {to:<8} {:>5.0} ± {within:.0} mm", length.as_mm())?;
        }
        writeln!(
            output,
            "{} from {} (95 %); a common scale error of up to {:.1} % comes on top",
            counted(distances.len(), "distance"),
            counted(fits.len(), "train"),
            100.0 * HALF_95 * survey.scale()
        )?;
        Ok(Outcome::Done)
    }
}

/// The estimated distance between neighbouring sensors.
struct Surveyed {
    from: String,
    to: String,
    length: Length,
    uncertainty: Length,
}

fn surveyed(layout: &Layout, sections: &SectionIndex, survey: &TrackSurvey) -> Vec<Surveyed> {
    let mut seen = BTreeSet::new();
    let between = |hop: &Hop<'_>| hop.sensor.is_some() && layout.sensor_at(hop.from).is_some();
    let found = layout.hops().filter(between).filter_map(|hop| {
        let section = sections.section(hop.id).filter(|section| seen.insert(*section))?;
        let [length, uncertainty] = survey.distance(section)?;
        let [from, to] = [hop.from, hop.to].map(|node| layout.node_name(node).to_owned());
        Some(Surveyed { from, to, length, uncertainty })
    });
    found.collect()
}

/// The fits of all trains that ran on the layout alone.
fn fits(layout: &Layout, path: &Path) -> anyhow::Result<Vec<MotionFit>> {
    let mut store = Store::open(path)?;
    let mut trains: BTreeSet<TrainId> = BTreeSet::new();
    for recording in
        store.recordings(LATEST)?.into_iter().filter(|recording| recording.layout == layout.name())
    {
        for run in store.runs(recording.key, LATEST)? {
            trains.extend(run.accepted().moving().iter().map(|at_start| at_start.train));
        }
    }
    let mut fits = Vec::new();
    for train in trains {
        let decoder = StoredModel::of_store(layout, &store, train, LATEST)?.decoder(&store, train, LATEST)?;
        let replay = MotionReplay::of_store(layout, &mut store, train, decoder.highest(), LATEST)?;
        if !replay.is_empty() {
            fits.push(replay.fit);
        }
    }
    Ok(fits)
}

/// The layout file with the estimated lengths.
fn written(
    file: &LayoutFile,
    survey: &TrackSurvey,
    sections: &SectionIndex,
    trains: usize,
) -> anyhow::Result<String> {
    let layout = survey.applied_to(&file.layout, sections)?;
    let lengths: Vec<_> = layout.edges().step_by(2).map(|(_, edge)| edge.known).collect();
    let before = &file.layout.survey().origin;
    let origin = format!("{before}; surveyed by {} that were driven", counted(trains, "train"));
    let layout = layout.surveyed(&lengths, Survey { origin, ..layout.survey().clone() })?;
    Ok(write_layout(&LayoutFile { layout, ..file.clone() }))
}
