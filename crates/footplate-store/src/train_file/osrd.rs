//! Rolling stock of OSRD (JSON), which has one effort curve per traction mode.
//!
//! The default curve of the default mode is read; restrictions of power and comfort are ignored.

use footplate_core::{Acceleration, Length, Ratio, Speed};
use footplate_sim::line::{Brake, Resistance, TractiveEffort, Train};

use super::form::{TrainFile, TrainFileForm, checked, full_brake_n};
use crate::document::{Fault, Node, Table};

pub(super) fn read(node: &Node) -> Result<TrainFile, Fault> {
    let table = Table::of(node, "rolling stock")?;
    let mass_kg = table.number("mass")?;
    let inertia_coefficient = table.number("inertia_coefficient")?;
    let rotating_mass = Ratio::from_parts(inertia_coefficient - 1.0);
    let davis = Table::of(table.needs("rolling_resistance")?, "`rolling_resistance`")?;
    if davis.text("type")? != "davis" {
        return Err(davis.needs("type")?.not("`type`", "\"davis\", the one kind that is known"));
    }
    let (service, braking) = deceleration(&table)?;
    let length = Length::from_m(table.number("length")?);
    let curves = Table::of(table.needs("effort_curves")?, "`effort_curves`")?;
    let (tractive_effort, mode) = effort(&curves)?;
    let train = Train {
        name: table.text("name")?.to_owned(),
        length,
        weight_length: length,
        mass_kg,
        rotating_mass,
        resistance: Resistance::davis(davis.number("A")?, davis.number("B")?, davis.number("C")?),
        tractive_effort,
        brake: Brake {
            service: Acceleration::from_m_per_s2(service),
            full_n: full_brake_n(mass_kg * inertia_coefficient, service),
        },
        max_speed: Speed::from_m_per_s(table.number("max_speed")?),
        max_acceleration: table.optional_number("comfort_acceleration")?.map(Acceleration::from_m_per_s2),
    };
    let train = checked(train, |error| match error.what {
        "mass" => table.place_of("mass"),
        "length" | "weight length" => table.place_of("length"),
        "rotating mass" => table.place_of("inertia_coefficient"),
        "maximum speed" => table.place_of("max_speed"),
        "maximum acceleration" => table.place_of("comfort_acceleration"),
        "service braking" | "full brake force" => braking.place,
        what if what.contains("resistance") => davis.place,
        _ => curves.place,
    })?;
    let version = table.optional_text("railjson_version")?.unwrap_or("of no version");
    let about = format!("From rolling stock of OSRD, railjson {version}, mode {mode}");
    Ok(TrainFile { form: TrainFileForm::Osrd, about, train })
}

/// The service deceleration, of the newer key or of the older `gamma`, with its place.
fn deceleration<'a>(table: &Table<'a>) -> Result<(f64, &'a Node), Fault> {
    if let Some(node) = table.get("const_gamma") {
        return Ok((node.number("`const_gamma`")?, node));
    }
    let node = table.needs("gamma")?;
    Ok((Table::of(node, "`gamma`")?.number("value")?, node))
}

/// The tractive effort of the default mode, and the name of the mode.
fn effort<'a>(curves: &Table<'a>) -> Result<(TractiveEffort, &'a str), Fault> {
    let mode = curves.text("default_mode")?;
    let modes = Table::of(curves.needs("modes")?, "`modes`")?;
    let curve = Table::of(modes.needs(mode)?, "the default mode")?.needs("default_curve")?;
    let curve = Table::of(curve, "`default_curve`")?;
    let (speeds, efforts) = (curve.list("speeds")?, curve.list("max_efforts")?);
    if speeds.len() != efforts.len() {
        let expected = format!("a list of {}, as long as `speeds`", speeds.len());
        return Err(curve.needs("max_efforts")?.not("`max_efforts`", &expected));
    }
    let points = speeds.iter().zip(efforts).map(|(speed, force)| {
        Ok((Speed::from_m_per_s(speed.number("a speed")?), force.number("an effort")?))
    });
    Ok((TractiveEffort::Table(points.collect::<Result<_, Fault>>()?), mode))
}
