//! The correction of a frame: dark level and gain.

use super::outliers::replace;
use epirig_core::frame::Frame;
use epirig_core::grid::Grid;

/// A pixel's light is (value - subtract) * multiply; pixels in `defective` have the mean of their good
/// neighbours, corrected, instead.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Correction {
    /// Dark level, in DN. `None` for zero everywhere.
    pub subtract: Option<Grid<f32>>,
    /// 1 over the gain, positive, whose mean is near 1. `None` for one everywhere.
    pub multiply: Option<Grid<f32>>,
    /// Columns and rows of the pixels that cannot be used, sorted.
    pub defective: Vec<(usize, usize)>,
}

impl Correction {
    /// A frame corrected, in DN. `None` if the correction is of another size.
    ///
    /// ```
    /// use epirig_core::frame::{Frame, Samples};
    /// use epirig_calibration::photometry::Correction;
    /// use epirig_core::grid::Grid;
    ///
    /// let frame = Frame::new(1, 3, 8, Samples::U8(vec![12, 255, 22]))?;
    /// let correction = Correction {
    ///     subtract: Some(Grid::filled(1, 3, 2.0)),
    ///     multiply: Grid::from_values(1, 3, vec![1.0, 1.0, 0.5]),
    ///     defective: vec![(1, 0)],
    /// };
    /// assert_eq!(correction.applied(&frame).unwrap().values(), [10.0, 10.0, 10.0]);
    /// # Ok::<(), epirig_core::frame::FrameError>(())
    /// ```
    pub fn applied(&self, frame: &Frame) -> Option<Grid<f32>> {
        let fits = |map: &Grid<f32>| (map.rows(), map.columns()) == (frame.rows(), frame.columns());
        let all_fit = [&self.subtract, &self.multiply].into_iter().flatten().all(fits)
            && self.defective.iter().all(|&(x, y)| x < frame.columns() && y < frame.rows());
        if !all_fit {
            return None;
        }
        let mut light = super::average::as_grid(frame);
        if let Some(dark) = &self.subtract {
            light.values_mut().iter_mut().zip(dark.values()).for_each(|(light, dark)| *light -= dark);
        }
        if let Some(factor) = &self.multiply {
            light.values_mut().iter_mut().zip(factor.values()).for_each(|(light, factor)| *light *= factor);
        }
        replace(&mut light, &self.defective);
        Some(light)
    }
}
