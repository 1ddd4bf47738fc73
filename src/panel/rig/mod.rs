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

use super::shared::Shared;

pub(super) use controls::controls;
pub(super) use profile::{FormMistake, change_profile, profile_form, save_profile};

/// Starts the thread that owns the rig, and the one that looks at its pictures.
///
/// # Errors
/// What the system says if it allows no threads.
pub(super) fn start(shared: &Arc<Shared>) -> io::Result<Vec<JoinHandle<()>>> {
    let (owned, watched) = (Arc::clone(shared), Arc::clone(shared));
    let watcher = Builder::new().spawn(move || light::watch(&watched))?;
    let owner = Builder::new().spawn(move || owner::own(&owned)).inspect_err(|_| shared.end())?;
    Ok(vec![owner, watcher])
}
