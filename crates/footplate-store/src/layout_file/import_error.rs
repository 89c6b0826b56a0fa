//! Errors of an import: the row, what is wrong, and what would be right.

use footplate_core::track::LayoutError;

use crate::table::TableError;

/// Tables that could not be imported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// A table could not be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A table lacks required columns.
    #[error("{file}: the header lacks these columns: {missing}")]
    MissingColumns {
        /// The file.
        file: String,
        /// The columns.
        missing: String,
    },
    /// The last row is incomplete.
    #[error("{file}, line {line}: the row is incomplete; was the whole file copied?")]
    CutOff {
        /// The file.
        file: String,
        /// The line.
        line: u64,
    },
    /// More rows than a layout may have nodes.
    #[error("{file}: more than {limit} rows; is it a table of a layout?")]
    TooManyRows {
        /// The file.
        file: String,
        /// The limit.
        limit: usize,
    },
    /// A row disagrees with the others.
    #[error("{file}, line {line}: {problem}")]
    Row {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// The error.
        problem: Box<RowProblem>,
    },
    /// A property that the tables do not contain is invalid.
    #[error(transparent)]
    Context(LayoutError),
}

/// How a row disagrees with the others.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RowProblem {
    /// Another row has the same name.
    #[error("the node `{name}` is already in line {first}; every node needs its own name")]
    DuplicateNode {
        /// The name.
        name: String,
        /// The line of that row.
        first: u64,
    },
    /// The reverse node does not exist.
    #[error("the reverse of `{name}` should be a node of this file; `{reverse}` is not")]
    UnknownReverse {
        /// The node.
        name: String,
        /// The name of its reverse.
        reverse: String,
    },
    /// The reverse of the reverse is another node.
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
    /// A node is its own reverse.
    #[error("`{0}` cannot be its own reverse: each direction of travel is a node of its own")]
    OwnReverse(String),
    /// The types of a node and its reverse do not match.
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
        /// The type of the reverse.
        found: &'static str,
        /// The type that the reverse should have.
        expected: &'static str,
    },
    /// A branch and its merge belong to different turnouts.
    #[error("`{name}` is turnout {number}, so its reverse `{reverse}` should be, too, and it is {found}")]
    ReverseNumber {
        /// The node.
        name: String,
        /// Its number.
        number: u16,
        /// Its reverse.
        reverse: String,
        /// The number of the reverse.
        found: u16,
    },
    /// An edge names a node that is not in the table of nodes.
    #[error("no node is called `{0}`")]
    UnknownNode(String),
    /// Two edges leave a node by the same exit.
    #[error("line {first} already has an edge that leaves `{from}` by the same exit")]
    DuplicateEdge {
        /// The node.
        from: String,
        /// The line of the other edge.
        first: u64,
    },
    /// An edge has no twin for the other direction.
    #[error(
        "the edge from `{from}` to `{to}` has no twin: there should be one from `{twin_from}` to `{twin_to}`"
    )]
    NoTwin {
        /// Its start.
        from: String,
        /// Its end.
        to: String,
        /// The start of the missing twin.
        twin_from: String,
        /// The end of the missing twin.
        twin_to: String,
    },
    /// An edge and its twin differ in length.
    #[error(
        "the edge from `{from}` to `{to}` is {mm} mm long and its twin in line {twin_line} {twin_mm} mm; \
             they are the same rail"
    )]
    UnequalTwin {
        /// Its start.
        from: String,
        /// Its end.
        to: String,
        /// Its length.
        mm: f64,
        /// The line of the twin.
        twin_line: u64,
        /// The length of the twin.
        twin_mm: f64,
    },
    /// The two nodes of one place have different points.
    #[error("`{name}` and `{reverse}` are one place, but are drawn at different points")]
    TwoPoints {
        /// The node.
        name: String,
        /// The node of the other direction.
        reverse: String,
    },
    /// The layout is inconsistent.
    #[error(transparent)]
    Layout(LayoutError),
}
