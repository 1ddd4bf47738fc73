#![doc = include_str!("../README.md")]

mod answer;
mod error;
mod feed;
mod guard;
mod handshake;
mod page;
mod refusal;
mod reply;
mod seats;
mod server;
mod site;
mod socket;
mod threads;
mod token;

pub use error::ServerError;
pub use feed::{Bell, Feed, Message};
pub use refusal::{Refusal, RefusalKind};
pub use reply::Reply;
pub use server::{Limits, Server, ServerOptions, StopSwitch};
pub use site::{PostRules, Query, Site};
