//! Tachometer recordings dropped on the dashboard, computed by the same code as `footplate odometry`.
//!
//! ```text
//! POST /api/odometry/run.csv       the bytes of a recording; answers with the address of its page
//! GET  /api/odometry/pages/0       the page: charts of speed and bounds, slips, shares and score
//! ```

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use axum::Json;
use axum::body::Body;
use axum::extract::{Path, Query, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use serde::Deserialize;
use serde_json::json;

use super::answer_queue::{AnswerForm, AnswerQueue};
use crate::commands::clerk::Question;
use crate::dashboard::Routes;

/// The largest recording: an hour of two tachometers at 20 Hz is 4 MB of text.
const LARGEST: usize = 64 << 20;
/// Pages kept; a few megabytes each.
const PAGES_KEPT: usize = 4;

/// The content security policy of a page: it shows its own data and loads nothing. It is framed without an origin.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; \
     sandbox allow-scripts; frame-ancestors 'self'";

#[derive(Debug, Default)]
struct Pages {
    kept: VecDeque<(u64, Arc<str>)>,
    next: u64,
}

#[derive(Clone)]
struct OdometryPages {
    pages: Arc<Mutex<Pages>>,
    answer_queue: AnswerQueue,
}

/// The routes.
pub(crate) fn odometry_routes(answer_queue: &AnswerQueue) -> Routes {
    let state = OdometryPages { pages: Arc::default(), answer_queue: answer_queue.clone() };
    Routes::new(state, [("/api/odometry/{name}", post(compute)), ("/api/odometry/pages/{number}", get(page))])
}

/// The train of a recording.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct OfTrain {
    /// The text of a vehicle file.
    vehicle: Option<String>,
}

async fn compute(
    State(state): State<OdometryPages>,
    Path(name): Path<String>,
    Query(form): Query<AnswerForm>,
    Query(of_train): Query<OfTrain>,
    body: Body,
) -> Response {
    let question = Question::Recording { name, vehicle: of_train.vehicle, language: form.into_name() };
    let page = match state.answer_queue.ask(question, body, LARGEST).await {
        Ok(page) => page,
        Err(rejection) => return rejection.into_response(),
    };
    let mut pages = state.pages.lock().unwrap_or_else(PoisonError::into_inner);
    let number = pages.next;
    pages.next += 1;
    pages.kept.push_back((number, page.into()));
    if pages.kept.len() > PAGES_KEPT {
        pages.kept.pop_front();
    }
    Json(json!({ "page": format!("/api/odometry/pages/{number}") })).into_response()
}

async fn page(State(state): State<OdometryPages>, Path(number): Path<String>) -> Response {
    let pages = state.pages.lock().unwrap_or_else(PoisonError::into_inner);
    let found = pages.kept.iter().find(|(kept, _)| number.parse() == Ok(*kept));
    match found {
        Some((_, page)) => {
            let headers = [
                (header::CONTENT_TYPE, "text/html; charset=utf-8"),
                (header::CONTENT_SECURITY_POLICY, POLICY),
            ];
            (headers, page.to_string()).into_response()
        }
        None => {
            let why = "this page has been dropped: send the recording again";
            (StatusCode::NOT_FOUND, Json(json!({ "error": why }))).into_response()
        }
    }
}
