//! Correction of the raw samples before they are resampled.

use super::RectifyError;
use crate::photometry::{Correction, nearest_good};
use epirig_core::frame::Frame;

/// A pixel that is replaced by the mean of its neighbours.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Replaced {
    pub(super) x: usize,
    pub(super) y: usize,
    /// Columns and rows of the pixels that the mean is taken of.
    pub(super) neighbours: Vec<(usize, usize)>,
}

/// Farthest that a good neighbour may be, in px: farther off the picture is another one.
const FARTHEST_PX: usize = 3;

/// Checks sizes and values against the raw frames, and finds the neighbours of the defective pixels, in the
/// order of their rows.
pub(super) fn prepared(
    correction: &Correction,
    rows: usize,
    columns: usize,
) -> Result<Vec<Replaced>, RectifyError> {
    for (map, name) in [(&correction.subtract, "dark"), (&correction.multiply, "gain")] {
        let Some(map) = map else { continue };
        let (found, expected) = ((map.rows(), map.columns()), (rows, columns));
        if found != expected {
            return Err(RectifyError::CorrectionSize { map: name, found, expected });
        }
        if let Some(index) = map.values().iter().position(|value| !value.is_finite()) {
            return Err(RectifyError::CorrectionValue { map: name, x: index % columns, y: index / columns });
        }
    }
    let mut defective: Vec<_> = correction.defective.iter().map(|&(x, y)| (y, x)).collect();
    defective.sort_unstable();
    defective.dedup();
    let is_good = |&(x, y): &(usize, usize)| defective.binary_search(&(y, x)).is_err();
    let replaced = |&(y, x): &(usize, usize)| {
        if x >= columns || y >= rows {
            return Err(RectifyError::Defective { x, y });
        }
        nearest_good((x, y), (rows, columns), FARTHEST_PX, is_good)
            .map(|neighbours| Replaced { x, y, neighbours })
            .ok_or(RectifyError::Defective { x, y })
    };
    defective.iter().map(replaced).collect()
}

/// Row `y` of a frame, corrected; `replaced` are those that [`prepared`] found.
pub(super) fn correct_row(
    correction: &Correction,
    replaced: &[Replaced],
    frame: &Frame,
    y: usize,
    out: &mut [f32],
) {
    frame.samples().copy_to_f32(y * out.len(), out);
    if let Some(dark) = &correction.subtract {
        out.iter_mut().zip(dark.row(y)).for_each(|(value, dark)| *value -= dark);
    }
    if let Some(gain) = &correction.multiply {
        out.iter_mut().zip(gain.row(y)).for_each(|(value, gain)| *value *= gain);
    }
    replaced_in_row(replaced, y).for_each(|pixel| out[pixel.x] = mean_around(correction, frame, pixel));
}

/// The pixels of row `y` that are replaced.
pub(super) fn replaced_in_row(replaced: &[Replaced], y: usize) -> impl Iterator<Item = &Replaced> {
    let first = replaced.partition_point(|pixel| pixel.y < y);
    replaced[first..].iter().take_while(move |pixel| pixel.y == y)
}

/// What a pixel is replaced by.
pub(super) fn mean_around(correction: &Correction, frame: &Frame, pixel: &Replaced) -> f32 {
    let value = |&(x, y): &(usize, usize)| {
        let mut sample = [0.0];
        frame.samples().copy_to_f32(y * frame.columns() + x, &mut sample);
        apply(correction, x, y, sample[0])
    };
    pixel.neighbours.iter().map(value).sum::<f32>() / pixel.neighbours.len() as f32
}

/// The corrected sample of pixel (`x`, `y`).
fn apply(correction: &Correction, x: usize, y: usize, sample: f32) -> f32 {
    let dark = correction.subtract.as_ref().map_or(0.0, |map| map.at(x, y));
    let gain = correction.multiply.as_ref().map_or(1.0, |map| map.at(x, y));
    (sample - dark) * gain
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_core::grid::Grid;

    #[test]
    fn defective_pixels_take_their_good_neighbours() {
        let correction = Correction { defective: vec![(1, 0), (0, 0), (1, 0)], ..Correction::default() };
        let replaced = prepared(&correction, 3, 4).unwrap();
        assert_eq!(replaced.len(), 2);
        assert_eq!(replaced[0].neighbours, [(0, 1), (1, 1)]);
        assert_eq!(replaced[1].neighbours, [(2, 0), (0, 1), (1, 1), (2, 1)]);
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let map = |rows, value| Some(Grid::filled(rows, 4, value));
        let dark = Correction { subtract: map(2, 1.0), ..Correction::default() };
        assert!(matches!(prepared(&dark, 3, 4), Err(RectifyError::CorrectionSize { map: "dark", .. })));
        let mut gain = Correction { multiply: map(3, 1.0), ..Correction::default() };
        gain.multiply.as_mut().unwrap().row_mut(2)[1] = f32::NAN;
        assert_eq!(prepared(&gain, 3, 4), Err(RectifyError::CorrectionValue { map: "gain", x: 1, y: 2 }));
        let all = (0..12).map(|index| (index % 4, index / 4)).collect();
        let all = Correction { defective: all, ..Correction::default() };
        assert_eq!(prepared(&all, 3, 4), Err(RectifyError::Defective { x: 0, y: 0 }));
        let outside = Correction { defective: vec![(4, 0)], ..Correction::default() };
        assert_eq!(prepared(&outside, 3, 4), Err(RectifyError::Defective { x: 4, y: 0 }));
    }
}
