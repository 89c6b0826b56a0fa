//! Live simulated slides: a train of the simulator through the real odometer, in real time or faster.
//!
//! ```text
//! GET /api/slides                          the scenarios
//! GET /api/slides/S2?seed=7&speed=2        server-sent events: `train`, `rows` of periods, and `score` at the end
//! ```

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::Json;
use axum::extract::{Path, Query, State};
use axum::http::StatusCode;
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use footplate_core::TimeSpan;
use footplate_sim::line::LineScenario;
use futures_util::stream::{Stream, unfold};
use serde::{Deserialize, Serialize};
use serde_json::json;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{Instant, sleep_until};

use crate::commands::odometry::WatchedSlide;
use crate::dashboard::Routes;

/// Slides stream at once; each takes a few thousandths of a core.
const MAX_WATCHED: usize = 4;
/// The interval between two events: 25 a second look smooth.
const EVENT_INTERVAL: Duration = Duration::from_millis(40);
/// The most periods in one event; a slow reader misses older ones.
const MAX_ROWS: usize = 400;
/// Allowed ratios of simulated to real time: at 20, a stop of a minute takes three seconds.
const SPEEDS: std::ops::RangeInclusive<f64> = 0.1..=20.0;

/// The routes.
pub(crate) fn slide_routes() -> Routes {
    let permits = Arc::new(Semaphore::new(MAX_WATCHED));
    Routes::new(permits, [("/api/slides", get(list)), ("/api/slides/{scenario}", get(watch))])
}

#[derive(Debug, Deserialize)]
#[serde(default)]
struct Asked {
    seed: u64,
    speed: f64,
}

impl Default for Asked {
    fn default() -> Self {
        Self { seed: 1, speed: 1.0 }
    }
}

async fn list() -> Response {
    let one =
        |scenario: &LineScenario| json!({ "name": scenario.name(), "description": scenario.description() });
    Json(LineScenario::all().iter().map(one).collect::<Vec<_>>()).into_response()
}

fn reject(status: StatusCode, why: &str) -> Response {
    (status, Json(json!({ "error": why }))).into_response()
}

async fn watch(
    State(permits): State<Arc<Semaphore>>,
    Path(name): Path<String>,
    asked: Result<Query<Asked>, axum::extract::rejection::QueryRejection>,
) -> Response {
    let Some(scenario) = LineScenario::by_name(&name) else {
        return reject(
            StatusCode::NOT_FOUND,
            &format!("there is no scenario `{name}`; /api/slides lists them"),
        );
    };
    let asked = match asked {
        Ok(Query(asked)) if SPEEDS.contains(&asked.speed) => asked,
        _ => {
            let why = "write a whole number as seed and a speed from 0.1 to 20 times real: ?seed=7&speed=2";
            return reject(StatusCode::UNPROCESSABLE_ENTITY, why);
        }
    };
    let Ok(permit) = permits.try_acquire_owned() else {
        return reject(
            StatusCode::SERVICE_UNAVAILABLE,
            "four slides are being watched already: try again in a minute",
        );
    };
    // Simulating minutes takes a moment, too long for the server's thread.
    match tokio::task::spawn_blocking(move || WatchedSlide::new(scenario, asked.seed)).await {
        Ok(Ok(slide)) => {
            let stream = SlideStream {
                slide,
                speed: asked.speed,
                began: Instant::now(),
                events_sent: 0,
                part: Part::Train,
                _permit: permit,
            };
            Sse::new(stream.events()).keep_alive(KeepAlive::default()).into_response()
        }
        _ => reject(StatusCode::INTERNAL_SERVER_ERROR, "this could not be simulated: the terminal why more"),
    }
}

/// A slide that one client watches; it ends with the connection.
struct SlideStream {
    slide: WatchedSlide,
    speed: f64,
    began: Instant,
    events_sent: u32,
    part: Part,
    _permit: OwnedSemaphorePermit,
}

/// The next event to send.
#[derive(Debug, Clone, Copy)]
enum Part {
    Train,
    Rows,
    Score,
    Nothing,
}

impl SlideStream {
    fn events(self) -> impl Stream<Item = Result<Event, Infallible>> {
        unfold(self, |mut stream| async move {
            let event = match stream.part {
                Part::Train => {
                    stream.part = Part::Rows;
                    event("train", &stream.slide.opening())
                }
                Part::Rows => stream.rows().await,
                Part::Score => {
                    stream.part = Part::Nothing;
                    event("score", &stream.slide.score())
                }
                Part::Nothing => return None,
            };
            Some((Ok(event), stream))
        })
    }

    async fn rows(&mut self) -> Event {
        self.events_sent += 1;
        sleep_until(self.began + EVENT_INTERVAL * self.events_sent).await;
        let elapsed = self.began.elapsed();
        // A slow reader continues with the next event that is due.
        self.events_sent = self
            .events_sent
            .max(elapsed.as_millis().div_euclid(EVENT_INTERVAL.as_millis()).try_into().unwrap_or(u32::MAX));
        let until = TimeSpan::from_s(self.speed * elapsed.as_secs_f64());
        let (rows, gone) = self.slide.go_on(until, MAX_ROWS);
        if self.slide.is_over() {
            self.part = Part::Score;
        }
        event("rows", &json!({ "rows": rows, "gone": gone }))
    }
}

fn event(kind: &'static str, what: &impl Serialize) -> Event {
    // A failure to write JSON is a bug that a test finds.
    Event::default().event(kind).data(serde_json::to_string(what).unwrap_or_default())
}
