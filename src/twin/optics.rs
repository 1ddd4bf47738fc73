//! The twin's lens and pixel grid: a pinhole with a point spread and darkening.

use serde::{Deserialize, Serialize};

use super::TwinError;

/// A pinhole camera: x = f X / Z + c_x, y = f Y / Z + c_y, blurred and darkened as stated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Optics {
    /// Rows of the image.
    pub rows: usize,
    /// Columns of the image.
    pub columns: usize,
    /// Focal length, in px.
    pub focal_length_px: f64,
    /// Principal point, column.
    pub principal_point_x_px: f64,
    /// Principal point, row.
    pub principal_point_y_px: f64,
    /// Standard deviation of the Gaussian point spread, in px; 0 for none. The pixel's own area comes on top.
    pub point_spread_sigma_px: f64,
    /// Light lost in the corner farthest from the principal point, 0 to less than 1; the loss follows cos^4.
    pub corner_darkening: f64,
}

impl Optics {
    /// A square image with the principal point in its middle, a point spread of 0.5 px and no darkening.
    pub fn square(side_px: usize, focal_length_px: f64) -> Self {
        let middle = 0.5 * (side_px as f64 - 1.0);
        Self {
            rows: side_px,
            columns: side_px,
            focal_length_px,
            principal_point_x_px: middle,
            principal_point_y_px: middle,
            point_spread_sigma_px: 0.5,
            corner_darkening: 0.0,
        }
    }

    pub(super) fn check(&self) -> Result<(), TwinError> {
        let bad = |what, value, expected| Err(TwinError::BadNumber { what, value, expected });
        if !(0.0..=10.0).contains(&self.point_spread_sigma_px) {
            return bad("point spread in px", self.point_spread_sigma_px, "from 0 to 10");
        }
        if !(0.0..1.0).contains(&self.corner_darkening) {
            return bad("corner darkening", self.corner_darkening, "from 0 to less than 1");
        }
        Ok(())
    }

    /// Direction (X / Z, Y / Z) of the ray through image point (x, y).
    pub fn ray(&self, x: f64, y: f64) -> (f64, f64) {
        let f = self.focal_length_px;
        ((x - self.principal_point_x_px) / f, (y - self.principal_point_y_px) / f)
    }

    /// Largest |X / Z| and |Y / Z| of any ray that a pixel can receive, the point spread included.
    pub(super) fn steepest_ray(&self) -> (f64, f64) {
        let reach = 1.0 + 5.0 * self.point_spread_sigma_px;
        let steepest = |size: usize, middle: f64| {
            (middle + reach).max(size as f64 - 1.0 + reach - middle) / self.focal_length_px
        };
        (steepest(self.columns, self.principal_point_x_px), steepest(self.rows, self.principal_point_y_px))
    }

    /// Share of the light that pixel (x, y) receives: 1 / (1 + k r^2)^2, which is cos^4 of the ray's angle to the axis for
    /// the k that loses `corner_darkening` in the farthest corner.
    pub fn transmission(&self, x: f64, y: f64) -> f64 {
        let square = |x: f64, y: f64| {
            (x - self.principal_point_x_px).powi(2) + (y - self.principal_point_y_px).powi(2)
        };
        let (right, bottom) = (self.columns as f64 - 1.0, self.rows as f64 - 1.0);
        let corner = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)]
            .iter()
            .fold(f64::MIN_POSITIVE, |farthest, &(x, y)| farthest.max(square(x, y)));
        let k = ((1.0 - self.corner_darkening).powf(-0.5) - 1.0) / corner;
        (1.0 + k * square(x, y)).powi(-2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corner_loses_what_is_stated_and_the_axis_nothing() {
        let optics = Optics { corner_darkening: 0.15, ..Optics::square(101, 300.0) };
        assert!((optics.transmission(50.0, 50.0) - 1.0).abs() < 1e-12);
        assert!((optics.transmission(0.0, 100.0) - 0.85).abs() < 1e-12);
        // cos^4 falls with r^2 near the axis: a quarter of the radius loses about a sixteenth of the loss.
        let quarter = 1.0 - optics.transmission(50.0 + 12.5, 50.0 + 12.5);
        assert!((quarter / 0.15 - 1.0 / 16.0).abs() < 0.01, "{quarter}");
    }
}
