//! What is to be searched.

use crate::candidates::DisparityRange;
use crate::lines::{EpiLines, SeenRule};
use crate::maps::OrderingUsed;
use crate::options::MatchOptions;
use epirig_core::progress::Progress;
use epirig_core::volume::Volume;

/// What is to be searched.
#[derive(Clone, Copy)]
pub(crate) struct Task<'a> {
    /// The frames.
    pub(crate) volume: &'a Volume,
    /// The lines through the pixels of the reference frame.
    pub(crate) lines: &'a EpiLines,
    /// Disparities.
    pub(crate) range: DisparityRange,
    /// The ordering to be applied.
    pub(crate) ordering: OrderingUsed,
    /// By which candidates are seen.
    pub(crate) rule: SeenRule,
    /// The caller's choices.
    pub(crate) options: &'a MatchOptions,
    /// Who is told of it, and may cancel it.
    pub(crate) progress: &'a dyn Progress,
}
