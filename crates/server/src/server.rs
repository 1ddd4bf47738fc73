//! Listens, and serves connections within limits.

use std::net::{Ipv4Addr, SocketAddr, TcpListener, UdpSocket};
use std::sync::Arc;
use std::time::Duration;

use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::runtime::Builder;
use tokio::sync::{Semaphore, watch};
use tracing::{debug, info};

use super::ServerError;
use super::answer::{FeedLimits, router};
use super::guard::Guard;
use super::seats::Seats;
use super::site::Site;
use super::threads;
use super::token::{Token, Tokens};

/// What clients may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Connections at once. One more takes the place of that which has been idle for longest, so that whoever
    /// comes to stop something is heard.
    pub connections: usize,
    /// Time for a client to send the head of a request; a connection without one is closed then.
    pub head_time: Duration,
    /// Longest life of a connection. A client that reads slowly does not hold its place for ever.
    pub connection_time: Duration,
    /// Longest time for a request and its answer.
    pub request_time: Duration,
    /// Feeds at once; more are refused. They do not count as connections.
    pub feeds: usize,
}

impl Default for Limits {
    /// Room for a dozen browsers.
    fn default() -> Self {
        Self {
            connections: 128,
            head_time: Duration::from_secs(10),
            connection_time: Duration::from_secs(600),
            request_time: Duration::from_secs(60),
            feeds: 32,
        }
    }
}

/// Largest head of a request, in bytes.
const LARGEST_HEAD: usize = 16 << 10;
/// Longer than any server runs.
const THREADS_STAY: Duration = Duration::from_secs(10 * 365 * 24 * 3600);
/// Longest time for feeds to take leave when the server ends.
const LEAVING: Duration = Duration::from_secs(2);

/// Where the server listens, and what clients may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ServerOptions {
    /// Address and port; port 0 takes any free one.
    pub listen: SocketAddr,
    /// What clients may take.
    pub limits: Limits,
}

impl Default for ServerOptions {
    /// This machine alone, any free port.
    fn default() -> Self {
        Self { listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)), limits: Limits::default() }
    }
}

/// Ends a server. Clones share their state.
#[derive(Debug, Clone)]
pub struct StopSwitch(Arc<watch::Sender<bool>>);

impl StopSwitch {
    /// Ends the server; open feeds are ended, and open connections are closed.
    pub fn press(&self) {
        self.0.send_replace(true);
    }
}

/// A server that listens.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    limits: Limits,
    tokens: Tokens,
    stop: StopSwitch,
}

impl Server {
    /// Begins to listen.
    ///
    /// # Errors
    /// [`ServerError`] if the address cannot be used, or the system gives no random numbers or no threads.
    pub fn bind(options: &ServerOptions) -> Result<Self, ServerError> {
        let failed = |source| ServerError::Listen { address: options.listen, source };
        let listener = TcpListener::bind(options.listen).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let stop = StopSwitch(Arc::new(watch::Sender::new(false)));
        // Without one nothing could be answered.
        std::thread::Builder::new().spawn(|| ()).map_err(ServerError::Runtime)?;
        Ok(Self { listener, address, limits: options.limits, tokens: Tokens::new()?, stop })
    }

    /// The address that is listened on.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The link that opens the page, with the token. Browsers do not send the part after `#`.
    pub fn link(&self) -> String {
        self.link_with(&self.tokens.control)
    }

    /// The link for somebody who looks and changes nothing.
    pub fn watch_link(&self) -> String {
        self.link_with(&self.tokens.watch)
    }

    fn link_with(&self, token: &Token) -> String {
        format!("http://{}/#token={}", reachable(self.address), token.digits())
    }

    /// What ends [`run`](Self::run).
    pub fn stop_switch(&self) -> StopSwitch {
        self.stop.clone()
    }

    /// Serves `site` until the stop switch is pressed.
    ///
    /// # Errors
    /// [`ServerError::Runtime`] if the system gives no threads.
    pub fn run(self, site: impl Site) -> Result<(), ServerError> {
        let runtime = Builder::new_current_thread()
            .enable_io()
            .enable_time()
            .max_blocking_threads(threads::MOST)
            // Those that there are stay: later the system may allow no others.
            .thread_keep_alive(THREADS_STAY)
            .build()
            .map_err(ServerError::Runtime)?;
        let mut stopped = self.stop.0.subscribe();
        let places = Arc::new(Semaphore::new(self.limits.feeds));
        let feeds = FeedLimits { places: places.clone(), stopped: stopped.clone() };
        let guard = Guard::new(self.address, self.tokens);
        let service = TowerToHyperService::new(router(guard, site, self.limits.request_time, feeds));
        let served = runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener).map_err(ServerError::Runtime)?;
            info!(address = %self.address, "serving");
            // One thread at least is there from now on.
            drop(tokio::task::spawn_blocking(|| ()));
            let seats = Seats::new(self.limits.connections);
            let mut http = http1::Builder::new();
            // A clock that is set to no usual year has no date for it.
            http.auto_date_header(false)
                .timer(TokioTimer::new())
                .header_read_timeout(self.limits.head_time)
                .max_buf_size(LARGEST_HEAD);
            loop {
                let accepted = tokio::select! {
                    accepted = listener.accept() => accepted,
                    _ = stopped.wait_for(|stopped| *stopped) => break,
                };
                let stream = match accepted {
                    Ok((stream, _)) => stream,
                    Err(error) => {
                        // Out of file handles, for example: others will be given back.
                        debug!(%error, "a connection could not be accepted");
                        tokio::time::sleep(Duration::from_millis(50)).await;
                        continue;
                    }
                };
                if let Err(error) = stream.set_nodelay(true) {
                    debug!(%error, "the end of a message may wait for what was sent before");
                }
                let seat = seats.next();
                let desk = seat.desk();
                let service = service.clone();
                let answering = service_fn(move |request| {
                    let answering = desk.answering();
                    let answer = service.call(request);
                    async move {
                        let answer = answer.await;
                        drop(answering);
                        answer
                    }
                });
                let connection = http.serve_connection(TokioIo::new(stream), answering).with_upgrades();
                let longest = self.limits.connection_time;
                tokio::spawn(seat.hold(async move {
                    if let Ok(Err(error)) = tokio::time::timeout(longest, connection).await {
                        debug!(%error, "a connection ended with an error");
                    }
                }));
            }
            // Feeds tell their clients why they end, and let go of what they hold.
            let all = u32::try_from(self.limits.feeds).unwrap_or(u32::MAX);
            if tokio::time::timeout(LEAVING, places.acquire_many(all)).await.is_err() {
                debug!("some feeds did not end in time");
            }
            Ok(())
        });
        // An answer that is still worked on is not waited for.
        runtime.shutdown_background();
        served
    }
}

/// The address for others, if `address` stands for all of this machine's.
fn reachable(address: SocketAddr) -> SocketAddr {
    if !address.ip().is_unspecified() {
        return address;
    }
    // An address for documentation (RFC 5737, RFC 3849). A datagram socket that is connected sends nothing,
    // but the system has chosen the address that it would send from.
    let (own, far) = match address {
        SocketAddr::V4(_) => ("0.0.0.0:0", "192.0.2.1:9"),
        SocketAddr::V6(_) => ("[::]:0", "[2001:db8::1]:9"),
    };
    let chosen = UdpSocket::bind(own).and_then(|socket| {
        socket.connect(far)?;
        socket.local_addr()
    });
    chosen.map_or(address, |chosen| SocketAddr::new(chosen.ip(), address.port()))
}
