//! Reads a published table of speeds or stopping distances.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use footplate_core::{Approach, SpeedStep, TrainId};

use crate::table::{Column, Row, Table, TableError};

/// The largest plausible figure (mm/s, or mm of stopping distance): beyond it a unit is wrong.
const LARGEST_FIGURE: f64 = 100_000.0;

/// The origin of a published stopping distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CountedFrom {
    /// The command to stop: the team subtracted the distance before it.
    Command,
    /// The light gate at which the command was sent.
    Gate,
    /// Not stated: the command, or the sensor whose report triggered it.
    NotStated,
}

/// The quantity of a published figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PublishedQuantity {
    /// A steady speed, in mm/s.
    Speed,
    /// A stopping distance, in mm.
    Stop(CountedFrom),
}

/// One figure as published.
#[derive(Debug, Clone, PartialEq)]
pub struct PublishedFigure {
    /// The quantity.
    pub quantity: PublishedQuantity,
    /// The train's number.
    pub train: TrainId,
    /// The throttle step.
    pub step: SpeedStep,
    /// The side from which the step was reached, if stated.
    pub approach: Approach,
    /// The figure: mm/s for a speed, mm for a stop.
    pub value: f64,
    /// The team.
    pub team: String,
    /// The year or term of publication.
    pub term: String,
}

/// A published table that could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PublishedTableError {
    /// A line or a field is invalid.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The columns are not those of a published table.
    #[error(
        "{file}, line {line}: a table of speeds has the columns train, step, approach, speed_mm_s, team and term; one \
         of stops has train, step, approach, distance_mm, counted_from, team and term"
    )]
    Columns {
        /// The file.
        file: String,
        /// The line of the header.
        line: u64,
    },
    /// The table has no rows.
    #[error("{0}: the table has no row below its header")]
    NoRow(String),
}

/// Reads a table of speeds or of stops, recognised by its columns; other columns are ignored.
///
/// # Errors
/// [`PublishedTableError`] with file, line and column.
pub fn read_published_table(path: &Path) -> Result<Vec<PublishedFigure>, PublishedTableError> {
    let file = path.display().to_string();
    let input = File::open(path).map_err(|source| TableError::Read { file: file.clone(), source })?;
    let mut table = Table::open(&file, BufReader::new(input))?;
    let shared = table.columns_named(["train", "step", "approach", "team", "term"]);
    let kind = match (table.column("speed_mm_s"), table.columns_named(["distance_mm", "counted_from"])) {
        (Some(speed), None) => Some((speed, None)),
        (None, Some([distance, counted_from])) => Some((distance, Some(counted_from))),
        _ => None,
    };
    let (Some(shared), Some((value, counted_from))) = (shared, kind) else {
        return Err(PublishedTableError::Columns { file, line: table.line() });
    };
    let mut figures = Vec::new();
    while let Some(row) = table.next_row()? {
        figures.push(figure(row, shared, value, counted_from)?);
    }
    table.check_end()?;
    if figures.is_empty() {
        return Err(PublishedTableError::NoRow(file));
    }
    Ok(figures)
}

fn figure(
    row: Row<'_>,
    [train, step, approach, team, term]: [Column; 5],
    value: Column,
    counted_from: Option<Column>,
) -> Result<PublishedFigure, TableError> {
    let quantity = match counted_from {
        None => PublishedQuantity::Speed,
        Some(column) => PublishedQuantity::Stop(row.read(
            column,
            "command, gate, or empty if the team does not state it",
            counted,
        )?),
    };
    let positive =
        |text: &str| text.parse::<f64>().ok().filter(|value| *value > 0.0 && *value < LARGEST_FIGURE);
    let name = |text: &str| (!text.is_empty()).then(|| text.to_owned());
    Ok(PublishedFigure {
        quantity,
        train: TrainId(row.read(train, "the number of a train", |text| text.parse().ok())?),
        step: row.read(step, "a throttle step from 1", |text| {
            text.parse().ok().and_then(SpeedStep::new).filter(|step| *step > SpeedStep::STAND)
        })?,
        approach: row.read(approach, "below, above, or empty if the team does not state it", |text| {
            match text {
                "below" => Some(Approach::Below),
                "above" => Some(Approach::Above),
                "" => Some(Approach::Unknown),
                _ => None,
            }
        })?,
        value: row.read(value, "a number above 0 and below 100000", positive)?,
        team: row.read(team, "the name of a team", name)?,
        term: row.text(term).to_owned(),
    })
}

fn counted(text: &str) -> Option<CountedFrom> {
    match text {
        "command" => Some(CountedFrom::Command),
        "gate" => Some(CountedFrom::Gate),
        "" => Some(CountedFrom::NotStated),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPEEDS: &str = "train,step,approach,speed_mm_s,team,term\n";

    fn read(text: &str) -> Result<Vec<PublishedFigure>, PublishedTableError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.csv");
        std::fs::write(&path, text).unwrap();
        read_published_table(&path)
    }

    #[test]
    fn tables_are_recognised_by_their_columns() {
        let speeds = read(&format!("{SPEEDS}24,14,above,557.5,someone,2018\n")).unwrap();
        let [speed] = speeds.as_slice() else { panic!("{speeds:?}") };
        assert_eq!((speed.quantity, speed.train), (PublishedQuantity::Speed, TrainId(24)));
        assert_eq!((speed.approach, speed.value), (Approach::Above, 557.5));

        let stops =
            read("team,term,train,step,approach,note,counted_from,distance_mm\na,2022,1,8,,x,gate,180\n")
                .unwrap();
        assert_eq!(stops[0].quantity, PublishedQuantity::Stop(CountedFrom::Gate));
        assert_eq!((stops[0].approach, stops[0].value), (Approach::Unknown, 180.0));
    }

    #[test]
    fn errors_name_their_place() {
        for (text, expected) in [
            ("", "is empty"),
            (SPEEDS, "no row"),
            ("train,step,speed\n1,2,3\n", "speed_mm_s"),
            (&format!("{SPEEDS}x,14,,1,a,\n"), "line 2, column 1 (train): `x`"),
            (&format!("{SPEEDS}1,0,,1,a,\n"), "column 2 (step)"),
            (&format!("{SPEEDS}1,1,beside,1,a,\n"), "column 3 (approach)"),
            (&format!("{SPEEDS}1,1,,NaN,a,\n"), "column 4 (speed_mm_s)"),
            (&format!("{SPEEDS}1,1,,-3,a,\n"), "above 0"),
            (&format!("{SPEEDS}1,1,,inf,a,\n"), "above 0"),
            (&format!("{SPEEDS}1,1,,1,,\n"), "column 5 (team)"),
            (&format!("{SPEEDS}1,1,,1\n"), "4 fields"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(expected), "{text:?}: {error}");
        }
    }
}
