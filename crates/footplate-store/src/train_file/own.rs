//! Footplate's own format of a train: TOML in SI units, with the units in the names.

use std::fmt::Write as _;

use footplate_core::{Acceleration, Length, Ratio, Speed};
use footplate_sim::line::{Brake, PerMille, Resistance, TractiveEffort, Train};

use super::form::{TrainFile, TrainFileForm, checked, full_brake_n};
use crate::document::{Fault, Node, Table, pairs};

/// The version of the format.
const FORMAT: i64 = 1;

const KEYS: [&str; 13] = [
    "format",
    "name",
    "about",
    "length_m",
    "weight_length_m",
    "mass_kg",
    "rotating_mass",
    "max_speed_m_s",
    "max_acceleration_m_s2",
    "resistance",
    "resistance_per_mille",
    "traction",
    "brake",
];

pub(super) fn read(node: &Node) -> Result<TrainFile, Fault> {
    let table = Table::of(node, "a train")?;
    table.check_format(FORMAT)?;
    table.only(&KEYS)?;
    let length = table.number("length_m")?;
    let mass_kg = table.number("mass_kg")?;
    let rotating_mass = Ratio::from_parts(table.number("rotating_mass")?);
    let brake = Table::of(table.needs("brake")?, "`brake`")?;
    brake.only(&["service_m_s2", "full_n"])?;
    let service = brake.number("service_m_s2")?;
    let inertia = mass_kg * (1.0 + rotating_mass.as_parts());
    let full_n = brake.optional_number("full_n")?.unwrap_or_else(|| full_brake_n(inertia, service));
    let traction = Table::of(table.needs("traction")?, "`traction`")?;
    let train = Train {
        name: table.text("name")?.to_owned(),
        length: Length::from_m(length),
        weight_length: Length::from_m(table.optional_number("weight_length_m")?.unwrap_or(length)),
        mass_kg,
        rotating_mass,
        resistance: resistance(&table, mass_kg)?,
        tractive_effort: tractive_effort(&traction)?,
        brake: Brake { service: Acceleration::from_m_per_s2(service), full_n },
        max_speed: Speed::from_m_per_s(table.number("max_speed_m_s")?),
        max_acceleration: table.optional_number("max_acceleration_m_s2")?.map(Acceleration::from_m_per_s2),
    };
    let train = checked(train, |error| match error.what {
        "mass" => table.place_of("mass_kg"),
        "length" => table.place_of("length_m"),
        "weight length" => table.place_of("weight_length_m"),
        "rotating mass" => table.place_of("rotating_mass"),
        "maximum speed" => table.place_of("max_speed_m_s"),
        "maximum acceleration" => table.place_of("max_acceleration_m_s2"),
        "service braking" => brake.place_of("service_m_s2"),
        "full brake force" => brake.place_of("full_n"),
        "power" => traction.place_of("power_w"),
        what if what.contains("tractive effort") => traction.place,
        _ => table.place_of("resistance"),
    })?;
    let about = table.optional_text("about")?.unwrap_or_default().trim().to_owned();
    Ok(TrainFile { form: TrainFileForm::Own, about, train })
}

/// Resistance as A + B v + C v², in N or in per mille of the weight.
fn resistance(table: &Table<'_>, mass_kg: f64) -> Result<Resistance, Fault> {
    if let (Some(both), Some(_)) = (table.get("resistance_per_mille"), table.get("resistance")) {
        return Err(both.not("`resistance_per_mille`", "absent beside `resistance`; one of the two holds"));
    }
    if let Some(node) = table.get("resistance_per_mille") {
        let per_mille = Table::of(node, "`resistance_per_mille`")?;
        per_mille.only(&["base", "rolling", "air", "head_wind_m_s"])?;
        let part = |key| Ok(per_mille.optional_number(key)?.unwrap_or(0.0));
        let coefficients = PerMille {
            base: per_mille.number("base")?,
            rolling: part("rolling")?,
            air: part("air")?,
            head_wind: Speed::from_m_per_s(part("head_wind_m_s")?),
        };
        return Ok(Resistance::per_mille(mass_kg, coefficients));
    }
    let davis = Table::of(table.needs("resistance")?, "`resistance`")?;
    davis.only(&["constant_n", "linear_n_s_m", "square_n_s2_m2"])?;
    Ok(Resistance::davis(
        davis.number("constant_n")?,
        davis.number("linear_n_s_m")?,
        davis.number("square_n_s2_m2")?,
    ))
}

/// Tractive effort as a table over speed, or as a force and a power.
fn tractive_effort(traction: &Table<'_>) -> Result<TractiveEffort, Fault> {
    traction.only(&["force_n", "power_w", "effort_n_at_m_s"])?;
    let Some(node) = traction.get("effort_n_at_m_s") else {
        let (force_n, power_w) = (traction.number("force_n")?, traction.number("power_w")?);
        return Ok(TractiveEffort::ForceAndPower { force_n, power_w });
    };
    if traction.get("force_n").is_some() || traction.get("power_w").is_some() {
        return Err(node.not("`effort_n_at_m_s`", "absent beside `force_n` and `power_w`"));
    }
    let points = pairs(node, "`effort_n_at_m_s`", ["force in N", "speed in m/s"])?;
    Ok(TractiveEffort::Table(points.into_iter().map(|(n, v)| (Speed::from_m_per_s(v), n)).collect()))
}

/// The text of a train file; it reads back as the same train, to the last bit.
pub fn write_train(train: &Train, about: &str) -> String {
    let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
    let mut text = format!("format = {FORMAT}\nname = {}\n", quoted(&train.name));
    if !about.is_empty() {
        let _ = writeln!(text, "about = {}", quoted(about));
    }
    // `{:?}` writes the shortest digits that read back as the same number, always with a point or an exponent.
    let mut number = |key: &str, value: f64| {
        let _ = writeln!(text, "{key} = {value:?}");
    };
    number("length_m", train.length.as_m());
    if train.weight_length != train.length {
        number("weight_length_m", train.weight_length.as_m());
    }
    number("mass_kg", train.mass_kg);
    number("rotating_mass", train.rotating_mass.as_parts());
    number("max_speed_m_s", train.max_speed.as_m_per_s());
    if let Some(limit) = train.max_acceleration {
        number("max_acceleration_m_s2", limit.as_m_per_s2());
    }
    let resistance = train.resistance;
    let _ = write!(
        text,
        "\n[resistance]\nconstant_n = {:?}\nlinear_n_s_m = {:?}\nsquare_n_s2_m2 = {:?}\n",
        resistance.constant_n, resistance.linear_n_s_per_m, resistance.square_n_s2_per_m2,
    );
    let _ = write!(
        text,
        "\n[brake]\nservice_m_s2 = {:?}\nfull_n = {:?}\n",
        train.brake.service.as_m_per_s2(),
        train.brake.full_n,
    );
    text.push_str("\n[traction]\n");
    match &train.tractive_effort {
        TractiveEffort::ForceAndPower { force_n, power_w } => {
            let _ = write!(text, "force_n = {force_n:?}\npower_w = {power_w:?}\n");
        }
        TractiveEffort::Table(points) => {
            text.push_str("effort_n_at_m_s = [\n");
            for (speed, force) in points {
                let _ = writeln!(text, "  [{force:?}, {:?}],", speed.as_m_per_s());
            }
            text.push_str("]\n");
        }
    }
    text
}
