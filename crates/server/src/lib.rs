#![doc = include_str!("../README.md")]

mod answer;
mod error;
mod guard;
mod page;
mod refusal;
mod reply;
mod server;
mod site;
mod token;

pub use error::ServerError;
pub use refusal::{Refusal, RefusalKind};
pub use reply::Reply;
pub use server::{Limits, Server, ServerOptions, StopSwitch};
pub use site::{Query, Site};
