//! The dashboard of a session: what it answers beside driving, from the store, from uploads and from the set-up.

mod answer_queue;
mod archive;
mod clerk_process;
mod drawn_layout;
mod odometry_pages;
mod schedules;
mod set_up;
mod slides;

use std::path::PathBuf;
use std::sync::Arc;

use footplate_store::parse_layout;

use super::written_layout::WrittenLayout;
use crate::dashboard::{Board, Dashboard, Routes, ServedAt, Token};
use crate::standard_error::say;

pub(crate) use answer_queue::{AnswerForm, AnswerQueue};
pub(crate) use archive::StoreQuery;
pub(super) use archive::{Archive, archive_routes};
pub(super) use drawn_layout::{DrawnLayout, drawn_layout_routes};
use odometry_pages::odometry_routes;
pub(super) use schedules::schedule_routes;
#[cfg(test)]
pub(crate) use set_up::set_up_paths;
pub(crate) use set_up::{SetUpMode, SetUpRoute, read_fuzzed_set_up};
pub(super) use set_up::{fuzzed_set_up_routes, run as set_up_in_browser};
use slides::slide_routes;

/// Opens the dashboard of a session and prints its address.
///
/// # Errors
/// The address cannot be used.
pub(super) fn open_dashboard(
    at: &ServedAt,
    written: &WrittenLayout,
    store: Option<PathBuf>,
    set_up: SetUpRoute,
) -> anyhow::Result<Dashboard> {
    let chosen = std::env::var("FOOTPLATE_TOKEN").ok().filter(|text| !text.is_empty());
    let token = chosen.as_deref().map(Token::chosen).transpose()?;
    let layout = parse_layout(written.layout.name(), written.text.as_bytes())?;
    let answer_queue = AnswerQueue::new();
    let archive = Archive::new(store, written, &answer_queue);
    let more = |board: &Arc<Board>| session_routes(archive, &answer_queue, board).and(set_up.routes());
    let dashboard = Dashboard::open(at, token, &layout, more)?;
    say!("the dashboard is at {}", dashboard.url);
    Ok(dashboard)
}

/// The routes of a session beside those of driving and of the set-up.
fn session_routes(archive: Archive, answer_queue: &AnswerQueue, board: &Arc<Board>) -> Routes {
    archive_routes(archive.clone())
        .and(schedule_routes(archive, Arc::clone(board)))
        .and(odometry_routes(answer_queue))
        .and(slide_routes())
        .and(drawn_layout_routes(answer_queue))
}

/// The same for the test of the description.
#[cfg(test)]
pub(crate) fn session_paths(board: &Arc<Board>) -> Vec<&'static str> {
    let layout = WrittenLayout::named("track-a").expect("built in");
    let answer_queue = AnswerQueue::new();
    let routes = session_routes(Archive::new(None, &layout, &answer_queue), &answer_queue, board);
    routes.paths().to_vec()
}
