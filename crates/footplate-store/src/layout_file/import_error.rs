//! Why tables could not be imported: the row at fault, what stands there and what would be right.

use footplate_core::track::LayoutError;

use crate::table::TableError;

/// Why tables could not be imported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// A table could not be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A table without columns it cannot do without.
    #[error("{file}: the header lacks these columns: {missing}")]
    MissingColumns {
        /// The file.
        file: String,
        /// The columns.
        missing: String,
    },
    /// The last row breaks off.
    #[error("{file}, line {line}: the row breaks off; was the file copied whole?")]
    CutOff {
        /// The file.
        file: String,
        /// The line.
        line: u64,
    },
    /// More rows than a layout has nodes.
    #[error("{file}: more than {limit} rows; is it a table of a layout?")]
    TooManyRows {
        /// The file.
        file: String,
        /// The most that are read.
        limit: usize,
    },
    /// A row that does not agree with the others.
    #[error("{file}, line {line}: {problem}")]
    Row {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// What is wrong.
        problem: Box<RowProblem>,
    },
    /// What the tables do not say is wrong.
    #[error(transparent)]
    Context(LayoutError),
}

/// How a row does not agree with the others.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RowProblem {
    /// A name that another row has.
    #[error("the node `{name}` is already in line {first}; every node needs its own name")]
    DuplicateNode {
        /// The name.
        name: String,
        /// The line that has it.
        first: u64,
    },
    /// A reverse that is in no row.
    #[error("the reverse of `{name}` should be a node of this file, and `{reverse}` is none")]
    UnknownReverse {
        /// The node.
        name: String,
        /// What it says.
        reverse: String,
    },
    /// A reverse that has another reverse.
    #[error(
        "the reverse of `{name}` is `{reverse}`, so the reverse of `{reverse}` should be `{name}`, not `{back}`"
    )]
    OneWayReverse {
        /// The node.
        name: String,
        /// Its reverse.
        reverse: String,
        /// The reverse of that.
        back: String,
    },
    /// A node that is its own reverse.
    #[error("`{name}` cannot be its own reverse: each direction of travel is a node of its own")]
    OwnReverse {
        /// The node.
        name: String,
    },
    /// A reverse of a type that does not fit.
    #[error(
        "`{name}` is of type {kind}, so its reverse `{reverse}` should be of type {expected}, not {found}"
    )]
    ReverseType {
        /// The node.
        name: String,
        /// Its type.
        kind: &'static str,
        /// Its reverse.
        reverse: String,
        /// The type of that.
        found: &'static str,
        /// The type it should be of.
        expected: &'static str,
    },
    /// A branch and a merge of different turnouts.
    #[error("`{name}` is turnout {number}, so its reverse `{reverse}` should be, too, and it is {found}")]
    ReverseNumber {
        /// The node.
        name: String,
        /// Its number.
        number: u16,
        /// Its reverse.
        reverse: String,
        /// The number of that.
        found: u16,
    },
    /// An edge from or to a node that is not in the table of nodes.
    #[error("no node is called `{name}`")]
    UnknownNode {
        /// The name.
        name: String,
    },
    /// Two edges that leave a node by the same way.
    #[error("line {first} already has an edge that leaves `{from}` by the same exit")]
    DuplicateEdge {
        /// The node.
        from: String,
        /// The line that has it.
        first: u64,
    },
    /// An edge whose rails cannot be run over the other way.
    #[error(
        "the edge from `{from}` to `{to}` has no twin: there should be one from `{twin_from}` to `{twin_to}`"
    )]
    NoTwin {
        /// Where it begins.
        from: String,
        /// Where it ends.
        to: String,
        /// Where the twin should begin.
        twin_from: String,
        /// Where the twin should end.
        twin_to: String,
    },
    /// An edge whose twin has another length.
    #[error(
        "the edge from `{from}` to `{to}` is {mm} mm long and its twin in line {twin_line} {twin_mm} mm; \
             they are the same rail"
    )]
    UnequalTwin {
        /// Where it begins.
        from: String,
        /// Where it ends.
        to: String,
        /// Its length.
        mm: f64,
        /// The line of the twin.
        twin_line: u64,
        /// The length of the twin.
        twin_mm: f64,
    },
    /// Two points for one place.
    #[error("`{name}` and `{reverse}` are one place, but are drawn at different points")]
    TwoPoints {
        /// The node.
        name: String,
        /// The node of the other direction.
        reverse: String,
    },
    /// It is no layout.
    #[error(transparent)]
    Layout(LayoutError),
}
