#![doc = include_str!("../README.md")]

mod answer;
mod error;
mod guard;
mod page;
mod server;
mod site;
mod token;

pub use error::ServerError;
pub use server::{Limits, Server, ServerOptions, StopSwitch};
pub use site::{Query, Refusal, RefusalKind, Reply, Site};
