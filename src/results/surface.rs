//! Contents of `surface.json`.

use serde::Serialize;

use super::{Conclusion, MaskFacts};
use crate::number::{fixed, with_sigma};
use epirig_surface::conformity::Conformity;
use epirig_surface::{
    Budget, Depth, DepthAtMargin, DepthOnPlateaus, Filters, Part, Rectangle, Roughness, ScaleSigma, Trend,
};

/// Contents of `surface.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SurfaceSummary {
    /// Version of the record, that of [`ResultsKind::Surface`](super::ResultsKind).
    pub format: u32,
    /// Version of the program.
    pub program: String,
    /// Uid of the sequence.
    pub sequence_uid: String,
    /// Hash of the `match.json` of the results whose heights these are.
    pub matched_blake3: String,
    /// The answer in words.
    pub conclusion: Conclusion,
    /// Whether the surface conforms to its limits; `None` without limits.
    #[cfg_attr(test, ts(type = "unknown"))]
    pub conformity: Option<Conformity>,
    /// How the scan had ended when it was matched, as in `match.json`.
    pub scan_ended: String,
    /// Distance that is the zero of heights, in mm.
    pub distance_mm: f64,
    /// Width of a pixel at that distance, in mm.
    pub pixel_mm: f64,
    /// Column and row where x and y in mm are zero: those of the principal point.
    pub origin_px: (f64, f64),
    /// Relative standard uncertainties of the scale. All lengths along the optical axis share both of them; those along
    /// the picture share that of the baseline alone, because Z / f = b / |d|.
    #[cfg_attr(test, ts(type = "unknown"))]
    pub scale_sigma: ScaleSigma,
    /// The heights that were used.
    pub field: FieldSummary,
    /// Form that was removed from the heights: that of the upper level if there are two, else of the whole
    /// region.
    #[cfg_attr(test, ts(type = "unknown"))]
    pub trend: Trend,
    /// Its tilt along x and y, in deg.
    pub tilt_deg: (f64, f64),
    /// Its bow over the region, in mm.
    pub bow_mm: f64,
    /// The two levels, if there are two.
    pub levels: Option<LevelsSummary>,
    /// Why there are no levels.
    pub no_levels: Option<String>,
    /// Filters of all roughness here.
    #[cfg_attr(test, ts(type = "unknown"))]
    pub filters: Filters,
    /// Roughness of the region after removal of the form and of outliers; hollows are included.
    #[cfg_attr(test, ts(as = "crate::panel::page_type_tests::Roughness"))]
    pub roughness: Roughness,
}

impl SurfaceSummary {
    /// The distance as well as the scale is known.
    pub fn distance_in_words(&self) -> String {
        let sigma_mm = self.scale_sigma.together() * self.distance_mm;
        match sigma_mm > 0.0 {
            true => with_sigma(self.distance_mm, Some(sigma_mm), "mm"),
            false => format!("{} mm", fixed(self.distance_mm, 2)),
        }
    }
}

/// Use of the heights, as in `used.png`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct FieldSummary {
    /// Region of the picture, if one was given.
    #[cfg_attr(test, ts(type = "unknown"))]
    pub region: Option<Rectangle>,
    /// Mask of the picture, if one was given; pixels must lie in both.
    pub mask: Option<MaskFacts>,
    /// Pixels of it that have a height, without those of the target.
    pub answered_px: usize,
    /// Pixels that have a height and were left out because they show the calibration's target.
    pub target_px: usize,
    /// Pixels of the largest connected region; all other numbers refer to it.
    pub used_px: usize,
    /// Pixels left out because their sigma is much larger than usual.
    pub uncertain_px: usize,
    /// Pixels left out because they are not connected to the region.
    pub apart_px: usize,
    /// Pixels left out at the rim of the region.
    pub rim_px: usize,
    /// Pixels left out because they lie far beyond the levels, with few others: outliers.
    pub outlier_px: usize,
}

/// The two levels of a surface.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct LevelsSummary {
    /// Depth of the lower level below the upper, with the interval by its scatter alone.
    #[cfg_attr(test, ts(as = "crate::panel::page_type_tests::Depth"))]
    pub depth: Depth,
    /// All contributions to its uncertainty, and their sum.
    #[cfg_attr(test, ts(as = "crate::panel::page_type_tests::Budget"))]
    pub budget: Budget,
    /// Whether each half of the frames was measured on the levels that the other half shows. Otherwise the heights
    /// were divided by themselves, and the depth is too large.
    pub by_halves: bool,
    /// Whether parts rise from the lower level.
    pub raised: bool,
    /// Distance from the walls that was left out, in px.
    pub margin_px: usize,
    /// Depth at other distances. If it still grows, windows reach across the walls.
    #[cfg_attr(test, ts(type = "unknown"))]
    pub by_margin: Vec<DepthAtMargin>,
    /// Depth on the plateaus of ISO 5436-1, if parts are wide enough for them.
    #[cfg_attr(test, ts(type = "unknown"))]
    pub on_plateaus: Option<DepthOnPlateaus>,
    /// Width of the walls from 10 % to 90 % of the depth, in mm, to about a pixel: that of the object's walls, of blur and
    /// windows together.
    pub wall_width_mm: Option<f64>,
    /// Errors of pixels further apart than this are independent, in px.
    pub correlation_reach_px: usize,
    /// Roughness of the levels away from the walls, with the noise that sigma predicts.
    #[cfg_attr(test, ts(as = "Option<crate::panel::page_type_tests::Roughness>"))]
    pub roughness: Option<Roughness>,
    /// Roughness of the upper level alone, away from the walls.
    #[cfg_attr(test, ts(as = "Option<crate::panel::page_type_tests::Roughness>"))]
    pub upper: Option<Roughness>,
    /// Roughness of the lower level alone, away from the walls.
    #[cfg_attr(test, ts(as = "Option<crate::panel::page_type_tests::Roughness>"))]
    pub lower: Option<Roughness>,
    /// Each part.
    #[cfg_attr(test, ts(as = "Vec<crate::panel::page_type_tests::Part>"))]
    pub parts: Vec<Part>,
}

impl LevelsSummary {
    /// What heights that scatter much more about their levels than sigma explains may mean; `None` if they do not.
    pub fn misfit(&self) -> Option<String> {
        /// Above this, three quarters of the variance are no noise.
        const UNEXPLAINED: f64 = 2.0;
        let rough = self.roughness.as_ref()?;
        let noise_mm = rough.sq_noise_mm.filter(|noise_mm| rough.sq_mm > UNEXPLAINED * noise_mm)?;
        Some(format!(
            "heights lie {:.4} mm off their levels (RMS), sigma explains {noise_mm:.4} mm: the surface is rough, has more \
             than two levels, sloping walls, or a form that the trend does not describe; look at height.png",
            rough.sq_mm
        ))
    }
}
