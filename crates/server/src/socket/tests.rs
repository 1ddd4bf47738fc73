//! What takes long, on a clock that jumps whenever everybody waits.

use serde_json::{Value, json};
use tokio::io::{DuplexStream, duplex};
use tokio::task::JoinHandle;
use tokio_tungstenite::tungstenite::Message as Frame;

use super::*;

/// Tells its news once, and then what was wished last.
struct Parrot(Bell, Option<Message>);

impl Feed for Parrot {
    fn bell(&self) -> Bell {
        self.0.clone()
    }

    fn next(&mut self) -> Option<Message> {
        self.1.take()
    }

    fn wish(&mut self, wish: &Value) -> Result<(), Refusal> {
        self.1 = Some(Message::json(wish)?);
        Ok(())
    }
}

fn on_a_jumping_clock(test: impl Future<Output = ()>) {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
    runtime.unwrap().block_on(test);
}

/// A served feed: its bell, its task, and the client's end of a line that holds `room` bytes.
fn served(first: Option<Message>, room: usize) -> (Bell, JoinHandle<()>, DuplexStream) {
    let (bell, (ours, theirs)) = (Bell::default(), duplex(room));
    let opened = Opened::new(Box::new(Parrot(bell.clone(), first)));
    let task = tokio::spawn(async move {
        let (_never, stopped) = watch::channel(false);
        serve(ours, opened, Arc::new(Threads::new()), stopped).await;
    });
    (bell, task, theirs)
}

async fn client(line: DuplexStream) -> WebSocketStream<DuplexStream> {
    WebSocketStream::from_raw_socket(line, Role::Client, None).await
}

/// Code and words of the frame that closes the socket.
async fn farewell(client: &mut WebSocketStream<DuplexStream>) -> (u16, String) {
    loop {
        if let Frame::Close(Some(frame)) = client.next().await.unwrap().unwrap() {
            return (frame.code.into(), frame.reason.to_string());
        }
    }
}

#[test]
fn a_silent_client_is_pinged_twice_and_then_closed() {
    on_a_jumping_clock(async {
        let begun = Instant::now();
        let (bell, task, mut line) = served(None, 1 << 20);
        // Rings without news do not keep it.
        let ringing = async {
            loop {
                bell.ring();
                tokio::time::sleep(Duration::from_millis(700)).await;
            }
        };
        tokio::select! {
            done = task => done.unwrap(),
            () = ringing => {},
        }
        assert!(begun.elapsed() >= SILENCE && begun.elapsed() < SILENCE + PING, "{:?}", begun.elapsed());
        assert_eq!(bell.listeners(), 0);
        let mut said = Vec::new();
        line.read_to_end(&mut said).await.unwrap();
        // Two pings without content; a frame that closes, with code 1008.
        assert_eq!(said[..4], [0x89, 0, 0x89, 0]);
        assert_eq!((said[4], &said[6..8]), (0x88, &1008_u16.to_be_bytes()[..]));
        assert!(said.ends_with(b"half a minute"), "{said:?}");
    });
}

#[test]
fn a_client_that_answers_pings_stays_without_news() {
    on_a_jumping_clock(async {
        let (bell, task, line) = served(None, 1 << 20);
        let mut client = client(line).await;
        // Whoever reads answers pings.
        let hour = timeout(Duration::from_secs(3600), client.next()).await;
        assert!(matches!(hour, Ok(Some(Ok(Frame::Ping(_))))));
        for _ in 0..359 {
            assert!(matches!(client.next().await, Some(Ok(Frame::Ping(_)))));
        }
        assert_eq!(bell.listeners(), 1);
        client.close(None).await.unwrap();
        task.await.unwrap();
        assert_eq!(bell.listeners(), 0);
    });
}

#[test]
fn a_client_that_takes_nothing_is_closed_after_ten_seconds() {
    on_a_jumping_clock(async {
        let begun = Instant::now();
        let (bell, task, _line) = served(Some(Message::Bytes(vec![0; 1 << 20])), 1 << 10);
        task.await.unwrap();
        assert!(begun.elapsed() >= SENDING && begun.elapsed() < SENDING + 3 * LEAVING);
        assert_eq!(bell.listeners(), 0);
    });
}

#[test]
fn fifty_wishes_a_second_are_taken_and_one_more_closes() {
    on_a_jumping_clock(async {
        let (_bell, task, line) = served(None, 1 << 20);
        let mut client = client(line).await;
        for second in 0..3 {
            for wish in 0..MOST_WISHES {
                let wish = json!([second, wish]).to_string();
                client.send(Frame::text(wish.clone())).await.unwrap();
                // Each is told back.
                assert_eq!(client.next().await.unwrap().unwrap(), Frame::text(wish));
                client.send(Frame::text(TAKEN)).await.unwrap();
            }
            tokio::time::sleep(Duration::from_secs(1)).await;
        }
        for wish in 0..=MOST_WISHES {
            client.send(Frame::text(wish.to_string())).await.unwrap();
        }
        let (code, words) = farewell(&mut client).await;
        assert!(code == 1008 && words.contains("50 wishes"), "{code} {words}");
        drop(client);
        task.await.unwrap();
    });
}

#[test]
fn ok_without_a_message_closes() {
    on_a_jumping_clock(async {
        let (_bell, task, line) = served(None, 1 << 20);
        let mut client = client(line).await;
        client.send(Frame::text(TAKEN)).await.unwrap();
        assert_eq!(farewell(&mut client).await.0, 1008);
        drop(client);
        task.await.unwrap();
    });
}
