//! What orders of the page say.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use epirig_server::{Refusal, RefusalKind};

/// The order in `asked`.
///
/// # Errors
/// [`Refusal`] if something is missing, or is of another kind.
pub(super) fn taken<T: DeserializeOwned>(asked: &Value) -> Result<T, Refusal> {
    serde_json::from_value(asked.clone())
        .map_err(|error| Refusal::new(RefusalKind::Wrong, format!("this order is not complete: {error}")))
}

/// What all orders say: which page they come from.
#[derive(Deserialize)]
pub(super) struct Signed {
    pub(super) client: String,
}

#[derive(Deserialize)]
pub(super) struct Mm {
    pub(super) mm: f64,
}

#[derive(Deserialize)]
pub(super) struct Jogged {
    pub(super) id: u64,
    pub(super) direction: i8,
    pub(super) fast: bool,
}

#[derive(Deserialize)]
pub(super) struct Id {
    pub(super) id: u64,
}

#[derive(Deserialize)]
pub(super) struct Named {
    pub(super) name: String,
}

#[derive(Deserialize)]
pub(super) struct Setting {
    pub(super) name: String,
    pub(super) value: String,
}

#[derive(Deserialize)]
pub(super) struct Values {
    pub(super) values: BTreeMap<String, String>,
    #[serde(default)]
    pub(super) overwrite: bool,
}

#[derive(Deserialize)]
pub(super) struct Show {
    pub(super) what: String,
    #[serde(default)]
    pub(super) pose: usize,
}

#[derive(Deserialize)]
pub(super) struct On {
    pub(super) on: bool,
}

#[derive(Deserialize)]
pub(super) struct Done {
    pub(super) done: bool,
}

#[derive(Deserialize)]
pub(super) struct Short {
    pub(super) short: bool,
}
