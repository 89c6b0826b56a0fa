//! The rows of the tables that a layout is imported from: nodes, directed edges and points.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use footplate_core::track::Leg;

use super::import_error::ImportError;
use super::read::LARGEST_COORDINATE;
use crate::table::{Column, LastLine, Row, Table, TableError};

/// The most rows of a table: a layout cannot number more nodes.
const MAX_ROWS: usize = 1 << 16;

/// The tables of one layout, each with its name in messages.
#[derive(Debug)]
pub struct LayoutTables<R> {
    /// Columns `name`, `type`, `number`, `reverse`.
    pub nodes: (String, R),
    /// Columns `src`, `dst`, `direction`, `dist_mm`: every edge and its twin.
    pub edges: (String, R),
    /// Columns `name`, `x_px`, `y_px`, for nodes with a point.
    pub schematic: Option<(String, R)>,
}

impl LayoutTables<BufReader<File>> {
    /// Opens the files.
    ///
    /// # Errors
    /// A file cannot be opened.
    pub fn open(nodes: &Path, edges: &Path, schematic: Option<&Path>) -> Result<Self, ImportError> {
        let open = |path: &Path| {
            let file = path.display().to_string();
            match File::open(path) {
                Ok(input) => Ok((file, BufReader::new(input))),
                Err(source) => Err(TableError::Read { file, source }),
            }
        };
        Ok(Self { nodes: open(nodes)?, edges: open(edges)?, schematic: schematic.map(open).transpose()? })
    }
}

/// The type of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NodeType {
    Sensor,
    Branch,
    Merge,
    Enter,
    Exit,
}

impl NodeType {
    const ALL: [Self; 5] = [Self::Sensor, Self::Branch, Self::Merge, Self::Enter, Self::Exit];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Sensor => "sensor",
            Self::Branch => "branch",
            Self::Merge => "merge",
            Self::Enter => "enter",
            Self::Exit => "exit",
        }
    }

    /// The type of the reverse node.
    pub(super) fn reverse(self) -> Self {
        match self {
            Self::Sensor => Self::Sensor,
            Self::Branch => Self::Merge,
            Self::Merge => Self::Branch,
            Self::Enter => Self::Exit,
            Self::Exit => Self::Enter,
        }
    }
}

pub(super) struct NodeRow {
    pub(super) line: u64,
    pub(super) name: String,
    pub(super) kind: NodeType,
    /// The number of the sensor or turnout; 0 for ends.
    pub(super) number: u16,
    pub(super) reverse: String,
}

pub(super) fn read_nodes(file: &str, input: impl BufRead) -> Result<Vec<NodeRow>, ImportError> {
    read_rows(file, input, ["name", "type", "number", "reverse"], |row, [name, kind, number, reverse]| {
        let kind = row.read(kind, "`sensor`, `branch`, `merge`, `enter` or `exit`", |text| {
            NodeType::ALL.into_iter().find(|kind| kind.name() == text)
        })?;
        let number = match kind {
            NodeType::Enter | NodeType::Exit => 0,
            _ => row.read(number, "a whole number from 0 to 65535", |text| text.parse().ok())?,
        };
        let text = |column| row.text(column).to_owned();
        Ok(NodeRow { line: row.line(), name: text(name), kind, number, reverse: text(reverse) })
    })
}

pub(super) struct EdgeRow {
    pub(super) line: u64,
    pub(super) from: String,
    pub(super) to: String,
    pub(super) leg: Option<Leg>,
    pub(super) mm: f64,
}

pub(super) fn read_edges(file: &str, input: impl BufRead) -> Result<Vec<EdgeRow>, ImportError> {
    read_rows(file, input, ["src", "dst", "direction", "dist_mm"], |row, [from, to, direction, mm]| {
        let leg = row.read(direction, "`ahead`, `straight` or `curved`", |text| match text {
            "ahead" => Some(None),
            "straight" => Some(Some(Leg::Straight)),
            "curved" => Some(Some(Leg::Curved)),
            _ => None,
        })?;
        let mm = row.read(mm, "a length in millimetres", |text| text.parse().ok())?;
        let text = |column| row.text(column).to_owned();
        Ok(EdgeRow { line: row.line(), from: text(from), to: text(to), leg, mm })
    })
}

pub(super) struct PointRow {
    pub(super) line: u64,
    pub(super) name: String,
    pub(super) point: [f64; 2],
}

pub(super) fn read_points(file: &str, input: impl BufRead) -> Result<Vec<PointRow>, ImportError> {
    read_rows(file, input, ["name", "x_px", "y_px"], |row, [name, x, y]| {
        let coordinate = |column| {
            let expected = format!("a number between -{LARGEST_COORDINATE} and {LARGEST_COORDINATE}");
            row.read(column, &expected, |text| {
                text.parse().ok().filter(|number: &f64| number.abs() <= LARGEST_COORDINATE)
            })
        };
        Ok(PointRow {
            line: row.line(),
            name: row.text(name).to_owned(),
            point: [coordinate(x)?, coordinate(y)?],
        })
    })
}

fn read_rows<const N: usize, T>(
    file: &str,
    input: impl BufRead,
    names: [&str; N],
    read: impl Fn(Row<'_>, [Column; N]) -> Result<T, TableError>,
) -> Result<Vec<T>, ImportError> {
    let mut table = Table::open(file, input)?;
    let Some(columns) = table.columns_named(names) else {
        let missing = names.into_iter().filter(|name| table.column(name).is_none()).collect::<Vec<_>>();
        return Err(ImportError::MissingColumns { file: file.to_owned(), missing: missing.join(", ") });
    };
    let mut rows = Vec::new();
    while let Some(row) = table.next_row()? {
        if rows.len() == MAX_ROWS {
            return Err(ImportError::TooManyRows { file: file.to_owned(), limit: MAX_ROWS });
        }
        rows.push(read(row, columns)?);
    }
    if table.last_line() == LastLine::CutOff {
        return Err(ImportError::CutOff { file: file.to_owned(), line: table.line() });
    }
    Ok(rows)
}
