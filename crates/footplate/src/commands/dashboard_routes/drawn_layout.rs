//! A layout that is being drawn in the browser.
//!
//! ```text
//! POST /api/layout/check    {"toml": ".."}: what `footplate layout check` says of it
//! ```

use axum::body::Body;
use axum::extract::State;
use axum::response::Response;
use axum::routing::post;
use serde::Deserialize;

use super::answer_queue::AnswerQueue;
use crate::commands::clerk::Question;
use crate::commands::written_layout::WrittenLayout;
use crate::dashboard::Routes;

/// The largest layout that is taken, in bytes: thousands of nodes.
pub(super) const LARGEST_LAYOUT: usize = 1 << 20;

/// A layout as text.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DrawnLayout {
    pub(super) toml: String,
}

impl DrawnLayout {
    /// Reads it.
    ///
    /// # Errors
    /// The first error of the layout, with line and column.
    pub(crate) fn written(&self) -> anyhow::Result<WrittenLayout> {
        WrittenLayout::of("the drawn layout", self.toml.clone())
    }
}

/// The route that checks a layout. A megabyte of text may need 300 of memory while it is read: not in the process that drives trains.
pub(in crate::commands) fn drawn_layout_routes(answer_queue: &AnswerQueue) -> Routes {
    Routes::new(answer_queue.clone(), [("/api/layout/check", post(check))])
}

async fn check(State(answer_queue): State<AnswerQueue>, body: Body) -> Response {
    answer_queue.answer(Question::DrawnLayout, body, LARGEST_LAYOUT).await
}
