//! The rig in the panel: its owner, its camera and its stage.

mod camera;
mod controls;
mod light;
mod owner;
mod profile;
mod stage;

use std::io;
use std::sync::Arc;
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use super::shared::SharedState;

pub(super) use controls::{Controls, controls};
pub(super) use profile::{ProfileMistake, change_profile, profile_form, save_profile};

/// Starts the thread that owns the rig, the one that looks at its pictures, and the one that frees the control of
/// pages that have gone.
///
/// # Errors
/// What the system says if it allows no threads.
pub(super) fn start(shared: &Arc<SharedState>) -> io::Result<Vec<JoinHandle<()>>> {
    let works: [fn(&Arc<SharedState>); 3] = [light::watch, |shared| free_control(shared), owner::own];
    let begin = |work: fn(&Arc<SharedState>)| {
        let shared = Arc::clone(shared);
        Builder::new().spawn(move || work(&shared))
    };
    works.into_iter().map(begin).collect::<io::Result<_>>().inspect_err(|_| shared.end())
}

/// Frees the control of pages that have gone, until the panel ends.
fn free_control(shared: &SharedState) {
    /// Time between two looks.
    const LOOK: Duration = Duration::from_millis(250);
    while !shared.is_ending() {
        shared.control(|controller| controller.release(Instant::now()));
        std::thread::sleep(LOOK);
    }
}
