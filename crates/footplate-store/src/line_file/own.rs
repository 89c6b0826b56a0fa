//! Footplate's own form of a line: TOML, speeds in km/h as the boards beside the track have them.

use footplate_core::{Length, TimeSpan};
use footplate_sim::line::{LineParts, Stop};

use super::form::{LineFile, LineFileForm, at_places, built, limits};
use crate::document::{DocumentProblem, Fault, Node, Table, pairs};

/// The version of the form.
pub(super) const FORMAT: i64 = 1;

const KEYS: [&str; 7] = [
    "format",
    "name",
    "about",
    "speed_limits_km_h",
    "gradients_per_mille",
    "curve_resistances_per_mille",
    "stops",
];

pub(super) fn read(node: &Node) -> Result<LineFile, Fault> {
    let table = Table::of(node, "a line")?;
    let format = table.number("format")?;
    if format != FORMAT as f64 {
        let what = "`format`".to_owned();
        let expected = format!("{FORMAT}, the one that this version of Footplate knows");
        let found = format.to_string();
        return Err((table.place_of("format"), DocumentProblem::Kind { what, found, expected }));
    }
    table.only(&KEYS)?;
    let steps = |key: &str, unit| match table.get(key) {
        Some(node) => pairs(node, &format!("`{key}`"), ["place in m", unit]),
        None => Ok(Vec::new()),
    };
    table.needs("speed_limits_km_h")?;
    let stops = table.list("stops")?.iter().map(stop).collect::<Result<_, Fault>>()?;
    let parts = LineParts {
        name: table.text("name")?.to_owned(),
        gradients: at_places(&steps("gradients_per_mille", "rise in per mille")?),
        curve_resistances: at_places(&steps("curve_resistances_per_mille", "resistance in per mille")?),
        speed_limits: limits(&steps("speed_limits_km_h", "limit in km/h")?),
        stops,
    };
    let line = built(parts, |error| {
        let key = match error.what {
            "gradient" => "gradients_per_mille",
            "curve resistance" => "curve_resistances_per_mille",
            "stop" => "stops",
            _ => "speed_limits_km_h",
        };
        table.place_of_entry(key, error.index)
    })?;
    let about = table.optional_text("about")?.unwrap_or_default().trim().to_owned();
    Ok(LineFile { form: LineFileForm::Own, about, line })
}

fn stop(node: &Node) -> Result<Stop, Fault> {
    let table = Table::of(node, "a stop")?;
    table.only(&["name", "at_m", "dwell_s"])?;
    Ok(Stop {
        name: table.text("name")?.to_owned(),
        at: Length::from_m(table.number("at_m")?),
        dwell: TimeSpan::from_s(table.optional_number("dwell_s")?.unwrap_or(0.0)),
    })
}
