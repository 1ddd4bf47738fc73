//! The form of a field: level, tilt and bow.

use serde::Serialize;

use super::SurfaceError;
use super::blocks::{Blocks, Correlation, Scatter};
use super::height::Heights;
use super::normal::{MOST_TERMS, Normal, Solution};
use epirig_core::choice::Choice as _;
use epirig_core::grid::Grid;
use epirig_core::statistics::{SIGMA_OF_MEDIAN, quantile};

/// Residuals beyond this many standard deviations do not count, and nearer ones the less the larger they are:
/// Tukey's biweight, which loses 5 % with Gaussian errors. Huber's weights never reach zero, so a rim of
/// wrong answers would pull a quadric, which nothing holds there.
const BIWEIGHT: f64 = 4.685;
/// Pixels beyond this many standard deviations are outliers; of a million Gaussian ones 63 are.
const OUTLIER: f64 = 4.0;
/// Rounds until weights converge: each reduces the effect of outliers to half at most.
const ROUNDS: usize = 12;

epirig_core::choices! {
    /// Which form.
    pub enum TrendKind {
        /// Only the level: 1 coefficient.
        Constant = "constant",
        /// Level and tilt: 3 coefficients.
        Plane = "plane",
        /// Level, tilt and bow: 6 coefficients.
        Quadric = "quadric",
        /// Level, tilt, bow and third powers, as uncorrected lenses cause: 10 coefficients.
        Cubic = "cubic",
    }
}

impl TrendKind {
    /// Number of coefficients, the form in words, and the least side of its field in px.
    ///
    /// A plane needs two columns and rows, a quadric three, a cubic four: less are only told apart by how
    /// their heights shift them. Half a pixel is left for that shift.
    fn facts(self) -> (usize, &'static str, f64) {
        match self {
            Self::Constant => (1, "a mean height", 0.0),
            Self::Plane => (3, "a plane", 0.5),
            Self::Quadric => (6, "a quadric", 1.5),
            Self::Cubic => (MOST_TERMS, "a cubic", 2.5),
        }
    }

    /// Number of coefficients.
    pub fn terms(self) -> usize {
        self.facts().0
    }

    /// The form with the powers of one more degree.
    pub(super) fn richer(self) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.terms() > self.terms())
    }
}

/// The degree of each term.
const DEGREES: [i32; MOST_TERMS] = [0, 1, 1, 2, 2, 2, 3, 3, 3, 3];
/// The terms of tilt and level come first.
const PLANE_TERMS: usize = 3;

/// h = c0 + c1 u + c2 v + c3 u^2 + c4 u v + c5 v^2 + c6 u^3 + c7 u^2 v + c8 u v^2 + c9 v^3, with u and v in
/// mm from the middle of the field, to the right and down.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trend {
    /// Which form.
    pub kind: TrendKind,
    /// Place of u = v = 0: X and Y in the camera's frame, in mm.
    pub centre_mm: (f64, f64),
    /// c0 in mm, c1 and c2 in mm/mm, c3 to c5 in 1/mm, c6 to c9 in 1/mm^2; as many as the form has.
    pub coefficients: Vec<f64>,
    /// Their standard deviations, from the scatter between independent parts of the field; `None` where it
    /// has too few of them.
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
        at(&self.coefficients, &basis.row(x_mm, y_mm))
    }

    /// Tilt in the middle of the field along x and along y, in deg; positive where the right or the lower
    /// side is nearer to the camera.
    pub fn tilt_deg(&self) -> (f64, f64) {
        let along =
            |index: usize| self.coefficients.get(index).map_or(0.0, |slope| slope.atan().to_degrees());
        (along(1), along(2))
    }

    /// How far the highest point of the field lies over the lowest by its bow alone, in mm; 0 for a plane.
    pub fn bow_mm(&self) -> f64 {
        self.bow_of(self.coefficients.get(PLANE_TERMS..).unwrap_or_default())
    }

    /// Standard uncertainty of [`Self::bow_mm`] by the scatter of the heights, in mm: as if all coefficients of the
    /// bow erred together and in one direction, which is the worst. `None` if the scatter is not known, or the form
    /// has no bow.
    pub fn bow_sigma_mm(&self) -> Option<f64> {
        let sigmas = self.sigmas.get(PLANE_TERMS..).filter(|sigmas| !sigmas.is_empty())?;
        let of_term = |(index, sigma): (usize, &Option<f64>)| {
            let mut alone = vec![0.0; sigmas.len()];
            alone[index] = (*sigma)?;
            Some(self.bow_of(&alone))
        };
        sigmas.iter().enumerate().map(of_term).sum()
    }

    /// From the lowest to the highest point of a form with these coefficients behind those of the plane, in mm.
    fn bow_of(&self, curved: &[f64]) -> f64 {
        const STEPS: i32 = 32;
        let basis = Basis { kind: self.kind, centre: (0.0, 0.0), scale: 1.0 };
        let (mut low, mut high) = (0.0_f64, 0.0_f64);
        for i in -STEPS..=STEPS {
            for j in -STEPS..=STEPS {
                let u = f64::from(i) / f64::from(STEPS) * self.half_extent_mm.0;
                let v = f64::from(j) / f64::from(STEPS) * self.half_extent_mm.1;
                let bow = at(curved, &basis.row(u, v)[PLANE_TERMS..]);
                (low, high) = (low.min(bow), high.max(bow));
            }
        }
        high - low
    }

    /// The heights without it, in mm.
    pub fn removed_from(&self, heights: &Heights) -> Grid<f32> {
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
    #[inline]
    pub(super) fn row(&self, x_mm: f64, y_mm: f64) -> [f64; MOST_TERMS] {
        let (u, v) = ((x_mm - self.centre.0) / self.scale, (y_mm - self.centre.1) / self.scale);
        let (uu, uv, vv) = (u * u, u * v, v * v);
        [1.0, u, v, uu, uv, vv, u * uu, u * uv, v * uv, v * vv]
    }

    pub(super) fn terms(&self) -> usize {
        self.kind.terms()
    }
}

/// The height of a trend with these coefficients at the place with these terms.
pub(super) fn at(coefficients: &[f64], terms: &[f64]) -> f64 {
    coefficients.iter().zip(terms).map(|(coefficient, term)| coefficient * term).sum()
}

/// A pixel as fits take it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) x: usize,
    pub(super) y: usize,
    /// Terms of the trend at its place.
    pub(super) row: [f64; MOST_TERMS],
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
        let (terms, what, least_px) = kind.facts();
        let too_few = SurfaceError::TooFewPixels { pixels: sigmas.len(), what };
        if sigmas.len() < 10 * terms {
            return Err(too_few);
        }
        let median = quantile(&mut sigmas, 0.5).ok_or(too_few)?;
        let half_extent = (0.5 * (high.0 - low.0), 0.5 * (high.1 - low.1));
        if 2.0 * half_extent.0.min(half_extent.1) < least_px * heights.pixel_mm() {
            return Err(SurfaceError::Undetermined { what });
        }
        let basis = Basis {
            kind,
            centre: (0.5 * (low.0 + high.0), 0.5 * (low.1 + high.1)),
            scale: half_extent.0.max(half_extent.1).max(f64::MIN_POSITIVE),
        };
        Ok(Self { heights, basis, half_extent, least_sigma: 0.5 * median })
    }

    /// Other heights of the same field, with the same terms.
    pub(super) fn with_heights<'b>(&self, heights: &'b Heights) -> Result<Field<'b>, SurfaceError> {
        let other = Field::new(heights, self.basis.kind)?;
        Ok(Field { basis: self.basis, half_extent: self.half_extent, ..other })
    }

    /// The same heights with the terms of one more degree at the same place; `None` if there is no such form,
    /// or too few pixels for it.
    pub(super) fn richer(&self) -> Option<Field<'a>> {
        let kind = self.basis.kind.richer()?;
        let richer = Field::new(self.heights, kind).ok()?;
        Some(Field { basis: Basis { kind, ..self.basis }, ..richer })
    }

    /// The pixel, if height and sigma are known there.
    #[inline]
    pub(super) fn sample(&self, x: usize, y: usize) -> Option<Sample> {
        let (height, sigma) = (self.heights.height_mm.at(x, y), self.heights.sigma_mm.at(x, y));
        if !(height.is_finite() && sigma.is_finite() && sigma > 0.0) {
            return None;
        }
        let (x_mm, y_mm) = self.heights.lateral_mm(x, y);
        let sigma_mm = f64::from(sigma).max(self.least_sigma);
        Some(Sample { x, y, row: self.basis.row(x_mm, y_mm), height_mm: f64::from(height), sigma_mm })
    }

    /// All pixels, from top to bottom. `for_each` runs over them faster than a loop does.
    pub(super) fn samples(&self) -> impl Iterator<Item = Sample> {
        self.samples_where(|_, _| true)
    }

    /// The pixels whose column and row are `wanted`.
    pub(super) fn samples_where<'b>(
        &'b self,
        wanted: impl Fn(usize, usize) -> bool + Copy + 'b,
    ) -> impl Iterator<Item = Sample> + 'b {
        let (rows, columns) = (self.heights.height_mm.rows(), self.heights.height_mm.columns());
        (0..rows).flat_map(move |y| {
            (0..columns).filter(move |&x| wanted(x, y)).filter_map(move |x| self.sample(x, y))
        })
    }

    pub(super) fn undetermined(&self) -> SurfaceError {
        SurfaceError::Undetermined { what: self.basis.kind.facts().1 }
    }

    /// Coefficients (in the units of the terms) that few pixels far off hardly change: from a start that
    /// bears them, with the scatter about that (an MM-estimate, Yohai 1987).
    pub(super) fn robust(&self) -> Result<Vec<f64>, SurfaceError> {
        let mut coefficients = self.start()?;
        let scatter = self.scatter(&coefficients);
        for _ in 0..ROUNDS {
            let weight = |sample: &Sample| {
                // Of a field without any scatter all pixels count that lie on the trend.
                let off = self.off(&coefficients, sample) / (BIWEIGHT * scatter).max(f64::MIN_POSITIVE);
                if off < 1.0 { (1.0 - off * off).powi(2) } else { 0.0 }
            };
            let next = self.solve(weight)?;
            let change = next
                .iter()
                .zip(&coefficients)
                .map(|(next, before)| (next - before).abs())
                .fold(0.0, f64::max);
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
        self.samples().for_each(|sample| {
            sums.add(&sample.row[..terms], sample.height_mm, weight(&sample) / sample.sigma_mm.powi(2));
        });
        Ok(sums.solve(terms).ok_or_else(|| self.undetermined())?.values.as_slice().to_vec())
    }

    /// How far heights scatter about the trend, in units of their own sigma; half of them lie nearer than
    /// 0.67 of it.
    pub(super) fn scatter(&self, coefficients: &[f64]) -> f64 {
        let mut all = Vec::new();
        self.samples().for_each(|sample| all.push(self.off(coefficients, &sample)));
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
        let units = |index: usize| self.basis.scale.powi(DEGREES[index]);
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
/// Hollows are part of the field here; where there are two levels, [`find_steps`](super::find_steps) finds
/// the trend of both together.
///
/// # Errors
/// [`SurfaceError`] if there are too few pixels, or they lie in a line.
pub fn fit_trend(heights: &Heights, kind: TrendKind) -> Result<Trend, SurfaceError> {
    let field = Field::new(heights, kind)?;
    let terms = kind.terms();
    let mut coefficients = field.robust()?;
    let (rows, columns) = (heights.height_mm.rows(), heights.height_mm.columns());
    // Outliers far off still pull at the first of these, and may take right pixels at the edge with them;
    // without outliers the second is right.
    for _ in 0..2 {
        let limit = OUTLIER * field.scatter(&coefficients);
        coefficients =
            field.solve(|sample| f64::from(u8::from(field.off(&coefficients, sample) <= limit)))?;
    }
    let limit = OUTLIER * field.scatter(&coefficients);
    let mut residuals = Grid::filled(rows, columns, f32::NAN);
    let (mut kept, mut outliers) = (Vec::new(), 0);
    for sample in field.samples() {
        let residual = (sample.height_mm - at(&coefficients, &sample.row)) / sample.sigma_mm;
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

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::Geometry;

    /// c0 to c5 in mm, mm/mm and 1/mm.
    const TRUTH: [f64; 6] = [0.3, 0.004, -0.007, 2e-4, -1e-4, -1.5e-4];

    /// 100 x 80 px of 0.5 mm, its middle on the optical axis, `height_mm` of u and v in mm; white errors of
    /// `sigma_mm`.
    fn field(sigma_mm: f64, height_mm: impl Fn(f64, f64) -> f64) -> Heights {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let mut error = || -> f64 { StandardNormal.sample(&mut random) };
        let values = (0..8000).map(|index| {
            let (u, v) = (0.5 * (f64::from(index % 100) - 49.5), 0.5 * (f64::from(index / 100) - 39.5));
            (height_mm(u, v) + sigma_mm * error()) as f32
        });
        Heights {
            height_mm: Grid::from_values(80, 100, values.collect()).unwrap(),
            sigma_mm: Grid::filled(80, 100, sigma_mm.max(1e-6) as f32),
            // So far away that X and Y do not depend on the height.
            distance_mm: 1e6,
            geometry: Geometry::exact(2e6, 100.0, (49.5, 39.5)),
        }
    }

    fn quadric(u: f64, v: f64) -> f64 {
        let [c0, c1, c2, c3, c4, c5] = TRUTH;
        c0 + c1 * u + c2 * v + c3 * u * u + c4 * u * v + c5 * v * v
    }

    fn assert_is_the_truth(trend: &Trend) {
        for ((found, sigma), truth) in trend.coefficients.iter().zip(&trend.sigmas).zip(TRUTH) {
            let sigma = sigma.unwrap();
            assert!((found - truth).abs() < 4.0 * sigma, "{found} +- {sigma}, not {truth}");
            // 0.02 mm / sqrt(8000) on heights of up to 0.3 mm: far below the coefficients themselves.
            assert!(sigma < 0.05 * truth.abs(), "{truth} +- {sigma}");
        }
    }

    #[test]
    fn a_trend_without_noise_is_found_with_tilt_and_bow() {
        let heights = field(0.0, quadric);
        let found = fit_trend(&heights, TrendKind::Quadric).unwrap();
        for (coefficient, truth) in found.coefficients.iter().zip(TRUTH) {
            // Heights are stored to 3e-8.
            assert!((coefficient - truth).abs() < 1e-6 * truth.abs().max(1e-2), "{coefficient}, not {truth}");
        }
        // atan 0.004 and -atan 0.007.
        let (x, y) = found.tilt_deg();
        assert!((x - 0.229_182).abs() < 1e-4 && (y + 0.401_064).abs() < 1e-4, "{x}, {y}");
        // Over u to 24.75 and v to 19.75 the bow is highest where its slope along v is none, v = -u / 3:
        // 2.1667e-4 u^2 = 0.132722 mm; lowest where that along u is none, u = v / 4: -1.625e-4 v^2 =
        // -0.063385 mm. 65 points along a side find the extrema to 1 in 1000.
        assert!((found.bow_mm() - 0.196_107).abs() < 2e-4, "{}", found.bow_mm());
        // Half a mm^-1 of u^2 is known: over 24.75 mm that is 306 mm; and 1 mm^-1 of u v: 2 (24.75) (19.75) = 978 mm.
        let sigmas = [0.0, 0.0, 0.0, 0.5, 1.0, 0.0].map(Some).to_vec();
        let with_sigmas = Trend { sigmas, ..found.clone() };
        let worst_mm = 0.5 * 24.75_f64.powi(2) + 2.0 * 24.75 * 19.75;
        // The extent comes from places that are computed from disparities of 32 bit.
        let told_mm = with_sigmas.bow_sigma_mm().unwrap();
        assert!((told_mm / worst_mm - 1.0).abs() < 1e-6, "{told_mm}, not {worst_mm}");
        let rest = found.removed_from(&heights);
        assert!(rest.values().iter().all(|height| height.abs() < 1e-6));
        assert_eq!(fit_trend(&heights, TrendKind::Plane).unwrap().bow_sigma_mm(), None);
        assert_eq!(fit_trend(&heights, TrendKind::Plane).unwrap().bow_mm(), 0.0);
    }

    #[test]
    fn a_trend_with_noise_is_as_well_known_as_it_says() {
        let found = fit_trend(&field(0.02, quadric), TrendKind::Quadric).unwrap();
        assert_is_the_truth(&found);
        // 63 of a million pixels lie beyond four standard deviations.
        assert!(found.outliers <= 5 && found.pixels + found.outliers == 8000, "{found:?}");
    }

    #[test]
    fn wrong_answers_at_one_side_do_not_tilt_the_trend() {
        // The outermost fifth is another surface, 17 mm away and sloping: a fit to all bends towards it by
        // millimetres.
        let heights = field(0.02, |u, v| if u > 14.9 { 17.0 - 0.3 * u + 0.1 * v } else { quadric(u, v) });
        let found = fit_trend(&heights, TrendKind::Quadric).unwrap();
        // Columns of u = 15.25 to 24.75 mm.
        assert!((1600..=1605).contains(&found.outliers), "{}", found.outliers);
        // The centre is still the middle of the whole field.
        assert_is_the_truth(&found);
    }

    #[test]
    fn what_cannot_be_fitted_is_refused() {
        let heights = field(0.0, quadric);
        let row =
            heights.only(&Grid::from_values(80, 100, (0..8000).map(|i| i / 100 == 7).collect()).unwrap());
        assert_eq!(
            fit_trend(&row, TrendKind::Plane).unwrap_err(),
            SurfaceError::Undetermined { what: "a plane" }
        );
        assert!(fit_trend(&row, TrendKind::Constant).is_ok());
        let few =
            heights.only(&Grid::from_values(80, 100, (0..8000).map(|i| i % 161 == 0).collect()).unwrap());
        // Every 161st of 8000, the first included: 50.
        assert_eq!(
            fit_trend(&few, TrendKind::Quadric).unwrap_err(),
            SurfaceError::TooFewPixels { pixels: 50, what: "a quadric" }
        );
    }
}
