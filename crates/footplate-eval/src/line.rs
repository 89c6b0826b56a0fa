//! Full-size trains that slip and slide, through the odometer and what others make of the same counts.

mod families_page;
mod family;
mod mechanism;
mod score_figures;
mod scored_run;
mod worlds_page;

pub use self::families_page::FamiliesPage;
pub use self::score_figures::{figure, score_json};
pub use self::scored_run::ScoredRun;
pub use self::worlds_page::{ScoredWorld, WorldsPage};
