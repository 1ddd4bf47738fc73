//! A program with feeds of all kinds, and a server that shows it.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, mpsc};
use std::thread::JoinHandle;
use std::time::Duration;

use epirig_server::{
    Bell, Feed, Message, PostRules, Query, Refusal, RefusalKind, Reply, Server, ServerError, ServerOptions,
    Site, StopSwitch,
};
use serde_json::Value;

/// Far longer than anything takes.
const LONG: Duration = Duration::from_secs(60);

/// Holds all who come, until it is opened.
#[derive(Default)]
pub(super) struct Gate {
    came: Mutex<(usize, bool)>,
    changed: Condvar,
}

impl Gate {
    fn pass(&self) {
        let mut came = self.came.lock().unwrap();
        came.0 += 1;
        self.changed.notify_all();
        drop(self.changed.wait_while(came, |came| !came.1).unwrap());
    }

    pub(super) fn open(&self) {
        self.came.lock().unwrap().1 = true;
        self.changed.notify_all();
    }

    /// How many came; waits until there are so many.
    pub(super) fn wait_for(&self, count: usize) -> usize {
        let came = self.came.lock().unwrap();
        let (came, waited) = self.changed.wait_timeout_while(came, LONG, |came| came.0 < count).unwrap();
        assert!(!waited.timed_out(), "{} of {count} came", came.0);
        came.0
    }
}

/// What the test and the program's feeds share.
#[derive(Default)]
pub(super) struct State {
    pub(super) bell: Bell,
    /// What feeds tell.
    pub(super) value: AtomicU64,
    /// How often feeds were opened, asked for news, and dropped.
    pub(super) opened: AtomicU64,
    pub(super) asked: AtomicU64,
    pub(super) gets: Gate,
    pub(super) feeds: Gate,
    wishes: Mutex<Option<mpsc::Sender<Value>>>,
}

impl State {
    pub(super) fn set(&self, value: u64) {
        self.value.store(value, Ordering::SeqCst);
        self.bell.ring();
    }

    /// Where wishes arrive from now on.
    pub(super) fn wishes(&self) -> mpsc::Receiver<Value> {
        let (sender, receiver) = mpsc::channel();
        *self.wishes.lock().unwrap() = Some(sender);
        receiver
    }
}

struct Program(Arc<State>);

impl Site for Program {
    fn get(&self, path: &[&str], _query: &Query) -> Result<Reply, Refusal> {
        match path {
            ["slow"] => self.0.gets.pass(),
            _ => return Err(Refusal::unknown(path)),
        }
        Reply::json("done")
    }

    fn post(&self, path: &[&str], _asked: &Value) -> Result<Reply, Refusal> {
        Reply::json(path)
    }

    fn feed(&self, path: &[&str]) -> Result<Box<dyn Feed>, Refusal> {
        self.0.opened.fetch_add(1, Ordering::SeqCst);
        let state = self.0.clone();
        match path {
            ["value"] => Ok(Box::new(Values { state, told: None, size: 0 })),
            ["picture"] => Ok(Box::new(Values { state, told: None, size: 1 << 20 })),
            ["large"] => Ok(Box::new(Values { state, told: None, size: 32 << 20 })),
            ["wishes"] => Ok(Box::new(Wishes(state))),
            ["blocked"] => Ok(Box::new(Blocked(state))),
            ["panic"] => panic!("on purpose"),
            _ => Err(Refusal::unknown(path)),
        }
    }

    fn rules(&self, path: &[&str]) -> PostRules {
        PostRules { urgent: path == ["stop"], ..PostRules::default() }
    }
}

/// Tells the value when it is another; with so many bytes behind it, if any.
struct Values {
    state: Arc<State>,
    told: Option<u64>,
    size: usize,
}

impl Feed for Values {
    fn bell(&self) -> Bell {
        self.state.bell.clone()
    }

    fn next(&mut self) -> Option<Message> {
        self.state.asked.fetch_add(1, Ordering::SeqCst);
        let value = self.state.value.load(Ordering::SeqCst);
        let message = match self.size {
            0 => Message::json(&value),
            size => Message::framed(&value, &vec![value as u8; size]),
        };
        (self.told.replace(value) != Some(value)).then(|| message.unwrap())
    }
}

/// Passes wishes on, and tells the value; `{"value": 1}` wishes it, `{"refuse": "words"}` is refused.
struct Wishes(Arc<State>);

impl Feed for Wishes {
    fn bell(&self) -> Bell {
        self.0.bell.clone()
    }

    fn next(&mut self) -> Option<Message> {
        let value = self.0.value.load(Ordering::SeqCst);
        (value > 0).then(|| Message::json(&value).unwrap())
    }

    fn wish(&mut self, wish: &Value) -> Result<(), Refusal> {
        if let Some(words) = wish.get("refuse").and_then(Value::as_str) {
            return Err(Refusal::new(RefusalKind::Wrong, words));
        }
        assert!(wish.get("panic").is_none(), "on purpose");
        if let Some(value) = wish.get("value").and_then(Value::as_u64) {
            self.0.value.store(value, Ordering::SeqCst);
        }
        if let Some(wishes) = &*self.0.wishes.lock().unwrap() {
            wishes.send(wish.clone()).unwrap();
        }
        Ok(())
    }
}

/// Never comes to its news while the gate is closed.
struct Blocked(Arc<State>);

impl Feed for Blocked {
    fn bell(&self) -> Bell {
        self.0.bell.clone()
    }

    fn next(&mut self) -> Option<Message> {
        self.0.feeds.pass();
        None
    }
}

/// A server that shows the program.
pub(super) struct Running {
    pub(super) address: SocketAddr,
    pub(super) token: String,
    pub(super) stop: StopSwitch,
    pub(super) state: Arc<State>,
    thread: Option<JoinHandle<Result<(), ServerError>>>,
}

impl Running {
    pub(super) fn new() -> Self {
        Self::at(Ipv4Addr::LOCALHOST)
    }

    pub(super) fn at(listen: Ipv4Addr) -> Self {
        let listen = SocketAddr::from((listen, 0));
        let server = Server::bind(&ServerOptions { listen, ..ServerOptions::default() }).unwrap();
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, server.address().port()));
        let (stop, state) = (server.stop_switch(), Arc::new(State::default()));
        let token = server.link().split_once("token=").unwrap().1.to_owned();
        let program = Program(state.clone());
        let thread = Some(std::thread::spawn(move || server.run(program)));
        Self { address, token, stop, state, thread }
    }

    /// Sends a request, without waiting for the answer.
    pub(super) fn send(&self, first: &str, body: &str) -> TcpStream {
        let mut stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(LONG)).unwrap();
        let (address, token, length) = (self.address, &self.token, body.len());
        let request = format!(
            "{first} HTTP/1.1\r\nHost: {address}\r\nx-epirig-token: {token}\r\nContent-Length: {length}\r\n\
             Connection: close\r\n\r\n{body}"
        );
        stream.write_all(request.as_bytes()).unwrap();
        stream
    }

    /// Waits for the end of the server, whoever asked for it.
    pub(super) fn join(&mut self) {
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap().unwrap();
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop.press();
        self.join();
    }
}

/// The status of the answer that comes.
pub(super) fn status(mut stream: TcpStream) -> u16 {
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer.split(' ').nth(1).unwrap().parse().unwrap()
}
