//! The controls of the camera as the page has them.

use serde::Serialize;

use crate::panel::shared::SharedState;
use epirig_devices::camera;

/// A control of the camera.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct Control {
    name: String,
    #[cfg_attr(test, ts(type = "'integer' | 'boolean' | 'menu' | 'bitmask' | 'button' | 'other'"))]
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
pub(in crate::panel) fn controls(shared: &SharedState) -> Vec<Control> {
    let facts = |control: camera::Control| Control {
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
    let controls = shared.look(|state| state.controls.clone());
    controls.into_iter().map(facts).collect()
}
