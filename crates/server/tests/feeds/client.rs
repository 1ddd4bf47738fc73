//! A client of feeds that speaks RFC 6455 by hand, also wrongly.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

pub(super) const TEXT: u8 = 1;
pub(super) const BINARY: u8 = 2;
pub(super) const CLOSE: u8 = 8;
pub(super) const PING: u8 = 9;
pub(super) const PONG: u8 = 10;
/// The bit of a frame that ends its message.
pub(super) const LAST: u8 = 0x80;

/// The headers of a feed's request that a page sends without a token.
pub(super) const OFFER: &str = "Sec-WebSocket-Protocol: epirig\r\n";

pub(super) struct Client(TcpStream);

impl Client {
    /// Opens a feed; what is refused comes with status and words. `headers` hold the protocols.
    pub(super) fn open(address: SocketAddr, path: &str, headers: &str) -> Result<Self, (u16, String)> {
        let mut stream = TcpStream::connect(address).unwrap();
        // Far longer than any answer takes: what hangs is a failure, not a wait.
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let host = match headers.contains("Host:") {
            true => String::new(),
            false => format!("Host: {address}\r\n"),
        };
        // The key of the standard, section 1.2, and the answer to it.
        let request = format!(
            "GET {path} HTTP/1.1\r\n{host}{headers}Connection: Upgrade\r\nUpgrade: websocket\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        );
        stream.write_all(request.as_bytes()).unwrap();
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).unwrap();
            head.push(byte[0]);
        }
        let head = String::from_utf8(head).unwrap().to_lowercase();
        let status = head.split(' ').nth(1).unwrap().parse().unwrap();
        let value = |name: &str| head.lines().find_map(|line| line.strip_prefix(name)).map(str::trim);
        if status == 101 {
            assert_eq!(value("sec-websocket-accept:"), Some("s3pplmbitxaq9kygzzhzrbk+xoo="));
            assert_eq!(value("sec-websocket-protocol:"), Some("epirig"));
            return Ok(Self(stream));
        }
        let mut words = vec![0; value("content-length:").unwrap().parse().unwrap()];
        stream.read_exact(&mut words).unwrap();
        Err((status, String::from_utf8(words).unwrap()))
    }

    /// Sends a frame; `first` is its first byte. A server that has hung up is no failure here.
    pub(super) fn send(&mut self, first: u8, payload: &[u8]) {
        let mask = [0x1f, 0xa5, 0, 0xff];
        let mut frame = head(first, payload.len(), 0x80);
        frame.extend(mask);
        frame.extend(payload.iter().zip(mask.iter().cycle()).map(|(byte, mask)| byte ^ mask));
        let _ = self.0.write_all(&frame);
    }

    /// Sends a frame without a mask, which a client must not do.
    pub(super) fn send_unmasked(&mut self, first: u8, payload: &[u8]) {
        let mut frame = head(first, payload.len(), 0);
        frame.extend(payload);
        let _ = self.0.write_all(&frame);
    }

    pub(super) fn say(&mut self, text: &str) {
        self.send(LAST | TEXT, text.as_bytes());
    }

    pub(super) fn ok(&mut self) {
        self.say("ok");
    }

    /// Opcode and payload of the next frame.
    pub(super) fn frame(&mut self) -> (u8, Vec<u8>) {
        let mut start = [0; 2];
        self.0.read_exact(&mut start).unwrap();
        assert_eq!(start[0] & 0xf0, LAST, "a whole message");
        let mut length = [0; 8];
        match start[1] {
            126 => self.0.read_exact(&mut length[6..]).unwrap(),
            127 => self.0.read_exact(&mut length).unwrap(),
            short => length[7] = short,
        }
        let mut payload = vec![0; u64::from_be_bytes(length) as usize];
        self.0.read_exact(&mut payload).unwrap();
        (start[0] & 0xf, payload)
    }

    /// The next frame but for pings.
    pub(super) fn message(&mut self) -> (u8, Vec<u8>) {
        std::iter::repeat_with(|| self.frame()).find(|(opcode, _)| *opcode != PING).unwrap()
    }

    /// The next message, which is a number.
    pub(super) fn number(&mut self) -> u64 {
        let (opcode, text) = self.message();
        assert_eq!(opcode, TEXT);
        String::from_utf8(text).unwrap().parse().unwrap()
    }

    /// Waits until the server has read all that was sent so far; nothing else may come meanwhile.
    pub(super) fn is_heard(&mut self) {
        self.send(LAST | PING, b"heard?");
        assert_eq!(self.message(), (PONG, b"heard?".to_vec()));
    }

    /// Code and words with which the socket is closed, whatever comes before.
    pub(super) fn farewell(mut self) -> (u16, String) {
        let (_, payload) =
            std::iter::repeat_with(|| self.frame()).find(|(opcode, _)| *opcode == CLOSE).unwrap();
        let words = String::from_utf8(payload[2..].to_vec()).unwrap();
        assert!(words.len() <= 120, "{words}");
        // Then nothing comes, even if the server hung up before it had read all.
        let mut rest = Vec::new();
        let _ = self.0.read_to_end(&mut rest);
        assert!(rest.is_empty());
        (u16::from_be_bytes([payload[0], payload[1]]), words)
    }
}

fn head(first: u8, length: usize, masked: u8) -> Vec<u8> {
    let mut head = vec![first];
    match length {
        0..126 => head.push(masked | length as u8),
        126..0x1_0000 => {
            head.push(masked | 126);
            head.extend((length as u16).to_be_bytes());
        }
        _ => {
            head.push(masked | 127);
            head.extend((length as u64).to_be_bytes());
        }
    }
    head
}
