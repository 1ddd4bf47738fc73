//! The conversation with one client of a feed: a message at a time, each acknowledged, so that a slow client
//! gets fewer of them and nobody waits for it.

mod end;
#[cfg(test)]
mod tests;

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use futures_util::{SinkExt, StreamExt};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::sync::watch;
use tokio::time::{Instant, MissedTickBehavior, interval_at, sleep_until, timeout};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::protocol::{Role, WebSocketConfig, frame::coding::CloseCode};
use tokio_tungstenite::tungstenite::{self, Error};
use tracing::debug;

use super::feed::{Bell, Feed, Message};
use super::refusal::Refusal;
use super::threads::{Threads, Work};
use end::End;

/// Largest wish, in bytes.
const LARGEST_WISH: usize = 4 << 10;
/// Messages of a client within one second, besides those that acknowledge.
const MOST_WISHES: u32 = 50;
/// What a client says when it has taken a message.
const TAKEN: &str = "ok";

/// Time between two pings.
const PING: Duration = Duration::from_secs(10);
/// A client that says nothing for so long, not even to a ping, is gone.
const SILENCE: Duration = Duration::from_secs(30);
/// Longest time for sending a message.
const SENDING: Duration = Duration::from_secs(10);
/// Longest time for each step of taking leave.
const LEAVING: Duration = Duration::from_secs(1);

/// A feed that was opened, and whose bell is listened to.
pub(super) struct Opened {
    feed: Box<dyn Feed>,
    /// Held so that there is one who could ring.
    bell: Bell,
    rings: watch::Receiver<u64>,
}

impl Opened {
    /// Listens to the feed's bell. To be called on a worker thread, as the feed is asked.
    pub(super) fn new(feed: Box<dyn Feed>) -> Self {
        let bell = feed.bell();
        let rings = bell.listen();
        Self { feed, bell, rings }
    }

    /// Drops the feed on a worker thread: it may have to let go of a device.
    pub(super) async fn drop_on(self, threads: &Threads) {
        if let Err(refusal) = threads.turn(Work::Feed).await.run(move || drop(self)).await {
            debug!(reason = refusal.message, "a feed broke off at its end");
        }
    }
}

/// Serves a feed until its client is gone, breaks a rule, or `stopped` is true.
pub(super) async fn serve<S: AsyncRead + AsyncWrite + Unpin>(
    stream: S,
    opened: Opened,
    threads: Arc<Threads>,
    mut stopped: watch::Receiver<bool>,
) {
    let config = WebSocketConfig::default()
        .read_buffer_size(LARGEST_WISH)
        .max_message_size(Some(LARGEST_WISH))
        .max_frame_size(Some(LARGEST_WISH));
    let now = Instant::now();
    let mut talk = Talk {
        socket: WebSocketStream::from_raw_socket(stream, Role::Server, Some(config)).await,
        feed: Some(opened.feed),
        rings: opened.rings,
        threads,
        in_flight: false,
        is_due: true,
        heard: now,
        second: now,
        wishes: 0,
    };
    let end = tokio::select! {
        biased;
        _ = stopped.wait_for(|stopped| *stopped) => End::told(CloseCode::Away, "epirig has ended"),
        Err(end) = talk.run() => end,
    };
    debug!(reason = end.words(), "a feed ends");
    let Talk { socket, feed, rings, threads, .. } = talk;
    let bell = opened.bell;
    let dropping = async {
        if let Some(feed) = feed {
            Opened { feed, bell, rings }.drop_on(&threads).await;
        }
    };
    tokio::join!(take_leave(socket, end), dropping);
}

/// Tells the client why, if it can be told, and closes the socket.
async fn take_leave<S: AsyncRead + AsyncWrite + Unpin>(mut socket: WebSocketStream<S>, end: End) {
    let telling = async {
        match end.frame() {
            Some(frame) => socket.close(Some(frame)).await,
            // The client's own farewell is answered, if there was one.
            None => socket.flush().await,
        }
    };
    let told = timeout(LEAVING, telling).await;
    if !matches!(told, Ok(Ok(()))) {
        return;
    }
    // A socket that is closed with bytes unread takes back what was sent last: the words would be lost.
    let stream = socket.get_mut();
    let drained = timeout(LEAVING, async {
        stream.shutdown().await?;
        let mut unread = [0; 4096];
        while stream.read(&mut unread).await? > 0 {}
        std::io::Result::Ok(())
    });
    let _ = drained.await;
}

/// The state of a conversation.
struct Talk<S> {
    socket: WebSocketStream<S>,
    /// `None` while a thread has it, and after it panicked there.
    feed: Option<Box<dyn Feed>>,
    rings: watch::Receiver<u64>,
    threads: Arc<Threads>,
    /// A message was sent and not yet acknowledged.
    in_flight: bool,
    /// The feed is to be asked for news.
    is_due: bool,
    /// When the client was last heard.
    heard: Instant,
    /// When the present second of counting began, and the messages since then.
    second: Instant,
    wishes: u32,
}

impl<S: AsyncRead + AsyncWrite + Unpin> Talk<S> {
    async fn run(&mut self) -> Result<Infallible, End> {
        let mut ping = interval_at(Instant::now() + PING, PING);
        ping.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            if self.is_due && !self.in_flight {
                self.tell_news().await?;
            }
            tokio::select! {
                // What the client says comes first: it may have been heard just before its time was over.
                biased;
                message = self.socket.next() => self.hear(message).await?,
                () = sleep_until(self.heard + SILENCE) => {
                    return Err(End::told(CloseCode::Policy, "nothing was heard for half a minute"));
                }
                _ = ping.tick() => self.send(tungstenite::Message::Ping(Vec::new().into())).await?,
                // There is always one who could ring, so this is no error.
                _ = self.rings.changed(), if !self.in_flight => self.is_due = true,
            }
        }
    }

    /// Asks the feed for news and sends them.
    async fn tell_news(&mut self) -> Result<(), End> {
        self.is_due = false;
        // Rings from here on are for the news after these.
        self.rings.mark_unchanged();
        let Some(news) = self.ask(|feed| feed.next()).await? else { return Ok(()) };
        self.in_flight = true;
        self.send(match news {
            Message::Text(text) => tungstenite::Message::Text(text.into()),
            Message::Bytes(bytes) => tungstenite::Message::Binary(bytes.into()),
        })
        .await
    }

    /// Has a thread ask the feed.
    async fn ask<T: Send + 'static>(
        &mut self,
        question: impl FnOnce(&mut dyn Feed) -> T + Send + 'static,
    ) -> Result<T, End> {
        let begun = Instant::now();
        // The feed stays here until it is its turn, to be dropped as it should if the server ends meanwhile.
        let turn = self.threads.turn(Work::Feed).await;
        let Some(mut feed) = self.feed.take() else { return Err(End::gone("the feed is gone")) };
        let work = turn.run(move || {
            let answer = question(&mut *feed);
            (feed, answer)
        });
        let broken = |refusal: Refusal| End::told(CloseCode::Error, &refusal.message);
        let (feed, answer) = work.await.map_err(broken)?;
        self.feed = Some(feed);
        // Nobody listened meanwhile, so that the client's silence does not count.
        self.heard += begun.elapsed();
        Ok(answer)
    }

    async fn send(&mut self, message: tungstenite::Message) -> Result<(), End> {
        match timeout(SENDING, self.socket.send(message)).await {
            Ok(sent) => sent.map_err(End::from),
            Err(_) => Err(End::gone("a message could not be sent in time")),
        }
    }

    /// Takes what the client says.
    async fn hear(&mut self, message: Option<Result<tungstenite::Message, Error>>) -> Result<(), End> {
        let message = message.unwrap_or(Err(Error::ConnectionClosed))?;
        self.heard = Instant::now();
        if matches!(&message, tungstenite::Message::Text(text) if text.as_str() == TAKEN) {
            return match std::mem::take(&mut self.in_flight) {
                true => Ok(()),
                false => Err(End::told(CloseCode::Policy, "\"ok\" was said, but no message was sent")),
            };
        }
        self.count()?;
        match message {
            tungstenite::Message::Text(text) => self.wish(text.as_str()).await,
            tungstenite::Message::Binary(_) => Err(End::told(CloseCode::Unsupported, "a wish is JSON text")),
            tungstenite::Message::Close(_) => Err(End::gone("the client took leave")),
            // Pings are answered by the protocol.
            _ => Ok(()),
        }
    }

    /// Counts a message, and ends with who sends too many.
    fn count(&mut self) -> Result<(), End> {
        if self.second.elapsed() >= Duration::from_secs(1) {
            (self.second, self.wishes) = (Instant::now(), 0);
        }
        self.wishes += 1;
        if self.wishes <= MOST_WISHES {
            return Ok(());
        }
        Err(End::told(CloseCode::Policy, &format!("more than {MOST_WISHES} wishes came within one second")))
    }

    async fn wish(&mut self, text: &str) -> Result<(), End> {
        let wish = serde_json::from_str(text)
            .map_err(|error| End::told(CloseCode::Invalid, &format!("the wish is no JSON: {error}")))?;
        let taken = self.ask(move |feed| feed.wish(&wish)).await?;
        taken.map_err(|refusal| End::told(CloseCode::Policy, &refusal.message))?;
        self.is_due = true;
        Ok(())
    }
}
