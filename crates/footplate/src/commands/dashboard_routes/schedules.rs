//! The routes of schedules: saved scripts that run in the session beside its operator.
//!
//! ```text
//! GET  /api/schedules           the saved schedules of the layout
//! POST /api/schedules           {"name": "evening", "lines": ["go 24 to C13", "wait 24 at rest"], "rounds": 2}: save it
//! POST /api/schedules/delete    {"name": "evening"}
//! POST /api/schedules/run       {"name": "evening"}, or a schedule with its lines, which is not saved
//! POST /api/schedules/end       {"name": "evening"}: its trains finish the commands that they have
//! ```

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::Json;
use axum::extract::State;
use axum::extract::rejection::JsonRejection;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use footplate_store::Schedule;
use serde::Deserialize;
use serde_json::json;

use super::answer_queue::Rejection;
use super::archive::{Archive, StoreQuery};
use crate::dashboard::{Board, Request, Routes, answered};

/// The longest name of a schedule, in characters: it fits on a button.
const LONGEST_NAME: usize = 40;

#[derive(Clone)]
struct Schedules {
    archive: Archive,
    board: Arc<Board>,
    /// The saved schedules, once they were read: only these routes change them.
    known: Arc<Mutex<Option<Vec<Schedule>>>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Named {
    name: String,
}

/// A saved schedule by its name, or one with its lines.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum ToRun {
    Written(Schedule),
    Saved(Named),
}

type Body<T> = Result<Json<T>, JsonRejection>;

/// The routes; `archive` has the store, `board` leads to the control loop.
pub(in crate::commands) fn schedule_routes(archive: Archive, board: Arc<Board>) -> Routes {
    Routes::new(
        Schedules { archive, board, known: Arc::default() },
        [
            ("/api/schedules", get(saved).post(save)),
            ("/api/schedules/delete", post(delete)),
            ("/api/schedules/run", post(run)),
            ("/api/schedules/end", post(end)),
        ],
    )
}

fn wrong(error: &JsonRejection) -> Response {
    Rejection(error.status(), error.body_text()).into_response()
}

fn refused(why: String) -> Response {
    Rejection(StatusCode::UNPROCESSABLE_ENTITY, why).into_response()
}

impl Schedules {
    /// The saved schedules; none without a store.
    async fn saved(&self) -> Result<Vec<Schedule>, Rejection> {
        if !self.archive.has_store() {
            return Ok(Vec::new());
        }
        let known = self.known().clone();
        match known {
            Some(known) => Ok(known),
            None => self.changed(StoreQuery::Schedules).await,
        }
    }

    /// The saved schedules after a request to the store.
    async fn changed(&self, query: StoreQuery) -> Result<Vec<Schedule>, Rejection> {
        let saved = self.archive.schedules(query).await?;
        let known = self.known().replace(saved.clone());
        // The prompt runs them by name. A session that is ending need not know.
        if known.as_ref() != Some(&saved) {
            let _ = self.board.ask(Request::SavedSchedules(saved.clone()));
        }
        Ok(saved)
    }

    fn known(&self) -> MutexGuard<'_, Option<Vec<Schedule>>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn listed(saved: Result<Vec<Schedule>, Rejection>) -> Response {
    match saved {
        Ok(schedules) => Json(json!({ "schedules": schedules })).into_response(),
        Err(rejection) => rejection.into_response(),
    }
}

async fn saved(State(schedules): State<Schedules>) -> Response {
    listed(schedules.saved().await)
}

async fn save(State(schedules): State<Schedules>, body: Body<Schedule>) -> Response {
    let schedule = match body {
        Ok(Json(schedule)) => schedule,
        Err(error) => return wrong(&error),
    };
    let name = schedule.name.trim();
    if name.is_empty() || name.chars().count() > LONGEST_NAME {
        return refused(format!("give the schedule a name of 1 to {LONGEST_NAME} characters"));
    }
    let schedule = Schedule { name: name.to_owned(), ..schedule };
    // The control loop knows the trains and the places that the lines name.
    let checked = schedules.board.ask_and_wait(Request::CheckSchedule(schedule.clone())).await;
    match checked {
        Ok(_) => listed(schedules.changed(StoreQuery::KeepSchedule(schedule)).await),
        Err(not_done) => answered(Err(not_done)),
    }
}

async fn delete(State(schedules): State<Schedules>, body: Body<Named>) -> Response {
    match body {
        Ok(Json(Named { name })) => listed(schedules.changed(StoreQuery::WithdrawSchedule { name }).await),
        Err(error) => wrong(&error),
    }
}

async fn run(State(schedules): State<Schedules>, body: Body<ToRun>) -> Response {
    let schedule = match body {
        Ok(Json(ToRun::Written(schedule))) => schedule,
        Ok(Json(ToRun::Saved(Named { name }))) => match schedules.saved().await {
            Ok(saved) => match saved.into_iter().find(|schedule| schedule.name == name) {
                Some(schedule) => schedule,
                None => return refused(format!("there is no schedule `{name}`; /api/schedules lists them")),
            },
            Err(rejection) => return rejection.into_response(),
        },
        Err(error) => return wrong(&error),
    };
    answered(schedules.board.ask_and_wait(Request::RunSchedule(schedule)).await)
}

async fn end(State(schedules): State<Schedules>, body: Body<Named>) -> Response {
    match body {
        Ok(Json(Named { name })) => answered(schedules.board.ask_and_wait(Request::EndSchedule(name)).await),
        Err(error) => wrong(&error),
    }
}
