//! The controls of the camera as the page has them.

use serde::Serialize;

use crate::panel::shared::Shared;
use epirig_devices::camera::Control;
use epirig_server::{Refusal, Reply};

#[derive(Serialize)]
struct ControlFacts {
    name: String,
    kind: &'static str,
    minimum: i64,
    maximum: i64,
    step: u64,
    default: i64,
    value: Option<i64>,
    read_only: bool,
    inactive: bool,
    items: Vec<(i64, String)>,
}

/// The controls of the camera.
pub(in crate::panel) fn controls(shared: &Shared) -> Result<Reply, Refusal> {
    let facts = |control: Control| ControlFacts {
        name: control.name,
        kind: control.kind.name(),
        minimum: control.minimum,
        maximum: control.maximum,
        step: control.step,
        default: control.default,
        value: control.value,
        read_only: control.read_only,
        inactive: control.inactive,
        items: control.items,
    };
    Reply::json(&shared.controls().into_iter().map(facts).collect::<Vec<_>>())
}
