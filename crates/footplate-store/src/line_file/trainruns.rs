//! Lines after the running-path schema of railtoolkit (YAML), as TrainRuns.jl reads them.
//!
//! A characteristic section gives one resistance of the path for gradient and curves together; it counts as gradient
//! here. Trains start at the first section and stop where the last one begins.

use footplate_core::{Length, TimeSpan};
use footplate_sim::line::{LineParts, Stop};

use super::form::{LineFile, LineFileForm, at_places, built, limits};
use crate::document::{Fault, Node, Table};
use crate::railtoolkit::{VERSION, after_schema, chosen};

/// The schema that is read.
const SCHEMA: &str = "https://railtoolkit.org/schema/running-path.json";

pub(super) fn read(node: &Node, which: Option<&str>) -> Result<LineFile, Fault> {
    let table = Table::of(node, "a file of running paths")?;
    after_schema(&table, SCHEMA)?;
    let path = chosen(&table, "paths", which)?;
    let (mut speed_limits, mut gradients) = (Vec::new(), Vec::new());
    for section in path.list("characteristic_sections")? {
        const ITEMS: [&str; 3] = ["place in m", "limit in km/h", "resistance in per mille"];
        let [place, limit, resistance] = section.row("a characteristic section", ITEMS)?;
        let place = place.number(ITEMS[0])?;
        speed_limits.push((place, limit.number(ITEMS[1])?));
        gradients.push((place, resistance.number(ITEMS[2])?));
    }
    let ends = [("begin", speed_limits.first()), ("end", speed_limits.last())];
    let stops = ends.into_iter().filter_map(|(name, section)| {
        let at = Length::from_m(section?.0);
        Some(Stop { name: name.to_owned(), at, dwell: TimeSpan::ZERO })
    });
    let parts = LineParts {
        name: path.text("name")?.to_owned(),
        gradients: at_places(&gradients),
        curve_resistances: Vec::new(),
        speed_limits: limits(&speed_limits),
        stops: stops.collect(),
    };
    let line = built(parts, |error| path.place_of_entry("characteristic_sections", error.index))?;
    let about = format!("From {SCHEMA}, {VERSION}: {}", path.text("id")?);
    Ok(LineFile { form: LineFileForm::TrainRuns, about, line })
}
