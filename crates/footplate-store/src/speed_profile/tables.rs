//! Reads a profile of any form: XML by its first character, tables by the names of their columns.

use std::borrow::Cow;
use std::path::Path;

use footplate_core::SpeedStep;

use super::error::ProfileError;
use super::jmri;
use super::profile::{ProfileSpeed, SpeedProfile};
use crate::table::{LastLine, Row, Table, shown};
use crate::text_file::{TextFile, TextPlace};

/// The largest file that is read, in bytes: roster entries with thousands of CVs and labels have a tenth of it.
pub const LARGEST_PROFILE: usize = 4 * 1024 * 1024;
const PROFILE: TextFile =
    TextFile { kind: "the roster entry of one locomotive, or a table of speeds", largest: LARGEST_PROFILE };
/// More rows than a train passes in an evening.
const MOST_ROWS: usize = 20_000;
/// One km/h in mm/s.
const MM_S_PER_KMH: f64 = 1e6 / 3_600.0;
/// Full speed in the column `Velocity` of MVTrack unless stated otherwise: per cent.
const FULL_VELOCITY: f64 = 100.0;
/// Locomotives that an error names.
const MOST_NAMED: usize = 8;

const SPEED: &str = "a speed in mm/s, 0 or more";

/// What a file does not say itself.
#[derive(Debug, Clone, PartialEq)]
pub struct ProfileContext {
    /// The highest step of the decoder: 14, 28 or 126. Tables by step need it.
    pub highest: SpeedStep,
    /// The scale of the models, 87 for H0. Speeds of the full-size train need it.
    pub scale: Option<f64>,
    /// The locomotive, where a table has several.
    pub loco: Option<String>,
    /// The value of MVTrack's `Velocity` at full speed, if not 100.
    pub full_velocity: Option<f64>,
}

/// Reads the profile in the file at `path`.
///
/// # Errors
/// The first error, with file, line and column; a file without a usable speed.
pub fn read_profile(path: &Path, context: &ProfileContext) -> Result<SpeedProfile, ProfileError> {
    let file = path.display().to_string();
    parse_profile(&file, &PROFILE.read(path)?, context)
}

/// Reads a profile from the bytes of a file. `file` is its name in messages.
///
/// # Errors
/// As [`read_profile`].
pub fn parse_profile(
    file: &str,
    bytes: &[u8],
    context: &ProfileContext,
) -> Result<SpeedProfile, ProfileError> {
    let text = text_of(file, bytes)?;
    let profile = if text.trim_start().starts_with('<') {
        jmri::read(file, text)?
    } else {
        read_table(file, text, context)?
    };
    if profile.is_other_unit() {
        return Err(ProfileError::OtherUnit(file.to_owned()));
    }
    if profile.speeds.is_empty() {
        return Err(ProfileError::NoSpeeds(file.to_owned()));
    }
    Ok(profile)
}

/// The text of a file, without a byte order mark.
pub(super) fn text_of<'b>(file: &str, bytes: &'b [u8]) -> Result<&'b str, ProfileError> {
    PROFILE.check_size(file, bytes)?;
    let text = std::str::from_utf8(bytes)
        .map_err(|error| ProfileError::NotText(TextPlace::of_error(file, bytes, &error)))?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

fn read_table(file: &str, text: &str, context: &ProfileContext) -> Result<SpeedProfile, ProfileError> {
    let commas = with_commas(text);
    let mut table = Table::open(file, commas.as_bytes())?;
    let mut profile = SpeedProfile { source: file.to_owned(), ..SpeedProfile::default() };
    if let Some(columns) = table.columns_named(["LocoID", "KMH", "Velocity", "Direction"]) {
        read_track_measurements(file, &mut table, columns, context, &mut profile)?;
    } else if let Some([step, forward]) = table.columns_named(["step", "forward_mm_s"]) {
        let (reverse, uncertainty) = (table.column("reverse_mm_s"), table.column("uncertainty_mm_s"));
        let highest = context.highest.get();
        let mut rows = 0;
        while let Some(row) = table.next_row()? {
            count(&mut rows, &row, step)?;
            let at =
                row.read(step, &format!("a step from 0 to {highest}; --steps sets the highest"), |text| {
                    text.parse::<u8>().ok().filter(|step| *step <= highest)
                })?;
            let optional = |column: Option<_>| -> Result<Option<f64>, ProfileError> {
                let Some(column) = column else { return Ok(None) };
                Ok(if row.text(column).is_empty() {
                    None
                } else {
                    Some(row.read(column, SPEED, at_least_zero)?)
                })
            };
            profile.push(ProfileSpeed {
                line: row.line(),
                throttle: f64::from(at) / f64::from(highest.max(1)),
                forward_mm_s: optional(Some(forward))?,
                reverse_mm_s: optional(reverse)?,
                uncertainty_mm_s: optional(uncertainty)?,
            });
        }
    } else {
        return Err(ProfileError::Form(file.to_owned()));
    }
    if table.last_line() == LastLine::CutOff {
        let place = TextPlace { file: file.to_owned(), line: table.line() as usize, column: 1 };
        let problem =
            super::error::ProfileProblem::Xml("the line breaks off; complete it or delete it".to_owned());
        return Err(ProfileError::Wrong { place, problem });
    }
    Ok(profile)
}

/// The table with commas between its fields. Where it has semicolons instead, a comma is a decimal point.
fn with_commas(text: &str) -> Cow<'_, str> {
    let header = text.lines().next().unwrap_or_default();
    if header.contains(';') && !header.contains(',') {
        Cow::Owned(text.replace(',', ".").replace(';', ","))
    } else {
        Cow::Borrowed(text)
    }
}

fn at_least_zero(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|number| (0.0..=f64::MAX).contains(number))
}

fn count(rows: &mut usize, row: &Row<'_>, column: crate::table::Column) -> Result<(), ProfileError> {
    *rows += 1;
    if *rows > MOST_ROWS {
        return Err(row.wrong(column, format!("the last row: at most {MOST_ROWS} are read")).into());
    }
    Ok(())
}

/// Measurements of Rocrail's MVTrack: one row per passage of a measuring track.
fn read_track_measurements(
    file: &str,
    table: &mut Table<&[u8]>,
    [loco, kmh, velocity, direction]: [crate::table::Column; 4],
    context: &ProfileContext,
    profile: &mut SpeedProfile,
) -> Result<(), ProfileError> {
    let full = context.full_velocity.unwrap_or(FULL_VELOCITY);
    let Some(scale) = context.scale else {
        return Err(ProfileError::NeedsScale { file: file.to_owned(), column: "KMH".to_owned() });
    };
    let mut names: Vec<String> = Vec::new();
    let mut rows = 0;
    while let Some(row) = table.next_row()? {
        count(&mut rows, &row, loco)?;
        let name = row.text(loco);
        if context.loco.as_ref().is_some_and(|wanted| wanted != name) {
            continue;
        }
        if !names.iter().any(|known| known == name) && names.len() < MOST_NAMED {
            names.push(name.to_owned());
        }
        let speed =
            row.read(kmh, "a speed in km/h of the full-size train", at_least_zero)? * MM_S_PER_KMH / scale;
        let throttle =
            row.read(velocity, "a throttle setting up to full speed; --full-velocity sets it", |text| {
                at_least_zero(text).map(|velocity| velocity / full).filter(|throttle| *throttle <= 1.0)
            })?;
        let is_reverse =
            row.read(direction, "forward or reverse", |text| match text.to_ascii_lowercase().as_str() {
                "forward" | "forwards" | "fwd" | "true" | "1" => Some(false),
                "reverse" | "backward" | "backwards" | "rev" | "false" | "0" => Some(true),
                _ => None,
            })?;
        let (forward_mm_s, reverse_mm_s) = if is_reverse { (None, Some(speed)) } else { (Some(speed), None) };
        let line = row.line();
        profile.push(ProfileSpeed { line, throttle, forward_mm_s, reverse_mm_s, uncertainty_mm_s: None });
    }
    match names.as_slice() {
        [_, _, ..] => {
            let names: Vec<String> = names.iter().map(|name| shown(name)).collect();
            Err(ProfileError::Which { file: file.to_owned(), found: names.join(", ") })
        }
        _ => Ok(()),
    }
}
