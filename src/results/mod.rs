//! The folder of results, written as a whole or not at all.

mod classes;
mod conclusion;
mod error;
mod files;
mod kind;
mod maps;
mod mismatch;
pub(crate) mod names;
mod place;
mod read;
mod region;
mod surface;
mod verdict;
mod write;
mod writer;

use serde::{Deserialize, Serialize};

pub use classes::{ANSWER_CLASSES, Class, USED_CLASSES, class_of, reason};
pub use conclusion::{Conclusion, SurfaceFacts, read_surface_facts, scale_in_words};
pub use error::ResultsError;
pub use files::{CompareFacts, ResultFiles};
pub use kind::ResultsKind;
pub use maps::{Look, MapRow, ResultMap};
pub use mismatch::ResultsMismatch;
pub use read::{read_map, record_hash, results_beside};
pub use region::{Mask, MaskError, MaskFacts, Region, parse_mask, read_mask};
pub use surface::{FieldSummary, LevelsSummary, SurfaceSummary};
pub(crate) use verdict::{judged_name, judged_value};
pub use write::{ResultsFolder, encoded_picture};

use epirig_matcher::{
    DisparityRange, LightChange, LockingAmplitudes, LockingHarmonic, MatchOptions, OrderingConstraint,
    OrderingUsed, PixelLocking, ReferenceFrame, Validity,
};
use epirig_surface::Rectangle;

/// Pixel locking over many frames, as in [`epirig_matcher::PixelLocking`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LockingSummary {
    /// Amplitudes of the first and the second harmonic from interpolation, in px.
    pub interpolation_px: Vec<f64>,
    /// Their standard uncertainties.
    pub interpolation_sigma_px: Vec<f64>,
    /// The same from aliasing, in px.
    pub aliasing_px: Vec<f64>,
    /// Their standard uncertainties.
    pub aliasing_sigma_px: Vec<f64>,
    /// Whether the amplitudes come from lines; else they come from the texture, and biases are rough.
    pub from_lines: bool,
    /// The largest predicted bias of an answered pixel, in px.
    pub worst_bias_px: f64,
    /// The disparity with that bias, in px; `None` without a bias.
    pub worst_disparity_px: Option<f64>,
    /// Share of the answered pixels whose bias exceeds a tenth of the wanted sigma, or of their own sigma if
    /// none is wanted.
    pub share_locked: f64,
    /// Smallest and largest disparity of those pixels, in px.
    pub locked_px: Option<(f64, f64)>,
}

impl From<PixelLocking> for LockingSummary {
    fn from(locking: PixelLocking) -> Self {
        let LockingAmplitudes { harmonics, from_lines, .. } = locking.amplitudes;
        let each = |value: fn(&LockingHarmonic) -> f64| harmonics.iter().map(value).collect();
        Self {
            interpolation_px: each(|harmonic| harmonic.interpolation_px),
            interpolation_sigma_px: each(|harmonic| harmonic.interpolation_sigma_px),
            aliasing_px: each(|harmonic| harmonic.aliasing_px),
            aliasing_sigma_px: each(|harmonic| harmonic.aliasing_sigma_px),
            from_lines,
            worst_bias_px: locking.worst_bias_px,
            worst_disparity_px: locking.worst_disparity_px,
            share_locked: locking.share_locked,
            locked_px: locking.locked_px,
        }
    }
}

/// Contents of `match.json`: settings and results in numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct MatchSummary {
    /// Version of the format: that of [`ResultsKind::Match`].
    pub format: u32,
    /// Version of the program.
    pub program: String,
    /// Uid of the sequence.
    pub sequence_uid: String,
    /// How the scan ended: `complete`, `aborted`, `failed`, `not-closed` (its positions are wrong), or
    /// `unfinished`.
    pub scan_ended: String,
    /// Hash of the frames and their positions.
    pub frames_blake3: String,
    /// Hash of the calibration that corrected and rectified the frames; `None` if they were matched as
    /// captured.
    #[serde(default)]
    pub calibration: Option<String>,
    /// Source of tau: `stage`, `import`, `equal-steps` (no positions are known), `target` or `texture`.
    #[serde(default)]
    pub positions: String,
    /// Region of the picture that was asked for, if one was given.
    #[serde(default)]
    #[cfg_attr(test, ts(type = "unknown"))]
    pub region: Option<Rectangle>,
    /// Mask of the picture, if one was given; pixels were matched that lie in both.
    #[serde(default)]
    pub mask: Option<MaskFacts>,
    /// The options of the matcher, as they were asked for.
    #[cfg_attr(test, ts(type = "unknown"))]
    pub settings: MatchOptions,
    /// Index of the reference frame.
    pub reference: usize,
    /// Part of the baseline before the reference frame.
    pub tau_before: f64,
    /// Part of the baseline after it.
    pub tau_after: f64,
    /// Smallest disparity searched, in px.
    pub minimum_px: f64,
    /// Largest disparity searched, in px.
    pub maximum_px: f64,
    /// Whether the range was found from the data.
    pub range_found: bool,
    /// Whether the ordering constraint was applied.
    #[cfg_attr(test, ts(type = "unknown"))]
    pub ordering_constraint: OrderingUsed,
    /// Neighbouring pixels of the final map that change their order between the first and the last frame.
    /// Without the ordering constraint depth edges do that. With it the mapping of candidates has no
    /// violations, so they come from the fit.
    pub order_violations: usize,
    /// Share of the pixels that belong to the object: they have answers to all four sides.
    #[serde(default)]
    pub object: f64,
    /// Share of the object's pixels with an answer.
    #[serde(default)]
    pub object_answered: f64,
    /// Share of the pixels with an answer.
    pub answered: f64,
    /// Share of the pixels whose line is in view in too few frames.
    pub leaves_image: f64,
    /// Share of the pixels whose best candidate is at an end of the range.
    pub beyond_range: f64,
    /// Share of the pixels whose sigma exceeds the limit: too little texture, or no line fits.
    pub no_texture: f64,
    /// Share of the pixels with several equally good candidates.
    pub ambiguous: f64,
    /// Share of the pixels that are occluded in too many frames.
    pub occluded: f64,
    /// Share of the pixels outside region or mask, which were not asked for.
    #[serde(default)]
    pub outside: f64,
    /// Median disparity of the answered pixels, in px; `None` if there are none.
    pub median_disparity_px: Option<f64>,
    /// Median sigma of the answered pixels, in px.
    pub median_sigma_px: Option<f64>,
    /// Pixel locking; absent if it could not be measured.
    #[serde(default)]
    #[cfg_attr(test, ts(type = "unknown"))]
    pub pixel_locking: Option<LockingSummary>,
    /// How the light changed, which is taken off; absent if nothing shows it.
    #[cfg_attr(test, ts(type = "unknown"))]
    pub light: Option<LightChange>,
    /// Distance that is the zero of heights, in mm, if the geometry is known.
    pub distance_mm: Option<f64>,
    /// Duration of the matching, in s.
    pub seconds: f64,
}

impl MatchSummary {
    /// The options with what was found for those that were left open: a match with them does the same again.
    pub fn options(&self) -> MatchOptions {
        MatchOptions {
            range: Some(DisparityRange { minimum_px: self.minimum_px, maximum_px: self.maximum_px }),
            reference: ReferenceFrame::Index(self.reference),
            ordering_constraint: match self.ordering_constraint {
                OrderingUsed::On => OrderingConstraint::On,
                OrderingUsed::Off => OrderingConstraint::Off,
            },
            ..self.settings.clone()
        }
    }

    /// Share of the pixels with this answer, 0 to 1.
    pub fn share(&self, validity: Validity) -> f64 {
        match validity {
            Validity::Found => self.answered,
            Validity::LeavesImage => self.leaves_image,
            Validity::BeyondRange => self.beyond_range,
            Validity::NoTexture => self.no_texture,
            Validity::Occluded => self.occluded,
            Validity::Ambiguous => self.ambiguous,
            Validity::Outside => self.outside,
        }
    }
}
