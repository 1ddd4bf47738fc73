//! What is looked at.

use epirig_core::grid::Grid;

/// Frames of one scene, as numbers.
pub trait Frames: Sync {
    /// Number of frames.
    fn count(&self) -> usize;
    /// Their rows and columns.
    fn size(&self) -> (usize, usize);
    /// Frame `index`, in DN of 8 bit; means over squares of `factor` pixels.
    fn picture(&self, index: usize, factor: usize) -> Grid<f32>;
    /// Whether nobody waits for the motion any more.
    fn cancelled(&self) -> bool {
        false
    }
}
