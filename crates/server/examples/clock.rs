//! Serves the time since its start: `cargo run -p epirig-server --example clock`, and Ctrl-C.
//!
//! With `--once` it answers itself one question and ends. The feed `/api/ticks` tells each second that begins.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use epirig_server::{Bell, Feed, Message, Query, Refusal, Reply, Server, ServerError, ServerOptions, Site};

struct Clock {
    begun: Instant,
    tick: Bell,
}

impl Site for Clock {
    fn get(&self, path: &[&str], _query: &Query) -> Result<Reply, Refusal> {
        match path {
            ["seconds"] => Reply::json(&self.begun.elapsed().as_secs_f64()),
            _ => Err(Refusal::unknown(path)),
        }
    }

    fn feed(&self, path: &[&str]) -> Result<Box<dyn Feed>, Refusal> {
        match path {
            ["ticks"] => Ok(Box::new(Ticks { begun: self.begun, tick: self.tick.clone() })),
            _ => Err(Refusal::unknown(path)),
        }
    }
}

/// The whole seconds since the start.
struct Ticks {
    begun: Instant,
    tick: Bell,
}

impl Feed for Ticks {
    fn bell(&self) -> Bell {
        self.tick.clone()
    }

    fn next(&mut self) -> Option<Message> {
        Message::json(&self.begun.elapsed().as_secs()).ok()
    }
}

fn main() -> Result<(), ServerError> {
    let server = Server::bind(&ServerOptions::default())?;
    println!("curl http://{}/api/seconds", server.address());
    if std::env::args().any(|argument| argument == "--once") {
        let (address, stop) = (server.address(), server.stop_switch());
        std::thread::spawn(move || {
            let mut answer = String::new();
            let request =
                format!("GET /api/seconds HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
            let asked = TcpStream::connect(address).and_then(|mut stream| {
                stream.write_all(request.as_bytes())?;
                stream.read_to_string(&mut answer)
            });
            println!("{}", asked.map_or_else(|error| error.to_string(), |_| answer));
            stop.press();
        });
    }
    let clock = Clock { begun: Instant::now(), tick: Bell::default() };
    let tick = clock.tick.clone();
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_secs(1));
            tick.ring();
        }
    });
    server.run(clock)
}
