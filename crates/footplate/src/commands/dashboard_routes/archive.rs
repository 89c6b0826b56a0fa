//! The routes of the dashboard to the store: recordings, calibrations and marks.
//!
//! ```text
//! GET  /api/recordings               the list of recordings
//! GET  /api/recordings/3/pictures    a session replayed: its pictures and events
//! GET  /api/trains/24/calibration    the calibration of a train from all recordings
//! GET  /api/trains/24/why/SPEED:8    the measurements behind a value
//! GET  /api/marks                    excluded events, with reasons
//! POST /api/marks                    {"events": [465], "mark": "excluded", "reason": "the wheels were dirty"}
//! ```

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, bail};
use axum::Json;
use axum::body::Body;
use axum::extract::rejection::JsonRejection;
use axum::extract::{Path, Query, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use footplate_core::TrainId;
use footplate_core::track::Layout;
use footplate_store::{Batch, EventKey, MarkKind, RecordingKey, Schedule, Store};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::answer_queue::{AnswerForm, AnswerQueue, Rejection};
use crate::clock::{LATEST, now, rfc3339};
use crate::commands::calibrate;
use crate::commands::clerk::Question;
use crate::commands::replay::pictures;
use crate::commands::report::store_report;
use crate::commands::store::words;
use crate::commands::written_layout::WrittenLayout;
use crate::dashboard::Routes;

/// The most events in one mark: more than a hop has, fewer than a session.
const MAX_MARKED: usize = 1_000;

/// The store of a session.
#[derive(Clone)]
pub(in crate::commands) struct Archive {
    store: Option<Arc<PathBuf>>,
    layout: Arc<WrittenLayout>,
    answer_queue: AnswerQueue,
}

/// The routes; without a store they answer that there is none.
pub(in crate::commands) fn archive_routes(archive: Archive) -> Routes {
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
    pub(in crate::commands) fn new(
        store: Option<PathBuf>,
        layout: &WrittenLayout,
        answer_queue: &AnswerQueue,
    ) -> Self {
        Self {
            store: store.map(Arc::new),
            layout: Arc::new(layout.clone()),
            answer_queue: answer_queue.clone(),
        }
    }

    fn question(&self, query: StoreQuery) -> Result<Question, Rejection> {
        let Some(path) = &self.store else {
            let why = "this session has no store: start it with `--store railway.db`".to_owned();
            return Err(Rejection(StatusCode::NOT_FOUND, why));
        };
        Ok(Question::Store { path: path.to_path_buf(), layout: self.layout.text.clone(), query })
    }

    pub(super) async fn answer(&self, query: StoreQuery) -> Response {
        match self.question(query) {
            Ok(question) => self.answer_queue.answer(question, Body::empty(), 0).await,
            Err(rejection) => rejection.into_response(),
        }
    }

    pub(super) const fn has_store(&self) -> bool {
        self.store.is_some()
    }

    /// The saved schedules after a request for them, or one that changes them.
    pub(super) async fn schedules(&self, query: StoreQuery) -> Result<Vec<Schedule>, Rejection> {
        let text = self.answer_queue.ask(self.question(query)?, Body::empty(), 0).await?;
        serde_json::from_str(&text)
            .map_err(|error| Rejection(StatusCode::INTERNAL_SERVER_ERROR, error.to_string()))
    }
}

/// A request to the store.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) enum StoreQuery {
    Recordings,
    Pictures { recording: String },
    Calibration { train: String, language: String },
    Why { train: String, number: String },
    Marks,
    Mark(NewMark),
    Schedules,
    KeepSchedule(Schedule),
    WithdrawSchedule { name: String },
}

impl StoreQuery {
    /// Whether the answer changes the store.
    pub(crate) const fn writes(&self) -> bool {
        matches!(self, Self::Mark(_) | Self::KeepSchedule(_) | Self::WithdrawSchedule { .. })
    }

    /// The answer as JSON text.
    ///
    /// # Errors
    /// The request or the store is invalid.
    pub(crate) fn answer(self, layout: &Layout, mut store: Store) -> anyhow::Result<String> {
        match self {
            Self::Recordings => listed(&store),
            Self::Pictures { recording } => {
                let wrong = || format!("`{recording}` is not the number of a recording");
                pictures(&store, RecordingKey(recording.parse().with_context(wrong)?))
            }
            Self::Calibration { train, language } => {
                store_report(layout, &store, train_of(&train)?, AnswerForm::named(language).language())
            }
            Self::Why { train, number } => {
                let question: calibrate::Question = number.parse().map_err(anyhow::Error::msg)?;
                let batch = Batch::of_store(layout, &store, LATEST, Some(train_of(&train)?))?;
                let mut text = Vec::new();
                question.answer(layout, &batch, true, &mut text)?;
                Ok(String::from_utf8(text)?)
            }
            Self::Marks => marked(layout, &store),
            Self::Mark(new) => new.make(&mut store),
            Self::Schedules => schedules(layout, &store),
            Self::KeepSchedule(schedule) => {
                store.keep_schedule(layout.name(), &schedule, now())?;
                schedules(layout, &store)
            }
            Self::WithdrawSchedule { name } => {
                store.withdraw_schedule(layout.name(), &name, now())?;
                schedules(layout, &store)
            }
        }
    }
}

fn schedules(layout: &Layout, store: &Store) -> anyhow::Result<String> {
    Ok(serde_json::to_string(&store.schedules(layout.name())?)?)
}

fn train_of(text: &str) -> anyhow::Result<TrainId> {
    Ok(TrainId(text.parse().with_context(|| format!("`{text}` is not the number of a train, such as 24"))?))
}

async fn recordings(State(archive): State<Archive>) -> Response {
    archive.answer(StoreQuery::Recordings).await
}

fn listed(store: &Store) -> anyhow::Result<String> {
    let machines = store.machines()?;
    let list: Vec<Value> = store
        .recordings(LATEST)?
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
}

async fn recorded_pictures(State(archive): State<Archive>, Path(recording): Path<String>) -> Response {
    archive.answer(StoreQuery::Pictures { recording }).await
}

async fn calibration(
    State(archive): State<Archive>,
    Path(train): Path<String>,
    Query(wished): Query<AnswerForm>,
) -> Response {
    archive.answer(StoreQuery::Calibration { train, language: wished.into_name() }).await
}

async fn why(State(archive): State<Archive>, Path((train, number)): Path<(String, String)>) -> Response {
    archive.answer(StoreQuery::Why { train, number }).await
}

async fn marks(State(archive): State<Archive>) -> Response {
    archive.answer(StoreQuery::Marks).await
}

fn marked(layout: &Layout, store: &Store) -> anyhow::Result<String> {
    let mut list = Vec::new();
    for recording in store.recordings(LATEST)?.into_iter().filter(|recording| recording.excluded > 0) {
        let runs = store.runs(recording.key, LATEST)?;
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
}

/// A new mark on events.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewMark {
    events: Vec<i64>,
    mark: Wanted,
    reason: String,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
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
            let why = format!("{}; write {right}", wrong.body_text());
            return (wrong.status(), Json(json!({ "error": why }))).into_response();
        }
    };
    archive.answer(StoreQuery::Mark(new)).await
}

impl NewMark {
    fn make(self, store: &mut Store) -> anyhow::Result<String> {
        if self.events.is_empty() || self.events.len() > MAX_MARKED {
            bail!("{} events cannot be marked at once: 1 to {MAX_MARKED} can", self.events.len());
        }
        let events: Vec<EventKey> = self.events.into_iter().map(EventKey).collect();
        let kind = match self.mark {
            Wanted::Excluded => MarkKind::Excluded,
            Wanted::Restored => MarkKind::Restored,
        };
        match kind {
            MarkKind::Excluded => store.exclude(&events, &self.reason, now())?,
            MarkKind::Restored => store.restore(&events, &self.reason, now())?,
        }
        Ok(json!({ "marked": events.len() }).to_string())
    }
}
