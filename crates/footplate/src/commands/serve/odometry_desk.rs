//! Recordings of tachometers that are dropped on the dashboard: walked by the same code as `footplate odometry`.
//!
//! ```text
//! POST /api/odometry/run.csv       the bytes of a recording; answers where its page is
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

use super::desk::{Desk, Wished};
use crate::commands::clerk::Question;
use crate::dashboard::Routes;

/// The largest recording that is taken: an hour of two tachometers at 20 Hz is four megabytes as text.
const LARGEST: usize = 64 << 20;
/// Pages that are kept; some megabytes each.
const PAGES_KEPT: usize = 4;

/// What a browser may do for a page: show it, and nothing that leaves it. It is framed without an origin of its own.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; \
     sandbox allow-scripts; frame-ancestors 'self'";

#[derive(Debug, Default)]
struct Pages {
    kept: VecDeque<(u64, Arc<str>)>,
    next: u64,
}

#[derive(Clone)]
struct OdometryDesk {
    pages: Arc<Mutex<Pages>>,
    desk: Desk,
}

/// The routes.
pub(crate) fn odometry_routes(desk: &Desk) -> Routes {
    let desk = OdometryDesk { pages: Arc::default(), desk: desk.clone() };
    Routes::new(desk, [("/api/odometry/{name}", post(walk)), ("/api/odometry/pages/{number}", get(page))])
}

/// The train that a recording is of.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct OfTrain {
    /// The text of a vehicle file.
    vehicle: Option<String>,
}

async fn walk(
    State(desk): State<OdometryDesk>,
    Path(name): Path<String>,
    Query(wished): Query<Wished>,
    Query(of_train): Query<OfTrain>,
    body: Body,
) -> Response {
    let question = Question::Recording { name, vehicle: of_train.vehicle, language: wished.into_name() };
    let page = match desk.desk.ask(question, body, LARGEST).await {
        Ok(page) => page,
        Err(refusal) => return refusal.into_response(),
    };
    let mut pages = desk.pages.lock().unwrap_or_else(PoisonError::into_inner);
    let number = pages.next;
    pages.next += 1;
    pages.kept.push_back((number, page.into()));
    if pages.kept.len() > PAGES_KEPT {
        pages.kept.pop_front();
    }
    Json(json!({ "page": format!("/api/odometry/pages/{number}") })).into_response()
}

async fn page(State(desk): State<OdometryDesk>, Path(number): Path<String>) -> Response {
    let pages = desk.pages.lock().unwrap_or_else(PoisonError::into_inner);
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
            let says = "this page is not kept any more: send the recording again";
            (StatusCode::NOT_FOUND, Json(json!({ "error": says }))).into_response()
        }
    }
}
