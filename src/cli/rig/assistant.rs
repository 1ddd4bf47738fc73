//! Arranging what is in front of the camera.

use std::io::{BufRead, IsTerminal};

use crate::capture::{Arrangement, Assistant};
use crate::cli::Talk;
use crate::cli::progress::tell;
use epirig_devices::camera::{Camera, ViewSwitch};

/// The person at the terminal, or the simulation.
pub(in crate::cli) struct Hands<'a> {
    pub(in crate::cli) talk: &'a Talk,
    /// Selects what a simulated camera sees.
    pub(in crate::cli) view: Option<ViewSwitch>,
}

impl Assistant for Hands<'_> {
    fn is_there(&self) -> bool {
        self.view.is_some() || !self.talk.has_caller() && std::io::stdin().is_terminal()
    }

    fn arrange(&mut self, arrangement: Arrangement, _camera: &mut dyn Camera) -> bool {
        if let Some(view) = &self.view {
            view.put(arrangement.simulated());
            return true;
        }
        self.talk.aside(|| {
            tell(&format!("place {}, then press Enter", arrangement.words()));
            std::io::stdin().lock().read_line(&mut String::new()).is_ok_and(|bytes| bytes > 0)
        })
    }
}
