//! What orders of the page say.

use std::collections::BTreeMap;

use serde::Deserialize;

/// What all orders say: which page they come from.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct Signature {
    pub(super) client: String,
}

/// Nothing more.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct Nothing {}

/// A position or a distance.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct Length {
    pub(super) mm: f64,
}

/// A button that moves the stage while it is held.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct JogButton {
    pub(super) id: u64,
    /// 1 for up, -1 for down.
    pub(super) direction: i8,
    pub(super) fast: bool,
}

/// The button that is held, or released.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct JogId {
    pub(super) id: u64,
}

/// A sequence in the folder of the panel.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct SequenceName {
    pub(super) name: String,
}

/// A control of the camera, and its new value.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct ControlValue {
    pub(super) name: String,
    pub(super) value: String,
}

/// Values of the profile that are to be others, by their keys.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct ProfileValues {
    pub(super) values: BTreeMap<String, String>,
}

/// The same, to be saved.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct SavedValues {
    pub(super) values: BTreeMap<String, String>,
    /// Whether a file that is there is replaced.
    #[serde(default)]
    pub(super) overwrite: bool,
}

/// What a simulated camera is to see.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct View {
    /// `object`, `dark`, `flat` or `board`.
    pub(super) what: String,
    /// Number of the board's pose, from 0.
    #[serde(default)]
    pub(super) pose: usize,
}

/// Whether something is to be done from now on.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct Switched {
    pub(super) on: bool,
}

/// Whether what a scan asked for is arranged; else it was cancelled.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct Arranged {
    pub(super) done: bool,
}

/// An examination of the rig.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct Examination {
    /// Leaves out what needs many moves.
    pub(super) short: bool,
}

/// Which live map is asked for.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct LiveMapQuery {
    /// `disparity`, which is the usual one, or `sigma`.
    pub(super) kind: Option<String>,
}
