//! The desk at which a browser asks for what is worked out from files: one question at a time, each in a limited program of its
//! own (`commands/clerk.rs`), so that no file and no store can take memory or time from the one that drives trains.

use std::io::{Read, Write};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, anyhow};
use axum::Json;
use axum::body::{Body, Bytes};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use serde::Deserialize;
use serde_json::json;
use tokio::sync::{Semaphore, mpsc};
use tokio::time::timeout;

use crate::commands::clerk::{CLERK, LONGEST_ANSWER, Question, limit_that_ended};
use crate::commands::odometry::PassingFolder;
use crate::commands::web_page::Language;

/// Works out one answer after the other: on a small machine the control loop wants the other core.
#[derive(Debug, Clone)]
pub(crate) struct Desk {
    /// Those who have come.
    places: Arc<Semaphore>,
    /// The one who is served.
    turn: Arc<Semaphore>,
}

/// Those who wait for their turn; more are sent away.
const MOST_AT_THE_DESK: usize = 8;
/// How long a browser may take to send a recording, and for its next piece.
const SENT_WITHIN: Duration = Duration::from_secs(60);
/// Pieces of a recording that wait to be passed on.
const PIECES: usize = 4;
/// What a clerk may say about its troubles.
const LONGEST_COMPLAINT: u64 = 1 << 16;

/// What somebody asks cannot be answered.
#[derive(Debug)]
pub(crate) struct Refusal(StatusCode, String);

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        (self.0, Json(json!({ "error": self.1 }))).into_response()
    }
}

impl Desk {
    pub(crate) fn new() -> Self {
        Self { places: Arc::new(Semaphore::new(MOST_AT_THE_DESK)), turn: Arc::new(Semaphore::new(1)) }
    }

    /// Works out a text of JSON, or says what is wrong with what was asked.
    pub(super) async fn answer(&self, question: Question) -> Response {
        match self.ask(question, Body::empty(), 0).await {
            Ok(text) => {
                ([(header::CONTENT_TYPE, "application/json"), (header::CACHE_CONTROL, "no-store")], text)
                    .into_response()
            }
            Err(refusal) => refusal.into_response(),
        }
    }

    /// Has a question about a body of at most so many bytes answered. The body is not read before it is its turn.
    ///
    /// # Errors
    /// What is wrong with what was asked.
    pub(super) async fn ask(&self, question: Question, body: Body, most: usize) -> Result<String, Refusal> {
        let internal =
            |error: anyhow::Error| Refusal(StatusCode::INTERNAL_SERVER_ERROR, format!("{error:#}"));
        let too_many = || {
            let says = "too many answers are being worked out: ask again in a moment".to_owned();
            Refusal(StatusCode::TOO_MANY_REQUESTS, says)
        };
        let _place = self.places.try_acquire().map_err(|_| too_many())?;
        let _turn = self.turn.acquire().await.map_err(|_| too_many())?;
        let (pieces, passed) = mpsc::channel(PIECES);
        let clerk = tokio::task::spawn_blocking(move || answered(&question, passed));
        let sent = timeout(SENT_WITHIN, pass_on(body, most, &pieces)).await.unwrap_or_else(|_| {
            let says = format!("the recording was not sent within {} s", SENT_WITHIN.as_secs());
            Err(Refusal(StatusCode::REQUEST_TIMEOUT, says))
        });
        if sent.is_err() {
            let _ = pieces.send(Piece::Ended).await;
        }
        drop(pieces);
        let answer = clerk.await.map_err(|error| internal(anyhow!(error)))?;
        sent?;
        answer.map_err(internal)?
    }
}

/// A piece of a body on its way to the clerk.
enum Piece {
    Bytes(Bytes),
    /// It will not come whole.
    Ended,
}

async fn pass_on(body: Body, most: usize, pieces: &mpsc::Sender<Piece>) -> Result<(), Refusal> {
    let mut stream = body.into_data_stream();
    let mut count = 0;
    while let Some(piece) = stream.next().await {
        let piece = piece.map_err(|error| Refusal(StatusCode::BAD_REQUEST, error.to_string()))?;
        count += piece.len();
        if count > most {
            let says = format!("the recording is too large: at most {} MB are taken", most >> 20);
            return Err(Refusal(StatusCode::PAYLOAD_TOO_LARGE, says));
        }
        if pieces.send(Piece::Bytes(piece)).await.is_err() {
            // The clerk has seen enough, and says why.
            return Ok(());
        }
    }
    Ok(())
}

/// Ends with whoever asked.
struct Clerk(Child);

impl Drop for Clerk {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts a clerk, gives it a question and what belongs to it, and takes its answer.
fn answered(
    question: &Question,
    mut passed: mpsc::Receiver<Piece>,
) -> anyhow::Result<Result<String, Refusal>> {
    // What a clerk that is ended leaves behind goes with it.
    let folder = PassingFolder::make().context("making room for an answer")?;
    let clerk = Command::new(std::env::current_exe()?)
        .arg(CLERK)
        .env("TMPDIR", folder.path())
        // It has no guardian, and no secret of this program.
        .env_remove("FOOTPLATE_WARD")
        .env_remove("FOOTPLATE_TOKEN")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .context("cannot start a program to work this out")?;
    let mut clerk = Clerk(clerk);
    let pipes = (clerk.0.stdin.take(), clerk.0.stdout.take(), clerk.0.stderr.take());
    let (Some(mut input), Some(output), Some(errors)) = pipes else {
        return Err(anyhow!("a pipe is missing"));
    };
    let output = std::thread::spawn(move || text_of(output, LONGEST_ANSWER));
    let errors = std::thread::spawn(move || text_of(errors, LONGEST_COMPLAINT));
    // A clerk that does not want to read on says why, and its status is looked at below.
    let mut wants = writeln!(input, "{}", serde_json::to_string(question)?).is_ok();
    while let Some(piece) = passed.blocking_recv().filter(|_| wants) {
        match piece {
            Piece::Bytes(bytes) => wants = input.write_all(&bytes).is_ok(),
            Piece::Ended => drop(clerk.0.kill()),
        }
    }
    drop((input, passed));
    let output = output.join().unwrap_or_default();
    let errors = errors.join().unwrap_or_default();
    let status = clerk.0.wait()?;
    Ok(match limit_that_ended(status, &errors) {
        Some(limit) => Err(Refusal(StatusCode::PAYLOAD_TOO_LARGE, limit)),
        None if status.success() => Ok(output),
        None => {
            let said = errors.trim().trim_start_matches("error: ");
            let said = if said.is_empty() { "this could not be worked out" } else { said };
            Err(Refusal(StatusCode::UNPROCESSABLE_ENTITY, said.to_owned()))
        }
    })
}

fn text_of(pipe: impl Read, most: u64) -> String {
    let mut bytes = Vec::new();
    // What is longer is cut off, and its writer finds nobody to read on.
    let _ = pipe.take(most).read_to_end(&mut bytes);
    String::from_utf8_lossy(&bytes).into_owned()
}

/// How an answer shall be written.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Wished {
    language: String,
}

impl Wished {
    pub(crate) const fn named(language: String) -> Self {
        Self { language }
    }

    pub(crate) fn into_name(self) -> String {
        self.language
    }

    pub(crate) fn language(&self) -> Language {
        Language::of_code(&self.language)
    }
}
