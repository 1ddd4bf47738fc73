//! The plane of a part of a field: to level a map by, and to find roughness about.
//!
//! Other than a [`Trend`](super::Trend) it takes every height as it is, without weights and without leaving
//! any out, as ISO 25178-2 has it.

use super::SurfaceError;
use super::blocks::{Blocks, Correlation, Scatter};
use super::extent::Rectangle;
use super::height::Heights;
use super::normal::{Normal, Solution};
use super::roughness::{Roughness, roughness};
use epirig_core::grid::Grid;

/// Coefficients of a plane.
const TERMS: usize = 3;
/// A point of three stands for the mean of the pixels so far around it: the noise of a single one would tilt all.
const AROUND_PX: usize = 2;
/// Less variance of its pixels across their direction is that of a line, in px^2: two full rows have 0.25. Heights
/// shift places a little, so a line of pixels is none of places, and a plane through it would mean nothing.
const LEAST_SPREAD_PX2: f64 = 0.1;
/// So far from the line through two of them the third point must lie, in px.
const LEAST_OFF_PX: f64 = 1.0;

/// A plane over the camera's X and Y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Place of `level_mm`: X and Y in the camera's frame, in mm.
    pub centre_mm: (f64, f64),
    /// Its height there, in mm.
    pub level_mm: f64,
    /// How much it rises along X and along Y, in mm/mm; positive where the right or the lower side is nearer to
    /// the camera.
    pub slopes: (f64, f64),
}

/// A region in numbers: its mean height, its tilt, and its roughness about its least-squares plane by the height
/// parameters of ISO 25178-2.
///
/// Uncertainties come from the scatter of the heights about the plane between independent parts of the region.
/// They hold no error that all its heights share, such as that of the scale; `None` for too few such parts.
#[derive(Debug, Clone, PartialEq)]
pub struct RegionStatistics {
    /// Pixels of the region.
    pub pixels: usize,
    /// Mean height, in mm.
    pub mean_mm: f64,
    /// Its standard uncertainty, in mm.
    pub mean_sigma_mm: Option<f64>,
    /// The least-squares plane; its level is the mean height.
    pub plane: Plane,
    /// Standard uncertainties of its slopes, in mm/mm.
    pub slope_sigmas: [Option<f64>; 2],
    /// Roughness about the plane; its pixels are those that have a height.
    pub roughness: Roughness,
}

/// A pixel with a height: where it is seen, where it lies, how high.
struct Sample {
    at: (usize, usize),
    place_mm: (f64, f64),
    height_mm: f64,
}

/// The pixels of `region` whose height and sigma are known.
fn samples<'a>(
    heights: &'a Heights,
    height_mm: &'a Grid<f32>,
    region: Rectangle,
) -> impl Iterator<Item = Sample> + 'a {
    let places =
        (region.top..=region.bottom).flat_map(move |y| (region.left..=region.right).map(move |x| (x, y)));
    places.filter_map(|(x, y)| {
        let (height_mm, place_mm) = (f64::from(height_mm.at(x, y)), heights.lateral_mm(x, y));
        let known =
            (height_mm + place_mm.0 + place_mm.1).is_finite() && heights.sigma_mm.at(x, y).is_finite();
        known.then_some(Sample { at: (x, y), place_mm, height_mm })
    })
}

/// Number, mean place and mean height; `None` without any.
fn mean(of: impl Iterator<Item = Sample>) -> Option<(usize, (f64, f64), f64)> {
    let (count, x, y, height) = of.fold((0, 0.0, 0.0, 0.0), |(count, x, y, height), sample| {
        (count + 1, x + sample.place_mm.0, y + sample.place_mm.1, height + sample.height_mm)
    });
    let number = count as f64;
    (count > 0).then(|| (count, (x / number, y / number), height / number))
}

/// Variance of the pixels across the direction in which they vary most, in px^2.
fn spread_px2(of: impl Iterator<Item = Sample>, region: Rectangle) -> f64 {
    let (mut count, mut sums, mut squares) = (0.0, [0.0; 2], [0.0; 3]);
    of.for_each(|Sample { at: (x, y), .. }| {
        let (u, v) = ((x - region.left) as f64, (y - region.top) as f64);
        count += 1.0;
        [u, v].into_iter().zip(&mut sums).for_each(|(value, sum)| *sum += value);
        [u * u, u * v, v * v].into_iter().zip(&mut squares).for_each(|(value, sum)| *sum += value);
    });
    let [u, v] = sums.map(|sum| sum / count);
    let [uu, uv, vv] = squares.map(|sum| sum / count);
    let (a, b, c) = (uu - u * u, uv - u * v, vv - v * v);
    0.5 * (a + c) - (0.5 * (a - c)).hypot(b)
}

/// Distance of one of the points from the line through the two that are farthest apart, in px.
fn off_line_px(points: [(usize, usize); 3]) -> f64 {
    let [one, two, three] = points.map(|(x, y)| (x as f64, y as f64));
    let side = |from: (f64, f64), to: (f64, f64)| (to.0 - from.0).hypot(to.1 - from.1);
    let longest = side(one, two).max(side(two, three)).max(side(three, one));
    let area = (two.0 - one.0) * (three.1 - one.1) - (two.1 - one.1) * (three.0 - one.0);
    if longest > 0.0 { area.abs() / longest } else { 0.0 }
}

impl Plane {
    /// The plane for which the sum of the squared distances of the heights of `region` is least. `height_mm` has
    /// the size of `heights`, for example the same without a form, and holds `region`.
    ///
    /// # Errors
    /// [`SurfaceError::NoPlane`] if the pixels of the region that have a height are too few, or lie in a line.
    pub fn least_squares(
        heights: &Heights,
        height_mm: &Grid<f32>,
        region: Rectangle,
    ) -> Result<Self, SurfaceError> {
        let none = |pixels| SurfaceError::NoPlane { pixels };
        let (count, centre_mm, level_mm) =
            mean(samples(heights, height_mm, region)).ok_or_else(|| none(0))?;
        if spread_px2(samples(heights, height_mm, region), region) < LEAST_SPREAD_PX2 {
            return Err(none(count));
        }
        let start = Self { centre_mm, level_mm, slopes: (0.0, 0.0) };
        let mut sums = Normal::empty();
        samples(heights, height_mm, region)
            .for_each(|sample| sums.add(&start.terms(sample.place_mm), start.above(&sample), 1.0));
        let solution = sums.solve(TERMS).ok_or_else(|| none(count))?;
        Ok(start.moved(&solution))
    }

    /// The plane through three points, given as columns and rows of `height_mm`; each stands for the mean of the
    /// known heights of 5 x 5 px about it.
    ///
    /// # Errors
    /// [`SurfaceError::NoPoint`] if no height is known about a point, [`SurfaceError::InLine`] if all lie in a line.
    pub fn through(
        heights: &Heights,
        height_mm: &Grid<f32>,
        points: [(usize, usize); 3],
    ) -> Result<Self, SurfaceError> {
        let mut found = [[0.0; 3]; 3];
        for ((x, y), found) in points.into_iter().zip(&mut found) {
            let low = |at: usize| at.saturating_sub(AROUND_PX);
            let last = (height_mm.columns().saturating_sub(1), height_mm.rows().saturating_sub(1));
            let high = ((x + AROUND_PX).min(last.0), (y + AROUND_PX).min(last.1));
            let around = Rectangle::between((low(x), low(y)), high);
            let inside = x <= last.0 && y <= last.1;
            let known = inside.then(|| mean(samples(heights, height_mm, around))).flatten();
            let (_, place, height) = known.ok_or(SurfaceError::NoPoint { x, y })?;
            *found = [place.0, place.1, height];
        }
        if off_line_px(points) < LEAST_OFF_PX {
            return Err(SurfaceError::InLine);
        }
        let [x_mm, y_mm, level_mm] =
            [0, 1, 2].map(|index| found.iter().map(|point| point[index]).sum::<f64>() / 3.0);
        let start = Self { centre_mm: (x_mm, y_mm), level_mm, slopes: (0.0, 0.0) };
        let mut sums = Normal::empty();
        for [x_mm, y_mm, height_mm] in found {
            sums.add(&start.terms((x_mm, y_mm)), height_mm - level_mm, 1.0);
        }
        Ok(start.moved(&sums.solve(TERMS).ok_or(SurfaceError::InLine)?))
    }

    fn terms(&self, (x_mm, y_mm): (f64, f64)) -> [f64; TERMS] {
        [1.0, x_mm - self.centre_mm.0, y_mm - self.centre_mm.1]
    }

    /// How far a pixel lies above the plane, in mm.
    fn above(&self, sample: &Sample) -> f64 {
        sample.height_mm - self.height_mm(sample.place_mm)
    }

    /// With what was found of the rest above it.
    fn moved(&self, rest: &Solution) -> Self {
        let [level, x, y] = [0, 1, 2].map(|index| rest.values[index]);
        Self { level_mm: self.level_mm + level, slopes: (self.slopes.0 + x, self.slopes.1 + y), ..*self }
    }

    /// Its height at X and Y of the camera's frame, all in mm.
    pub fn height_mm(&self, (x_mm, y_mm): (f64, f64)) -> f64 {
        self.level_mm + self.slopes.0 * (x_mm - self.centre_mm.0) + self.slopes.1 * (y_mm - self.centre_mm.1)
    }

    /// What is left of `height_mm`, which has the size of `heights`, above the plane, in mm.
    pub fn removed_from(&self, heights: &Heights, height_mm: &Grid<f32>) -> Grid<f32> {
        let mut rest = height_mm.clone();
        for y in 0..rest.rows() {
            for (x, height) in rest.row_mut(y).iter_mut().enumerate() {
                *height = (f64::from(*height) - self.height_mm(heights.lateral_mm(x, y))) as f32;
            }
        }
        rest
    }
}

impl RegionStatistics {
    /// Of the pixels of `region` whose height and sigma are known. `height_mm` has the size of `heights`, for
    /// example the same without a form, and holds `region`.
    ///
    /// # Errors
    /// [`SurfaceError::NoPlane`] if they are too few, or lie in a line.
    pub fn of(heights: &Heights, height_mm: &Grid<f32>, region: Rectangle) -> Result<Self, SurfaceError> {
        let plane = Plane::least_squares(heights, height_mm, region)?;
        let (rows, columns) = (region.bottom + 1 - region.top, region.right + 1 - region.left);
        let mut rest = Grid::filled(rows, columns, f32::NAN);
        samples(heights, height_mm, region).for_each(|sample| {
            rest.row_mut(sample.at.1 - region.top)[sample.at.0 - region.left] = plane.above(&sample) as f32;
        });
        let sigma = heights.sigma_mm.cropped(region.left..region.right + 1, region.top..region.bottom + 1);
        let found = roughness(&rest, &sigma, |_, _| true).ok_or(SurfaceError::NoPlane { pixels: 0 })?;
        let mut blocks = Blocks::new(rows, columns, &Correlation::of(&rest));
        samples(heights, height_mm, region).for_each(|sample| {
            let (x, y) = (sample.at.0 - region.left, sample.at.1 - region.top);
            blocks.of(x, y).add(&plane.terms(sample.place_mm), plane.above(&sample), 1.0);
        });
        let scatter = blocks.total().solve(TERMS).map(|solution| blocks.scatter(&solution, TERMS));
        let sigma = |index: usize| {
            let of_term: Option<Scatter> = scatter.as_ref().and_then(|scatter| scatter[index]);
            of_term.map(|scatter| scatter.variance.sqrt())
        };
        Ok(Self {
            pixels: rows * columns,
            mean_mm: plane.level_mm,
            mean_sigma_mm: sigma(0),
            plane,
            slope_sigmas: [sigma(1), sigma(2)],
            roughness: found,
        })
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::Geometry;

    /// 120 x 100 px of 0.5 mm, whose X and Y hardly depend on the height; `height_mm` of X and Y.
    fn field(mut height_mm: impl FnMut(f64, f64) -> f64) -> Heights {
        let of = |at: usize, middle: f64| 0.5 * (at as f64 - middle);
        let values = (0..12_000).map(|index| height_mm(of(index % 120, 59.5), of(index / 120, 49.5)) as f32);
        Heights {
            height_mm: Grid::from_values(100, 120, values.collect()).unwrap(),
            sigma_mm: Grid::filled(100, 120, 0.01),
            distance_mm: 1e7,
            geometry: Geometry::exact(2e7, 100.0, (59.5, 49.5)),
        }
    }

    const ALL: Rectangle = Rectangle { left: 0, top: 0, right: 119, bottom: 99 };

    fn assert_near(found: f64, truth: f64, by: f64) {
        assert!((found - truth).abs() < by, "{found}, not {truth}");
    }

    #[test]
    fn a_plane_is_found_and_leaves_nothing() {
        let mut heights = field(|x, y| 0.3 + 0.004 * x - 0.007 * y);
        heights.height_mm.row_mut(50)[3..40].fill(f32::NAN);
        for found in [
            Plane::least_squares(&heights, &heights.height_mm, ALL).unwrap(),
            Plane::through(&heights, &heights.height_mm, [(0, 0), (119, 10), (40, 99)]).unwrap(),
        ] {
            assert_near(found.slopes.0, 0.004, 1e-7);
            assert_near(found.slopes.1, -0.007, 1e-7);
            assert_near(found.height_mm((0.0, 0.0)), 0.3, 1e-6);
            let rest = found.removed_from(&heights, &heights.height_mm);
            let known: Vec<f32> = rest.values().iter().copied().filter(|value| value.is_finite()).collect();
            assert_eq!(known.len(), 12_000 - 37);
            assert!(known.iter().all(|value| value.abs() < 1e-6));
        }
    }

    #[test]
    fn a_tilted_sine_has_the_roughness_of_the_textbook() {
        // Ten whole waves of amplitude A along X, even about the middle: Sa = 2 A / pi, Sq = A / sqrt 2, Sz = 2 A.
        let wave = |x: f64| 0.05 * (std::f64::consts::TAU * x / 6.0).cos();
        let heights = field(|x, y| 2.0 + 0.01 * x + 0.02 * y + wave(x));
        let found = RegionStatistics::of(&heights, &heights.height_mm, ALL).unwrap();
        assert_eq!((found.pixels, found.roughness.pixels), (12_000, 12_000));
        assert_near(found.mean_mm, 2.0, 1e-6);
        assert_near(found.plane.slopes.0, 0.01, 1e-6);
        assert_near(found.plane.slopes.1, 0.02, 1e-6);
        // A wave is seen in 12 pixels.
        let sa = (0..12).map(|at| wave(0.5 * (f64::from(at) + 0.5)).abs()).sum::<f64>() / 12.0;
        assert_near(found.roughness.sa_mm, sa, 1e-6);
        assert_near(found.roughness.sq_mm, 0.05 / 2_f64.sqrt(), 1e-6);
        assert_near(found.roughness.sz_mm, 2.0 * wave(0.25), 1e-6);
    }

    #[test]
    fn the_uncertainty_of_the_mean_is_that_of_its_independent_pixels() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
        let heights = field(|x, _| 0.01 * x + 0.02 * noise());
        let found = RegionStatistics::of(&heights, &heights.height_mm, ALL).unwrap();
        // 0.02 / sqrt(12 000), and over the root of the sum of squares of X for the slope.
        let spread = (12_000.0 * (60.0_f64.powi(2) - 0.25) / 12.0).sqrt();
        for (sigma, truth) in
            [(found.mean_sigma_mm, 0.02 / 12_000_f64.sqrt()), (found.slope_sigmas[0], 0.02 / spread)]
        {
            let ratio = sigma.unwrap() / truth;
            assert!((0.8..1.25).contains(&ratio), "{ratio}");
        }
        assert_near(found.mean_mm, 0.0, 4.0 * 0.02 / 12_000_f64.sqrt());
        assert_near(found.plane.slopes.0, 0.01, 4.0 * 0.02 / spread);
    }

    #[test]
    fn what_determines_no_plane_is_refused() {
        // Heights that differ, seen from near: places of a row do not lie in a line.
        let mut heights = field(|x, y| 0.1 * (7.0 * x).sin() + 0.05 * y);
        heights.distance_mm = 100.0;
        heights.geometry.focal_length_px = 200.0;
        let row = Rectangle { bottom: 0, ..ALL };
        let plane = |heights: &Heights, region| Plane::least_squares(heights, &heights.height_mm, region);
        assert_eq!(plane(&heights, row), Err(SurfaceError::NoPlane { pixels: 120 }));
        let through = |heights: &Heights, points| Plane::through(heights, &heights.height_mm, points);
        assert_eq!(through(&heights, [(0, 0), (50, 50), (90, 90)]), Err(SurfaceError::InLine));
        assert_eq!(
            through(&heights, [(0, 0), (120, 5), (9, 90)]),
            Err(SurfaceError::NoPoint { x: 120, y: 5 })
        );
        assert_eq!(through(&heights, [(7, 7), (7, 7), (90, 20)]), Err(SurfaceError::InLine));
        assert!(plane(&heights, Rectangle { bottom: 1, ..ALL }).is_ok());
        for y in 0..100 {
            heights.height_mm.row_mut(y)[40..].fill(f32::NAN);
        }
        assert_eq!(through(&heights, [(0, 0), (42, 5), (9, 90)]), Err(SurfaceError::NoPoint { x: 42, y: 5 }));
        assert!(through(&heights, [(0, 0), (41, 5), (9, 90)]).is_ok());
    }
}
