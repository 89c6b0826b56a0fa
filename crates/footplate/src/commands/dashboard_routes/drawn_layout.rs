//! A layout that is being drawn in the browser.
//!
//! ```text
//! POST /api/layout/check    {"toml": ".."}: what `footplate layout check` says of it
//! ```

use axum::Json;
use axum::extract::DefaultBodyLimit;
use axum::extract::rejection::JsonRejection;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use axum::routing::post;
use serde::Deserialize;
use serde_json::json;

use super::answer_queue::Rejection;
use crate::commands::written_layout::WrittenLayout;
use crate::dashboard::Routes;
use crate::error_text::error_text;

/// The largest layout that is taken, in bytes: thousands of nodes.
pub(super) const LARGEST_LAYOUT: usize = 1 << 20;

/// A layout as text.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DrawnLayout {
    pub(super) toml: String,
}

impl DrawnLayout {
    /// Reads it.
    ///
    /// # Errors
    /// The first error of the layout, with line and column.
    pub(super) fn written(&self) -> anyhow::Result<WrittenLayout> {
        WrittenLayout::of("the drawn layout", self.toml.clone())
    }
}

/// The route that checks a layout.
pub(in crate::commands) fn drawn_layout_routes() -> Routes {
    Routes::new((), [("/api/layout/check", post(check).layer(DefaultBodyLimit::max(LARGEST_LAYOUT)))])
}

async fn check(body: Result<Json<DrawnLayout>, JsonRejection>) -> Response {
    let drawn = match body {
        Ok(Json(drawn)) => drawn,
        Err(wrong) => return Rejection(wrong.status(), wrong.body_text()).into_response(),
    };
    let checked = tokio::task::spawn_blocking(move || drawn.written().map(|_| ())).await;
    match checked.map_err(anyhow::Error::from).and_then(|checked| checked) {
        Ok(()) => Json(json!({ "taken": true })).into_response(),
        Err(error) => Rejection(StatusCode::UNPROCESSABLE_ENTITY, error_text(&error)).into_response(),
    }
}
