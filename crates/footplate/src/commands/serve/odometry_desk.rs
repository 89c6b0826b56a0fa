//! Recordings of tachometers that are dropped on the dashboard: walked by the same code as `footplate odometry`.
//!
//! ```text
//! POST /api/odometry/run.csv       the bytes of a recording; answers where its page is
//! GET  /api/odometry/pages/0       the page: charts of speed and bounds, slips, shares and score
//! ```

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use axum::Json;
use axum::body::Bytes;
use axum::extract::rejection::BytesRejection;
use axum::extract::{DefaultBodyLimit, Path, Query, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use serde::Deserialize;
use serde_json::json;

use super::desk::{Desk, Wished};
use crate::commands::odometry::uploaded_page;
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
pub(crate) fn odometry_routes() -> Routes {
    let desk = OdometryDesk { pages: Arc::default(), desk: Desk::new() };
    Routes::new(
        desk,
        [
            ("/api/odometry/{name}", post(walk).layer(DefaultBodyLimit::max(LARGEST))),
            ("/api/odometry/pages/{number}", get(page)),
        ],
    )
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
    bytes: Result<Bytes, BytesRejection>,
) -> Response {
    let bytes = match bytes {
        Ok(bytes) => bytes,
        Err(rejection) => {
            let says = format!("{}; at most {} MB are taken", rejection.body_text(), LARGEST >> 20);
            return (rejection.status(), Json(json!({ "error": says }))).into_response();
        }
    };
    let pages = Arc::clone(&desk.pages);
    desk.desk
        .answer(move || {
            let page = uploaded_page(&name, &bytes, of_train.vehicle.as_deref(), wished.language())?;
            let mut pages = pages.lock().unwrap_or_else(PoisonError::into_inner);
            let number = pages.next;
            pages.next += 1;
            pages.kept.push_back((number, page.into()));
            if pages.kept.len() > PAGES_KEPT {
                pages.kept.pop_front();
            }
            Ok(json!({ "page": format!("/api/odometry/pages/{number}") }).to_string())
        })
        .await
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
