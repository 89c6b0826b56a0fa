//! Answers requests that read files. Each is computed by a child process with limited memory and time
//! (`commands/clerk.rs`), one at a time, so that no file and no store can slow down the process that drives trains.

use std::io::{Read, Write};
use std::process::{Command, Stdio};
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

use super::clerk_process::{ClerkProcess, UntilDropped};
use crate::commands::clerk::{CLERK, LONGEST_ANSWER, Question, limit_that_ended};
use crate::commands::odometry::PassingFolder;
use crate::commands::web_page::Language;
use crate::error_text::error_text;

/// Computes one answer at a time: on a machine with two cores the control loop needs the other one.
#[derive(Debug, Clone)]
pub(crate) struct AnswerQueue {
    /// Permits for requests that have been accepted.
    permits: Arc<Semaphore>,
    /// The permit of the request that is being computed.
    turn: Arc<Semaphore>,
}

/// Accepted requests; further ones are rejected.
const MAX_REQUESTS: usize = 8;
/// The longest time for an uploaded recording, from its turn on.
const UPLOAD_TIMEOUT: Duration = Duration::from_secs(60);
/// Parts of an uploaded recording that are buffered.
const BUFFERED_PARTS: usize = 4;
/// The most bytes that are read of a child's error output.
const MAX_ERROR_TEXT: u64 = 1 << 16;

/// A rejected request.
#[derive(Debug)]
pub(super) struct Rejection(pub(super) StatusCode, pub(super) String);

impl IntoResponse for Rejection {
    fn into_response(self) -> Response {
        (self.0, Json(json!({ "error": self.1 }))).into_response()
    }
}

impl AnswerQueue {
    pub(crate) fn new() -> Self {
        Self { permits: Arc::new(Semaphore::new(MAX_REQUESTS)), turn: Arc::new(Semaphore::new(1)) }
    }

    /// Computes the answer to a request with a body of at most `most` bytes as JSON, or the reason why not.
    pub(super) async fn answer(&self, question: Question, body: Body, most: usize) -> Response {
        match self.ask(question, body, most).await {
            Ok(text) => {
                ([(header::CONTENT_TYPE, "application/json"), (header::CACHE_CONTROL, "no-store")], text)
                    .into_response()
            }
            Err(rejection) => rejection.into_response(),
        }
    }

    /// Computes the answer to a request with a body of at most `most` bytes. The body is read only when it is the
    /// request's turn.
    ///
    /// # Errors
    /// The request is invalid.
    pub(super) async fn ask(&self, question: Question, body: Body, most: usize) -> Result<String, Rejection> {
        let internal =
            |error: anyhow::Error| Rejection(StatusCode::INTERNAL_SERVER_ERROR, error_text(&error));
        let too_many = || {
            let why = "too many requests are being computed: try again in a moment".to_owned();
            Rejection(StatusCode::TOO_MANY_REQUESTS, why)
        };
        let permit = Arc::clone(&self.permits).try_acquire_owned().map_err(|_| too_many())?;
        let turn = Arc::clone(&self.turn).acquire_owned().await.map_err(|_| too_many())?;
        let (parts, passed) = mpsc::channel(BUFFERED_PARTS);
        let process = ClerkProcess::default();
        // If the client leaves, this future is dropped, and the child process ends. The next request waits until it has.
        let _client = UntilDropped::of(&process);
        let clerk = tokio::task::spawn_blocking(move || {
            let answer = answered(&process, &question, passed);
            process.end();
            drop((permit, turn));
            answer
        });
        let sent = timeout(UPLOAD_TIMEOUT, forward_body(body, most, &parts)).await.unwrap_or_else(|_| {
            let why = format!("what was sent did not arrive within {} s", UPLOAD_TIMEOUT.as_secs());
            Err(Rejection(StatusCode::REQUEST_TIMEOUT, why))
        });
        if sent.is_err() {
            let _ = parts.send(BodyPart::Ended).await;
        }
        drop(parts);
        let answer = clerk.await.map_err(|error| internal(anyhow!(error)))?;
        sent?;
        answer.map_err(internal)?
    }
}

/// A part of a body.
enum BodyPart {
    Bytes(Bytes),
    /// The upload ended early.
    Ended,
}

async fn forward_body(body: Body, most: usize, parts: &mpsc::Sender<BodyPart>) -> Result<(), Rejection> {
    let mut stream = body.into_data_stream();
    let mut count = 0;
    while let Some(part) = stream.next().await {
        let part = part.map_err(|error| Rejection(StatusCode::BAD_REQUEST, error.to_string()))?;
        count += part.len();
        if count > most {
            let why = format!("what was sent is too large: at most {} MB are allowed", most >> 20);
            return Err(Rejection(StatusCode::PAYLOAD_TOO_LARGE, why));
        }
        if parts.send(BodyPart::Bytes(part)).await.is_err() {
            // The child has stopped reading; its status says why.
            return Ok(());
        }
    }
    Ok(())
}

/// Starts a child process, passes it the request and its body, and reads the answer.
fn answered(
    process: &ClerkProcess,
    question: &Question,
    mut passed: mpsc::Receiver<BodyPart>,
) -> anyhow::Result<Result<String, Rejection>> {
    // Files of a killed child are removed with the folder.
    let folder = PassingFolder::make().context("making room for an answer")?;
    let mut clerk = Command::new(std::env::current_exe()?);
    clerk
        .arg(CLERK)
        .env("TMPDIR", folder.path())
        // The child gets no guardian and none of this process's secrets.
        .env_remove("FOOTPLATE_WARD")
        .env_remove("FOOTPLATE_TOKEN")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let (mut input, output, errors) = process.start(&mut clerk)?;
    let output = std::thread::spawn(move || text_of(output, LONGEST_ANSWER));
    let errors = std::thread::spawn(move || text_of(errors, MAX_ERROR_TEXT));
    // A child that stops reading says why by its status, which is checked below.
    let mut is_reading = writeln!(input, "{}", serde_json::to_string(question)?).is_ok();
    while let Some(part) = passed.blocking_recv().filter(|_| is_reading) {
        match part {
            BodyPart::Bytes(bytes) => is_reading = input.write_all(&bytes).is_ok(),
            BodyPart::Ended => process.kill(),
        }
    }
    drop((input, passed));
    let output = output.join().unwrap_or_default();
    let errors = errors.join().unwrap_or_default();
    let status = process.wait()?;
    Ok(match limit_that_ended(status, &errors) {
        Some(limit) => Err(Rejection(StatusCode::PAYLOAD_TOO_LARGE, limit)),
        None if status.success() => Ok(output),
        None => {
            let why = errors.trim().trim_start_matches("error: ");
            let why = if why.is_empty() { "the request failed without a reason" } else { why };
            Err(Rejection(StatusCode::UNPROCESSABLE_ENTITY, why.to_owned()))
        }
    })
}

fn text_of(pipe: impl Read, most: u64) -> String {
    let mut bytes = Vec::new();
    // A longer output is cut off.
    let _ = pipe.take(most).read_to_end(&mut bytes);
    String::from_utf8_lossy(&bytes).into_owned()
}

/// The requested form of an answer.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct AnswerForm {
    language: String,
}

impl AnswerForm {
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
