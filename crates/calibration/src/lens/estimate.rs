//! A lens and how well it is known: from calibration frames, from its data sheet, or not at all.

use serde::{Deserialize, Serialize};

use super::{Distortion, Lens};

/// Distortion of an unknown lens, as a share of the radius at the corner of the image: that of cheap lenses.
const UNKNOWN_DISTORTION: f64 = 0.03;
/// Standard deviation of a principal point that was not measured, as a share of the image's width: the usual
/// error of mounting.
const PRINCIPAL_POINT: f64 = 0.01;
/// Pixels are square to this share.
const SQUARE: f64 = 1e-4;
/// Focal length of an unknown lens, in lengths of the image's longer side, and its standard deviation as a share.
const UNKNOWN_FOCAL_LENGTH: (f64, f64) = (1.5, 0.5);

/// A lens with the covariance of its parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensEstimate {
    /// Rows of the frames it was found for.
    pub rows: usize,
    /// Columns of the frames.
    pub columns: usize,
    /// The lens.
    pub lens: Lens,
    /// Covariance of its parameters in the order of [`Lens::to_array`]. A parameter with variance 0 is held
    /// as it is.
    pub covariance: [[f64; Lens::PARAMETERS]; Lens::PARAMETERS],
}

impl LensEstimate {
    /// A lens whose parameters are known independently, each with its standard deviation; 0 for one that is
    /// held.
    pub fn independent(rows: usize, columns: usize, lens: Lens, sigma: [f64; Lens::PARAMETERS]) -> Self {
        let mut covariance = [[0.0; Lens::PARAMETERS]; Lens::PARAMETERS];
        for (index, sigma) in sigma.iter().enumerate() {
            covariance[index][index] = sigma * sigma;
        }
        Self { rows, columns, lens, covariance }
    }

    /// Standard deviation of each parameter, in the order of [`Lens::to_array`].
    pub fn sigma(&self) -> [f64; Lens::PARAMETERS] {
        std::array::from_fn(|index| self.covariance[index][index].sqrt())
    }

    /// A lens from a data sheet, for frames of this size, with how well such numbers are known.
    /// Distortion 0 stands for not known; `focal_length_sigma` is a share of the focal length.
    pub fn from_data_sheet(lens: Lens, focal_length_sigma: f64, rows: usize, columns: usize) -> Self {
        let f = lens.focal_length_x_px;
        let corner = (0.5 * columns as f64 / f).powi(2) + (0.5 * rows as f64 / f).powi(2);
        let centre = PRINCIPAL_POINT * columns as f64;
        let k1 = if lens.distortion == Distortion::default() {
            UNKNOWN_DISTORTION / corner
        } else {
            // Given numbers are good to a tenth.
            0.1 * lens.distortion.k1.abs()
        };
        let mut sigma = [0.0; Lens::PARAMETERS];
        sigma[2..5].copy_from_slice(&[centre, centre, k1]);
        let mut estimate = Self::independent(rows, columns, lens, sigma);
        estimate.set_focal_length_sigma(focal_length_sigma);
        estimate
    }

    /// States both focal lengths to be off by the same share, with this standard deviation.
    fn set_focal_length_sigma(&mut self, sigma: f64) {
        let (x, y) = (self.lens.focal_length_x_px, self.lens.focal_length_y_px);
        for (i, j, value) in [(0, 0, x * x), (0, 1, x * y), (1, 0, x * y), (1, 1, y * y)] {
            let own = if i == j { SQUARE * SQUARE } else { 0.0 };
            self.covariance[i][j] = value * (sigma * sigma + own);
        }
    }

    /// The same lens with a focal length that is so many times as long, known to `sigma` as a share of it. The distortion
    /// moves each pixel as before.
    pub fn lengthened(&self, times: f64, sigma: f64) -> Self {
        let [once, square, fourth, sixth] = [1, 2, 4, 6].map(|power| times.powi(power));
        let changes = [times, times, 1.0, 1.0, square, fourth, once, once, sixth];
        let mut values = self.lens.to_array();
        values.iter_mut().zip(changes).for_each(|(value, change)| *value *= change);
        let mut estimate = Self { lens: Lens::from_array(values), ..self.clone() };
        for (row, by_row) in estimate.covariance.iter_mut().zip(changes) {
            row.iter_mut().zip(changes).for_each(|(value, by_column)| *value *= by_row * by_column);
        }
        estimate.set_focal_length_sigma(sigma);
        estimate
    }

    /// A lens of which nothing is known. It serves to rectify rows along the stage axis; angles and
    /// heights it does not tell.
    pub fn unknown(rows: usize, columns: usize) -> Self {
        let (sides, sigma) = UNKNOWN_FOCAL_LENGTH;
        let middle = |size: usize| 0.5 * (size as f64 - 1.0);
        let lens = Lens::pinhole(sides * rows.max(columns) as f64, middle(columns), middle(rows));
        Self::from_data_sheet(lens, sigma, rows, columns)
    }

    /// A lens of which a file tells the parameters and not how well they are known: as a calibration that
    /// went well has them, with focal lengths to 0.2 %, principal point to 0.2 % of the width, k1 to a
    /// twentieth and 0.1 % of the radius at the corner.
    pub fn of_a_calibration(lens: Lens, rows: usize, columns: usize) -> Self {
        let (fx, fy) = (lens.focal_length_x_px, lens.focal_length_y_px);
        let corner = (0.5 * columns as f64 / fx).powi(2) + (0.5 * rows as f64 / fy).powi(2);
        let k1 = 0.05 * lens.distortion.k1.abs() + 0.001 / corner;
        let centre = 0.002 * columns as f64;
        Self::independent(
            rows,
            columns,
            lens,
            [0.002 * fx, 0.002 * fy, centre, centre, k1, 0.0, 0.0, 0.0, 0.0],
        )
    }
}
