//! Recordings whose columns have other names, units or separators than ours, read by a mapping that says what they are.
//!
//! A [`ColumnMapping`] is a list of pairs, our name and theirs. `docs/formats/column-mapping.md` describes it.

mod clock;
mod column_mapping;
mod mapped_columns;
mod mapped_reader;
mod number_style;
mod target;
mod unit_watch;
mod wheel_path;

pub use column_mapping::ColumnMapping;
pub use column_mapping::MappingError;
pub(super) use mapped_reader::MappedReader;
