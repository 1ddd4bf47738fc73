//! Feeds as a client meets them, over real sockets: one message at a time, wishes, and what is refused.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

#[path = "feeds/client.rs"]
mod client;
#[path = "feeds/program.rs"]
mod program;

use std::net::Ipv4Addr;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use client::{BINARY, CLOSE, Client, LAST, OFFER, TEXT};
use program::{Running, status};
use serde_json::json;

fn open(server: &Running, path: &str) -> Client {
    Client::open(server.address, path, OFFER).map_err(|refused| panic!("{refused:?}")).unwrap()
}

#[test]
fn news_come_as_text_or_bytes_and_are_acknowledged() {
    let server = Running::new();
    server.state.set(7);
    let mut values = open(&server, "/api/value");
    assert_eq!(values.number(), 7, "without a ring");
    values.ok();
    server.state.set(8);
    assert_eq!(values.number(), 8);
    values.ok();
    server.state.set(300);
    assert_eq!(values.number(), 300);
    let (opcode, bytes) = open(&server, "/api/picture").message();
    assert_eq!((opcode, bytes.len()), (BINARY, 4 + 4 + (1 << 20)));
    assert_eq!(bytes[..12], *b"\x04\0\0\x00300 \x2c\x2c\x2c\x2c");
    assert!(bytes[8..].iter().all(|byte| *byte == 0x2c));
}

#[test]
fn without_ok_nothing_more_comes_and_after_it_the_newest() {
    let server = Running::new();
    let mut values = open(&server, "/api/value");
    assert_eq!(values.number(), 0);
    for value in 1..=1000 {
        server.state.set(value);
        if value % 100 == 0 {
            values.is_heard();
        }
    }
    assert_eq!(server.state.asked.load(Ordering::SeqCst), 1);
    values.ok();
    assert_eq!(values.number(), 1000);
    assert_eq!(server.state.asked.load(Ordering::SeqCst), 2);
}

#[test]
fn who_rings_does_not_wait_for_clients_that_read_nothing() {
    let server = Running::new();
    // What they are sent fits in no buffer.
    let clients: Vec<Client> = (0..4).map(|_| open(&server, "/api/large")).collect();
    wait_until("all are sent something", || server.state.asked.load(Ordering::SeqCst) == 4);
    // That this comes to its end is the test: nobody reads meanwhile.
    for value in 1..=100_000 {
        server.state.set(value);
    }
    // Nor do others wait for them.
    assert_eq!(open(&server, "/api/value").number(), 100_000);
    drop(clients);
}

#[test]
fn wishes_reach_the_feed_in_their_order() {
    let server = Running::new();
    let wishes = server.state.wishes();
    let mut client = open(&server, "/api/wishes");
    // In one piece, in three, and as long as may be.
    client.say("{\"part\": [1, 2]}");
    client.send(TEXT, b"{\"par");
    client.send(0, b"t\": [3");
    client.send(LAST, b", 4]}");
    let long = format!("\"{}\"", "x".repeat(4094));
    client.say(&long);
    assert_eq!(wishes.recv().unwrap(), json!({"part": [1, 2]}));
    assert_eq!(wishes.recv().unwrap(), json!({"part": [3, 4]}));
    assert_eq!(wishes.recv().unwrap().as_str().unwrap().len(), 4094);
    // News that a wish makes need no ring.
    client.say("{\"value\": 5}");
    assert_eq!(client.number(), 5);
    // A wish may come before the acknowledgement, and its news come after it.
    client.say("{\"value\": 6}");
    client.is_heard();
    client.ok();
    assert_eq!(client.number(), 6);
}

#[test]
fn wrong_wishes_close_the_socket_with_words() {
    let server = Running::new();
    let long = "ä".repeat(100);
    let refused = json!({ "refuse": format!("x{long}") }).to_string();
    let spaces = " ".repeat(4097);
    let much = format!("\"{}\"", "x".repeat(1 << 20));
    for (first, payload, code, words) in [
        (TEXT, refused.as_str(), 1008, &long[..20]),
        (TEXT, "{\"panic\": 1}", 1011, "on purpose"),
        (TEXT, "no json", 1007, "no JSON"),
        (TEXT, "", 1007, "no JSON"),
        (BINARY, "{}", 1003, "JSON text"),
        (TEXT, spaces.as_str(), 1009, "4096 bytes"),
        (TEXT, much.as_str(), 1009, "4096 bytes"),
        (BINARY, much.as_str(), 1009, "4096 bytes"),
        (3, "{}", 1002, ""),
    ] {
        let mut client = open(&server, "/api/wishes");
        client.send(LAST | first, payload.as_bytes());
        let (told, reason) = client.farewell();
        assert!(told == code && reason.contains(words) && !reason.is_empty(), "{told} {reason}");
    }
    // In pieces that are short enough.
    let mut client = open(&server, "/api/wishes");
    client.send(TEXT, &[b' '; 3000]);
    client.send(LAST, &[b' '; 3000]);
    assert_eq!(client.farewell().0, 1009);
    let mut client = open(&server, "/api/wishes");
    client.send_unmasked(LAST | TEXT, b"{}");
    assert_eq!(client.farewell().0, 1002);
    let mut client = open(&server, "/api/wishes");
    client.send(LAST | TEXT, b"\"\xff\"");
    assert_eq!(client.farewell().0, 1007);
    // A feed without wishes.
    let mut client = open(&server, "/api/value");
    client.say("{}");
    let (code, words) = client.farewell();
    assert!(code == 1008 && words.contains("no wishes"), "{words}");
    // All of them are gone, and others are served.
    wait_until("nobody listens", || server.state.bell.listeners() == 0);
    open(&server, "/api/value").number();
}

#[test]
fn a_flood_of_wishes_closes_the_socket() {
    // As fast as they go; the exact limit is tested inside the crate, on a clock of its own.
    let server = Running::new();
    let mut client = open(&server, "/api/wishes");
    for wish in 0..2000 {
        client.say(&wish.to_string());
    }
    let (code, words) = client.farewell();
    assert!(code == 1008 && words.contains("50 wishes"), "{code} {words}");
}

#[test]
fn who_may_not_read_gets_no_socket() {
    let server = Running::at(Ipv4Addr::UNSPECIFIED);
    let (port, token) = (server.address.port(), &server.token);
    let with = format!("Sec-WebSocket-Protocol: epirig, token.{token}\r\n");
    let refused = |path: &str, headers: &str| Client::open(server.address, path, headers).err().unwrap().0;
    for foreign in [
        "Origin: http://evil.example\r\n".to_owned(),
        "Origin: null\r\n".to_owned(),
        format!("Origin: http://localhost:{port}\r\n"),
        format!("Origin: https://{}\r\n", server.address),
        format!("Host: evil.example:{port}\r\n"),
        format!("Host: evil.example:{port}\r\nOrigin: http://evil.example:{port}\r\n"),
    ] {
        assert_eq!(refused("/api/value", &(with.clone() + &foreign)), 403, "{foreign}");
    }
    let wrong = format!("Sec-WebSocket-Protocol: epirig, token.{}0\r\n", &token[1..]);
    for without in [OFFER, &wrong, &format!("{OFFER}x-epirig-token: \r\n")] {
        assert_eq!(refused("/api/value", without), 401, "{without}");
    }
    assert_eq!(refused("/api/value", &format!("Sec-WebSocket-Protocol: token.{token}\r\n")), 400);
    assert_eq!(refused("/value", &with), 404);
    assert_eq!(server.state.opened.load(Ordering::SeqCst), 0, "the program was not asked");
    assert_eq!(refused("/api/none", &with), 404);
    assert_eq!(refused("/api/panic", &with), 500);
    for may in [
        with.clone(),
        format!("{with}Origin: http://{}\r\n", server.address),
        format!("{OFFER}x-epirig-token: {token}\r\n"),
        format!("Sec-WebSocket-Protocol: token.{token}\r\n{OFFER}"),
    ] {
        assert_eq!(Client::open(server.address, "/api/value", &may).ok().unwrap().number(), 0, "{may}");
    }
}

#[test]
fn there_are_32_feeds_at_once() {
    let server = Running::new();
    let mut open: Vec<Client> = (0..32).map(|_| open(&server, "/api/value")).collect();
    let one_more = || Client::open(server.address, "/api/value", OFFER);
    let (code, words) = one_more().err().unwrap();
    assert!(code == 503 && words.contains("too many feeds"), "{code} {words}");
    // Who takes leave is answered, and gives the place to another.
    let mut leaving = open.swap_remove(5);
    assert_eq!(leaving.number(), 0);
    leaving.send(LAST | CLOSE, &1000_u16.to_be_bytes());
    assert_eq!(leaving.farewell(), (1000, String::new()));
    wait_until("a place is free", || one_more().is_ok());
    // So does who vanishes.
    drop(open);
    wait_until("nobody listens", || server.state.bell.listeners() == 0);
}

#[test]
fn the_stop_switch_ends_feeds_and_the_server() {
    let mut server = Running::new();
    let mut ready = open(&server, "/api/value");
    assert_eq!(ready.number(), 0);
    ready.ok();
    let in_flight = open(&server, "/api/value");
    let reads_nothing = open(&server, "/api/large");
    let blocked = open(&server, "/api/blocked");
    server.state.feeds.wait_for(1);
    server.stop.press();
    for client in [ready, in_flight, blocked] {
        let (code, words) = client.farewell();
        assert!(code == 1001 && words.contains("ended"), "{code} {words}");
    }
    server.join();
    drop(reads_nothing);
    server.state.feeds.open();
}

#[test]
fn an_urgent_order_waits_for_nothing() {
    let server = Running::new();
    // Half of those who ask hang up; their threads stay busy all the same.
    let slow: Vec<_> = (0..12).map(|_| server.send("GET /api/slow", "")).collect();
    server.state.gets.wait_for(4);
    let patient = slow.into_iter().skip(6).collect::<Vec<_>>();
    let feeds: Vec<_> = (0..4).map(|_| open(&server, "/api/blocked")).collect();
    server.state.feeds.wait_for(4);
    for _ in 0..20 {
        assert_eq!(status(server.send("POST /api/stop", "{}")), 200);
    }
    // Nothing else has begun.
    assert_eq!((server.state.gets.wait_for(4), server.state.feeds.wait_for(4)), (4, 4));
    server.state.gets.open();
    for answer in patient {
        assert_eq!(status(answer), 200);
    }
    // Nor do answers wait for feeds.
    assert_eq!(status(server.send("GET /api/slow", "")), 200);
    server.state.feeds.open();
    drop(feeds);
}

fn wait_until(what: &str, is_so: impl Fn() -> bool) {
    let begun = Instant::now();
    while !is_so() {
        assert!(begun.elapsed() < Duration::from_secs(60), "in vain: {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}
