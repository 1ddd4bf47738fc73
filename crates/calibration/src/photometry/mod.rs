//! Photometric calibration: dark level, defective pixels, flat field (vignetting), flicker of the lamp,
//! linearity.
//!
//! A frame is corrected as (value - dark) / gain, where the gain is that of lens and pixel as flat frames
//! show it, with mean 1. [`Photometry`] is the record of what was found; the rectifier applies its
//! [`Correction`] to frames.

mod average;
mod cross_validation;
mod dark;
mod error;
mod flat_checks;
mod flat_field;
mod frame_gain;
mod grid;
mod linearity;
mod outliers;
mod polynomial;
mod record;
#[cfg(test)]
mod tests;
mod windows;

pub use cross_validation::{Trial, TrialModel};
pub use dark::{DarkFrame, DarkModel, DarkRecord, dark_frame};
pub use error::PhotometryError;
pub use flat_field::{FlatField, FlatMethod, FlatModel, flat_field};
pub use frame_gain::{FrameGains, GainError, dominant_disparity, frame_gains};
pub use grid::CellGrid;
pub use linearity::{ExposureLevel, Linearity, LinearityError, linearity};
pub(crate) use outliers::nearest_good;
pub use outliers::{Outlier, OutlierKind};
pub use polynomial::{Cell, HIGHEST_ORDER, Polynomial};
pub use record::{Correction, Maps, Outcome, Photometry, PhotometryOptions};
