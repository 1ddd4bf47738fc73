//! Heights along a line.

use serde::Serialize;

use super::SurfaceError;
use super::height::Heights;
use epirig_core::grid::Grid;

/// A straight line over the field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfileLine {
    /// First point, column and row in px.
    pub from_px: (f64, f64),
    /// Last point.
    pub to_px: (f64, f64),
    /// Over how many px across the line heights are averaged; 1 takes the line alone.
    pub width_px: usize,
}

/// A point of a profile.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ProfilePoint {
    /// Column, in px.
    pub x_px: f64,
    /// Row, in px.
    pub y_px: f64,
    /// Distance from the first point, along the level from which heights are counted, in mm.
    pub distance_mm: f64,
    /// Mean height over the width, in mm; NaN where less than half of it is known.
    pub height_mm: f64,
    /// Its standard deviation, in mm.
    pub sigma_mm: f64,
}

/// Heights along a line, a point for each px.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// The line.
    pub line: ProfileLine,
    /// From its first point to its last.
    pub points: Vec<ProfilePoint>,
}

/// Heights of `height_mm`, a field of the size of `heights`, along `line`, between pixels by bilinear
/// interpolation.
///
/// Neighbours err together: of a width of w px, w / `correlation_px` count as independent (at least one), and
/// sigma falls by the root of that. 1 is right if every pixel errs by itself.
///
/// # Errors
/// [`SurfaceError::LineOutside`] if an end of the line lies outside the picture, [`SurfaceError::EmptyLine`] if no height along it is known.
pub fn profile(
    heights: &Heights,
    height_mm: &Grid<f32>,
    line: ProfileLine,
    correlation_px: f64,
) -> Result<Profile, SurfaceError> {
    let ((from_x, from_y), (to_x, to_y)) = (line.from_px, line.to_px);
    let (columns, rows) = (height_mm.columns() as f64, height_mm.rows() as f64);
    let outside =
        |&(x, y): &(f64, f64)| !((-0.5..=columns - 0.5).contains(&x) && (-0.5..=rows - 0.5).contains(&y));
    if let Some(&(x, y)) = [line.from_px, line.to_px].iter().find(|end| outside(end)) {
        let (columns, rows) = (height_mm.columns(), height_mm.rows());
        return Err(SurfaceError::LineOutside { x, y, columns, rows });
    }
    let length_px = (to_x - from_x).hypot(to_y - from_y);
    let steps = length_px.round().max(1.0) as usize;
    // Across the line, to its right.
    let across =
        if length_px > 0.0 { ((from_y - to_y) / length_px, (to_x - from_x) / length_px) } else { (0.0, 1.0) };
    let independent = (line.width_px as f64 / correlation_px.max(1.0)).max(1.0);
    let points = (0..=steps).map(|step| {
        // Divided last: between pixels of a row or a column, all points are pixels exactly.
        let at = |from: f64, to: f64| from + step as f64 * (to - from) / steps as f64;
        let (x_px, y_px) = (at(from_x, to_x), at(from_y, to_y));
        let (mut height, mut variance, mut known) = (0.0, 0.0, 0_usize);
        for index in 0..line.width_px {
            let off = index as f64 - 0.5 * (line.width_px as f64 - 1.0);
            let (x, y) = (x_px + off * across.0, y_px + off * across.1);
            if let Some((here, sigma)) =
                interpolated(height_mm, x, y).zip(interpolated(&heights.sigma_mm, x, y))
            {
                height += here;
                variance += sigma * sigma;
                known += 1;
            }
        }
        let enough = 2 * known >= line.width_px && known > 0;
        let count = known as f64;
        ProfilePoint {
            x_px,
            y_px,
            distance_mm: at(0.0, length_px) * heights.pixel_mm(),
            height_mm: if enough { height / count } else { f64::NAN },
            sigma_mm: if enough {
                (variance / count / (independent * count / line.width_px as f64).max(1.0)).sqrt()
            } else {
                f64::NAN
            },
        }
    });
    let points: Vec<ProfilePoint> = points.collect();
    if points.iter().all(|point| point.height_mm.is_nan()) {
        return Err(SurfaceError::EmptyLine { from: line.from_px, to: line.to_px });
    }
    Ok(Profile { line, points })
}

/// The value between four pixels by linear interpolation along both axes; `None` outside, and where one that matters
/// is unknown.
pub(crate) fn interpolated(map: &Grid<f32>, x: f64, y: f64) -> Option<f64> {
    let inside = x >= 0.0 && y >= 0.0 && x <= (map.columns() - 1) as f64 && y <= (map.rows() - 1) as f64;
    if !inside {
        return None;
    }
    let (left, top) = (x.floor(), y.floor());
    let mut value = 0.0;
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let part = |offset: usize, share: f64| if offset == 1 { share } else { 1.0 - share };
        let weight = part(dx, x - left) * part(dy, y - top);
        if weight > 0.0 {
            value += weight * f64::from(map.at(left as usize + dx, top as usize + dy));
        }
    }
    (!value.is_nan()).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Geometry;

    /// h = 0.1 x + 0.01 y over 20 x 30 px of 0.5 mm.
    fn ramp() -> Heights {
        let values = (0..600).map(|index| 0.1 * (index % 30) as f32 + 0.01 * (index / 30) as f32).collect();
        Heights {
            height_mm: Grid::from_values(20, 30, values).unwrap(),
            sigma_mm: Grid::filled(20, 30, 0.06),
            distance_mm: 500.0,
            geometry: Geometry::exact(1000.0, 100.0, (0.0, 0.0)),
        }
    }

    #[test]
    fn a_ramp_along_an_oblique_line() {
        let heights = ramp();
        let line = ProfileLine { from_px: (2.5, 3.0), to_px: (14.5, 12.0), width_px: 4 };
        let found = profile(&heights, &heights.height_mm, line, 1.0).unwrap();
        // 12 and 9 px make 15.
        assert_eq!(found.points.len(), 16);
        for (index, point) in found.points.iter().enumerate() {
            let (x, y) = (2.5 + 0.8 * index as f64, 3.0 + 0.6 * index as f64);
            assert!((point.x_px - x).abs() < 1e-9 && (point.y_px - y).abs() < 1e-9);
            assert!((point.height_mm - (0.1 * x + 0.01 * y)).abs() < 1e-6);
            assert!((point.distance_mm - 0.5 * index as f64).abs() < 1e-9);
            assert!((point.sigma_mm - 0.03).abs() < 1e-6);
        }
        // Neighbours that err wholly together gain nothing.
        let together = profile(&heights, &heights.height_mm, line, 9.0).unwrap();
        assert!((together.points[3].sigma_mm - 0.06).abs() < 1e-6);
    }

    #[test]
    fn points_between_pixels_of_a_row_are_pixels() {
        let heights = ramp();
        for from in 0..28 {
            let line = ProfileLine { from_px: (f64::from(from), 4.0), to_px: (29.0, 4.0), width_px: 1 };
            let found = profile(&heights, &heights.height_mm, line, 1.0).unwrap();
            let columns: Vec<f64> = found.points.iter().map(|point| point.x_px).collect();
            assert_eq!(columns, (from..30).map(f64::from).collect::<Vec<_>>());
        }
    }

    #[test]
    fn holes_stay_holes() {
        let mut heights = ramp();
        heights.height_mm.row_mut(5)[10] = f32::NAN;
        let line = ProfileLine { from_px: (0.0, 5.0), to_px: (29.0, 5.0), width_px: 1 };
        let found = profile(&heights, &heights.height_mm, line, 1.0).unwrap();
        let holes: Vec<usize> = (0..30).filter(|&x| found.points[x].height_mm.is_nan()).collect();
        assert_eq!(holes, [10]);
        // Three rows wide, two of them are known there.
        let wide = profile(&heights, &heights.height_mm, ProfileLine { width_px: 3, ..line }, 1.0).unwrap();
        assert!((wide.points[10].height_mm - 1.05).abs() < 1e-6);
        heights.height_mm.row_mut(7).fill(f32::NAN);
        let unknown = ProfileLine { from_px: (0.0, 7.0), to_px: (29.0, 7.0), width_px: 1 };
        let found = profile(&heights, &heights.height_mm, unknown, 1.0);
        assert!(matches!(found, Err(SurfaceError::EmptyLine { .. })));
        for end in [(0.0, 50.0), (1e308, 1.0), (f64::NAN, 1.0), (-1.0, 1.0), (30.0, 1.0)] {
            let outside = ProfileLine { from_px: (0.0, 1.0), to_px: end, width_px: 1 };
            let found = profile(&heights, &heights.height_mm, outside, 1.0);
            assert!(matches!(found, Err(SurfaceError::LineOutside { .. })), "{end:?}");
        }
    }
}
