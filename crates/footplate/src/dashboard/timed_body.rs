//! Gives the body of a request a time limit: a client that sends it byte by byte, or not at all, holds a connection.
//!
//! Recordings, which are large, have a limit of their own from their turn on (`commands/dashboard_routes/answer_queue.rs`).

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::Json;
use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use futures_util::{StreamExt, stream};
use serde_json::json;
use tokio::time::{Instant, timeout_at};

/// The content type of recordings.
const RECORDING: &str = "application/octet-stream";

/// Answers a request whose body does not arrive within a time with status 408. Its connection is closed.
pub(super) async fn in_time(State(within): State<Duration>, request: Request, next: Next) -> Response {
    let content = request.headers().get(header::CONTENT_TYPE).and_then(|content| content.to_str().ok());
    if content.is_some_and(|content| content.starts_with(RECORDING)) {
        return next.run(request).await;
    }
    let is_late = Arc::new(AtomicBool::new(false));
    let late = Arc::clone(&is_late);
    let response = next.run(request.map(|body| timed(body, within, late))).await;
    if !is_late.load(Ordering::Relaxed) {
        return response;
    }
    let says = format!("the request did not arrive within {} s: send it again", within.as_secs_f64());
    (StatusCode::REQUEST_TIMEOUT, [(header::CONNECTION, "close")], Json(json!({ "error": says })))
        .into_response()
}

/// A body that ends with an error when its time is over, which begins with its first part.
fn timed(body: Body, within: Duration, is_late: Arc<AtomicBool>) -> Body {
    let parts = (body.into_data_stream(), None);
    Body::from_stream(stream::unfold(parts, move |(mut parts, until)| {
        let is_late = Arc::clone(&is_late);
        async move {
            let until = until.unwrap_or_else(|| Instant::now() + within);
            let part = timeout_at(until, parts.next()).await.unwrap_or_else(|late| {
                is_late.store(true, Ordering::Relaxed);
                Some(Err(axum::Error::new(late)))
            });
            part.map(|part| (part, (parts, Some(until))))
        }
    }))
}

#[cfg(test)]
mod tests {
    use axum::Router;
    use axum::extract::rejection::StringRejection;
    use axum::middleware::from_fn_with_state;
    use axum::routing::post;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio::net::{TcpListener, TcpStream};

    use super::*;

    const WITHIN: Duration = Duration::from_millis(200);

    /// The answer to a request with a body of 20 bytes, of which these are sent.
    async fn answer(sent: &str) -> String {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let at = listener.local_addr().expect("an address");
        let router = Router::new()
            .route("/", post(async |text: Result<String, StringRejection>| text))
            .layer(from_fn_with_state(WITHIN, in_time));
        tokio::spawn(async { axum::serve(listener, router).await });
        let mut stream = TcpStream::connect(at).await.expect("a connection");
        let header = format!("POST / HTTP/1.1\r\nHost: here\r\nContent-Length: 20\r\n\r\n{sent}");
        stream.write_all(header.as_bytes()).await.expect("sent");
        if sent.len() == 20 {
            stream.shutdown().await.expect("open until now");
        }
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await.expect("an answer, and its end");
        answer
    }

    #[test]
    fn a_body_that_does_not_come_is_answered_and_its_connection_closed() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        runtime.block_on(async {
            for sent in ["", "half of it"] {
                let late = answer(sent).await;
                assert!(late.starts_with("HTTP/1.1 408 "), "{late}");
                assert!(late.contains("the request did not arrive within 0.2 s: send it again"), "{late}");
            }
            let whole = answer("a body of 20 letters").await;
            assert!(whole.starts_with("HTTP/1.1 200 ") && whole.ends_with("a body of 20 letters"), "{whole}");
        });
    }
}
