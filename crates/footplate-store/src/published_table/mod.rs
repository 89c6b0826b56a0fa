//! Published measurements of trains of the same number, and the comparison with ours.

mod cross_check;
mod read;

pub use cross_check::{CheckedFigure, CrossCheck, NothingToCompare, TeamSummary};
pub use read::{CountedFrom, PublishedFigure, PublishedQuantity, PublishedTableError, read_published_table};
