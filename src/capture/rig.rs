//! What a scan works with.

use super::PauseSwitch;
use crate::camera::Camera;
use crate::progress::Progress;
use crate::stage::StageSource;

/// What is to be in front of the camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrangement {
    /// The object that is measured.
    Object,
    /// No light: a cap on the lens.
    Dark,
    /// A uniform target that fills the view.
    Flat,
}

impl Arrangement {
    /// What a person has to do.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Object => "the object in its place",
            Self::Dark => "the cap on the lens",
            Self::Flat => "a uniform white target in front of the camera",
        }
    }
}

/// Whoever puts things in front of the camera.
pub trait Assistant {
    /// Whether anybody is there to be asked.
    fn is_there(&self) -> bool;

    /// Puts it there, and tells whether it is there now.
    fn arrange(&mut self, arrangement: Arrangement) -> bool;
}

/// Nobody: only the object is there.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unattended;

impl Assistant for Unattended {
    fn is_there(&self) -> bool {
        false
    }

    fn arrange(&mut self, arrangement: Arrangement) -> bool {
        arrangement == Arrangement::Object
    }
}

/// A rig, and whoever watches it.
pub struct Rig<'a> {
    /// Where the stage comes from.
    pub stages: &'a mut dyn StageSource,
    /// The camera.
    pub camera: &'a mut dyn Camera,
    /// Who puts things in front of it.
    pub assistant: &'a mut dyn Assistant,
    /// Who may end the scan after a frame.
    pub pause: PauseSwitch,
    /// Who is told how far it is.
    pub progress: &'a dyn Progress,
}
