//! The result of a match: maps of disparity, sigma, cost, confidence and the kind of answer.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::candidates::DisparityRange;
use super::light_change::LightChange;
use super::locking::PixelLocking;
use super::validity::Validity;
use epirig_core::grid::Grid;

epirig_core::choices! {
    /// Whether the ordering constraint was applied.
    pub enum OrderingUsed {
        /// The mapping from the first to the last frame increases strictly.
        On = "on",
        /// Each pixel took its best candidate.
        Off = "off",
    }
}

/// The matcher's result: maps of rows x columns over the pixels of the reference frame. Records (serde) have all but
/// the maps, which have no pixels when it is read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct DisparityMaps {
    /// Disparity in px over the whole baseline, signed; NaN where there is no answer.
    #[serde(skip, default = "no_pixels")]
    pub disparity: Grid<f32>,
    /// Standard deviation of the disparity in px, from the residuals of the fit; NaN where there is no
    /// answer.
    #[serde(skip, default = "no_pixels")]
    pub sigma: Grid<f32>,
    /// Cost of the candidate that the search chose, of means of 2 x 2 pixels with
    /// [`MatchOptions::quick`](super::MatchOptions::quick): DN^2 for the variance (of normalised frames: 1/1024 of the
    /// local variance), 1 - correlation otherwise; NaN where it has none.
    #[serde(skip, default = "no_pixels")]
    pub cost: Grid<f32>,
    /// Confidence of the chosen candidate against the best one elsewhere, 0 to 1; NaN where it has no cost or
    /// no rival.
    #[serde(skip, default = "no_pixels")]
    pub confidence: Grid<f32>,
    /// Whether there is an answer, and if not, why.
    #[serde(skip, default = "no_answers")]
    pub validity: Grid<Validity>,
    /// Index of the reference frame.
    pub reference: usize,
    /// The disparities that were searched.
    pub range: DisparityRange,
    /// Whether `range` was found from the data.
    pub range_found: bool,
    /// Whether the ordering constraint was applied.
    pub ordering: OrderingUsed,
    /// The effect of pixel locking; its bias is a part of each sigma. `None` if nothing was fitted, or too
    /// few frames, rows or points show it.
    pub locking: Option<PixelLocking>,
    /// How the light changed, which is taken off; `None` if nothing was fitted or nothing shows it.
    pub light: Option<LightChange>,
}

impl DisparityMaps {
    /// Share of the pixels with this answer, 0 to 1.
    pub fn share(&self, validity: Validity) -> f64 {
        let count = self.validity.values().iter().filter(|&&value| value == validity).count();
        count as f64 / self.validity.values().len().max(1) as f64
    }

    /// The maps of these rows alone.
    ///
    /// # Panics
    /// If a row lies outside the maps.
    #[must_use]
    pub fn of_rows(self, rows: Range<usize>) -> Self {
        if rows == (0..self.disparity.rows()) {
            return self;
        }
        let columns = 0..self.disparity.columns();
        let cut = |map: &Grid<f32>| map.cropped(columns.clone(), rows.clone());
        Self {
            disparity: cut(&self.disparity),
            sigma: cut(&self.sigma),
            cost: cut(&self.cost),
            confidence: cut(&self.confidence),
            validity: self.validity.cropped(columns.clone(), rows.clone()),
            ..self.without_pixels()
        }
    }

    /// Puts the rows of `part` in, the first at row `y`.
    pub(super) fn put_rows(&mut self, y: usize, part: &Self) {
        self.disparity.put_rows(y, &part.disparity);
        self.sigma.put_rows(y, &part.sigma);
        self.cost.put_rows(y, &part.cost);
        self.confidence.put_rows(y, &part.confidence);
        self.validity.put_rows(y, &part.validity);
    }

    /// The same without pixels.
    #[must_use]
    pub fn without_pixels(&self) -> Self {
        Self {
            disparity: no_pixels(),
            sigma: no_pixels(),
            cost: no_pixels(),
            confidence: no_pixels(),
            validity: no_answers(),
            ..*self
        }
    }

    /// Number of neighbouring answered pixels in a row whose order in the first or the last frame, at
    /// `tau_before` before and `tau_after` after the reference, is not that in the reference frame.
    pub fn order_violations(&self, tau_before: f64, tau_after: f64) -> usize {
        let violates = |pair: &[f32]| {
            let step = f64::from(pair[1] - pair[0]);
            1.0 + step * tau_after <= 0.0 || 1.0 - step * tau_before <= 0.0
        };
        let rows = 0..self.disparity.rows();
        rows.map(|y| self.disparity.row(y).windows(2).filter(|pair| violates(pair)).count()).sum()
    }
}

fn no_pixels() -> Grid<f32> {
    Grid::filled(0, 0, f32::NAN)
}

fn no_answers() -> Grid<Validity> {
    Grid::filled(0, 0, Validity::Outside)
}
