//! Who may ask the server for anything.
//!
//! A page from elsewhere that a browser has open must not drive trains. It cannot read answers, but it can send requests:
//! straight to loopback (so the origin is checked), or under a name of its own that it lets point here later (so the name in
//! `Host` is checked: DNS rebinding). Beyond loopback everybody needs the token besides.

use std::net::SocketAddr;

use axum::http::{HeaderMap, Method, StatusCode, header};

/// What is checked of every request.
#[derive(Debug, Clone)]
pub(super) struct Guard {
    bound: SocketAddr,
    token: Option<String>,
}

/// Why a request is turned away.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Denied {
    /// The name in `Host` is none of this server's.
    Host,
    /// The page comes from elsewhere.
    Origin,
    /// No token, or another one.
    Token,
    /// What is sent has to come as JSON or as plain bytes, which no form of a foreign page can send unasked.
    NotJson,
}

impl Denied {
    pub(super) const fn status(self) -> StatusCode {
        match self {
            Self::Host => StatusCode::MISDIRECTED_REQUEST,
            Self::Origin => StatusCode::FORBIDDEN,
            Self::Token => StatusCode::UNAUTHORIZED,
            Self::NotJson => StatusCode::UNSUPPORTED_MEDIA_TYPE,
        }
    }

    pub(super) const fn says(self) -> &'static str {
        match self {
            Self::Host => {
                "this server is not called that: open it by the address that `footplate` printed when it began"
            }
            Self::Origin => "only the dashboard's own pages may ask this server",
            Self::Token => "beyond this machine the token is needed, as `Authorization: Bearer ...`",
            Self::NotJson => {
                "orders come as `Content-Type: application/json`, recordings as `application/octet-stream`"
            }
        }
    }
}

impl Guard {
    /// A guard of a server bound to an address.
    pub(super) const fn new(bound: SocketAddr, token: Option<String>) -> Self {
        Self { bound, token }
    }

    /// Whether a request may pass. The pages themselves tell nobody anything: a browser that opens one with the token in its
    /// address fetches its scripts without.
    pub(super) fn check(
        &self,
        method: &Method,
        headers: &HeaderMap,
        token: Option<&str>,
        is_page: bool,
    ) -> Result<(), Denied> {
        let text = |name: header::HeaderName| headers.get(name).map(|value| value.to_str().unwrap_or("?"));
        let host = text(header::HOST).unwrap_or_default();
        // Who shows the token is meant to be here, under whatever name the machine has in its network.
        if self.token.is_none() && !self.is_own(host) {
            return Err(Denied::Host);
        }
        if let Some(origin) = text(header::ORIGIN)
            && origin.strip_prefix("http://") != Some(host)
        {
            return Err(Denied::Origin);
        }
        if let Some(wanted) = self.token.as_ref().filter(|_| !is_page) {
            let bearer = text(header::AUTHORIZATION).and_then(|value| value.strip_prefix("Bearer "));
            let shown = bearer.or(token).unwrap_or_default();
            if !same(shown.as_bytes(), wanted.as_bytes()) {
                return Err(Denied::Token);
            }
        }
        let kind = text(header::CONTENT_TYPE).unwrap_or_default();
        let is_unforged = kind.starts_with("application/json") || kind == "application/octet-stream";
        if *method == Method::POST && !is_unforged { Err(Denied::NotJson) } else { Ok(()) }
    }

    /// Whether a `Host` names this server on its own machine.
    fn is_own(&self, host: &str) -> bool {
        let port = self.bound.port();
        let names = [self.bound.ip().to_string(), "127.0.0.1".into(), "localhost".into(), "[::1]".into()];
        names.iter().any(|name| {
            host.strip_prefix(name.as_str()).is_some_and(|rest| {
                rest.strip_prefix(':').map_or(rest.is_empty() && port == 80, |text| text.parse() == Ok(port))
            })
        })
    }
}

/// Compares without telling by its time how much was right.
fn same(one: &[u8], other: &[u8]) -> bool {
    one.len() == other.len() && one.iter().zip(other).fold(0, |differ, (a, b)| differ | (a ^ b)) == 0
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    fn check(guard: &Guard, method: &Method, pairs: &[(header::HeaderName, &str)]) -> Result<(), Denied> {
        let mut headers = HeaderMap::new();
        for (name, value) in pairs {
            headers.insert(name.clone(), HeaderValue::from_str(value).expect("a header"));
        }
        guard.check(method, &headers, None, false)
    }

    #[test]
    fn foreign_names_and_pages_are_turned_away() {
        let guard = Guard::new("127.0.0.1:8417".parse().expect("an address"), None);
        let get = |host| check(&guard, &Method::GET, &[(header::HOST, host)]);
        assert_eq!(get("127.0.0.1:8417"), Ok(()));
        assert_eq!(get("localhost:8417"), Ok(()));
        assert_eq!(get("trains.example:8417"), Err(Denied::Host));
        assert_eq!(get("127.0.0.1:80"), Err(Denied::Host));
        assert_eq!(get("127.0.0.1.example:8417"), Err(Denied::Host));
        let post = |origin, kind| {
            let of =
                [(header::HOST, "localhost:8417"), (header::ORIGIN, origin), (header::CONTENT_TYPE, kind)];
            check(&guard, &Method::POST, &of)
        };
        assert_eq!(post("http://localhost:8417", "application/json"), Ok(()));
        assert_eq!(post("http://evil.example", "application/json"), Err(Denied::Origin));
        assert_eq!(post("null", "application/json"), Err(Denied::Origin));
        assert_eq!(post("http://localhost:8417", "text/plain"), Err(Denied::NotJson));
    }

    #[test]
    fn beyond_loopback_the_token_is_asked_for() {
        let guard = Guard::new("0.0.0.0:8417".parse().expect("an address"), Some("s3cret".into()));
        let get = |bearer: &str| {
            check(&guard, &Method::GET, &[(header::HOST, "club:8417"), (header::AUTHORIZATION, bearer)])
        };
        assert_eq!(get("Bearer s3cret"), Ok(()));
        assert_eq!(get("Bearer s3cre"), Err(Denied::Token));
        assert_eq!(get(""), Err(Denied::Token));
    }
}
