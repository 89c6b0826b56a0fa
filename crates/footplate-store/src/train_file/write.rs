//! Writes a train in Footplate's own format.

use std::fmt::Write as _;

use footplate_sim::line::{TractiveEffort, Train};

use super::own::FORMAT;

/// The text of a train file; it reads back as the same train, to the last bit.
#[must_use]
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
