//! The largest connected region of the heights that is one surface.
//!
//! The matcher also gives answers beside an object: along its rim, where windows see object and background,
//! between dark patches, and in places by chance. These answers are wrong, and too many for a robust fit.
//! They differ from the object in two ways: their sigma is large, and their regions are only a few pixels
//! wide.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::SurfaceError;
use super::connected::connected;
use super::height::Heights;
use super::smooth::count_around;
use epirig_core::grid::Grid;
use epirig_core::statistics::quantile;

/// Pixels whose sigma is this many times the median are left out. Texture makes sigma differ by a factor of
/// two or three over one surface, and where a step of 0.1 px lies is uncertain by six times the sigma of flat
/// places (0.1 / sqrt(12) and 0.005 px); beside an object it is dozens of times as large.
const UNCERTAIN: f64 = 10.0;

/// A part of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rectangle {
    /// First column, in px.
    pub left: usize,
    /// First row.
    pub top: usize,
    /// Last column; at least `left`.
    pub right: usize,
    /// Last row; at least `top`.
    pub bottom: usize,
}

impl Rectangle {
    /// Between any two corners (columns and rows), both of which belong to it.
    pub fn between(one: (usize, usize), other: (usize, usize)) -> Self {
        Self {
            left: one.0.min(other.0),
            top: one.1.min(other.1),
            right: one.0.max(other.0),
            bottom: one.1.max(other.1),
        }
    }

    /// Whether it holds the pixel at column `x` of row `y`.
    pub fn holds(&self, x: usize, y: usize) -> bool {
        (self.left..=self.right).contains(&x) && (self.top..=self.bottom).contains(&y)
    }

    /// Whether a picture of this size holds it.
    pub fn fits(&self, rows: usize, columns: usize) -> bool {
        self.right < columns && self.bottom < rows
    }
}

/// The pixels that count for a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Extent {
    /// Whether each pixel counts; rows x columns.
    pub used: Grid<bool>,
    /// Their number.
    pub used_px: usize,
    /// Pixels with a height, inside the region if one was given.
    pub answered_px: usize,
    /// Pixels left out because their sigma is far above the usual.
    pub uncertain_px: usize,
    /// Pixels left out because they are not connected with the region, or the region is too narrow there.
    pub apart_px: usize,
    /// Pixels left out because they lie at the rim of the field, where windows see something else.
    pub rim_px: usize,
}

/// Finds the largest connected region of `heights`; only pixels that `inside` holds count, if it is given (rows x
/// columns of the heights).
///
/// A region is everywhere at least as wide as two squares side by side that reach `margin_px` to each side of
/// a pixel, one for each of two levels. Along its rim, `rim_px` is left out, as
/// [`StepsOptions::rim_px`](super::StepsOptions::rim_px) says. The border of the picture or of `inside` is no
/// rim. A hole does not divide a region if more than half of the square that reaches `margin_px` to each side
/// is known.
///
/// # Errors
/// [`SurfaceError::TooFewPixels`] if there is no height, [`SurfaceError::NoExtent`] if no region is that
/// wide.
///
/// # Panics
/// If `inside` has another size.
pub fn find_extent(
    heights: &Heights,
    inside: Option<&Grid<bool>>,
    (margin_px, rim_px): (usize, usize),
) -> Result<Extent, SurfaceError> {
    let Heights { height_mm, sigma_mm, .. } = heights;
    let (rows, columns) = (height_mm.rows(), height_mm.columns());
    let everywhere = || Grid::filled(rows, columns, true);
    let inside = inside.map_or_else(|| Cow::Owned(everywhere()), Cow::Borrowed);
    assert_eq!((inside.rows(), inside.columns()), (rows, columns), "the region has another size");
    let places = inside.values().iter().zip(height_mm.values()).zip(sigma_mm.values());
    let known: Vec<Option<f64>> = places
        .map(|((&inside, height), sigma)| {
            (inside && height.is_finite() && sigma.is_finite()).then_some(f64::from(*sigma))
        })
        .collect();
    let mut sigmas: Vec<f64> = known.iter().copied().flatten().collect();
    let answered_px = sigmas.len();
    let too_few = SurfaceError::TooFewPixels { pixels: 0, what: "a surface" };
    let limit = UNCERTAIN * quantile(&mut sigmas, 0.5).ok_or(too_few)?;
    let mut trusted = Grid::filled(rows, columns, false);
    for (trusted, sigma) in trusted.values_mut().iter_mut().zip(known) {
        *trusted = sigma.is_some_and(|sigma| sigma <= limit);
    }

    let side_px = 2 * (2 * margin_px + 1);
    let wide = opened(&filled(&trusted, &inside, margin_px), side_px);
    let field = largest(&wide).ok_or(SurfaceError::NoExtent { side_px })?;
    let inner = without_rim(&field, &inside, rim_px);

    let mut used = Grid::filled(rows, columns, false);
    let (mut used_px, mut apart_px, mut rim_px) = (0, 0, 0);
    let places = trusted.values().iter().zip(inner.values()).zip(field.values());
    for (used, ((_, &inner), &field)) in
        used.values_mut().iter_mut().zip(places).filter(|(_, ((trusted, _), _))| **trusted)
    {
        if inner {
            *used = true;
            used_px += 1;
        } else if field {
            rim_px += 1;
        } else {
            apart_px += 1;
        }
    }
    let uncertain_px = answered_px - used_px - apart_px - rim_px;
    Ok(Extent { used, used_px, answered_px, uncertain_px, apart_px, rim_px })
}

/// With its holes: pixels inside that have more chosen than others, of those inside, in the square that reaches
/// `reach` px to each side.
fn filled(chosen: &Grid<bool>, inside: &Grid<bool>, reach: usize) -> Grid<bool> {
    let counts = count_around(chosen, reach);
    let is_most = counts.zip_map(&count_around(inside, reach), |count, all| 2 * count > all);
    let holes = inside.zip_map(&is_most, |inside, is_most| inside && is_most);
    chosen.zip_map(&holes, |chosen, hole| chosen || hole)
}

/// The union of all squares of this side that lie completely on the field (an opening by the square).
fn opened(field: &Grid<bool>, side: usize) -> Grid<bool> {
    let (rows, columns) = (field.rows(), field.columns());
    // How far the field goes on from each pixel to the right and down, and from those the largest square that
    // begins there.
    let mut square = Grid::filled(rows + 1, columns + 1, 0_usize);
    for y in (0..rows).rev() {
        for x in (0..columns).rev() {
            let beyond = square.at(x + 1, y).min(square.at(x, y + 1)).min(square.at(x + 1, y + 1));
            square.row_mut(y)[x] = if field.at(x, y) { beyond + 1 } else { 0 };
        }
    }
    let mut covered = Grid::filled(rows, columns, false);
    // Each row of a square that begins here is filled by its own rows' marks: how many pixels from here on
    // are covered.
    let mut down = vec![0_usize; columns];
    for y in 0..rows {
        let mut right = 0_usize;
        for (x, down) in down.iter_mut().enumerate() {
            if square.at(x, y) >= side {
                *down = side;
            }
            if *down > 0 {
                right = side;
                *down -= 1;
            }
            if right > 0 {
                covered.row_mut(y)[x] = true;
                right -= 1;
            }
        }
    }
    covered
}

/// The part that has most pixels; of equal ones the first.
fn largest(chosen: &Grid<bool>) -> Option<Grid<bool>> {
    let parts = connected(chosen, |chosen| chosen);
    let most = parts.iter().map(|part| part.pixels.len()).max()?;
    let part = parts.into_iter().find(|part| part.pixels.len() == most)?;
    let mut field = chosen.map(|_| false);
    part.pixels.into_iter().for_each(|(x, y)| field.row_mut(y)[x] = true);
    Some(field)
}

/// The field without pixels that have one beside it, in `inside`, in the square that reaches `reach` px to each
/// side.
fn without_rim(field: &Grid<bool>, inside: &Grid<bool>, reach: usize) -> Grid<bool> {
    let beside = inside.zip_map(field, |inside, field| inside && !field);
    field.zip_map(&count_around(&beside, reach), |field, outside| field && outside == 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Geometry;

    const NAN: f32 = f32::NAN;

    /// 80 x 60 px, known where `known` says, with this sigma.
    fn heights(sigma: impl Fn(usize, usize) -> f32) -> Heights {
        let values: Vec<f32> = (0..4800).map(|index| sigma(index % 80, index / 80)).collect();
        let sigma_mm = Grid::from_values(60, 80, values).unwrap();
        Heights {
            height_mm: sigma_mm.map(|sigma| if sigma.is_nan() { NAN } else { 0.0 }),
            sigma_mm,
            distance_mm: 500.0,
            geometry: Geometry::exact(1000.0, 100.0, (0.0, 0.0)),
        }
    }

    fn tile(x: usize, y: usize) -> bool {
        (20..60).contains(&x) && (15..45).contains(&y)
    }

    #[test]
    fn rims_strays_and_columns_are_left_out() {
        // A tile of 40 x 30 px with uncertain answers one pixel around it, columns of 6 px above it, and
        // strays.
        let around = |x: usize, y: usize| (19..61).contains(&x) && (14..46).contains(&y);
        let column = |x: usize, y: usize| y < 14 && x % 12 < 6 && (20..60).contains(&x);
        let field = heights(|x, y| match (tile(x, y), around(x, y), column(x, y)) {
            (true, ..) | (_, false, true) => 0.02,
            (_, true, _) => 0.5,
            _ if x % 10 == 9 && y > 50 => 0.01,
            _ => NAN,
        });
        let found = find_extent(&field, None, (2, 2)).unwrap();
        for (index, &used) in found.used.values().iter().enumerate() {
            let (x, y) = (index % 80, index / 80);
            assert_eq!(used, (22..58).contains(&x) && (17..43).contains(&y), "({x}, {y})");
        }
        // 40 x 30 less 36 x 26; 42 x 32 less 40 x 30; columns 24-29, 36-41, 48-53 (14 rows each); 8 columns
        // of 9 rows.
        assert_eq!((found.used_px, found.rim_px, found.uncertain_px), (936, 264, 144));
        assert_eq!(found.apart_px, 3 * 6 * 14 + 8 * 9);
        assert_eq!(found.answered_px, 936 + 264 + 144 + found.apart_px);
        let only = field.only(&found.used);
        assert_eq!(only.height_mm.values().iter().filter(|height| height.is_finite()).count(), 936);
        // Windows that grow see farther: 30 x 20 px are left.
        assert_eq!(find_extent(&field, None, (2, 5)).unwrap().used_px, 600);
    }

    #[test]
    fn single_holes_do_not_divide_a_field() {
        let field = heights(|x, y| if (x + 3 * y) % 7 == 0 { NAN } else { 0.02 });
        let found = find_extent(&field, None, (2, 2)).unwrap();
        assert_eq!((found.used_px, found.apart_px), (found.answered_px, 0));
    }

    #[test]
    fn of_two_fields_the_region_chooses() {
        let field = heights(|x, _| if (50..53).contains(&x) { NAN } else { 0.02 });
        let whole = find_extent(&field, None, (1, 1)).unwrap();
        assert!(whole.used.at(10, 30) && !whole.used.at(70, 30));
        let chosen = Rectangle::between((79, 50), (40, 10));
        assert!(chosen.fits(60, 80) && !chosen.fits(50, 80));
        let mut inside = Grid::filled(60, 80, false);
        (0..60).for_each(|y| (0..80).for_each(|x| inside.row_mut(y)[x] = chosen.holds(x, y)));
        let right = find_extent(&field, Some(&inside), (1, 1)).unwrap();
        assert!(!right.used.at(45, 30) && right.used.at(70, 30) && right.used.at(79, 50));
        assert!(!right.used.at(70, 9) && !right.used.at(70, 51) && !right.used.at(53, 30));
        // Of the columns 54 to 79 nothing is missing: the region's border is no rim.
        assert_eq!((right.used_px, right.rim_px), (26 * 41, 41));
    }

    #[test]
    fn a_region_of_any_shape_has_no_rim_of_its_own() {
        // A disc over two fields: it holds more of the right one.
        let field = heights(|x, _| if (30..34).contains(&x) { NAN } else { 0.02 });
        let mut disc = Grid::filled(60, 80, false);
        let holds = |x: usize, y: usize| x.abs_diff(45).pow(2) + y.abs_diff(30).pow(2) <= 400;
        (0..60).for_each(|y| (0..80).for_each(|x| disc.row_mut(y)[x] = holds(x, y)));
        let found = find_extent(&field, Some(&disc), (1, 1)).unwrap();
        let left_of_the_gap =
            (0..4800).filter(|index| index % 80 < 30 && holds(index % 80, index / 80)).count();
        // All of the disc to the right of the gap, but for the column beside the gap, and for the tips of the disc
        // that no square of 6 px reaches.
        for (index, &used) in found.used.values().iter().enumerate() {
            let (x, y) = (index % 80, index / 80);
            let within = x.abs_diff(45).pow(2) + y.abs_diff(30).pow(2) <= 17 * 17;
            assert!(!used || (holds(x, y) && x > 34), "({x}, {y})");
            assert!(used || !(within && x > 34), "({x}, {y})");
        }
        // The disc has 33 px in column 34. No square reaches its three tips of one pixel, and each has three
        // neighbours.
        assert_eq!((found.rim_px, found.apart_px), (33 + 3 * 3, 3 + left_of_the_gap));
        let nothing = Grid::filled(60, 80, false);
        assert!(matches!(
            find_extent(&field, Some(&nothing), (1, 1)),
            Err(SurfaceError::TooFewPixels { .. })
        ));
    }

    #[test]
    fn what_is_nowhere_wide_is_refused() {
        let found = find_extent(&heights(|x, _| if x % 20 < 9 { 0.02 } else { NAN }), None, (2, 2));
        assert_eq!(found.unwrap_err(), SurfaceError::NoExtent { side_px: 10 });
        let found = find_extent(&heights(|_, _| NAN), None, (2, 2));
        assert!(matches!(found, Err(SurfaceError::TooFewPixels { .. })));
    }
}
