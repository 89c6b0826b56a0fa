//! Access control.
//!
//! A foreign page that a browser has open must not drive trains. It cannot read answers, but it can send requests:
//! directly to loopback (hence the check of the origin), or under a name of its own that it later resolves to this
//! server (DNS rebinding; hence the check of the name in `Host`). Clients on other machines also need the token.

use std::net::SocketAddr;

use axum::http::{HeaderMap, Method, StatusCode, header};

use super::token::Token;

/// The origin of a request relative to this server, as the browser states it.
const FETCH_SITE: header::HeaderName = header::HeaderName::from_static("sec-fetch-site");

/// The access rules of a server.
#[derive(Debug, Clone)]
pub(super) struct Guard {
    bound: SocketAddr,
    token: Option<Token>,
}

/// Why a request is rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Denied {
    /// The name in `Host` is not a name of this server.
    Host,
    /// The request comes from a foreign page.
    Origin,
    /// The token is missing or wrong.
    Token,
    /// The body is neither JSON nor plain bytes, which a form of a foreign page cannot send without permission.
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
    /// The guard of a server bound to an address.
    pub(super) const fn new(bound: SocketAddr, token: Option<Token>) -> Self {
        Self { bound, token }
    }

    /// Whether a request may pass. The files of the pages need no token: they contain nothing secret, and a browser
    /// that opens a page with the token in its address loads its scripts without it.
    pub(super) fn check(
        &self,
        method: &Method,
        headers: &HeaderMap,
        token: Option<&str>,
        is_page: bool,
    ) -> Result<(), Denied> {
        let text = |name: header::HeaderName| headers.get(name).map(|value| value.to_str().unwrap_or("?"));
        let host = text(header::HOST).unwrap_or_default();
        // With a valid token any host name is accepted: the server cannot know its names in the network.
        if self.token.is_none() && !self.is_own(host) {
            return Err(Denied::Host);
        }
        if let Some(origin) = text(header::ORIGIN) {
            // Behind a TLS proxy the page has another scheme than this server; that is for other machines, which need the token.
            let over_tls = self.token.as_ref().and(origin.strip_prefix("https://"));
            if origin.strip_prefix("http://").or(over_tls) != Some(host) {
                return Err(Denied::Origin);
            }
        }
        // A link on a foreign page may open a page of the dashboard. Programs do not send this header.
        let site = text(FETCH_SITE);
        if !is_page && site.is_some_and(|site| !matches!(site, "same-origin" | "none")) {
            return Err(Denied::Origin);
        }
        if let Some(wanted) = self.token.as_ref().filter(|_| !is_page) {
            let bearer = text(header::AUTHORIZATION).and_then(|value| value.strip_prefix("Bearer "));
            let is_known = match bearer {
                Some(shown) => wanted.is(shown),
                None => token.is_some_and(|shown| wanted.is_decoded(shown)),
            };
            if !is_known {
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
        let get = |site, is_page| {
            let mut headers = HeaderMap::new();
            headers.insert(header::HOST, HeaderValue::from_static("localhost:8417"));
            headers.insert(FETCH_SITE, HeaderValue::from_static(site));
            guard.check(&Method::GET, &headers, None, is_page)
        };
        assert_eq!(get("same-origin", false), Ok(()));
        assert_eq!(get("none", false), Ok(()), "written into the address line");
        assert_eq!(get("cross-site", false), Err(Denied::Origin));
        assert_eq!(get("same-site", false), Err(Denied::Origin), "another port of this machine");
        assert_eq!(get("cross-site", true), Ok(()), "a link to the page");
        assert_eq!(post("http://localhost:8417", "text/plain"), Err(Denied::NotJson));
    }

    #[test]
    fn other_machines_need_the_token() {
        let token = Token::chosen("0123456789abcdef").expect("16 characters");
        let guard = Guard::new("0.0.0.0:8417".parse().expect("an address"), Some(token));
        let get = |bearer: &str| {
            check(&guard, &Method::GET, &[(header::HOST, "club:8417"), (header::AUTHORIZATION, bearer)])
        };
        assert_eq!(get("Bearer 0123456789abcdef"), Ok(()));
        assert_eq!(get("Bearer 0123456789abcde"), Err(Denied::Token));
        assert_eq!(get(""), Err(Denied::Token));
    }

    #[test]
    fn pages_behind_a_tls_proxy_may_ask_with_the_token() {
        let token = Token::chosen("0123456789abcdef").expect("16 characters");
        let bound = "127.0.0.1:8417".parse().expect("an address");
        let post = |guard: &Guard, origin, bearer| {
            let of = [
                (header::HOST, "club.example"),
                (header::ORIGIN, origin),
                (header::AUTHORIZATION, bearer),
                (header::CONTENT_TYPE, "application/json"),
            ];
            check(guard, &Method::POST, &of)
        };
        let (guard, good) = (Guard::new(bound, Some(token)), "Bearer 0123456789abcdef");
        assert_eq!(post(&guard, "https://club.example", good), Ok(()));
        assert_eq!(post(&guard, "http://club.example", good), Ok(()));
        assert_eq!(post(&guard, "https://club.example", "Bearer 0123456789abcde0"), Err(Denied::Token));
        assert_eq!(post(&guard, "https://evil.example", good), Err(Denied::Origin));
        assert_eq!(post(&guard, "ftp://club.example", good), Err(Denied::Origin));
        let open = [(header::HOST, "localhost:8417"), (header::ORIGIN, "https://localhost:8417")];
        assert_eq!(check(&Guard::new(bound, None), &Method::GET, &open), Err(Denied::Origin));
    }
}
