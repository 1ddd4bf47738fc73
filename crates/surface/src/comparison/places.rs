//! Where a difference is significant.

use serde::Serialize;

use crate::connected::connected;
use epirig_core::grid::Grid;

/// A difference of more than this many sigma is significant: of a thousand unchanged pixels, three are.
const SIGNIFICANT: f32 = 3.0;
/// Smaller places are not listed, in px: errors of neighbours within a window of the matcher are shared, so noise
/// makes such places.
const LEAST_PX: usize = 25;

/// A connected region in which the difference is significant and has one sign.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Place {
    /// Its middle: column and row of the first map, in px.
    pub centre_px: (f64, f64),
    /// Its pixels.
    pub area_px: usize,
    /// Its area, in mm^2.
    pub area_mm2: f64,
    /// Mean difference, in mm.
    pub mean_mm: f64,
    /// The difference that is farthest from zero, in mm.
    pub largest_mm: f64,
    /// Difference times area, in mm^3.
    pub volume_mm3: f64,
}

/// All places, the largest volume first, for pixels of this width.
pub(super) fn places(difference_mm: &Grid<f32>, sigma_mm: &Grid<f32>, pixel_mm: f64) -> Vec<Place> {
    let mut signs = Grid::filled(difference_mm.rows(), difference_mm.columns(), 0_i8);
    let pairs = difference_mm.values().iter().zip(sigma_mm.values());
    for (sign, (&difference, &sigma)) in signs.values_mut().iter_mut().zip(pairs) {
        // Unknown pixels are neither.
        *sign = i8::from(difference > SIGNIFICANT * sigma) - i8::from(difference < -SIGNIFICANT * sigma);
    }
    let parts = connected(&signs, |sign| sign != 0);
    let large = parts.into_iter().filter(|part| part.pixels.len() >= LEAST_PX);
    let mut places: Vec<Place> = large
        .map(|part| {
            let count = part.pixels.len() as f64;
            let values = || part.pixels.iter().map(|&(x, y)| f64::from(difference_mm.at(x, y)));
            let sum: f64 = values().sum();
            let middle = |of: fn(&(usize, usize)) -> usize| {
                part.pixels.iter().map(|pixel| of(pixel) as f64).sum::<f64>() / count
            };
            Place {
                centre_px: (middle(|pixel| pixel.0), middle(|pixel| pixel.1)),
                area_px: part.pixels.len(),
                area_mm2: count * pixel_mm * pixel_mm,
                mean_mm: sum / count,
                largest_mm: values()
                    .fold(0.0, |most: f64, value| if value.abs() > most.abs() { value } else { most }),
                volume_mm3: sum * pixel_mm * pixel_mm,
            }
        })
        .collect();
    places.sort_by(|a, b| b.volume_mm3.abs().total_cmp(&a.volume_mm3.abs()));
    places
}
