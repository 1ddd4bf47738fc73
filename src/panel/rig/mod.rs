//! The rig in the panel: its owner, its camera and its stage.

mod camera;
mod controls;
mod light;
mod owner;
mod profile;
mod stage;

use std::sync::Arc;
use std::thread::{JoinHandle, spawn};
use std::time::{Duration, Instant};

use super::shared::Shared;

pub(super) use controls::controls;
pub(super) use profile::{FormMistake, change_profile, profile_form, save_profile};

/// Starts the thread that owns the rig, the one that looks at its pictures, and the one that frees the control of
/// pages that have gone.
pub(super) fn start(shared: &Arc<Shared>) -> [JoinHandle<()>; 3] {
    let [owned, watched, controlled] = std::array::from_fn(|_| Arc::clone(shared));
    [
        spawn(move || owner::own(&owned)),
        spawn(move || light::watch(&watched)),
        spawn(move || free_control(&controlled)),
    ]
}

/// Frees the control of pages that have gone, until the panel ends.
fn free_control(shared: &Shared) {
    /// Time between two looks.
    const LOOK: Duration = Duration::from_millis(250);
    while !shared.is_ending() {
        shared.control(|controller| controller.release(Instant::now()));
        std::thread::sleep(LOOK);
    }
}
