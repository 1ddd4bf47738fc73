//! The decision about each pixel's answer after the fit.

use rayon::prelude::*;

use super::Validity;
use crate::candidates::DisparityRange;
use crate::maps::{DisparityMaps, OrderingUsed};
use crate::options::MatchOptions;
use epirig_core::grid::Grid;

/// By what it is decided.
pub(crate) struct ValidityRule<'a> {
    /// Disparities that were searched.
    pub(crate) range: DisparityRange,
    pub(crate) ordering: OrderingUsed,
    pub(crate) options: &'a MatchOptions,
}

impl ValidityRule<'_> {
    /// Decides about each pixel's answer after the fit, and removes the numbers of pixels without one.
    pub(crate) fn pass(&self, maps: &mut DisparityMaps, outliers: Option<&Grid<bool>>) {
        let columns = maps.validity.columns();
        let DisparityMaps { disparity, sigma, validity, confidence, .. } = maps;
        let rows =
            validity.values_mut().par_chunks_mut(columns).zip(disparity.values_mut().par_chunks_mut(columns));
        let rows = rows.zip(sigma.values_mut().par_chunks_mut(columns));
        rows.enumerate().for_each(|(y, ((answers, disparities), sigmas))| {
            let confidences = confidence.row(y);
            for (x, validity) in answers.iter_mut().enumerate() {
                let outlier = outliers.is_some_and(|outliers| outliers.at(x, y));
                if *validity == Validity::Found {
                    *validity = self.of_fitted(disparities[x], sigmas[x], outlier, confidences[x]);
                }
                if *validity != Validity::Found {
                    (disparities[x], sigmas[x]) = (f32::NAN, f32::NAN);
                }
            }
        });
    }

    fn of_fitted(&self, disparity_px: f32, sigma_px: f32, outlier: bool, confidence: f32) -> Validity {
        let ambiguous = f64::from(confidence) < self.options.min_confidence;
        // The fit may leave the candidates, but not the range by more than a step of it can.
        let disparity = f64::from(disparity_px);
        let outside = disparity < self.range.minimum_px - 1.0 || disparity > self.range.maximum_px + 1.0;
        if sigma_px.is_nan() || f64::from(sigma_px) > self.options.max_sigma_px {
            Validity::NoTexture
        } else if outlier {
            Validity::Occluded
        } else if outside {
            Validity::BeyondRange
        } else if self.ordering == OrderingUsed::Off && ambiguous {
            Validity::Ambiguous
        } else {
            Validity::Found
        }
    }
}
