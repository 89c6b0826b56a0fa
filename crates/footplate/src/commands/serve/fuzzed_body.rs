//! The bodies of the interface, answered without a connection, for the fuzzer.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, ensure};
use axum::body::{Body, to_bytes};
use axum::http::{Request, StatusCode, header};
use axum::response::Response;
use footplate_store::parse_layout;
use hyper::service::Service as _;
use hyper_util::service::TowerToHyperService;
use serde_json::Value;

use crate::commands::dashboard_routes::{
    AnswerQueue, Archive, SetUpRoute, archive_routes, fuzzed_set_up_routes, schedule_routes,
};
use crate::commands::drive::FuzzedSession;
use crate::dashboard::{Routes, answering, driving_routes};

/// Paths that answer by starting the program again; the fuzzer is not the program.
const STARTS_A_PROCESS: [&str; 2] = ["/api/setup/doctor", "/api/layout/check"];
/// The longest answer.
const LONGEST_ANSWER: usize = 1 << 20;

/// Posts the rest of the bytes to the path in their first line, lets the session answer and run on, and checks the answer.
///
/// # Errors
/// The answer is not one that a client may get, or a temporary file cannot be written.
pub(crate) fn answer_fuzzed(bytes: &[u8]) -> anyhow::Result<()> {
    let end = bytes.iter().position(|byte| *byte == b'\n').unwrap_or(bytes.len());
    let path = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let body = bytes.get(end + 1..).unwrap_or_default().to_vec();
    if STARTS_A_PROCESS.contains(&path.as_str()) {
        return Ok(());
    }
    let request = Request::post(path.as_str())
        .header(header::HOST, "127.0.0.1:8417")
        .header(header::CONTENT_TYPE, "application/json")
        .body(Body::from(body));
    // Bytes that are no path never become a request.
    let Ok(request) = request else { return Ok(()) };
    let mut session = FuzzedSession::new()?;
    let folder = Folder::make()?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build()?;
    let answer = runtime.block_on(async {
        let service = TowerToHyperService::new(answering(routes(&path, &session, &folder)?));
        let answer = service.call(request);
        tokio::pin!(answer);
        loop {
            tokio::select! {
                biased;
                Ok(answer) = &mut answer => return text_of(answer).await,
                () = tokio::task::yield_now() => session.attend(),
            }
        }
    });
    session.run_on();
    let (status, text) = answer?;
    ensure!(!status.is_server_error(), "{path} is answered with {status}: {text}");
    if matches!(status, StatusCode::BAD_REQUEST | StatusCode::UNPROCESSABLE_ENTITY) {
        let answer: Value = serde_json::from_str(&text).with_context(|| text.clone())?;
        let why = answer["error"].as_str().with_context(|| format!("{text} does not say why"))?;
        ensure!(!why.trim().is_empty() && !why.contains("panicked"), "{path} is refused: `{why}`");
    }
    Ok(())
}

/// The routes that read bodies: of a set-up, or of a session, which have paths in common.
fn routes(path: &str, session: &FuzzedSession, folder: &Folder) -> anyhow::Result<Routes> {
    if path.starts_with("/api/setup") && path != "/api/setup/again" {
        return Ok(fuzzed_set_up_routes(folder.0.join("railway.db")));
    }
    // What a store answers, another process computes.
    let archive = Archive::new(None, &session.written, &AnswerQueue::new());
    let file = parse_layout(session.written.layout.name(), session.written.text.as_bytes())?;
    Ok(driving_routes(&session.board, &file)?
        .and(archive_routes(archive.clone()))
        .and(schedule_routes(archive, Arc::clone(&session.board)))
        .and(SetUpRoute::fixed().routes()))
}

async fn text_of(answer: Response) -> anyhow::Result<(StatusCode, String)> {
    let (parts, body) = answer.into_parts();
    let bytes = to_bytes(body, LONGEST_ANSWER).await.context("an answer is too long")?;
    Ok((parts.status, String::from_utf8(bytes.to_vec()).context("an answer is no text")?))
}

/// A folder for the files of a set-up, which goes with it.
struct Folder(PathBuf);

impl Folder {
    fn make() -> anyhow::Result<Self> {
        let path = std::env::temp_dir().join(format!("footplate-fuzz-{}", std::process::id()));
        std::fs::create_dir_all(&path).with_context(|| format!("cannot make {}", path.display()))?;
        Ok(Self(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
