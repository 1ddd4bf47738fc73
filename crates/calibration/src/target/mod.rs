//! Chess-board targets: found in frames to a hundredth of a pixel, labelled, followed through a sequence, and
//! printed.
//!
//! A board is named by its inner corners, columns x rows, as in OpenCV. [`find_boards`] finds boards in one
//! frame, [`track`] labels the corners in all frames of a sequence, [`mod@print`] makes the sheet.

mod board;
mod detect;
mod error;
mod find;
mod label;
mod lattice;
pub mod print;
mod refine;
mod sampling;
mod shown;
#[cfg(test)]
mod tests;
mod tracks;

pub use board::{BoardCorner, ChessBoard, FoundBoard, Target};
pub use error::TargetError;
pub use find::find_boards;
pub use refine::{Corner, EdgeCross, refine_corner};
pub use shown::{OtherSize, other_size};
pub use tracks::{Observation, TrackedCorner, Tracks, track};
