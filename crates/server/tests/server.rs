//! The server as a client meets it, over real sockets, with what a hostile one would try.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};

use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use epirig_server::{
    Limits, PostRules, Query, Refusal, RefusalKind, Reply, Server, ServerError, ServerOptions, Site,
    StopSwitch,
};
use serde_json::Value;

struct Echo;

impl Site for Echo {
    fn get(&self, path: &[&str], query: &Query) -> Result<Reply, Refusal> {
        match path {
            ["sum"] => {
                let number = |name: &str| {
                    let text = query.text(name).unwrap_or_default();
                    let wrong = |_| Refusal::new(RefusalKind::Wrong, format!("{name}=\"{text}\" is none"));
                    text.parse::<i64>().map_err(wrong)
                };
                Reply::json(&(number("a")? + number("b")?))
            }
            ["picture"] => Ok(Reply::of("image/png", b"png".to_vec()).lasting()),
            ["panic"] => panic!("on purpose"),
            ["path", rest @ ..] => Reply::json(&rest.join("|")),
            _ => Err(Refusal::unknown(path)),
        }
    }

    fn post(&self, path: &[&str], asked: &Value) -> Result<Reply, Refusal> {
        Reply::json(&(path.join("/"), asked))
    }

    fn rules(&self, path: &[&str]) -> PostRules {
        let usual = PostRules { open_to_all: path == ["stop"], ..PostRules::default() };
        if path == ["long"] { PostRules { largest: 150_000, ..usual } } else { usual }
    }
}

struct Running {
    address: SocketAddr,
    token: String,
    watch_token: String,
    stop: StopSwitch,
    thread: Option<JoinHandle<Result<(), ServerError>>>,
}

impl Running {
    fn with(limits: Limits) -> Self {
        Self::at(&ServerOptions { limits, ..ServerOptions::default() })
    }

    fn at(options: &ServerOptions) -> Self {
        let server = Server::bind(options).unwrap();
        let (address, stop) =
            (SocketAddr::from(([127, 0, 0, 1], server.address().port())), server.stop_switch());
        let [token, watch_token] =
            [server.link(), server.watch_link()].map(|link| link.split_once("token=").unwrap().1.to_owned());
        let thread = Some(std::thread::spawn(move || server.run(Echo)));
        Self { address, token, watch_token, stop, thread }
    }

    fn new() -> Self {
        Self::with(Limits::default())
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        // Far longer than any answer takes: what hangs is a failure, not a wait.
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        stream
    }

    /// Status and body of the answer to a request with these further header lines.
    fn ask(&self, first: &str, headers: &str, body: &str) -> (u16, String) {
        let answer = self.answer(first, headers, body);
        let status = answer.split(' ').nth(1).and_then(|code| code.parse().ok()).unwrap_or(0);
        (status, answer.split_once("\r\n\r\n").map_or(String::new(), |(_, body)| body.to_owned()))
    }

    /// The whole answer.
    fn answer(&self, first: &str, headers: &str, body: &str) -> String {
        let host =
            if headers.contains("Host:") { String::new() } else { format!("Host: {}\r\n", self.address) };
        let length = body.len();
        let text = format!(
            "{first} HTTP/1.1\r\n{host}{headers}Content-Length: {length}\r\nConnection: close\r\n\r\n{body}"
        );
        let mut stream = self.connect();
        // A server that refuses early may close before all is sent.
        let _ = stream.write_all(text.as_bytes());
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    fn get(&self, path: &str) -> (u16, String) {
        self.ask(&format!("GET {path}"), "", "")
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop.press();
        self.thread.take().unwrap().join().unwrap().unwrap();
    }
}

#[test]
fn questions_are_answered_and_refusals_say_why() {
    let server = Running::new();
    assert_eq!(server.get("/api/sum?a=2&b=40"), (200, "42".to_owned()));
    let (status, words) = server.get("/api/sum?a=2&b=forty");
    assert_eq!(status, 400);
    assert!(words.contains("b=\\\"forty\\\""), "{words}");
    assert_eq!(server.get("/api/nothing").0, 404);
    assert_eq!(server.get("/nothing").0, 404);
    let (status, page) = server.get("/");
    assert!(status == 200 && page.to_lowercase().contains("<!doctype html"), "{page}");
    // A fault in one answer is told, and the next one is given.
    assert_eq!(server.get("/api/panic").0, 500);
    assert_eq!(server.get("/api/sum?a=1&b=1").0, 200);
}

#[test]
fn a_browser_keeps_what_lasts_and_nothing_else() {
    let server = Running::new();
    let kept = |path: &str| {
        let answer = server.answer(&format!("GET {path}"), "", "");
        let mut lines = answer.lines().take_while(|line| !line.is_empty());
        lines.find_map(|line| line.strip_prefix("cache-control: ")).map(str::to_owned)
    };
    assert_eq!(kept("/api/picture").as_deref(), Some("private, max-age=31536000, immutable"));
    for path in ["/api/sum?a=1&b=2", "/api/nothing", "/", "/app.js"] {
        assert_eq!(kept(path).as_deref(), Some("no-store"), "{path}");
    }
}

#[test]
fn nothing_is_changed_without_the_token() {
    let server = Running::new();
    let with = format!("x-epirig-token: {}\r\n", server.token);
    let wrong = format!("x-epirig-token: {}0\r\n", &server.token[1..]);
    assert_eq!(server.ask("POST /api/move", "", "{}").0, 401);
    assert_eq!(server.ask("POST /api/move", &wrong, "{}").0, 401);
    let watch = format!("x-epirig-token: {}\r\n", server.watch_token);
    let (status, words) = server.ask("POST /api/move", &watch, "{}");
    assert!(status == 401 && words.contains("the link for watching"), "{status} {words}");
    let (status, answer) = server.ask("POST /api/move", &with, "{\"to\": 3}");
    assert_eq!((status, answer.as_str()), (200, "[\"move\",{\"to\":3}]"));
    assert_eq!(server.ask("POST /api/move", &with, "no json").0, 400);
    assert_eq!(server.ask("DELETE /api/move", &with, "").0, 403);
    assert_eq!(server.ask("DELETE /api/stop", &watch, "").0, 401);
}

#[test]
fn what_is_open_to_all_needs_what_looking_needs() {
    let near = Running::new();
    let everywhere = SocketAddr::from(([0, 0, 0, 0], 0));
    let far = Running::at(&ServerOptions { listen: everywhere, ..ServerOptions::default() });
    for (server, without) in [(&near, 200), (&far, 401)] {
        let with = |token: &str| format!("x-epirig-token: {token}\r\n");
        assert_eq!(server.ask("POST /api/stop", "", "{}").0, without);
        assert_eq!(server.ask("POST /api/stop", &with(&server.watch_token), "{}").0, 200);
        assert_eq!(server.ask("POST /api/stop", &with(&server.token), "{}").0, 200);
        assert_eq!(server.ask("POST /api/move", &with(&server.watch_token), "{}").0, 401);
        // No page of another site makes its visitor stop the rig.
        let foreign = with(&server.watch_token) + "Origin: http://evil.example\r\n";
        assert_eq!(server.ask("POST /api/stop", &foreign, "{}").0, 403);
    }
}

#[test]
fn foreign_hosts_and_origins_are_refused_even_with_the_token() {
    let server = Running::new();
    let with = format!("x-epirig-token: {}\r\n", server.token);
    let port = server.address.port();
    for foreign in [
        format!("Host: evil.example:{port}\r\n"),
        "Host: \r\n".to_owned(),
        "Origin: http://evil.example\r\n".to_owned(),
        "Origin: null\r\n".to_owned(),
        format!("Origin: https://{}\r\n", server.address),
    ] {
        let headers = with.clone() + &foreign;
        assert_eq!(server.ask("POST /api/move", &headers, "{}").0, 403, "{foreign}");
        assert_eq!(server.ask("GET /api/sum?a=1&b=1", &headers, "").0, 403, "{foreign}");
    }
    let own = format!("{with}Origin: http://{}\r\n", server.address);
    assert_eq!(server.ask("POST /api/move", &own, "{}").0, 200);
    // Of two hosts or origins nobody knows which one counts.
    let host = format!("Host: {}\r\n", server.address);
    for first in [&host, "Host: evil.example\r\n"] {
        let two = format!("{with}{first}{host}");
        assert!(matches!(server.ask("GET /api/sum?a=1&b=1", &two, "").0, 400 | 403), "{two}");
    }
    let two = format!("{own}Origin: http://{}\r\n", server.address);
    assert_eq!(server.ask("POST /api/move", &two, "{}").0, 403);
}

#[test]
fn bodies_and_heads_are_bounded() {
    let server = Running::new();
    let with = format!("x-epirig-token: {}\r\n", server.token);
    let long = format!("\"{}\"", "x".repeat(100_000));
    assert_eq!(server.ask("POST /api/move", &with, &long).0, 413);
    // A site may read more at a path, and that has an end, too.
    assert_eq!(server.ask("POST /api/long", &with, &long).0, 200);
    let longer = format!("\"{}\"", "x".repeat(200_000));
    assert_eq!(server.ask("POST /api/long", &with, &longer).0, 413);
    let head = format!("x-long: {}\r\n", "y".repeat(100_000));
    let (status, _) = server.ask("GET /api/sum?a=1&b=1", &head, "");
    assert!(matches!(status, 431 | 0), "{status}");
    // A body without end is cut off.
    let mut stream = server.connect();
    let first = format!("POST /api/move HTTP/1.1\r\nHost: {}\r\n{with}", server.address);
    stream.write_all(format!("{first}Transfer-Encoding: chunked\r\n\r\n").as_bytes()).unwrap();
    let chunk = format!("1000\r\n{}\r\n", "z".repeat(0x1000));
    let sent = (0..10_000).take_while(|_| stream.write_all(chunk.as_bytes()).is_ok()).count();
    assert!(sent < 10_000, "40 MB were taken");
    assert_eq!(server.get("/api/sum?a=1&b=1").0, 200);
}

#[test]
fn idle_and_slow_connections_do_not_keep_others_out() {
    let limits = Limits { connections: 32, head_time: Duration::from_millis(500), ..Limits::default() };
    let server = Running::with(limits);
    // 2,000 that say nothing, or begin and never end.
    let idle: Vec<TcpStream> = (0..2000)
        .map(|index| {
            let mut stream = server.connect();
            if index % 2 == 0 {
                let _ = stream.write_all(b"GET /api/sum?a=1&b=1 HTTP/1.1\r\nHost: ");
            }
            stream
        })
        .collect();
    let begun = Instant::now();
    let answered = std::iter::repeat_with(|| server.get("/api/sum?a=20&b=22"))
        .take_while(|_| begun.elapsed() < Duration::from_secs(60))
        .find(|(status, _)| *status == 200);
    assert_eq!(answered, Some((200, "42".to_owned())));
    // All of the idle ones have been closed by the server.
    for mut stream in idle {
        let mut rest = Vec::new();
        match stream.read_to_end(&mut rest) {
            Ok(_) => {}
            Err(error) => assert_eq!(error.kind(), ErrorKind::ConnectionReset),
        }
    }
}

#[test]
fn a_stop_is_heard_while_all_seats_are_held() {
    let server = Running::new();
    let seats = Limits::default().connections;
    let host = format!("Host: {}\r\n", server.address);
    // Half of a request, a request without its body, or an answer that is not read, each as often as there are seats.
    let beginnings = [
        "GET /api/sum?a=1&b=1 HTTP/1.1\r\nHost: ".to_owned(),
        format!("POST /api/stop HTTP/1.1\r\n{host}Content-Length: 5\r\n\r\n{{"),
        format!("GET / HTTP/1.1\r\n{host}\r\n"),
        String::new(),
    ];
    let holds = |beginning: &String| -> Vec<TcpStream> {
        let open = |_| {
            let mut stream = server.connect();
            let _ = stream.write_all(beginning.as_bytes());
            stream
        };
        (0..seats).map(open).collect()
    };
    for beginning in &beginnings {
        let held = holds(beginning);
        for _ in 0..20 {
            assert_eq!(server.ask("POST /api/stop", "", "{}").0, 200, "{beginning}");
        }
        drop(held);
    }
}

#[test]
fn paths_reach_the_site_as_they_are() {
    // The site looks names up in lists; nothing is resolved on the way.
    let server = Running::new();
    assert_eq!(server.get("/api/path/../../etc/passwd").1, "\"..|..|etc|passwd\"");
    assert_eq!(server.get("/api/path/%2e%2e/x").1, "\"%2e%2e|x\"");
    assert_eq!(server.get("/../Cargo.toml").0, 404);
}

#[test]
fn a_taken_address_is_told() {
    let server = Running::new();
    let again = ServerOptions { listen: server.address, ..ServerOptions::default() };
    let error = Server::bind(&again).err().unwrap().to_string();
    assert!(error.contains(&server.address.to_string()) && error.contains("--listen"), "{error}");
}
