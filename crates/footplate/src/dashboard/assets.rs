//! The pages, inside the program: plain modules that a browser loads as they are.

use axum::http::header;
use axum::response::{IntoResponse, Response};

/// What a browser may do for the pages: ask this server, and nothing else.
const POLICY: &str = "default-src 'none'; connect-src 'self'; img-src 'self' data:; script-src 'self'; style-src 'self'; \
     base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// A file of the pages.
pub(super) struct Asset {
    kind: &'static str,
    text: &'static str,
}

macro_rules! file {
    ($kind:literal, $name:literal) => {
        Asset { kind: $kind, text: include_str!(concat!("../../assets/dashboard/", $name)) }
    };
}

/// The file of a path.
pub(super) fn asset(path: &str) -> Option<Asset> {
    const HTML: &str = "text/html; charset=utf-8";
    Some(match path {
        "" | "index.html" => Asset { kind: HTML, text: include_str!("../../assets/dashboard/index.html") },
        "dashboard.css" => file!("text/css; charset=utf-8", "dashboard.css"),
        "dashboard.js" => file!("text/javascript; charset=utf-8", "dashboard.js"),
        "track.js" => file!("text/javascript; charset=utf-8", "track.js"),
        "view.js" => file!("text/javascript; charset=utf-8", "view.js"),
        "words.js" => file!("text/javascript; charset=utf-8", "words.js"),
        _ => return None,
    })
}

impl IntoResponse for Asset {
    fn into_response(self) -> Response {
        let headers = [
            (header::CONTENT_TYPE, self.kind),
            (header::CONTENT_SECURITY_POLICY, POLICY),
            (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
            (header::CACHE_CONTROL, "no-cache"),
        ];
        (headers, self.text).into_response()
    }
}
