//! The desk behind which answers from files are worked out: one at a time, on a thread of their own, never on the server's.

use std::sync::Arc;

use axum::Json;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::json;
use tokio::sync::Semaphore;

use crate::commands::web_page::Language;

/// Works out one answer after the other: on a small machine the control loop wants the other core.
#[derive(Debug, Clone)]
pub(super) struct Desk(Arc<Semaphore>);

/// Those who wait for their turn; more are sent away.
const MOST_AT_THE_DESK: usize = 8;

impl Desk {
    pub(super) fn new() -> Self {
        Self(Arc::new(Semaphore::new(MOST_AT_THE_DESK)))
    }

    /// Works out a text of JSON, or says what is wrong with what was asked.
    pub(super) async fn answer(
        &self,
        work: impl FnOnce() -> anyhow::Result<String> + Send + 'static,
    ) -> Response {
        let error = |status: StatusCode, says: &str| (status, Json(json!({ "error": says }))).into_response();
        let Ok(_place) = self.0.try_acquire() else {
            return error(
                StatusCode::TOO_MANY_REQUESTS,
                "too many answers are being worked out: ask again in a moment",
            );
        };
        match tokio::task::spawn_blocking(work).await {
            Ok(Ok(text)) => {
                ([(header::CONTENT_TYPE, "application/json"), (header::CACHE_CONTROL, "no-store")], text)
                    .into_response()
            }
            Ok(Err(wrong)) => error(StatusCode::UNPROCESSABLE_ENTITY, &format!("{wrong:#}")),
            Err(_) => error(
                StatusCode::INTERNAL_SERVER_ERROR,
                "this could not be worked out: the terminal says more",
            ),
        }
    }
}

/// How an answer shall be written.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Wished {
    language: String,
}

impl Wished {
    pub(super) fn language(&self) -> Language {
        Language::of_code(&self.language)
    }
}
