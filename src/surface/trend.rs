//! The smooth form of a field: level, tilt, and bow.

use serde::Serialize;

use super::SurfaceError;
use super::blocks::{Blocks, Correlation, Scatter};
use super::height::Heights;
use super::normal::{Normal, Solution};
use super::smooth::{SIGMA_OF_MEDIAN, quantile};
use crate::plane::Plane;

/// Residuals beyond so many standard deviations count by their size, no longer by their square: Huber's choice, which loses 5 % with Gaussian
/// errors.
const HUBER: f64 = 1.345;
/// Pixels beyond so many standard deviations are outliers; of a million Gaussian ones 63 are.
const OUTLIER: f64 = 4.0;
/// Rounds after which weights have settled: each takes the effect of outliers down by half at least.
const ROUNDS: usize = 12;

/// Which form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrendKind {
    /// One height.
    Constant,
    /// A plane: 3 coefficients.
    Plane,
    /// A quadric: 6 coefficients.
    Quadric,
}

impl TrendKind {
    /// Number of coefficients.
    pub fn terms(self) -> usize {
        match self {
            Self::Constant => 1,
            Self::Plane => 3,
            Self::Quadric => 6,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Constant => "a mean height",
            Self::Plane => "a plane",
            Self::Quadric => "a quadric",
        }
    }
}

/// h = c0 + c1 u + c2 v + c3 u^2 + c4 u v + c5 v^2, with u and v in mm from the middle of the field, to the right and down.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trend {
    /// Which form.
    pub kind: TrendKind,
    /// Where u = v = 0 lies: X and Y in the camera's frame, in mm.
    pub centre_mm: (f64, f64),
    /// c0 in mm, c1 and c2 in mm/mm, c3 to c5 in 1/mm; as many as the form has.
    pub coefficients: Vec<f64>,
    /// Their standard deviations, from the scatter between independent parts of the field; `None` where it has too few of them.
    pub sigmas: Vec<Option<f64>>,
    /// Pixels that it was fitted to.
    pub pixels: usize,
    /// Pixels that were left out because they lie too far off.
    pub outliers: usize,
    /// Half the width and half the height of the field, in mm.
    pub half_extent_mm: (f64, f64),
}

impl Trend {
    /// Its height at X and Y of the camera's frame, all in mm.
    pub fn height_mm(&self, x_mm: f64, y_mm: f64) -> f64 {
        let basis = Basis { kind: self.kind, centre: self.centre_mm, scale: 1.0 };
        self.coefficients
            .iter()
            .zip(basis.row(x_mm, y_mm))
            .map(|(coefficient, term)| coefficient * term)
            .sum()
    }

    /// Tilt in the middle of the field along x and along y, in deg; positive where the right or the lower side is nearer to the camera.
    pub fn tilt_deg(&self) -> (f64, f64) {
        let along =
            |index: usize| self.coefficients.get(index).map_or(0.0, |slope| slope.atan().to_degrees());
        (along(1), along(2))
    }

    /// How far the highest point of the field lies over the lowest by its bow alone, in mm; 0 for a plane.
    pub fn bow_mm(&self) -> f64 {
        const STEPS: i32 = 32;
        let &[_, _, _, xx, xy, yy] = &self.coefficients[..] else { return 0.0 };
        let (mut low, mut high) = (0.0_f64, 0.0_f64);
        for i in -STEPS..=STEPS {
            for j in -STEPS..=STEPS {
                let u = f64::from(i) / f64::from(STEPS) * self.half_extent_mm.0;
                let v = f64::from(j) / f64::from(STEPS) * self.half_extent_mm.1;
                let bow = xx * u * u + xy * u * v + yy * v * v;
                (low, high) = (low.min(bow), high.max(bow));
            }
        }
        high - low
    }

    /// The heights without it, in mm.
    pub fn removed_from(&self, heights: &Heights) -> Plane<f32> {
        let mut rest = heights.height_mm.clone();
        for y in 0..rest.rows() {
            for (x, height) in rest.row_mut(y).iter_mut().enumerate() {
                let (x_mm, y_mm) = heights.lateral_mm(x, y);
                *height = (f64::from(*height) - self.height_mm(x_mm, y_mm)) as f32;
            }
        }
        rest
    }
}

/// The terms of a trend, in units in which all are of size 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Basis {
    kind: TrendKind,
    centre: (f64, f64),
    scale: f64,
}

impl Basis {
    pub(super) fn row(&self, x_mm: f64, y_mm: f64) -> [f64; 6] {
        let (u, v) = ((x_mm - self.centre.0) / self.scale, (y_mm - self.centre.1) / self.scale);
        [1.0, u, v, u * u, u * v, v * v]
    }

    pub(super) fn terms(&self) -> usize {
        self.kind.terms()
    }
}

/// A pixel as fits take it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) x: usize,
    pub(super) y: usize,
    /// Terms of the trend at its place.
    pub(super) row: [f64; 6],
    pub(super) height_mm: f64,
    pub(super) sigma_mm: f64,
}

/// Heights with the terms of a trend.
#[derive(Debug, Clone)]
pub(super) struct Field<'a> {
    pub(super) heights: &'a Heights,
    pub(super) basis: Basis,
    half_extent: (f64, f64),
    /// No pixel counts as better known than this: a few that are too sure of themselves must not decide.
    least_sigma: f64,
}

impl<'a> Field<'a> {
    pub(super) fn new(heights: &'a Heights, kind: TrendKind) -> Result<Self, SurfaceError> {
        let mut low = (f64::INFINITY, f64::INFINITY);
        let mut high = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        let mut sigmas = Vec::new();
        for y in 0..heights.height_mm.rows() {
            for x in 0..heights.height_mm.columns() {
                let (height, sigma) = (heights.height_mm.at(x, y), heights.sigma_mm.at(x, y));
                if height.is_finite() && sigma.is_finite() && sigma > 0.0 {
                    let (x_mm, y_mm) = heights.lateral_mm(x, y);
                    low = (low.0.min(x_mm), low.1.min(y_mm));
                    high = (high.0.max(x_mm), high.1.max(y_mm));
                    sigmas.push(f64::from(sigma));
                }
            }
        }
        // Ten pixels for each coefficient are little, and less is no field.
        let too_few = SurfaceError::TooFewPixels { pixels: sigmas.len(), what: kind.name() };
        if sigmas.len() < 10 * kind.terms() {
            return Err(too_few);
        }
        let median = quantile(&mut sigmas, 0.5).ok_or(too_few)?;
        let half_extent = (0.5 * (high.0 - low.0), 0.5 * (high.1 - low.1));
        let basis = Basis {
            kind,
            centre: (0.5 * (low.0 + high.0), 0.5 * (low.1 + high.1)),
            scale: half_extent.0.max(half_extent.1).max(f64::MIN_POSITIVE),
        };
        Ok(Self { heights, basis, half_extent, least_sigma: 0.5 * median })
    }

    /// The pixel, if height and sigma are known there.
    pub(super) fn sample(&self, x: usize, y: usize) -> Option<Sample> {
        let (height, sigma) = (self.heights.height_mm.at(x, y), self.heights.sigma_mm.at(x, y));
        if !(height.is_finite() && sigma.is_finite() && sigma > 0.0) {
            return None;
        }
        let (x_mm, y_mm) = self.heights.lateral_mm(x, y);
        let sigma_mm = f64::from(sigma).max(self.least_sigma);
        Some(Sample { x, y, row: self.basis.row(x_mm, y_mm), height_mm: f64::from(height), sigma_mm })
    }

    pub(super) fn samples(&self) -> impl Iterator<Item = Sample> {
        let (rows, columns) = (self.heights.height_mm.rows(), self.heights.height_mm.columns());
        (0..rows).flat_map(move |y| (0..columns).filter_map(move |x| self.sample(x, y)))
    }

    /// The height of the trend with these coefficients (in the units of the terms) at a pixel.
    pub(super) fn predicted(&self, coefficients: &[f64], sample: &Sample) -> f64 {
        coefficients[..self.basis.terms()]
            .iter()
            .zip(sample.row)
            .map(|(coefficient, term)| coefficient * term)
            .sum()
    }

    pub(super) fn undetermined(&self) -> SurfaceError {
        SurfaceError::Undetermined { what: self.basis.kind.name() }
    }

    /// Coefficients (in the units of the terms) that few pixels far off hardly change.
    pub(super) fn robust(&self) -> Result<Vec<f64>, SurfaceError> {
        let terms = self.basis.terms();
        let mut coefficients = self.solve(|_| 1.0)?;
        for _ in 0..ROUNDS {
            let scatter = self.scatter(&coefficients);
            let weight = |sample: &Sample| {
                let off = (sample.height_mm - self.predicted(&coefficients, sample)).abs() / sample.sigma_mm;
                if off > HUBER * scatter { HUBER * scatter / off } else { 1.0 }
            };
            let next = self.solve(weight)?;
            let change =
                (0..terms).map(|index| (next[index] - coefficients[index]).abs()).fold(0.0, f64::max);
            coefficients = next;
            if change < 1e-3 * scatter * self.least_sigma {
                break;
            }
        }
        Ok(coefficients)
    }

    fn solve(&self, weight: impl Fn(&Sample) -> f64) -> Result<Vec<f64>, SurfaceError> {
        let terms = self.basis.terms();
        let mut sums = Normal::empty();
        for sample in self.samples() {
            sums.add(&sample.row[..terms], sample.height_mm, weight(&sample) / sample.sigma_mm.powi(2));
        }
        Ok(sums.solve(terms).ok_or_else(|| self.undetermined())?.values.as_slice().to_vec())
    }

    /// How far heights scatter about the trend, in units of their own sigma; half of them lie nearer than 0.67 of it.
    fn scatter(&self, coefficients: &[f64]) -> f64 {
        let off = |sample: Sample| {
            (sample.height_mm - self.predicted(coefficients, &sample)).abs() / sample.sigma_mm
        };
        let mut all: Vec<f64> = self.samples().map(off).collect();
        SIGMA_OF_MEDIAN * quantile(&mut all, 0.5).unwrap_or(0.0)
    }

    /// The trend in mm.
    pub(super) fn trend(
        &self,
        solution: &Solution,
        scatter: &[Option<Scatter>],
        pixels: usize,
        outliers: usize,
    ) -> Trend {
        let units = |index: usize| self.basis.scale.powi([0, 1, 1, 2, 2, 2][index]);
        let terms = self.basis.terms();
        let sigma = |index: usize| scatter[index].map(|scatter| scatter.variance.sqrt() / units(index));
        Trend {
            kind: self.basis.kind,
            centre_mm: self.basis.centre,
            coefficients: (0..terms).map(|index| solution.values[index] / units(index)).collect(),
            sigmas: (0..terms).map(sigma).collect(),
            pixels,
            outliers,
            half_extent_mm: self.half_extent,
        }
    }
}

/// The trend of the whole field, weighted by sigma and robust against pixels that do not belong.
///
/// Hollows are part of the field here; where there are two levels, [`find_steps`](super::find_steps) finds the trend of both together.
///
/// # Errors
/// [`SurfaceError`] if there are too few pixels, or they lie in a line.
pub fn fit_trend(heights: &Heights, kind: TrendKind) -> Result<Trend, SurfaceError> {
    let field = Field::new(heights, kind)?;
    let terms = kind.terms();
    let coefficients = field.robust()?;
    let limit = OUTLIER * field.scatter(&coefficients);
    let (rows, columns) = (heights.height_mm.rows(), heights.height_mm.columns());
    let mut residuals = Plane::filled(rows, columns, f32::NAN);
    let (mut kept, mut outliers) = (Vec::new(), 0);
    for sample in field.samples() {
        let residual = (sample.height_mm - field.predicted(&coefficients, &sample)) / sample.sigma_mm;
        if residual.abs() <= limit {
            residuals.row_mut(sample.y)[sample.x] = residual as f32;
            kept.push((sample.x, sample.y));
        } else {
            outliers += 1;
        }
    }
    let mut blocks = Blocks::new(rows, columns, &Correlation::of(&residuals));
    for sample in kept.iter().filter_map(|&(x, y)| field.sample(x, y)) {
        let weight = sample.sigma_mm.powi(-2);
        blocks.of(sample.x, sample.y).add(&sample.row[..terms], sample.height_mm, weight);
    }
    let solution = blocks.total().solve(terms).ok_or_else(|| field.undetermined())?;
    let scatter = blocks.scatter(&solution, terms);
    Ok(field.trend(&solution, &scatter, kept.len(), outliers))
}
