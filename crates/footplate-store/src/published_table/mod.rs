//! What others measured of trains of the same number, and how far we agree with them.

mod cross_check;
mod read;

pub use cross_check::{CheckedFigure, CrossCheck, NothingToCompare, TeamSummary};
pub use read::{CountedFrom, PublishedFigure, PublishedQuantity, PublishedTableError, read_published_table};
