//! S-filter and L-filter: the areal Gaussian filter of ISO 16610-61.
//!
//! Pixels without a height have no weight, and the weights of the others are divided by their sum (the
//! Gaussian regression of ISO 16610-31 and -71 of order zero, without its robust weights). The same rule holds
//! at the rim. There the mean follows a slope less closely, so the form should be removed first.

use rayon::prelude::*;
use serde::Serialize;

use super::SurfaceError;
use super::roughness::{Roughness, roughness};
use epirig_core::grid::Grid;

/// The constant of ISO 16610-61, sqrt(ln 2 / pi): a wave as long as the cut-off keeps half its amplitude.
const ALPHA: f64 = 0.469_718_639_349_825_6;
/// Weights up to this many cut-offs away count. What is left out of them is 1e-7 of their sum.
const REACH: f64 = 1.0;
/// A cut-off is at least this many pixels: ISO 25178-3 wants sampling at a third of the S-filter's.
const LEAST_PX: f64 = 3.0;

/// The cut-offs (nesting indices) of both filters.
///
/// The default is no filter. Then the parameters belong to the S-F surface, whose S-filter is the matcher's
/// window. ISO 25178-3 leaves the cut-offs to the drawing of the part.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Filters {
    /// Cut-off of the S-filter in mm, which removes shorter waves (noise); `None` for no filter.
    pub s_filter_mm: Option<f64>,
    /// Cut-off of the L-filter in mm, which removes longer waves (waviness); `None` for no filter.
    pub l_filter_mm: Option<f64>,
}

impl Filters {
    /// Refuses cut-offs that pixels of `pixel_mm` cannot show, or that leave nothing between them.
    ///
    /// # Errors
    /// [`SurfaceError::CutOff`] if a cut-off is below three pixels or not finite, or if that of the L-filter
    /// does not exceed that of the S-filter.
    pub fn check(&self, pixel_mm: f64) -> Result<(), SurfaceError> {
        let least_mm = LEAST_PX * pixel_mm;
        for (filter, cutoff_mm) in [("S-filter", self.s_filter_mm), ("L-filter", self.l_filter_mm)] {
            if let Some(cutoff_mm) = cutoff_mm.filter(|mm| !mm.is_finite() || *mm < least_mm) {
                return Err(SurfaceError::CutOff { filter, cutoff_mm, least_mm });
            }
        }
        match (self.s_filter_mm, self.l_filter_mm) {
            (Some(least_mm), Some(cutoff_mm)) if cutoff_mm <= least_mm => {
                Err(SurfaceError::CutOff { filter: "L-filter", cutoff_mm, least_mm })
            }
            _ => Ok(()),
        }
    }

    /// Whether there is any filter.
    pub fn any(&self) -> bool {
        self.s_filter_mm.is_some() || self.l_filter_mm.is_some()
    }

    /// The heights between both cut-offs: smoothed by the S-filter, without what the L-filter smooths. NaN
    /// stays NaN. `heights_mm` are rows x columns, with pixels of `pixel_mm`.
    pub fn applied(&self, heights_mm: &Grid<f32>, pixel_mm: f64) -> Grid<f32> {
        let smooth = match self.s_filter_mm {
            Some(cutoff_mm) => gaussian_mean(heights_mm, cutoff_mm / pixel_mm),
            None => heights_mm.clone(),
        };
        let Some(cutoff_mm) = self.l_filter_mm else { return smooth };
        smooth.zip_map(&gaussian_mean(&smooth, cutoff_mm / pixel_mm), |smooth, long| smooth - long)
    }

    /// Roughness of the pixels of `rest_mm` (heights without their form) that `counts` chooses, after the
    /// filters, which do not see the others; `None` if it chooses no known one.
    ///
    /// Behind an S-filter the noise is not known: it depends on how the errors of neighbours are correlated.
    pub fn roughness(
        &self,
        rest_mm: &Grid<f32>,
        sigma_mm: &Grid<f32>,
        pixel_mm: f64,
        counts: impl Fn(usize, usize) -> bool,
    ) -> Option<Roughness> {
        if !self.any() {
            return roughness(rest_mm, sigma_mm, counts);
        }
        let mut chosen = rest_mm.clone();
        for y in 0..chosen.rows() {
            for (x, height) in chosen.row_mut(y).iter_mut().enumerate() {
                if !(height.is_finite() && sigma_mm.at(x, y).is_finite() && counts(x, y)) {
                    *height = f32::NAN;
                }
            }
        }
        self.roughness_behind(&self.applied(&chosen, pixel_mm), sigma_mm)
    }

    /// Roughness of heights that have been filtered: those that [`applied`](Self::applied) gave.
    pub fn roughness_behind(&self, filtered_mm: &Grid<f32>, sigma_mm: &Grid<f32>) -> Option<Roughness> {
        let found = roughness(filtered_mm, sigma_mm, |_, _| true)?;
        let noise_is_known = self.s_filter_mm.is_none();
        Some(Roughness {
            sq_noise_mm: found.sq_noise_mm.filter(|_| noise_is_known),
            sq_without_noise_mm: found.sq_without_noise_mm.filter(|_| noise_is_known),
            ..found
        })
    }
}

/// The Gaussian mean of the known values around each known one.
fn gaussian_mean(field: &Grid<f32>, cutoff_px: f64) -> Grid<f32> {
    let weights = weights(cutoff_px, field.rows().max(field.columns()));
    let sums = smoothed(field.map(|value| if value.is_nan() { 0.0 } else { value }), &weights);
    let totals = smoothed(field.map(|value| if value.is_nan() { 0.0 } else { 1.0 }), &weights);
    let means = sums.zip_map(&totals, |sum, total| sum / total);
    field.zip_map(&means, |value, mean| if value.is_nan() { f32::NAN } else { mean })
}

/// Weights of the pixels 0, 1, 2 ... away along one axis: s(x) = exp(-pi (x / (alpha cut-off))^2), not yet
/// divided by their sum. No more than the `longest` side of the field needs.
fn weights(cutoff_px: f64, longest: usize) -> Vec<f64> {
    let reach = (REACH * cutoff_px).ceil().min(longest as f64) as usize;
    let scale = ALPHA * cutoff_px;
    (0..=reach).map(|away| (-std::f64::consts::PI * (away as f64 / scale).powi(2)).exp()).collect()
}

/// Weighted sums along rows, then along columns; there is nothing beyond the borders.
fn smoothed(field: Grid<f32>, weights: &[f64]) -> Grid<f32> {
    let (rows, columns) = (field.rows(), field.columns());
    if columns == 0 {
        return field;
    }
    let reach = weights.len() - 1;
    let mut along_rows = field.clone();
    along_rows.values_mut().par_chunks_exact_mut(columns).enumerate().for_each(|(y, row)| {
        let mut padded = vec![0.0; columns + 2 * reach];
        padded[reach..].iter_mut().zip(field.row(y)).for_each(|(padded, &value)| *padded = f64::from(value));
        let mut sums: Vec<f64> =
            padded[reach..reach + columns].iter().map(|value| weights[0] * value).collect();
        for (away, &weight) in weights.iter().enumerate().skip(1) {
            let (before, behind) = (&padded[reach - away..], &padded[reach + away..]);
            let pairs = before.iter().zip(behind);
            sums.iter_mut().zip(pairs).for_each(|(sum, (one, other))| *sum += weight * (one + other));
        }
        row.iter_mut().zip(sums).for_each(|(value, sum)| *value = sum as f32);
    });
    let mut both = field;
    both.values_mut().par_chunks_exact_mut(columns).enumerate().for_each(|(y, row)| {
        let own = along_rows.row(y);
        let mut sums: Vec<f64> = own.iter().map(|&value| weights[0] * f64::from(value)).collect();
        for (away, &weight) in weights.iter().enumerate().skip(1) {
            let above = y.checked_sub(away).map(|above| along_rows.row(above));
            let below = (y + away < rows).then(|| along_rows.row(y + away));
            match (above, below) {
                (Some(one), Some(other)) => {
                    let pairs = one.iter().zip(other).map(|(&one, &other)| f64::from(one) + f64::from(other));
                    sums.iter_mut().zip(pairs).for_each(|(sum, pair)| *sum += weight * pair);
                }
                (Some(only), None) | (None, Some(only)) => {
                    sums.iter_mut().zip(only).for_each(|(sum, &value)| *sum += weight * f64::from(value));
                }
                (None, None) => break,
            }
        }
        row.iter_mut().zip(sums).for_each(|(value, sum)| *value = sum as f32);
    });
    both
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Amplitude of a wave of `wavelength_px` in the middle of a field of 400 px, after `filters` in px.
    fn amplitude(filters: Filters, wavelength_px: f64) -> f64 {
        let wave = |x: usize| (std::f64::consts::TAU * (x as f64 - 200.0) / wavelength_px).cos();
        let values = (0..5 * 400).map(|index| wave(index % 400) as f32).collect();
        let field = Grid::from_values(5, 400, values).unwrap();
        f64::from(filters.applied(&field, 1.0).at(200, 2))
    }

    /// The transmission of ISO 16610-61 for a wave along one axis: exp(-pi (alpha cut-off / wavelength)^2).
    fn transmission(cutoff: f64, wavelength: f64) -> f64 {
        2_f64.powf(-(cutoff / wavelength).powi(2))
    }

    #[test]
    fn waves_pass_as_the_standard_says() {
        let s_filter = Filters { s_filter_mm: Some(20.0), l_filter_mm: None };
        let l_filter = Filters { s_filter_mm: None, l_filter_mm: Some(20.0) };
        for wavelength in [10.0, 20.0, 50.0, 100.0] {
            let passes = transmission(20.0, wavelength);
            // Heights are stored to 6e-8, and weights end at 1e-7.
            assert!((amplitude(s_filter, wavelength) - passes).abs() < 1e-6);
            assert!((amplitude(l_filter, wavelength) - (1.0 - passes)).abs() < 1e-6);
        }
        assert!((amplitude(s_filter, 20.0) - 0.5).abs() < 1e-6, "half of it at the cut-off");
        let both = Filters { s_filter_mm: Some(10.0), l_filter_mm: Some(40.0) };
        let passes = transmission(10.0, 20.0) * (1.0 - transmission(40.0, 20.0));
        assert!((amplitude(both, 20.0) - passes).abs() < 1e-6);
    }

    #[test]
    fn holes_and_rims_do_not_pull_a_level_surface() {
        let mut field = Grid::filled(30, 40, 2.5_f32);
        field.row_mut(10)[3..17].fill(f32::NAN);
        let filters = Filters { s_filter_mm: Some(8.0), l_filter_mm: None };
        let smooth = filters.applied(&field, 1.0);
        for (found, given) in smooth.values().iter().zip(field.values()) {
            assert!((found - given).abs() < 1e-6 || (found.is_nan() && given.is_nan()));
        }
        let rough = Filters { l_filter_mm: Some(1e9), ..filters }.applied(&field, 1.0);
        assert!(rough.values().iter().all(|height| height.is_nan() || height.abs() < 1e-6));
    }

    #[test]
    fn pixels_that_do_not_count_are_not_seen() {
        // A step of 1 mm between columns 19 and 20: each level alone is flat.
        let values = (0..40 * 40).map(|index| if index % 40 < 20 { 1.0 } else { 0.0 }).collect();
        let field = Grid::from_values(40, 40, values).unwrap();
        let sigma = Grid::filled(40, 40, 0.1);
        let filters = Filters { s_filter_mm: Some(1.0), l_filter_mm: Some(4.0) };
        let level = filters.roughness(&field, &sigma, 0.25, |x, _| x < 20).unwrap();
        assert!(level.sz_mm < 1e-6 && level.pixels == 800, "{level:?}");
        assert_eq!(level.sq_noise_mm, None);
        let whole = filters.roughness(&field, &sigma, 0.25, |_, _| true).unwrap();
        assert!(whole.sz_mm > 0.5, "{whole:?}");
        let waviness = Filters { s_filter_mm: None, ..filters };
        assert!(waviness.roughness(&field, &sigma, 0.25, |_, _| true).unwrap().sq_noise_mm.is_some());
    }

    #[test]
    fn cut_offs_that_cannot_be_are_refused() {
        let check = |s_filter_mm, l_filter_mm| Filters { s_filter_mm, l_filter_mm }.check(0.1);
        assert!(check(None, None).is_ok() && check(Some(0.31), Some(0.8)).is_ok());
        for (s, l) in [(Some(0.2), None), (None, Some(f64::NAN)), (None, Some(-1.0)), (Some(0.8), Some(0.8))]
        {
            assert!(check(s, l).is_err(), "{s:?} {l:?}");
        }
    }
}
