//! What a scan works with.

use super::PauseSwitch;
use epirig_core::progress::Progress;
use epirig_devices::camera::Camera;
use epirig_devices::stage::StageSource;

/// What is to be in front of the camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrangement {
    /// The object that is measured.
    Object,
    /// No light: a cap on the lens.
    Dark,
    /// A uniform target that fills the view.
    Flat,
    /// A chess-board that is held before the camera.
    Board {
        /// Which of its poses, from 0.
        pose: usize,
        /// How many there are.
        poses: usize,
    },
}

/// Where in the picture the board is held: a lens is known only where it was seen through.
const PLACES: [&str; 9] = [
    "in the middle of the picture",
    "in its upper left corner",
    "in its lower right corner",
    "in its upper right corner",
    "in its lower left corner",
    "at its upper edge",
    "at its lower edge",
    "at its left edge",
    "at its right edge",
];
/// How it is tilted: boards that face the camera do not tell focal length from distance.
const TILTS: [&str; 4] = ["left side", "upper side", "right side", "lower side"];

impl Arrangement {
    /// What a person has to do.
    pub fn words(self) -> String {
        match self {
            Self::Object => "the object in its place".to_owned(),
            Self::Dark => "the cap on the lens".to_owned(),
            Self::Flat => "a uniform white target in front of the camera".to_owned(),
            Self::Board { pose, poses } => format!(
                "the chess-board before the camera and hold it still, pose {} of {poses}: all of its squares in view, {}, its {} tilted \
                 towards the camera by some 30 degrees",
                pose + 1,
                PLACES[pose % PLACES.len()],
                TILTS[pose % TILTS.len()]
            ),
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn poses_are_told_one_by_one_and_differ() {
        let words: BTreeSet<String> = (0..20)
            .map(|pose| {
                let words = Arrangement::Board { pose, poses: 20 }.words();
                assert!(words.contains(&format!("pose {} of 20:", pose + 1)), "{words}");
                words.split_once(": ").unwrap().1.to_owned()
            })
            .collect();
        assert_eq!(words.len(), 20);
        // Eight are enough for tilts to all sides, and for the middle, all corners and three edges.
        for word in TILTS.iter().chain(&PLACES[..8]) {
            let told = (0..8).any(|pose| Arrangement::Board { pose, poses: 8 }.words().contains(word));
            assert!(told, "{word}");
        }
    }
}
