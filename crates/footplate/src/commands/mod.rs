//! The verbs of the program, a file each.
//!
//! To add one: write `commands/VERB.rs` with a `pub(crate) struct Arguments` (its documentation is the help) that has
//! `fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome>`, and name the file below and in the list of
//! `command.rs`. A verb writes its result to `output` and messages about itself to standard error.

mod calibrate;
mod clerk;
mod command;
mod compare;
mod completions;
mod convert;
mod dashboard_routes;
mod demo;
mod doctor;
mod drive;
mod layout;
mod left_running;
mod log_file;
mod measure;
mod odometry;
mod output_files;
mod plot;
mod predict;
mod profiles;
mod replay;
mod report;
mod serve;
mod simulate;
mod store;
mod web_page;
mod written_layout;

pub(crate) use command::{Command, Outcome};
pub(crate) use dashboard_routes::read_fuzzed_set_up;
#[cfg(test)]
pub(crate) use dashboard_routes::{session_paths, set_up_paths};
pub(crate) use drive::FuzzedSession;
pub(crate) use left_running::{recall_directions, stop_all};
pub(crate) use serve::answer_fuzzed;
