//! What orders and questions of the page say.

use std::collections::BTreeMap;

/// Declares what the page sends: records that are read here, and that the page has as types.
macro_rules! requests {
    ($($(#[$about:meta])+ $name:ident { $($(#[$what:meta])* $field:ident: $type:ty),* $(,)? })+) => {$(
        $(#[$about])+
        #[derive(serde::Deserialize)]
        #[cfg_attr(test, derive(ts_rs::TS))]
        pub(in crate::panel) struct $name {
            $($(#[$what])* pub(in crate::panel) $field: $type,)*
        }
    )+};
}
pub(super) use requests;

requests! {
    /// What all orders say: which page they come from.
    Signature { client: String }
    /// Nothing more.
    Nothing {}
    /// A position or a distance.
    Length { mm: f64 }
    /// A button that moves the stage while it is held.
    JogButton {
        id: u64,
        /// 1 for up, -1 for down.
        direction: i8,
        fast: bool,
    }
    /// The button that is held, or released.
    JogId { id: u64 }
    /// A sequence in the folder of the panel.
    SequenceName { name: String }
    /// A control of the camera, and its new value.
    ControlValue { name: String, value: String }
    /// Values of the profile that are to be others, by their keys.
    ProfileValues { values: BTreeMap<String, String> }
    /// The same, to be saved.
    SavedValues {
        values: BTreeMap<String, String>,
        /// Whether a file that is there is replaced.
        #[serde(default)]
        overwrite: bool,
    }
    /// What a simulated camera is to see.
    View {
        /// `object`, `dark`, `flat` or `board`.
        what: String,
        /// Number of the board's pose, from 0.
        #[serde(default)]
        pose: usize,
    }
    /// Whether something is to be done from now on.
    Switched { on: bool }
    /// Whether what a scan asked for is arranged; else it was cancelled.
    Arranged { done: bool }
    /// An examination of the rig.
    Examination {
        /// Leaves out what needs many moves.
        short: bool,
    }
    /// Which live map is asked for.
    LiveMapQuery {
        /// `disparity`, which is the usual one, or `sigma`.
        kind: Option<String>,
    }
}
