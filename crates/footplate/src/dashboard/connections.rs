//! The connections that the server keeps. Whoever comes newly is let in: a person who stops all trains is the newest.
//!
//! A connection costs a descriptor, and a program may hold few of them: 1 100 that said nothing made an emergency stop time out
//! once. Who says nothing for a while is cut off, and where there are too many, the one that has been silent for longest makes
//! room, of the same address first, so that nobody fills the places of others.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use axum::{Extension, Router};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::{AbortHandle, Id, JoinSet};

use crate::clock::Stopwatch;

/// How many connections are kept, and for how long those that say nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    pub(super) in_all: usize,
    pub(super) of_an_address: usize,
    /// From the connection, or from the last answer, to the end of the next request's header.
    pub(super) header_within: Duration,
}

impl Limits {
    /// Half of the 1 024 descriptors that a program has on most systems leaves enough for the link, the store, and files.
    pub(super) const USUAL: Self =
        Self { in_all: 512, of_an_address: 384, header_within: Duration::from_secs(10) };
}

/// After a connection could not be taken, which costs no time, for want of descriptors.
const TRIED_AGAIN_AFTER: Duration = Duration::from_millis(5);

/// When a connection sent its last request that was let through; requests hold it as an extension.
#[derive(Debug, Clone)]
pub(super) struct LastRequest {
    served: Stopwatch,
    /// In nanoseconds, and 0 until there was one.
    at: Arc<AtomicU64>,
}

impl LastRequest {
    fn none_yet(served: Stopwatch) -> Self {
        Self { served, at: Arc::default() }
    }

    /// It is now.
    pub(super) fn is_now(&self) {
        let now = u64::try_from(self.served.elapsed().as_nanos()).unwrap_or(u64::MAX);
        self.at.store(now.max(1), Ordering::Relaxed);
    }
}

struct Connection {
    address: IpAddr,
    /// Counts connections.
    number: u64,
    last: LastRequest,
    task: AbortHandle,
}

/// Those that are open now.
#[derive(Default)]
struct Connections {
    open: BTreeMap<Id, Connection>,
    /// The number of the next.
    next: u64,
}

impl Connections {
    fn add(&mut self, address: IpAddr, last: LastRequest, task: AbortHandle) {
        self.open.insert(task.id(), Connection { address, number: self.next, last, task });
        self.next += 1;
    }

    /// Makes room for one more.
    fn make_room(&mut self, address: IpAddr, limits: Limits) {
        let own = self.open.values().filter(|connection| connection.address == address).count();
        if own >= limits.of_an_address {
            self.close_one(|connection| connection.address == address);
        } else if self.open.len() >= limits.in_all {
            self.close_one(|_| true);
        }
    }

    /// Closes the one that has been silent for longest: those that never asked for anything first, in the order they came.
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
    loop {
        tokio::select! {
            accepted = listener.accept() => match accepted {
                Ok((stream, from)) => {
                    connections.make_room(from.ip(), limits);
                    let last = LastRequest::none_yet(served);
                    let answers = connection(stream, router.clone(), last.clone(), limits.header_within);
                    connections.add(from.ip(), last, tasks.spawn(answers));
                }
                // It was gone again, or there is no descriptor left.
                Err(_) => {
                    connections.close_one(|_| true);
                    tokio::time::sleep(TRIED_AGAIN_AFTER).await;
                }
            },
            Some(ended) = tasks.join_next_with_id() => {
                let id = ended.map_or_else(|error| error.id(), |(id, ())| id);
                connections.open.remove(&id);
            }
        }
    }
}

/// One connection, until either end has had enough.
async fn connection(stream: TcpStream, router: Router, last: LastRequest, header_within: Duration) {
    // An answer of one segment is not held back for more to come.
    let _ = stream.set_nodelay(true);
    let service = TowerToHyperService::new(router.layer(Extension(last)));
    // What goes wrong with a connection concerns whoever opened it.
    let _ = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(header_within)
        .serve_connection(TokioIo::new(stream), service)
        .await;
}

#[cfg(test)]
mod tests {
    use axum::routing::get;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    use super::*;

    const FEW: Limits = Limits { in_all: 8, of_an_address: 8, header_within: Duration::from_secs(60) };

    /// Does something with a server of its own.
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
    fn who_comes_newly_is_answered_and_who_has_asked_is_kept_before_the_silent() {
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
    fn who_sends_no_whole_header_in_time_is_cut_off() {
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
