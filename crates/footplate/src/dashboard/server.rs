//! The HTTP server, on a thread of its own.
//!
//! ```text
//! GET  /                     the pages
//! GET  /api/openapi.json     the description of the interface
//! GET  /api/layout           the layout, with drawing coordinates
//! GET  /api/picture          the current state
//! GET  /api/events           server-sent events: `picture`, `line`, `passed`, `ended`, `alarm`, `gap`; resumes at
//! `Last-Event-ID`
//! GET  /api/trains/24/history   the last five minutes of a train
//! GET  /api/trains/24/model     its motion model
//! GET  /api/line             timing of the link and of the control loop
//! GET  /api/truth            where simulated trains really are
//! POST /api/alarms/3/end     {}: the operator has seen to this alarm
//! POST /api/orders           {"line": "stop 24 at C13+120mm"}: a line in the syntax of the prompt
//! POST /api/emergency-stop   {}: stop all trains, switch the track power off
//! ```

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::str::FromStr;
use std::sync::{Arc, PoisonError};
use std::thread;
use std::time::Duration;

use anyhow::Context;
use axum::extract::{DefaultBodyLimit, Path, Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::sse::{KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use footplate_core::TrainId;
use footplate_store::LayoutFile;
use serde::{Deserialize, Serialize};
use serde_json::json;
use tokio::net::TcpListener;
use tokio::sync::oneshot;

use super::assets::asset;
use super::board::{self, Board, NotDone};
use super::connections::{LastRequest, Limits, serve};
use super::guard::{Denied, Guard};
use super::model_picture::ModelPicture;
use super::picture::LayoutPicture;
use super::routes::Routes;
use super::stream::events;
use super::timed_body::in_time;
use super::token::Token;
use crate::accept_queue::listen;
use crate::clock::now;
use crate::link::{LineTallies, SharedTallies};
use crate::standard_error::say;

/// The largest request body, in bytes: longer than any command.
const MAX_BODY: usize = 4 << 10;
/// The longest time for it, as for a header: from the first part on that is read.
const BODY_WITHIN: Duration = Duration::from_secs(10);
/// The time in which the last answer reaches the browser, even on a busy machine.
const LAST_ANSWER_TIME: Duration = Duration::from_millis(300);
/// The default port.
const USUAL_PORT: u16 = 8417;

/// The OpenAPI description.
const OPENAPI: &str = include_str!("../../assets/dashboard/openapi.json");

/// The delay of a rejected token: a connection can try two a second.
const WRONG_TOKEN_DELAY: Duration = Duration::from_millis(500);

/// The address to serve at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ServedAt(SocketAddr);

impl std::fmt::Display for ServedAt {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl ServedAt {
    /// The default port of this machine.
    pub(crate) const USUAL: Self = Self(SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), USUAL_PORT));
    /// Any free port of this machine.
    pub(crate) const ANY: Self = Self(SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 0));
}

impl ServedAt {
    /// The address with a free port in place of 0.
    ///
    /// # Errors
    /// It is in use.
    pub(crate) fn with_port(&self) -> anyhow::Result<Self> {
        Ok(Self(self.listen()?.local_addr()?))
    }

    fn listen(&self) -> anyhow::Result<std::net::TcpListener> {
        listen(self.0)
            .with_context(|| format!("{} cannot be served at: name another port, or 0 for any", self.0))
    }

    /// Whether other machines can reach it.
    pub(crate) const fn needs_token(&self) -> bool {
        !self.0.ip().is_loopback()
    }
}

impl FromStr for ServedAt {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        let loopback = |port| SocketAddr::from(([127, 0, 0, 1], port));
        let address = match text {
            "" => Self::USUAL.0,
            _ => match text.parse::<u16>() {
                Ok(port) => loopback(port),
                Err(_) => text.parse().with_context(|| {
                    format!(
                        "`{text}` is not an address to serve at: use a port such as 8417, or \
                         127.0.0.1:8417"
                    )
                })?,
            },
        };
        Ok(Self(address))
    }
}

/// A server that runs until the program ends.
#[derive(Debug)]
pub(crate) struct Dashboard {
    pub(crate) board: Arc<Board>,
    /// Timing statistics of the link.
    pub(crate) line: SharedTallies,
    /// The address to open in a browser.
    pub(crate) url: String,
    _pages: ServedPages,
}

#[derive(Clone)]
struct Shared {
    board: Arc<Board>,
    layout: Arc<str>,
    line: SharedTallies,
}

impl Dashboard {
    /// Starts the server; `more` are routes beside those of driving, over the same board.
    ///
    /// # Errors
    /// The address is in use, or the token is too short.
    pub(crate) fn open(
        at: &ServedAt,
        token: Option<Token>,
        layout: &LayoutFile,
        more: impl FnOnce(&Arc<Board>) -> Routes,
    ) -> anyhow::Result<Self> {
        let layout = serde_json::to_string(&LayoutPicture::of(layout))?.into();
        // The start time in nanoseconds identifies the session.
        let board = Board::new(now().as_ns());
        let line = SharedTallies::default();
        let shared = Shared { board: Arc::clone(&board), layout, line: Arc::clone(&line) };
        let pages = ServedPages::open(at, token, own_routes(shared).and(more(&board)))?;
        Ok(Self { board, line, url: pages.url.clone(), _pages: pages })
    }
}

/// Pages and routes at an address, until they are dropped.
#[derive(Debug)]
pub(crate) struct ServedPages {
    /// The address to open in a browser.
    pub(crate) url: String,
    /// The end of the server: it runs until this is dropped.
    ends: Option<oneshot::Sender<()>>,
    thread: Option<thread::JoinHandle<()>>,
}

impl ServedPages {
    /// Starts a server.
    ///
    /// # Errors
    /// The address is in use, or the token is too short.
    pub(crate) fn open(at: &ServedAt, token: Option<Token>, routes: Routes) -> anyhow::Result<Self> {
        // A chosen token is known to its owner and is not printed.
        let generated = (token.is_none() && at.needs_token()).then(Token::generated).transpose()?;
        let listener = at.listen()?;
        listener.set_nonblocking(true)?;
        let bound = listener.local_addr()?;
        let shown = generated.as_ref().map(|token| format!("?token={}", token.text()));
        let url = format!("http://{bound}/{}", shown.unwrap_or_default());
        let guard = Guard::new(bound, token.or(generated));
        let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
        let (ends, ended) = oneshot::channel::<()>();
        let thread = thread::Builder::new().name("dashboard".to_owned()).spawn(move || {
            runtime.block_on(async move {
                match TcpListener::from_std(listener) {
                    Ok(listener) => tokio::select! {
                        () = serve(listener, router(guard, routes), Limits::USUAL) => {}
                        _ = ended => {}
                    },
                    Err(error) => say!("the dashboard is not served: {error}"),
                }
            });
            // Work that blocks is given up: no client waits for its answer any more.
            runtime.shutdown_background();
        })?;
        Ok(Self { url, ends: Some(ends), thread: Some(thread) })
    }
}

/// Waits for the last answer: an emergency stop may end the program before its answer is sent. The address is free
/// afterwards.
impl Drop for ServedPages {
    fn drop(&mut self) {
        thread::sleep(LAST_ANSWER_TIME);
        drop(self.ends.take());
        // A server that panicked has closed its address, too.
        let _ = self.thread.take().map(thread::JoinHandle::join);
    }
}

fn router(guard: Guard, routes: Routes) -> Router {
    Router::new()
        .route("/", get(|| page(Path(String::new()))))
        .route("/{file}", get(page))
        .merge(routes.into_router())
        .layer(DefaultBodyLimit::max(MAX_BODY))
        .layer(from_fn_with_state(BODY_WITHIN, in_time))
        .layer(from_fn_with_state(guard, guarded))
}

/// What answers requests without a connection, as at the usual address of this machine.
pub(crate) fn answering(routes: Routes) -> Router {
    router(Guard::new(ServedAt::USUAL.0, None), routes)
}

/// The routes of a driving session over a board, without the timing of its link.
///
/// # Errors
/// The layout cannot be drawn.
pub(crate) fn driving_routes(board: &Arc<Board>, layout: &LayoutFile) -> anyhow::Result<Routes> {
    let layout = serde_json::to_string(&LayoutPicture::of(layout))?.into();
    Ok(own_routes(Shared { board: Arc::clone(board), layout, line: SharedTallies::default() }))
}

/// The routes of a driving session.
fn own_routes(shared: Shared) -> Routes {
    Routes::new(
        shared,
        [
            ("/api/openapi.json", get(async || ready_json(OPENAPI))),
            ("/api/layout", get(layout)),
            ("/api/picture", get(picture)),
            ("/api/events", get(watch)),
            ("/api/trains/{train}/history", get(history)),
            ("/api/trains/{train}/model", get(model)),
            ("/api/line", get(line)),
            ("/api/truth", get(truth)),
            ("/api/alarms/{alarm}/end", post(end_alarm)),
            ("/api/orders", post(order)),
            ("/api/emergency-stop", post(emergency_stop)),
        ],
    )
}

async fn guarded(State(guard): State<Guard>, request: Request, next: Next) -> Response {
    // Event streams of browsers cannot send headers: they carry the token in the address.
    let query = request.uri().query().unwrap_or_default();
    let token = query.split('&').find_map(|pair| pair.strip_prefix("token="));
    let is_page = !request.uri().path().starts_with("/api/");
    let mut response = match guard.check(request.method(), request.headers(), token, is_page) {
        Ok(()) => {
            if let Some(last) = request.extensions().get::<LastRequest>().filter(|_| !is_page) {
                last.is_now();
            }
            next.run(request).await
        }
        Err(denied) => {
            if denied == Denied::Token {
                tokio::time::sleep(WRONG_TOKEN_DELAY).await;
            }
            (denied.status(), Json(json!({ "error": denied.says() }))).into_response()
        }
    };
    // Browsers must not sniff content types, nor pass on addresses, which may contain the token.
    let headers = response.headers_mut();
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    response
}

async fn page(Path(file): Path<String>) -> Response {
    match asset(&file) {
        Some(asset) => asset.into_response(),
        None => (StatusCode::NOT_FOUND, Json(json!({ "error": "there is no such page" }))).into_response(),
    }
}

fn ready_json(text: &str) -> Response {
    ([(header::CONTENT_TYPE, "application/json"), (header::CACHE_CONTROL, "no-store")], text.to_owned())
        .into_response()
}

async fn layout(State(shared): State<Shared>) -> Response {
    ready_json(&shared.layout)
}

async fn picture(State(shared): State<Shared>) -> Response {
    let picture = Arc::clone(&shared.board.pictures().borrow());
    ready_json(&picture)
}

async fn watch(State(shared): State<Shared>, headers: HeaderMap) -> Response {
    let Some(watching) = shared.board.watch() else {
        let says = "too many watch already: /api/picture can be asked for";
        return (StatusCode::SERVICE_UNAVAILABLE, Json(json!({ "error": says }))).into_response();
    };
    let last = headers.get("last-event-id").and_then(|value| value.to_str().ok());
    let from = last.and_then(|last| shared.board.number_after(last)).unwrap_or(0);
    Sse::new(events(shared.board, watching, from)).keep_alive(KeepAlive::default()).into_response()
}

/// Timing of the link and of the control loop.
async fn line(State(shared): State<Shared>) -> Response {
    let tallies = shared.line.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let LineTallies { periods, first_bytes, turns, power } = tallies;
    Json(json!({
        "poll_period": periods.picture(),
        "first_byte": first_bytes.picture(),
        "loop_turn": turns.picture(),
        "power": power,
    }))
    .into_response()
}

/// The JSON of a train, or the error that the session has no such train.
fn json_of_train<T: Serialize>(train: &str, found: impl FnOnce(TrainId) -> Option<T>) -> Response {
    match train.parse().ok().and_then(|number| found(TrainId(number))) {
        Some(found) => ([(header::CACHE_CONTROL, "no-store")], Json(found)).into_response(),
        None => {
            let says = format!("`{train}` is not a train of this session; /api/picture lists them");
            (StatusCode::NOT_FOUND, Json(json!({ "error": says }))).into_response()
        }
    }
}

async fn history(State(shared): State<Shared>, Path(train): Path<String>) -> Response {
    json_of_train(&train, |train| shared.board.history(train).map(|history| history.columns()))
}

async fn model(State(shared): State<Shared>, Path(train): Path<String>) -> Response {
    json_of_train(&train, |train| shared.board.model(train).map(|model| ModelPicture::of(&model)))
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct OrderLine {
    line: String,
}

async fn order(
    State(shared): State<Shared>,
    body: Result<Json<OrderLine>, axum::extract::rejection::JsonRejection>,
) -> Response {
    match body {
        Ok(Json(OrderLine { line })) => ask(&shared.board, board::Request::Line(line)).await,
        Err(wrong) => {
            let says = format!("{}; write {{\"line\": \"stop 24 at C13\"}}", wrong.body_text());
            (wrong.status(), Json(json!({ "error": says }))).into_response()
        }
    }
}

async fn emergency_stop(State(shared): State<Shared>) -> Response {
    ask(&shared.board, board::Request::EmergencyStop).await
}

async fn truth(State(shared): State<Shared>) -> Response {
    ask(&shared.board, board::Request::Truth).await
}

async fn end_alarm(State(shared): State<Shared>, Path(alarm): Path<String>) -> Response {
    match alarm.parse() {
        Ok(id) => ask(&shared.board, board::Request::EndAlarm(id)).await,
        Err(_) => {
            let says = format!("`{alarm}` is not the number of an alarm; /api/picture lists them");
            (StatusCode::NOT_FOUND, Json(json!({ "error": says }))).into_response()
        }
    }
}

async fn ask(board: &Board, request: board::Request) -> Response {
    answered(board.ask_and_wait(request).await)
}

/// The answer of the control loop as a response.
pub(crate) fn answered(answer: Result<Option<String>, NotDone>) -> Response {
    let not_done = match answer {
        Ok(None) => return (StatusCode::ACCEPTED, Json(json!({ "taken": true }))).into_response(),
        Ok(Some(json)) => return ready_json(&json),
        Err(not_done) => not_done,
    };
    let status = match not_done {
        NotDone::TooMany => StatusCode::TOO_MANY_REQUESTS,
        NotDone::Refused(_) => StatusCode::UNPROCESSABLE_ENTITY,
        NotDone::NoAnswer => StatusCode::GATEWAY_TIMEOUT,
    };
    (status, Json(json!({ "error": not_done.says() }))).into_response()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use hyper_util::service::TowerToHyperService;

    use super::*;
    use crate::commands::{session_paths, set_up_paths};

    #[test]
    fn the_description_of_the_interface_has_every_route_and_no_other() {
        let shared = Shared { board: Board::new(0), layout: "".into(), line: SharedTallies::default() };
        let of_session = session_paths(&shared.board);
        let own = own_routes(shared);
        let there: BTreeSet<&str> =
            own.paths().iter().copied().chain(of_session).chain(set_up_paths()).collect();
        let described: serde_json::Value = serde_json::from_str(OPENAPI).expect("JSON");
        let described: BTreeSet<&str> =
            described["paths"].as_object().expect("paths").keys().map(String::as_str).collect();
        assert_eq!(there, described);
    }

    #[test]
    fn a_wrong_token_is_answered_late_and_an_encoded_one_is_right() {
        let text = "a-token+of/letters=";
        let guard =
            || Guard::new(ServedAt::USUAL.0, Some(Token::chosen(text).expect("a token that is long enough")));
        let shared = || Shared { board: Board::new(0), layout: "".into(), line: SharedTallies::default() };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().expect("a runtime");
        let ask = |path: &str| {
            let service = TowerToHyperService::new(router(guard(), own_routes(shared())));
            let request = Request::get(path).header(header::HOST, ServedAt::USUAL.0.to_string());
            let began = tokio::time::Instant::now();
            let answer = runtime
                .block_on(hyper::service::Service::call(
                    &service,
                    request.body(axum::body::Body::empty()).expect("a request"),
                ))
                .expect("an answer");
            assert_eq!(answer.headers()[header::X_CONTENT_TYPE_OPTIONS], "nosniff", "{path}");
            (answer.status(), began.elapsed() >= WRONG_TOKEN_DELAY)
        };
        assert_eq!(ask("/api/picture?token=a-token%2Bof%2Fletters%3D"), (StatusCode::OK, false));
        assert_eq!(ask("/api/picture?token=a-token%2Bof%2Fletters"), (StatusCode::UNAUTHORIZED, true));
        assert_eq!(ask("/api/picture"), (StatusCode::UNAUTHORIZED, true));
    }

    #[test]
    fn every_path_that_takes_a_body_is_fuzzed_from_an_example() {
        // Answered by another process: what reads recordings and layouts has targets of its own, and the doctor takes nothing.
        const OF_OTHERS: [&str; 3] = ["/api/odometry/{name}", "/api/setup/doctor", "/api/layout/check"];
        let described: serde_json::Value = serde_json::from_str(OPENAPI).expect("JSON");
        let takes = described["paths"].as_object().expect("paths").iter();
        let takes: BTreeSet<String> = takes
            .filter(|(path, methods)| methods.get("post").is_some() && !OF_OTHERS.contains(&path.as_str()))
            .map(|(path, _)| path.replace("{alarm}", "3"))
            .collect();
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/http-bodies");
        let examples: BTreeSet<String> = std::fs::read_dir(folder)
            .expect("examples")
            .map(|entry| std::fs::read_to_string(entry.expect("a file").path()).expect("text"))
            .map(|text| text.lines().next().unwrap_or_default().to_owned())
            .collect();
        assert_eq!(examples, takes);
    }
}
