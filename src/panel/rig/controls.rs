//! The controls of the camera as the page has them.

use serde::Serialize;

#[cfg(test)]
use crate::panel::page_type_tests;
use crate::panel::shared::SharedState;
use epirig_devices::camera::Control;

/// The controls of the camera.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct Controls(
    #[cfg_attr(test, ts(as = "Vec<page_type_tests::Control>"))] Vec<Control>,
);

pub(in crate::panel) fn controls(shared: &SharedState) -> Controls {
    Controls(shared.look(|state| state.controls.clone()))
}
