//! The pairs of a mapping, from the command line and from a file.

use std::path::Path;

use toml::de::{DeTable, DeValue};

use super::target::Target;
use crate::table::shown;
use crate::text_file::{TextFile, TextFileError, TextPlace};

/// The largest file that is read, in bytes: a hundred times one that names every column.
const MAPPING: TextFile = TextFile { kind: "a column mapping", largest: 64 * 1024 };
/// Longest and shortest period that a counter of rows can have (s), as the `period_s` of a vehicle.
const PERIODS_S: std::ops::RangeInclusive<f64> = 0.001..=1.0;

/// Which column of a recording holds what, and how its numbers are written. Empty, it changes nothing but the separators.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ColumnMapping {
    /// Our name and theirs.
    pub(super) pairs: Vec<(&'static str, Target, String)>,
    /// What stands between fields; found in the header if it is not said.
    pub(super) separator: Option<u8>,
    /// The decimal mark, `.` or `,`; found in each field if it is not said.
    pub(super) decimal: Option<char>,
    /// How long a period of a counter of rows is (s).
    pub(super) period_s: Option<f64>,
}

impl ColumnMapping {
    /// Takes in a pair as it is written on the command line, `our name=their name`. A later pair replaces an earlier one of
    /// the same name.
    ///
    /// # Errors
    /// A pair that is none or a name that we do not have, with what would be right.
    pub fn take_pair(&mut self, pair: &str) -> Result<(), MappingError> {
        let wrong = |problem| MappingError::Pair { pair: shown(pair), problem };
        let (name, value) = pair.split_once('=').ok_or_else(|| {
            wrong("there should be a `=` between our name and theirs, as in speed_1_km_h=v1".to_owned())
        })?;
        self.set(name.trim(), value.trim()).map_err(wrong)
    }

    /// Takes in the pairs of a TOML file, `our_name = "their name"`, a line each.
    ///
    /// # Errors
    /// What is wrong with it, with file, line and column.
    pub fn take_file(&mut self, path: &Path) -> Result<(), MappingError> {
        let file = path.display().to_string();
        self.take_bytes(&file, &MAPPING.read(path)?)
    }

    /// Takes in the pairs of a TOML text. `file` is what messages call it.
    ///
    /// # Errors
    /// As [`take_file`](Self::take_file).
    pub fn take_bytes(&mut self, file: &str, bytes: &[u8]) -> Result<(), MappingError> {
        let text = MAPPING.text(file, bytes)?;
        let wrong =
            |byte, problem| MappingError::Wrong { place: TextPlace::of_byte(file, text, byte), problem };
        let document = DeTable::parse(text).map_err(|error| {
            let message = error.message().trim_end().replace('\n', "; ");
            wrong(error.span().map_or(0, |span| span.start), message)
        })?;
        for (name, value) in document.get_ref() {
            let written = match value.get_ref() {
                DeValue::String(text) => text.to_string(),
                DeValue::Integer(number) => number.to_string(),
                DeValue::Float(number) => number.to_string(),
                _ => {
                    let problem =
                        format!("{} should be a text in quotes, the name of a column", shown(name.get_ref()));
                    return Err(wrong(value.span().start, problem));
                }
            };
            self.set(name.get_ref(), &written).map_err(|problem| wrong(name.span().start, problem))?;
        }
        Ok(())
    }

    fn set(&mut self, name: &str, value: &str) -> Result<(), String> {
        match name {
            "separator" => self.separator = Some(separator(value)?),
            "decimal" => self.decimal = Some(decimal(value)?),
            "period_s" => self.period_s = Some(period(value)?),
            _ => {
                let Some((name, target)) = Target::named(name) else { return Err(unknown(name)) };
                if value.is_empty() {
                    return Err(format!("{name} should be followed by the name of a column"));
                }
                self.pairs.retain(|(known, ..)| *known != name);
                self.pairs.push((name, target, value.to_owned()));
            }
        }
        Ok(())
    }
}

fn unknown(name: &str) -> String {
    let near = Target::near(name).map_or_else(
        || "docs/formats/column-mapping.md lists the names".to_owned(),
        |near| format!("did you mean `{near}`?"),
    );
    format!("`{}` is not a column of Footplate; {near}", shown(name))
}

fn separator(text: &str) -> Result<u8, String> {
    match text {
        "," | ";" | "|" => Ok(text.as_bytes().first().copied().unwrap_or(b',')),
        "tab" | "\t" | "\\t" => Ok(b'\t'),
        _ => Err(format!("separator is `{}`; it should be `,`, `;`, `|` or `tab`", shown(text))),
    }
}

fn decimal(text: &str) -> Result<char, String> {
    match text {
        "." => Ok('.'),
        "," => Ok(','),
        _ => Err(format!("decimal is `{}`; it should be `.` or `,`", shown(text))),
    }
}

fn period(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value| PERIODS_S.contains(value));
    value.ok_or_else(|| {
        format!("period_s is `{}`; it should be a number of seconds between 0.001 and 1", shown(text))
    })
}

/// A column mapping that could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MappingError {
    /// It is no such text.
    #[error(transparent)]
    Text(#[from] TextFileError),
    /// Something in a file is wrong.
    #[error("{place}: {problem}")]
    Wrong {
        /// Where.
        place: TextPlace,
        /// What.
        problem: String,
    },
    /// Something in a pair on the command line is wrong.
    #[error("--map {pair}: {problem}")]
    Pair {
        /// The pair as it was written.
        pair: String,
        /// What is wrong with it.
        problem: String,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(pair: &str) -> String {
        ColumnMapping::default().take_pair(pair).unwrap_err().to_string()
    }

    #[test]
    fn a_pair_that_is_none_is_answered_with_what_one_is() {
        assert!(said("v1").contains("a `=` between our name and theirs"));
        assert_eq!(
            said("speed_1_kmh=v1"),
            "--map speed_1_kmh=v1: `speed_1_kmh` is not a column of Footplate; did you mean `speed_1_km_h`?"
        );
        assert!(said("wind=w").contains("docs/formats/column-mapping.md"));
        assert!(said("t_s=").contains("the name of a column"));
        assert!(said("separator=x").contains("it should be `,`, `;`, `|` or `tab`"));
        assert!(said("period_s=50").contains("between 0.001 and 1"));
    }

    #[test]
    fn a_file_holds_the_same_pairs_and_later_ones_replace_it() {
        let mut mapping = ColumnMapping::default();
        let text = "t_s = \"Zeit\"\nspeed_1_km_h = \"v vorn\"\nperiod_s = 0.05\nseparator = \";\"\n";
        mapping.take_bytes("columns.toml", text.as_bytes()).unwrap();
        mapping.take_pair("t_s=time").unwrap();
        let columns: Vec<&str> = mapping.pairs.iter().map(|(.., column)| column.as_str()).collect();
        assert_eq!(columns, ["v vorn", "time"]);
        assert_eq!((mapping.separator, mapping.period_s), (Some(b';'), Some(0.05)));
        let wrong = mapping.take_bytes("columns.toml", b"t_s = \"a\"\nsped_1_m_s = \"v\"\n").unwrap_err();
        assert_eq!(
            wrong.to_string(),
            "columns.toml, line 2, column 1: `sped_1_m_s` is not a column of Footplate; did you mean `speed_1_m_s`?"
        );
        assert!(
            mapping.take_bytes("c.toml", b"t_s = [1]").unwrap_err().to_string().contains("text in quotes")
        );
    }
}
