//! Lengths of the layout as trains run them, and whether a recording was made on it.

mod layout_test;
mod section_index;
mod survey_test;
mod track_survey;

pub use layout_test::LayoutTest;
pub use section_index::SectionIndex;
pub use survey_test::{OddSection, SurveyTest};
pub(super) use survey_test::{PER_MEDIAN, median};
pub use track_survey::TrackSurvey;
