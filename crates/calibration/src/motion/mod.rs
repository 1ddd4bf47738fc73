//! Whether frames show one scene that moves along their rows, in their order.
//!
//! Frames are made small. Blocks of each are looked for in others: their shifts tell which frames show one scene,
//! whither it moves, and whether it moves at all. Only blocks that move count, because a background may stand still.
//! Where shifts between neighbours do not agree, the frames are ordered by likeness. That is told only if shifts in
//! the new order agree. Where nothing is wrong so far, points are followed through all frames: they tell the direction
//! to hundredths of a degree, and each step. What cannot be measured is not told.

mod along;
mod blocks;
mod doubt;
mod judge;
mod order;
mod reduced;
#[cfg(test)]
mod tests;

use crate::texture_motion;
pub use doubt::{Doubt, Motion};
use epirig_core::frame::Frame;
use judge::Judge;
use reduced::Reduced;

/// Longest side of the frames that are held, for up to so many of them.
const SIZES: [(usize, usize); 2] = [(400, 512), (1600, 256)];

/// Collects frames, and judges all of them.
#[derive(Debug)]
pub struct MotionCheck {
    longest: usize,
    frames: Vec<Reduced>,
}

impl MotionCheck {
    /// A check of so many frames.
    pub fn new(count: usize) -> Self {
        let fitting = SIZES.iter().find(|(most, _)| count <= *most).or(SIZES.last());
        Self { longest: fitting.map_or(0, |(_, longest)| *longest), frames: Vec::new() }
    }

    /// Bytes that a check of so many frames holds at most.
    pub fn need(count: usize) -> u64 {
        let longest = Self::new(count).longest;
        // One picture, and one of half its size, as 32-bit floats; and what following points through them takes.
        let held = 5 * (longest * longest * count.min(SIZES[SIZES.len() - 1].0)) as u64;
        held + texture_motion::need(count.min(along::MOST_FRAMES), longest, longest)
    }

    /// Takes the next frame. Frames beyond the first 1600 are not looked at.
    pub fn look(&mut self, frame: &Frame) {
        if self.frames.len() < SIZES[SIZES.len() - 1].0 {
            self.frames.push(Reduced::of(frame, self.longest));
        }
    }

    /// What was seen of frames that are taken to stand at `places`, in any unit, in the order of the frames;
    /// in equal steps if that is `None`.
    pub fn motion(&self, places: Option<&[f64]>) -> Motion {
        Judge::new(&self.frames).motion(places)
    }

    /// The frames in the order of the motion, as far as their likeness tells it.
    pub fn order(&self) -> Vec<usize> {
        Judge::new(&self.frames).order()
    }
}
