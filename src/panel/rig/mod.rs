//! The rig in the panel: its owner, its camera and its stage.

mod camera;
mod controls;
mod light;
mod owner;
mod profile;
mod stage;

use std::sync::Arc;
use std::thread::{JoinHandle, spawn};

use super::shared::Shared;

pub(super) use controls::controls;
pub(super) use profile::{FormMistake, change_profile, profile_form, save_profile};

/// Starts the thread that owns the rig, and the one that looks at its pictures.
pub(super) fn start(shared: &Arc<Shared>) -> [JoinHandle<()>; 2] {
    let (owned, watched) = (Arc::clone(shared), Arc::clone(shared));
    [spawn(move || owner::own(&owned)), spawn(move || light::watch(&watched))]
}
