//! Serves the time since its start: `cargo run -p epirig-server --example clock`, and Ctrl-C.
//!
//! With `--once` it answers itself one question and ends.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Instant;

use epirig_server::{Query, Refusal, Reply, Server, ServerError, ServerOptions, Site};

struct Clock(Instant);

impl Site for Clock {
    fn get(&self, path: &[&str], _query: &Query) -> Result<Reply, Refusal> {
        match path {
            ["seconds"] => Reply::json(&self.0.elapsed().as_secs_f64()),
            _ => Err(Refusal::unknown(path)),
        }
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
    server.run(Clock(Instant::now()))
}
