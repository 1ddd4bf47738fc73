//! Where the bands of the target lie in rectified frames.

use nalgebra::{Matrix3, Matrix3x2, RowVector3};
use serde::{Deserialize, Serialize};

use super::AxisPoint;
use crate::target::Tracks;

/// The outline of a printed board in a rectified frame; it moves with the object.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outline {
    /// Corners of the outermost squares at tau = 0, column and row in px, in order around the board.
    pub corners_px: [[f64; 2]; 4],
    /// Disparity of the board over the whole baseline, in px.
    pub disparity_px: f64,
}

impl Outline {
    /// Whether the board covers the pixel at column `x` and row `y` of the rectified frame at `tau`.
    pub fn covers(&self, x: f64, y: f64, tau: f64) -> bool {
        let x = x - self.disparity_px * tau;
        let sides = (0..4).map(|index| {
            let [from_x, from_y] = self.corners_px[index];
            let [to_x, to_y] = self.corners_px[(index + 1) % 4];
            (to_x - from_x) * (y - from_y) - (to_y - from_y) * (x - from_x)
        });
        // On the same side of all four, whichever way round they are counted.
        let (mut left, mut right) = (false, false);
        sides.for_each(|side| (left, right) = (left || side < 0.0, right || side > 0.0));
        !(left && right)
    }
}

/// The outline of each band of which enough is seen, for a rectified camera with this focal length and principal
/// point in px. Its squares reach one square beyond the corners that were seen, for between four squares there
/// is one corner.
pub fn outlines(
    points: &[AxisPoint],
    tracks: &Tracks,
    focal_length_px: f64,
    (principal_point_x_px, principal_point_y_px): (f64, f64),
) -> Vec<Outline> {
    let bands = tracks.corners.iter().map(|corner| corner.band + 1).max().unwrap_or(0);
    let outline = |band: usize| {
        let of_band = || {
            points
                .iter()
                .map(|point| (tracks.corners[point.corner], point))
                .filter(|(corner, _)| corner.band == band)
        };
        // The place of a label: affine, as an object is far away against its size.
        let (mut normal, mut right) = (Matrix3::zeros(), Matrix3x2::zeros());
        let (mut disparity, mut count) = (0.0, 0.0);
        let (mut low, mut high) = ([i32::MAX; 2], [i32::MIN; 2]);
        for (corner, point) in of_band() {
            let row = RowVector3::new(1.0, f64::from(corner.column), f64::from(corner.row));
            normal += row.transpose() * row;
            right += row.transpose() * nalgebra::RowVector2::new(point.x, point.y);
            (disparity, count) = (disparity + point.disparity, count + 1.0);
            low = [low[0].min(corner.column), low[1].min(corner.row)];
            high = [high[0].max(corner.column), high[1].max(corner.row)];
        }
        let place = normal.cholesky()?.solve(&right);
        let corner = |column: i32, row: i32| {
            let at = RowVector3::new(1.0, f64::from(column), f64::from(row)) * place;
            [focal_length_px * at[0] + principal_point_x_px, focal_length_px * at[1] + principal_point_y_px]
        };
        let ([left, top], [right, bottom]) = (low.map(|label| label - 1), high.map(|label| label + 1));
        let corners_px = [corner(left, top), corner(right, top), corner(right, bottom), corner(left, bottom)];
        Some(Outline { corners_px, disparity_px: focal_length_px * disparity / count })
    };
    (0..bands).filter_map(outline).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::target::TrackedCorner;

    #[test]
    fn outlines_reach_a_square_beyond_the_corners_and_move() {
        // Two bands of 4 x 2 corners, squares of 0.01 of the focal length, turned by 0.1 rad; the second one 0.2
        // below. f = 1000 px: squares of 10 px.
        let (sin, cos) = 0.1_f64.sin_cos();
        let (mut corners, mut points) = (Vec::new(), Vec::new());
        for (band, y0) in [(0, -0.1), (1, 0.1)] {
            for row in 0..2 {
                for column in 0..4 {
                    let (u, v) = (0.01 * f64::from(column), y0 + 0.01 * f64::from(row));
                    points.push(AxisPoint {
                        corner: corners.len(),
                        x: cos * u - sin * v,
                        y: sin * u + cos * v,
                        disparity: 0.3,
                    });
                    corners.push(TrackedCorner { band, row, column });
                }
            }
        }
        let tracks = Tracks { corners, observations: Vec::new(), dropped: 0, anchored: vec![true; 2] };
        let found = outlines(&points, &tracks, 1000.0, (500.0, 400.0));
        assert_eq!(found.len(), 2);
        let place =
            |u: f64, v: f64| (1000.0 * (cos * u - sin * v) + 500.0, 1000.0 * (sin * u + cos * v) + 400.0);
        for (outline, y0) in found.iter().zip([-0.1, 0.1]) {
            assert!((outline.disparity_px - 300.0).abs() < 1e-9);
            // Squares from -0.01 to 0.04 along columns, and from -0.01 to 0.02 along rows.
            for (u, v, inside) in [
                (-0.0095, -0.0095, true),
                (0.0395, 0.0195, true),
                (0.015, 0.005, true),
                (-0.0105, 0.005, false),
                (0.0405, 0.005, false),
                (0.015, -0.0105, false),
                (0.015, 0.0205, false),
            ] {
                let (x, y) = place(u, y0 + v);
                assert_eq!(outline.covers(x, y, 0.0), inside, "{u} {v}");
                assert_eq!(outline.covers(x + 150.0, y, 0.5), inside, "{u} {v} half the way");
            }
        }
        assert_eq!(outlines(&points[..2], &tracks, 1000.0, (0.0, 0.0)), [], "two corners span nothing");
    }
}
