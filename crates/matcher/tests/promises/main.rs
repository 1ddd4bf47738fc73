//! What the matcher promises, against truth from closed formulas and from the simulator.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

mod accuracy;
mod first_look;
mod hollow_depth;
mod honest_sigma;
mod hundredth_of_a_pixel;
mod occlusions;
mod painted;
mod painted_scenes;
mod promises;
mod repetitive_texture;
mod shown;
mod stack;
mod turned;

use epirig_matcher::{MatchOptions, ReferenceFrame};

/// The usual options for the pixels of the first frame, as in the paper: what is promised of single pixels was
/// measured there.
fn of_first_frame() -> MatchOptions {
    MatchOptions { reference: ReferenceFrame::First, ..MatchOptions::default() }
}
