//! Limits the connections of the server. A new connection is always accepted: the operator that stops all trains may be
//! the newest.
//!
//! Each connection needs a file descriptor, and a process has few: 1100 idle connections once made an emergency stop
//! time out. Idle connections are therefore closed after a while; beyond the limit the longest idle one is closed,
//! first among those of the same address, so that one client cannot displace others.
//!
//! Connections are accepted a few at a time, and read in between: of thousands that wait to be accepted, the one with an
//! emergency stop would be displaced by those behind it before its request is read.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use axum::Router;
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::{AbortHandle, Id, JoinSet, yield_now};

use crate::clock::Stopwatch;

/// Limits on the number of connections and on their idle time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    pub(super) in_all: usize,
    pub(super) of_an_address: usize,
    /// From the connection, or from the last answer, to the end of the next request's header.
    pub(super) header_within: Duration,
}

impl Limits {
    /// Half of the usual limit of 1024 descriptors; the rest is for link, store and files.
    pub(super) const USUAL: Self =
        Self { in_all: 512, of_an_address: 384, header_within: Duration::from_secs(10) };
}

/// Connections that are accepted before others have their turn. The runtime gives 61 turns before it looks at the network
/// again (`event_interval`), and a new connection needs at most three to be closed.
const ACCEPTED_AT_ONCE: usize = 16;
/// The pause after a connection failed for lack of descriptors.
const RETRY_PAUSE: Duration = Duration::from_millis(5);

/// The time of a connection's last request that passed the guard; requests carry it as an extension.
#[derive(Debug, Clone)]
pub(super) struct LastRequest {
    served: Stopwatch,
    /// In nanoseconds; 0 before the first one.
    at: Arc<AtomicU64>,
}

impl LastRequest {
    fn none_yet(served: Stopwatch) -> Self {
        Self { served, at: Arc::default() }
    }

    /// Sets the time to now.
    pub(super) fn is_now(&self) {
        let now = u64::try_from(self.served.elapsed().as_nanos()).unwrap_or(u64::MAX);
        self.at.store(now.max(1), Ordering::Relaxed);
    }
}

struct Connection {
    address: IpAddr,
    /// A consecutive number.
    number: u64,
    last: LastRequest,
    task: AbortHandle,
}

/// The open connections.
#[derive(Default)]
struct Connections {
    open: BTreeMap<Id, Connection>,
    /// The number of the next connection.
    next: u64,
}

impl Connections {
    fn add(&mut self, address: IpAddr, last: LastRequest, task: AbortHandle) {
        self.open.insert(task.id(), Connection { address, number: self.next, last, task });
        self.next += 1;
    }

    /// Closes connections until one more fits.
    fn make_room(&mut self, address: IpAddr, limits: Limits) {
        let own = self.open.values().filter(|connection| connection.address == address).count();
        if own >= limits.of_an_address {
            self.close_one(|connection| connection.address == address);
        } else if self.open.len() >= limits.in_all {
            self.close_one(|_| true);
        }
    }

    /// Closes the longest idle connection; those without any request first, in the order in which they came.
    fn close_one(&mut self, may_be: impl Fn(&Connection) -> bool) {
        let silent =
            self.open.iter().filter(|(_, connection)| may_be(connection)).min_by_key(|(_, connection)| {
                (connection.last.at.load(Ordering::Relaxed), connection.number)
            });
        if let Some(connection) = silent.map(|(id, _)| *id).and_then(|id| self.open.remove(&id)) {
            connection.task.abort();
        }
    }
}

/// Serves until the program ends.
pub(super) async fn serve(listener: TcpListener, router: Router, limits: Limits) {
    let served = Stopwatch::start();
    let mut connections = Connections::default();
    let mut tasks = JoinSet::new();
    let mut accepted_now = 0;
    loop {
        if accepted_now == ACCEPTED_AT_ONCE {
            accepted_now = 0;
            yield_now().await;
        }
        tokio::select! {
            accepted = listener.accept() => match accepted {
                Ok((stream, from)) => {
                    accepted_now += 1;
                    connections.make_room(from.ip(), limits);
                    let last = LastRequest::none_yet(served);
                    let answers = connection(stream, router.clone(), last.clone(), limits.header_within);
                    connections.add(from.ip(), last, tasks.spawn(answers));
                }
                // The client has gone, or there is no descriptor left.
                Err(_) => {
                    connections.close_one(|_| true);
                    tokio::time::sleep(RETRY_PAUSE).await;
                }
            },
            Some(ended) = tasks.join_next_with_id() => {
                let id = ended.map_or_else(|error| error.id(), |(id, ())| id);
                connections.open.remove(&id);
            }
        }
    }
}

/// Serves one connection until either end closes it.
async fn connection(stream: TcpStream, router: Router, last: LastRequest, header_within: Duration) {
    // Short answers are sent at once instead of waiting for more data.
    let _ = stream.set_nodelay(true);
    let service = TowerToHyperService::new(router);
    let service = service_fn(move |mut request: Request<Incoming>| {
        request.extensions_mut().insert(last.clone());
        service.call(request)
    });
    // Errors of a connection concern its client only.
    let _ = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(header_within)
        .serve_connection(TokioIo::new(stream), service)
        .await;
}

#[cfg(test)]
mod tests {
    use axum::Extension;
    use axum::routing::get;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    use super::*;
    use crate::accept_queue::listen;

    const FEW: Limits = Limits { in_all: 8, of_an_address: 8, header_within: Duration::from_secs(60) };

    /// Runs `work` with a server of its own.
    fn served(limits: Limits, work: impl AsyncFnOnce(std::net::SocketAddr)) {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        runtime.block_on(async {
            let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
            let at = listener.local_addr().expect("an address");
            let answers = async |Extension(last): Extension<LastRequest>| {
                last.is_now();
                "here"
            };
            tokio::spawn(serve(listener, Router::new().route("/", get(answers)), limits));
            work(at).await;
        });
    }

    async fn ask(stream: &mut TcpStream) -> bool {
        let mut answer = [0; 512];
        if stream.write_all(b"GET / HTTP/1.1\r\nHost: here\r\n\r\n").await.is_err() {
            return false;
        }
        matches!(stream.read(&mut answer).await, Ok(count) if answer[..count].starts_with(b"HTTP/1.1 200"))
    }

    async fn is_closed(stream: &mut TcpStream) -> bool {
        !matches!(stream.read(&mut [0; 8]).await, Ok(1..))
    }

    #[test]
    fn new_connections_are_accepted_and_idle_ones_closed_first() {
        served(FEW, async |at| {
            let mut asking = TcpStream::connect(at).await.expect("a connection");
            assert!(ask(&mut asking).await);
            let mut silent = Vec::new();
            for _ in 0..100 {
                silent.push(TcpStream::connect(at).await.expect("a connection"));
                let mut newest = TcpStream::connect(at).await.expect("a connection");
                assert!(ask(&mut newest).await, "however many say nothing");
            }
            assert!(ask(&mut asking).await, "it was silent for longest but asked before");
            assert!(is_closed(&mut silent[0]).await);
        });
    }

    #[test]
    fn an_address_closes_its_own_connections_before_those_of_others() {
        let limits = Limits { of_an_address: 4, ..FEW };
        served(limits, async |at| {
            let from = async |address: &str| {
                let socket = tokio::net::TcpSocket::new_v4().expect("a socket");
                socket.bind(address.parse().expect("an address")).expect("loopback");
                socket.connect(at).await.expect("a connection")
            };
            let mut other = from("127.0.0.2:0").await;
            let mut greedy = Vec::new();
            for _ in 0..20 {
                greedy.push(from("127.0.0.3:0").await);
            }
            assert!(ask(&mut other).await, "it came first, and says something only now");
            assert!(is_closed(&mut greedy[0]).await);
            assert!(ask(greedy.last_mut().expect("twenty")).await);
        });
    }

    #[test]
    fn a_request_among_a_thousand_that_wait_to_be_accepted_is_answered() {
        let limits = Limits { in_all: 64, of_an_address: 64, ..FEW };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        let listener = listen(([127, 0, 0, 1], 0).into()).expect("a free port");
        let at = listener.local_addr().expect("an address");
        let connect = || std::net::TcpStream::connect(at).expect("a connection");
        let before: Vec<_> = (0..500).map(|_| connect()).collect();
        let mut asking = connect();
        std::io::Write::write_all(&mut asking, b"GET / HTTP/1.1\r\nHost: here\r\nConnection: close\r\n\r\n")
            .expect("a request");
        let behind: Vec<_> = (0..500).map(|_| connect()).collect();
        listener.set_nonblocking(true).expect("an option of sockets");
        asking.set_nonblocking(true).expect("an option of sockets");
        let answer = runtime.block_on(async {
            let listener = TcpListener::from_std(listener).expect("a listener");
            let answers = async |Extension(last): Extension<LastRequest>| {
                last.is_now();
                "here"
            };
            let serving = serve(listener, Router::new().route("/", get(answers)), limits);
            let mut answer = String::new();
            let mut asking = TcpStream::from_std(asking).expect("a stream");
            tokio::select! {
                () = serving => {}
                read = asking.read_to_string(&mut answer) => drop(read),
            }
            answer
        });
        assert!(
            answer.starts_with("HTTP/1.1 200"),
            "{} connections wait: {answer}",
            before.len() + behind.len()
        );
    }

    #[test]
    fn incomplete_headers_time_out() {
        served(Limits { header_within: Duration::from_millis(100), ..FEW }, async |at| {
            let mut slow = TcpStream::connect(at).await.expect("a connection");
            slow.write_all(b"GET / HTTP/1.1\r\nHo").await.expect("a part of a header");
            let mut idle = TcpStream::connect(at).await.expect("a connection");
            assert!(ask(&mut idle).await);
            assert!(is_closed(&mut slow).await);
            assert!(is_closed(&mut idle).await);
        });
    }
}
