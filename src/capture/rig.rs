//! The parts of a rig that a scan uses.

use super::{PauseSwitch, ScanWatcher};
use epirig_core::progress::Progress;
use epirig_devices::camera::{Camera, SimView};
use epirig_devices::stage::StageSource;

/// The arrangement in front of the camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrangement {
    /// The measured object.
    Object,
    /// No light: the cap on the lens.
    Dark,
    /// A uniform target that fills the view.
    Flat,
    /// A hand-held chess-board.
    Board {
        /// Index of the pose, from 0.
        pose: usize,
        /// Number of poses.
        poses: usize,
    },
}

/// Where the board is held in the picture: the lens is calibrated only where corners were seen.
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
/// How the board is tilted: boards that face the camera do not separate focal length from distance.
const TILTS: [&str; 4] = ["left side", "upper side", "right side", "lower side"];

impl Arrangement {
    /// What a simulated camera sees then.
    pub fn simulated(self) -> SimView {
        match self {
            Self::Object => SimView::Scene,
            Self::Dark => SimView::Dark,
            Self::Flat => SimView::Flat,
            Self::Board { pose, .. } => SimView::Board(pose),
        }
    }

    /// The arrangement as an instruction for the operator.
    pub fn words(self) -> String {
        match self {
            Self::Object => "the object in its place".to_owned(),
            Self::Dark => "the cap on the lens".to_owned(),
            Self::Flat => "a uniform white target in front of the camera".to_owned(),
            Self::Board { pose, poses } => format!(
                "the chess-board in front of the camera, held still, pose {} of {poses}: all of its squares in view, {}, its {} tilted \
                 towards the camera by some 30 degrees",
                pose + 1,
                PLACES[pose % PLACES.len()],
                TILTS[pose % TILTS.len()]
            ),
        }
    }
}

/// The operator, who changes what is in front of the camera.
pub trait Assistant {
    /// Whether an operator is present.
    fn is_there(&self) -> bool;

    /// Asks for an arrangement; returns whether it is confirmed. Meanwhile it may look through the camera.
    fn arrange(&mut self, arrangement: Arrangement, camera: &mut dyn Camera) -> bool;
}

/// No operator: only the object can be in front of the camera.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unattended;

impl Assistant for Unattended {
    fn is_there(&self) -> bool {
        false
    }

    fn arrange(&mut self, arrangement: Arrangement, _camera: &mut dyn Camera) -> bool {
        arrangement == Arrangement::Object
    }
}

/// A rig, its operator, and the listeners to its progress.
pub struct Rig<'a> {
    /// Source of connections to the stage.
    pub stages: &'a mut dyn StageSource,
    /// The camera.
    pub camera: &'a mut dyn Camera,
    /// The operator.
    pub assistant: &'a mut dyn Assistant,
    /// Asks the scan to end after a frame.
    pub pause: PauseSwitch,
    /// Receives the progress.
    pub progress: &'a dyn Progress,
    /// Is told of every frame.
    pub watcher: &'a dyn ScanWatcher,
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
