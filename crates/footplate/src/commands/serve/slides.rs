//! Simulated slides, live: a train of the simulator through the real odometer in real time, or faster.
//!
//! ```text
//! GET /api/slides                          what there is to watch
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

/// Slides that are shown at once; each takes a few thousandths of a core.
const MOST_WATCHED: usize = 4;
/// Between two parcels of periods: twenty-five a second look like motion.
const BETWEEN_PARCELS: Duration = Duration::from_millis(40);
/// Periods of one parcel. Who does not read for a while misses older ones, and nobody keeps them.
const MOST_ROWS: usize = 400;
/// Times real time that can be asked for: a stop that takes a minute is over in three seconds.
const SPEEDS: std::ops::RangeInclusive<f64> = 0.1..=20.0;

/// The routes.
pub(crate) fn slide_routes() -> Routes {
    let places = Arc::new(Semaphore::new(MOST_WATCHED));
    Routes::new(places, [("/api/slides", get(list)), ("/api/slides/{scenario}", get(watch))])
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

fn refused(status: StatusCode, says: &str) -> Response {
    (status, Json(json!({ "error": says }))).into_response()
}

async fn watch(
    State(places): State<Arc<Semaphore>>,
    Path(name): Path<String>,
    asked: Result<Query<Asked>, axum::extract::rejection::QueryRejection>,
) -> Response {
    let Some(scenario) = LineScenario::by_name(&name) else {
        return refused(
            StatusCode::NOT_FOUND,
            &format!("there is no scenario `{name}`; /api/slides lists them"),
        );
    };
    let asked = match asked {
        Ok(Query(asked)) if SPEEDS.contains(&asked.speed) => asked,
        _ => {
            let says = "write a whole number as seed and a speed from 0.1 to 20 times real: ?seed=7&speed=2";
            return refused(StatusCode::UNPROCESSABLE_ENTITY, says);
        }
    };
    let Ok(place) = places.try_acquire_owned() else {
        return refused(
            StatusCode::SERVICE_UNAVAILABLE,
            "four slides are watched already: come again in a minute",
        );
    };
    // A run of minutes is simulated in a moment, but not on the server's thread.
    match tokio::task::spawn_blocking(move || WatchedSlide::new(scenario, asked.seed)).await {
        Ok(Ok(slide)) => {
            let shown = Shown {
                slide,
                speed: asked.speed,
                began: Instant::now(),
                parcels: 0,
                part: Part::Train,
                _place: place,
            };
            Sse::new(shown.events()).keep_alive(KeepAlive::default()).into_response()
        }
        _ => {
            refused(StatusCode::INTERNAL_SERVER_ERROR, "this could not be simulated: the terminal says more")
        }
    }
}

/// A slide that somebody watches. It ends with them: nobody else holds it.
struct Shown {
    slide: WatchedSlide,
    speed: f64,
    began: Instant,
    parcels: u32,
    part: Part,
    _place: OwnedSemaphorePermit,
}

/// What is sent next.
#[derive(Debug, Clone, Copy)]
enum Part {
    Train,
    Rows,
    Score,
    Nothing,
}

impl Shown {
    fn events(self) -> impl Stream<Item = Result<Event, Infallible>> {
        unfold(self, |mut shown| async move {
            let event = match shown.part {
                Part::Train => {
                    shown.part = Part::Rows;
                    event("train", &shown.slide.opening())
                }
                Part::Rows => shown.rows().await,
                Part::Score => {
                    shown.part = Part::Nothing;
                    event("score", &shown.slide.score())
                }
                Part::Nothing => return None,
            };
            Some((Ok(event), shown))
        })
    }

    async fn rows(&mut self) -> Event {
        self.parcels += 1;
        sleep_until(self.began + BETWEEN_PARCELS * self.parcels).await;
        let elapsed = self.began.elapsed();
        // Who reads slowly gets the next parcel when it is due, and not those in between.
        self.parcels = self
            .parcels
            .max(elapsed.as_millis().div_euclid(BETWEEN_PARCELS.as_millis()).try_into().unwrap_or(u32::MAX));
        let until = TimeSpan::from_s(self.speed * elapsed.as_secs_f64());
        let (rows, gone) = self.slide.go_on(until, MOST_ROWS);
        if self.slide.is_over() {
            self.part = Part::Score;
        }
        event("rows", &json!({ "rows": rows, "gone": gone }))
    }
}

fn event(kind: &'static str, what: &impl Serialize) -> Event {
    // What cannot be written as JSON is a mistake of ours that a test finds.
    Event::default().event(kind).data(serde_json::to_string(what).unwrap_or_default())
}
