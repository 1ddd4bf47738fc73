//! Depth and trend together, and the depth of each part by itself.

use serde::Serialize;

use super::super::blocks::{Blocks, Correlation, Scatter, student_t_95};
use super::super::error::SurfaceError;
use super::super::normal::{Normal, Solution};
use super::super::trend::{Field, Sample, Trend};
use super::levels::Levels;
use super::options::StepsOptions;
use super::regions::{Level, Region, regions};
use epirig_core::statistics::{SIGMA_OF_MEDIAN, quantile};

use epirig_core::grid::Grid;

/// Pixels beyond this many standard deviations from their level are outliers; of a million Gaussian ones 63
/// are.
const OUTLIER: f64 = 4.0;

/// A plane of its own hardly raises the variance of a part's depth if there is ground on all sides. If it
/// raises it this many times, as at the border of a field, its tilt could stand for the depth, and turns
/// errors at the border into depth.
const STANDS_IN: f64 = 4.0;

/// A depth and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Depth {
    /// How far the lower level lies below the upper one, in mm.
    pub depth_mm: f64,
    /// Standard deviation from the scatter between independent parts of the field, in mm; `None` if there are
    /// too few.
    pub sigma_mm: Option<f64>,
    /// Degrees of freedom: number of independent differences behind it.
    pub degrees_of_freedom: Option<f64>,
    /// Half the width of the interval that holds the depth with 95 % coverage, in mm (Student's t).
    pub half_width_95_mm: Option<f64>,
    /// Standard uncertainty by the scale (focal length, baseline), in mm: the same share of all depths.
    pub scale_sigma_mm: f64,
}

/// A hollow, or a raised part.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Part {
    /// Middle of its pixels, column.
    pub centre_x_px: f64,
    /// Middle of its pixels, row.
    pub centre_y_px: f64,
    /// Its pixels.
    pub area_px: usize,
    /// Its area, in mm^2.
    pub area_mm2: f64,
    /// Its pixels that lie clear of the walls.
    pub used_px: usize,
    /// Its depth against the ground around it, or its height over the ground.
    pub depth: Depth,
}

/// Depth and trend of a divided field.
pub(super) struct Fit {
    pub(super) levels: Levels,
    /// The pixels that took part.
    pub(super) used: Grid<Level>,
    pub(super) pixels: usize,
    solution: Solution,
    outliers: usize,
}

/// How well a fit is known.
pub(super) struct Certainty {
    pub(super) correlation: Correlation,
    /// Standard deviation of the heights used about their level, in mm.
    pub(super) scatter_mm: f64,
    /// Of the trend's coefficients, and of the depth.
    scatter: Vec<Option<Scatter>>,
}

/// The terms of the trend, and -1 on the lower level.
fn row(sample: &Sample, terms: usize, level: Level) -> [f64; 7] {
    let mut row = [0.0; 7];
    row[..terms].copy_from_slice(&sample.row[..terms]);
    row[terms] = if level == Level::Lower { -1.0 } else { 0.0 };
    row
}

/// Fits to the pixels whose level is known in `clear`; `None` if there are none of one level.
pub(super) fn fit(field: &Field<'_>, clear: &Grid<Level>) -> Result<Option<Fit>, SurfaceError> {
    let terms = field.basis.terms();
    let present = |wanted: Level| clear.values().contains(&wanted);
    if !(present(Level::Upper) && present(Level::Lower)) {
        return Ok(None);
    }
    let mut used = clear.clone();
    let mut solution = solve(field, &used)?;
    // A few far off hold the first fit back; without them the second is right, and finds the others.
    for _ in 0..2 {
        let level = |sample: &Sample| clear.at(sample.x, sample.y);
        let known = || field.samples().filter(|sample| level(sample) != Level::Unknown);
        let mut sizes: Vec<f64> = known()
            .map(|sample| off(&solution, &sample, terms, level(&sample)).abs() / sample.sigma_mm)
            .collect();
        let limit = OUTLIER * SIGMA_OF_MEDIAN * quantile(&mut sizes, 0.5).unwrap_or(0.0);
        for sample in known() {
            let level = level(&sample);
            let inside = off(&solution, &sample, terms, level).abs() <= limit * sample.sigma_mm;
            used.row_mut(sample.y)[sample.x] = if inside { level } else { Level::Unknown };
        }
        solution = solve(field, &used)?;
    }
    let count = |map: &Grid<Level>| map.values().iter().filter(|&&level| level != Level::Unknown).count();
    let pixels = count(&used);
    let outliers = count(clear) - pixels;

    let levels = Levels {
        coefficients: solution.values.as_slice()[..terms].to_vec(),
        depth_mm: solution.values[terms],
    };
    Ok(Some(Fit { levels, used, solution, pixels, outliers }))
}

/// How far a pixel lies over its level, in mm.
fn off(solution: &Solution, sample: &Sample, terms: usize, level: Level) -> f64 {
    let row = row(sample, terms, level);
    sample.height_mm
        - row[..=terms].iter().zip(&solution.values).map(|(term, value)| term * value).sum::<f64>()
}

fn solve(field: &Field<'_>, used: &Grid<Level>) -> Result<Solution, SurfaceError> {
    let terms = field.basis.terms();
    let mut sums = Normal::empty();
    for sample in field.samples() {
        let level = used.at(sample.x, sample.y);
        if level != Level::Unknown {
            sums.add(&row(&sample, terms, level)[..=terms], sample.height_mm, sample.sigma_mm.powi(-2));
        }
    }
    sums.solve(terms + 1).ok_or_else(|| field.undetermined())
}

impl Fit {
    pub(super) fn certainty(&self, field: &Field<'_>) -> Certainty {
        let terms = field.basis.terms();
        let (rows, columns) = (self.used.rows(), self.used.columns());
        let level = |sample: &Sample| self.used.at(sample.x, sample.y);
        let used = || field.samples().filter(|sample| level(sample) != Level::Unknown);
        let mut residuals = Grid::filled(rows, columns, f32::NAN);
        let mut squares = 0.0;
        for sample in used() {
            let off = off(&self.solution, &sample, terms, level(&sample));
            residuals.row_mut(sample.y)[sample.x] = (off / sample.sigma_mm) as f32;
            squares += off * off;
        }
        let correlation = Correlation::of(&residuals);
        let mut blocks = Blocks::new(rows, columns, &correlation);
        for sample in used() {
            let row = row(&sample, terms, level(&sample));
            blocks.of(sample.x, sample.y).add(&row[..=terms], sample.height_mm, sample.sigma_mm.powi(-2));
        }
        let scatter = blocks.scatter(&self.solution, terms + 1);
        Certainty { correlation, scatter_mm: (squares / self.pixels.max(1) as f64).sqrt(), scatter }
    }

    pub(super) fn depth(&self, certainty: &Certainty, scale_sigma: f64) -> Depth {
        depth(self.levels.depth_mm, certainty.scatter.last().copied().flatten(), scale_sigma)
    }

    pub(super) fn trend(&self, field: &Field<'_>, certainty: &Certainty) -> Trend {
        field.trend(&self.solution, &certainty.scatter, self.pixels, self.outliers)
    }

    /// Factor by which correlated errors raise the variance of a depth over that of independent pixels with
    /// their sigma.
    fn raised_by(&self, certainty: &Certainty) -> Option<Scatter> {
        let last = certainty.scatter.len() - 1;
        let alone = self.solution.inverse[(last, last)];
        certainty.scatter[last].map(|scatter| Scatter { variance: scatter.variance / alone, ..scatter })
    }
}

fn depth(depth_mm: f64, scatter: Option<Scatter>, scale_sigma: f64) -> Depth {
    let sigma_mm = scatter.map(|scatter| scatter.variance.sqrt());
    let degrees_of_freedom = scatter.map(|scatter| scatter.degrees_of_freedom);
    Depth {
        depth_mm,
        sigma_mm,
        degrees_of_freedom,
        half_width_95_mm: sigma_mm
            .zip(degrees_of_freedom)
            .map(|(sigma, degrees)| sigma * student_t_95(degrees)),
        scale_sigma_mm: depth_mm.abs() * scale_sigma,
    }
}

/// The parts of the level that is not the ground, each against the ground around it.
pub(super) fn parts(
    field: &Field<'_>,
    levels: &Grid<Level>,
    fit: &Fit,
    certainty: &Certainty,
    raised: bool,
    options: &StepsOptions,
) -> Vec<Part> {
    let raised_by = fit.raised_by(certainty);
    let wanted = if raised { Level::Upper } else { Level::Lower };
    let found = regions(levels).into_iter().filter(|region| region.value == wanted);
    found.filter_map(|region| part(field, &region, fit, raised_by, options)).collect()
}

/// The depth of a part, with a plane of its own under it and the ground around it, so that a residual trend
/// does not tilt it (a level, where ground lies on one side only). `None` if nothing of the part or of its
/// surroundings is clear of the walls.
fn part(
    field: &Field<'_>,
    region: &Region,
    fit: &Fit,
    raised_by: Option<Scatter>,
    options: &StepsOptions,
) -> Option<Part> {
    let area_px = region.pixels.len();
    let mean = |of: fn(&(usize, usize)) -> usize| {
        region.pixels.iter().map(of).sum::<usize>() as f64 / area_px as f64
    };
    let (centre_x_px, centre_y_px) = (mean(|pixel| pixel.0), mean(|pixel| pixel.1));
    let scale = (area_px as f64).sqrt();
    let mut sums = Normal::empty();
    let mut used_px = 0;
    let mut add = |x: usize, y: usize, inside: bool| {
        let level = fit.used.at(x, y);
        if let Some(sample) = field.sample(x, y).filter(|_| level != Level::Unknown) {
            let rest = sample.height_mm - fit.levels.upper_mm(&sample.row);
            let (u, v) = ((x as f64 - centre_x_px) / scale, (y as f64 - centre_y_px) / scale);
            let lowered = if level == Level::Lower { -1.0 } else { 0.0 };
            sums.add(&[1.0, lowered, u, v], rest, sample.sigma_mm.powi(-2));
            used_px += usize::from(inside);
        }
    };
    region.pixels.iter().for_each(|&(x, y)| add(x, y, true));
    around(region, fit, options).into_iter().for_each(|(x, y)| add(x, y, false));
    let level = sums.solve(2)?;
    let tilted = sums.solve(4).filter(|tilted| tilted.inverse[(1, 1)] < STANDS_IN * level.inverse[(1, 1)]);
    let solution = tilted.unwrap_or(level);
    let alone = solution.inverse[(1, 1)];
    let scatter = raised_by.map(|factor| Scatter { variance: factor.variance * alone, ..factor });
    Some(Part {
        centre_x_px,
        centre_y_px,
        area_px,
        area_mm2: area_px as f64 * field.heights.pixel_mm().powi(2),
        used_px,
        depth: depth(solution.values[1], scatter, field.heights.geometry.scale_sigma),
    })
}

/// Pixels of the other level near the region: as far from its walls as it is wide, in the mean.
fn around(region: &Region, fit: &Fit, options: &StepsOptions) -> Vec<(usize, usize)> {
    let (rows, columns) = (fit.used.rows(), fit.used.columns());
    let mut reached = Grid::filled(rows, columns, false);
    region.pixels.iter().for_each(|&(x, y)| reached.row_mut(y)[x] = true);
    let beside = |(x, y): (usize, usize)| {
        let four = [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)];
        four.into_iter().filter(move |&(x, y)| x < columns && y < rows)
    };
    let is_border = |&pixel: &(usize, usize)| beside(pixel).any(|(x, y)| !reached.at(x, y));
    let mut front: Vec<(usize, usize)> = region.pixels.iter().copied().filter(is_border).collect();
    // A stripe's area over half its border is its width, a disc's is its radius.
    let width = 2 * region.pixels.len() / front.len().max(1);
    let reach = 2 * options.margin_px + width.max(options.margin_px);
    let mut found = Vec::new();
    for _ in 0..reach {
        let mut next = Vec::new();
        for (x, y) in front.into_iter().flat_map(beside) {
            if !reached.at(x, y) {
                reached.row_mut(y)[x] = true;
                next.push((x, y));
            }
        }
        let on_ground = |&&(x, y): &&(usize, usize)| {
            let level = fit.used.at(x, y);
            level != Level::Unknown && level != region.value
        };
        found.extend(next.iter().filter(on_ground));
        front = next;
    }
    found
}
