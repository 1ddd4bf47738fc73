//! Orders to the thread that owns the rig: only it carries them out.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use epirig_devices::camera::SimView;

/// Where the owner of the rig answers an order.
#[derive(Debug, Clone)]
pub(in crate::panel) struct OrderReply(SyncSender<Result<(), String>>);

impl OrderReply {
    /// A reply, and where it arrives.
    pub(in crate::panel) fn new() -> (Self, Receiver<Result<(), String>>) {
        let (sender, receiver) = sync_channel(1);
        (Self(sender), receiver)
    }

    /// Answers; who asked may have given up waiting.
    pub(in crate::panel) fn give(&self, answer: Result<(), String>) {
        let _ = self.0.try_send(answer);
    }
}

/// What the owner of the rig is to do.
#[derive(Debug, Clone)]
pub(in crate::panel) enum Order {
    /// Open stage and camera anew.
    Connect,
    /// Use the profile with other values from now on, and open stage and camera anew.
    Use { values: BTreeMap<String, String>, reply: OrderReply },
    /// Home the stage.
    Home,
    /// Move to a position, in mm from home.
    Go { mm: f64 },
    /// Move by a distance, in mm.
    Step { mm: f64 },
    /// Move while the jog is held.
    Jog { id: u64, up: bool, fast: bool },
    /// The stop switch was pressed: make sure that the stage stands, and release the switch.
    Stopped,
    /// Set a control of the camera.
    SetControl { name: String, value: String, reply: OrderReply },
    /// Show something else to a simulated camera.
    Show(SimView),
    /// Examine the rig.
    Examine { short: bool },
    /// Take the frames of a sequence in this folder of the panel.
    Scan { name: String, resumed: bool },
    /// End.
    End,
}
