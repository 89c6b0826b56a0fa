//! What the dashboard shows of the store: recordings, what was measured of trains, and what people think of it.
//!
//! ```text
//! GET  /api/recordings               what can be looked at again
//! GET  /api/recordings/3/pictures    a session walked again: pictures as they were, and what happened
//! GET  /api/trains/24/calibration    what all recordings together say of a train
//! GET  /api/trains/24/why/SPEED:8    the measurements behind a number
//! GET  /api/marks                    what is excluded, and why
//! POST /api/marks                    {"events": [465], "mark": "excluded", "reason": "the wheels were dirty"}
//! ```

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, bail};
use axum::Json;
use axum::extract::rejection::JsonRejection;
use axum::extract::{Path, Query, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use footplate_core::TrainId;
use footplate_core::track::Layout;
use footplate_store::{Batch, EventKey, MarkKind, RecordingKey, Store};
use serde::Deserialize;
use serde_json::{Value, json};

use super::desk::{Desk, Wished};
use crate::clock::{now, rfc3339};
use crate::commands::calibrate::Question;
use crate::commands::replay::pictures;
use crate::commands::report::store_report;
use crate::commands::store::words;
use crate::dashboard::Routes;

/// The most events that are marked at once: more than one hop, fewer than a session.
const MOST_MARKED: usize = 1_000;

#[derive(Clone)]
struct Archive {
    store: Option<Arc<PathBuf>>,
    layout: Arc<Layout>,
    desk: Desk,
}

/// The routes, over a store if the session has one.
pub(crate) fn archive_routes(store: Option<PathBuf>, layout: &Layout) -> Routes {
    let archive = Archive { store: store.map(Arc::new), layout: Arc::new(layout.clone()), desk: Desk::new() };
    Routes::new(
        archive,
        [
            ("/api/recordings", get(recordings)),
            ("/api/recordings/{recording}/pictures", get(recorded_pictures)),
            ("/api/trains/{train}/calibration", get(calibration)),
            ("/api/trains/{train}/why/{number}", get(why)),
            ("/api/marks", get(marks).post(mark)),
        ],
    )
}

impl Archive {
    async fn answer(
        &self,
        work: impl FnOnce(&Layout, Store) -> anyhow::Result<String> + Send + 'static,
    ) -> Response {
        let (store, layout) = (self.store.clone(), Arc::clone(&self.layout));
        let Some(path) = store else {
            let says = "this session keeps nothing: begin it with `--store railway.db`";
            return (StatusCode::NOT_FOUND, Json(json!({ "error": says }))).into_response();
        };
        self.desk.answer(move || work(&layout, Store::open(&path)?)).await
    }
}

fn train_of(text: &str) -> anyhow::Result<TrainId> {
    Ok(TrainId(text.parse().with_context(|| format!("`{text}` is not the number of a train, such as 24"))?))
}

async fn recordings(State(archive): State<Archive>) -> Response {
    archive
        .answer(|_, store| {
            let machines = store.machines()?;
            let list: Vec<Value> = store
                .recordings(now())?
                .into_iter()
                .map(|recording| {
                    let own = || machines.iter().filter(|machine| machine.recording == recording.key);
                    json!({
                        "recording": recording.key.0,
                        "name": recording.name,
                        "layout": recording.layout,
                        "stored_at": rfc3339(recording.stored_at),
                        "events": recording.events,
                        "excluded": recording.excluded,
                        "machines": own().map(|machine| machine.kind.as_str()).collect::<Vec<_>>(),
                        "inputs": own().map(|machine| machine.inputs).sum::<u64>(),
                    })
                })
                .collect();
            Ok(serde_json::to_string(&list)?)
        })
        .await
}

async fn recorded_pictures(State(archive): State<Archive>, Path(recording): Path<String>) -> Response {
    archive
        .answer(move |_, store| {
            let number = recording.parse().with_context(|| {
                format!(
                    "`{recording}` is not the number of a \
                                                           recording"
                )
            })?;
            pictures(&store, RecordingKey(number))
        })
        .await
}

async fn calibration(
    State(archive): State<Archive>,
    Path(train): Path<String>,
    Query(wished): Query<Wished>,
) -> Response {
    archive
        .answer(move |layout, store| store_report(layout, &store, train_of(&train)?, wished.language()))
        .await
}

async fn why(State(archive): State<Archive>, Path((train, number)): Path<(String, String)>) -> Response {
    archive
        .answer(move |layout, store| {
            let question: Question = number.parse().map_err(anyhow::Error::msg)?;
            let batch = Batch::of_store(layout, &store, now(), Some(train_of(&train)?))?;
            let mut text = Vec::new();
            question.answer(layout, &batch, true, &mut text)?;
            Ok(String::from_utf8(text)?)
        })
        .await
}

async fn marks(State(archive): State<Archive>) -> Response {
    archive
        .answer(|layout, store| {
            let at = now();
            let mut list = Vec::new();
            for recording in store.recordings(at)?.into_iter().filter(|recording| recording.excluded > 0) {
                let runs = store.runs(recording.key, at)?;
                for event in runs.iter().flat_map(|run| &run.events).filter(|event| event.is_excluded()) {
                    let mark = event.mark.as_ref();
                    list.push(json!({
                        "event": event.key.0,
                        "recording": recording.name,
                        "what": words(event.raw.event.kind, Some(layout)),
                        "reason": mark.map(|mark| mark.reason.as_str()),
                        "made_at": mark.map(|mark| rfc3339(mark.made_at)),
                    }));
                }
            }
            Ok(serde_json::to_string(&list)?)
        })
        .await
}

/// What somebody thinks of events.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct NewMark {
    events: Vec<i64>,
    mark: Wanted,
    reason: String,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Wanted {
    Excluded,
    Restored,
}

async fn mark(State(archive): State<Archive>, body: Result<Json<NewMark>, JsonRejection>) -> Response {
    let Json(new) = match body {
        Ok(new) => new,
        Err(wrong) => {
            let right = "{\"events\": [465], \"mark\": \"excluded\", \"reason\": \"the wheels were dirty\"}";
            let says = format!("{}; write {right}", wrong.body_text());
            return (wrong.status(), Json(json!({ "error": says }))).into_response();
        }
    };
    archive
        .answer(move |_, mut store| {
            if new.events.is_empty() || new.events.len() > MOST_MARKED {
                bail!("{} events cannot be marked at once: 1 to {MOST_MARKED} can", new.events.len());
            }
            let events: Vec<EventKey> = new.events.into_iter().map(EventKey).collect();
            let kind = match new.mark {
                Wanted::Excluded => MarkKind::Excluded,
                Wanted::Restored => MarkKind::Restored,
            };
            match kind {
                MarkKind::Excluded => store.exclude(&events, &new.reason, now())?,
                MarkKind::Restored => store.restore(&events, &new.reason, now())?,
            }
            Ok(json!({ "marked": events.len() }).to_string())
        })
        .await
}
