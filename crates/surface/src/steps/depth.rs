//! Depth and trend together, and the depth of each part by itself.

use serde::Serialize;

use super::super::blocks::{Blocks, Correlation, Scatter};
use super::super::normal::{MOST, Normal, Solution};
use super::super::student::student_t_95;
use super::super::trend::{Field, Sample, Trend, at};
use super::levels::Levels;
use super::options::StepsOptions;
use super::regions::{Level, Region, count, regions};
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

/// Heights, and the levels that they are measured on.
pub(super) struct Side<'a> {
    pub(super) field: &'a Field<'a>,
    /// Clear of the walls.
    pub(super) clear: Grid<Level>,
}

/// Depth and trend of a divided field.
pub(super) struct Fit {
    pub(super) levels: Levels,
    /// The pixels that took part, of each side.
    pub(super) used: Vec<Grid<Level>>,
    /// Their number; one of both sides counts once.
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
#[inline]
fn row(sample: &Sample, terms: usize, level: Level) -> [f64; MOST] {
    let mut row = [0.0; MOST];
    row[..terms].copy_from_slice(&sample.row[..terms]);
    row[terms] = if level == Level::Lower { -1.0 } else { 0.0 };
    row
}

/// Fits one depth and one trend to the pixels of all `sides` whose level is known; `None` if there are none of
/// one level, or so few that they do not determine both. All sides have the same terms.
pub(super) fn fit(sides: &[Side<'_>]) -> Option<Fit> {
    let terms = sides.first()?.field.basis.terms();
    let present = |wanted: Level| sides.iter().all(|side| side.clear.values().contains(&wanted));
    if !(present(Level::Upper) && present(Level::Lower)) {
        return None;
    }
    let mut used: Vec<Grid<Level>> = sides.iter().map(|side| side.clear.clone()).collect();
    let height_mm = |_: usize, sample: &Sample| sample.height_mm;
    let mut solution = solve(sides, &used, height_mm)?;
    // A few far off hold the first fit back; without them the second is right, and finds the others.
    for _ in 0..2 {
        for (side, used) in sides.iter().zip(&mut used) {
            let mut sizes = Vec::new();
            known(side.field, &side.clear).for_each(|(sample, level)| {
                sizes.push(off(&solution, &sample, terms, level).abs() / sample.sigma_mm);
            });
            let limit = OUTLIER * SIGMA_OF_MEDIAN * quantile(&mut sizes, 0.5).unwrap_or(0.0);
            known(side.field, &side.clear).for_each(|(sample, level)| {
                let inside = off(&solution, &sample, terms, level).abs() <= limit * sample.sigma_mm;
                used.row_mut(sample.y)[sample.x] = if inside { level } else { Level::Unknown };
            });
        }
        solution = solve(sides, &used, height_mm)?;
    }
    let clear = sides.iter().map(|side| &side.clear).collect::<Vec<_>>();
    let pixels = known_pixels(&used.iter().collect::<Vec<_>>());
    let outliers = known_pixels(&clear) - pixels;
    let levels = Levels {
        coefficients: solution.values.as_slice()[..terms].to_vec(),
        depth_mm: solution.values[terms],
    };
    Some(Fit { levels, used, solution, pixels, outliers })
}

/// Pixels whose level is known in any of the maps.
fn known_pixels(maps: &[&Grid<Level>]) -> usize {
    let all = maps.first().map_or(0, |map| map.values().len());
    (0..all).filter(|&index| maps.iter().any(|map| map.values()[index] != Level::Unknown)).count()
}

/// How far a pixel lies over its level, in mm.
#[inline]
fn off(solution: &Solution, sample: &Sample, terms: usize, level: Level) -> f64 {
    sample.height_mm - at(solution.values.as_slice(), &row(sample, terms, level))
}

/// The trend and the depth that fit best to values of the pixels used, which have a side by its index.
fn solve(
    sides: &[Side<'_>],
    used: &[Grid<Level>],
    value_mm: impl Fn(usize, &Sample) -> f64,
) -> Option<Solution> {
    let terms = sides[0].field.basis.terms();
    let mut sums = Normal::empty();
    for (index, (side, used)) in sides.iter().zip(used).enumerate() {
        known(side.field, used).for_each(|(sample, level)| {
            let row = row(&sample, terms, level);
            sums.add(&row[..=terms], value_mm(index, &sample), sample.sigma_mm.powi(-2));
        });
    }
    sums.solve(terms + 1)
}

/// The pixels whose level is known, with their levels.
fn known<'a>(field: &'a Field<'_>, levels: &'a Grid<Level>) -> impl Iterator<Item = (Sample, Level)> + 'a {
    let is_known = |x, y| levels.at(x, y) != Level::Unknown;
    field.samples_where(is_known).map(|sample| (sample, levels.at(sample.x, sample.y)))
}

impl Fit {
    /// Pixels of a level that took part, of all sides.
    pub(super) fn count(&self, level: Level) -> usize {
        self.used.iter().map(|used| count(used, level)).sum()
    }

    pub(super) fn certainty(&self, sides: &[Side<'_>]) -> Certainty {
        let terms = sides[0].field.basis.terms();
        let (rows, columns) = (self.used[0].rows(), self.used[0].columns());
        // What is off in several sides: their mean.
        let [mut residuals, mut offs, mut counts] = [(); 3].map(|()| Grid::filled(rows, columns, 0.0_f32));
        for (side, used) in sides.iter().zip(&self.used) {
            known(side.field, used).for_each(|(sample, level)| {
                let (Sample { x, y, sigma_mm, .. }, off) =
                    (sample, off(&self.solution, &sample, terms, level));
                residuals.row_mut(y)[x] += (off / sigma_mm) as f32;
                offs.row_mut(y)[x] += off as f32;
                counts.row_mut(y)[x] += 1.0;
            });
        }
        let sums = residuals.values_mut().iter_mut().zip(offs.values_mut()).zip(counts.values());
        sums.for_each(|((residual, off), &count)| (*residual, *off) = (*residual / count, *off / count));
        let squares: f64 =
            offs.values().iter().filter(|off| !off.is_nan()).map(|&off| f64::from(off).powi(2)).sum();
        let correlation = Correlation::of(&residuals);
        let mut blocks = Blocks::new(rows, columns, &correlation);
        for (side, used) in sides.iter().zip(&self.used) {
            known(side.field, used).for_each(|(sample, level)| {
                let row = row(&sample, terms, level);
                blocks.of(sample.x, sample.y).add(&row[..=terms], sample.height_mm, sample.sigma_mm.powi(-2));
            });
        }
        let scatter = blocks.scatter(&self.solution, terms + 1);
        Certainty { correlation, scatter_mm: (squares / self.pixels.max(1) as f64).sqrt(), scatter }
    }

    pub(super) fn depth(&self, certainty: &Certainty, scale_sigma: f64) -> Depth {
        depth(self.levels.depth_mm, certainty.scatter.last().copied().flatten(), scale_sigma)
    }

    /// What `errors_mm` of the heights, a map for each side, do to the depth, in mm; no map: none.
    pub(super) fn error_of_depth(&self, sides: &[Side<'_>], errors_mm: &[Option<&Grid<f32>>]) -> Option<f64> {
        let error_mm = |side: usize, sample: &Sample| {
            errors_mm[side].map_or(0.0, |errors| f64::from(errors.at(sample.x, sample.y)))
        };
        solve(sides, &self.used, error_mm)?.values.iter().next_back().copied()
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
    sides: &[Side<'_>],
    levels: &Grid<Level>,
    fit: &Fit,
    certainty: &Certainty,
    raised: bool,
    options: &StepsOptions,
) -> Vec<Part> {
    let raised_by = fit.raised_by(certainty);
    let wanted = if raised { Level::Upper } else { Level::Lower };
    let found = regions(levels).into_iter().filter(|region| region.value == wanted);
    found.filter_map(|region| part(sides, &region, fit, raised_by, options)).collect()
}

/// The depth of a part, with a plane of its own under it and the ground around it, so that a residual trend
/// does not tilt it (a level, where ground lies on one side only). `None` if nothing of the part or of its
/// surroundings is clear of the walls.
fn part(
    sides: &[Side<'_>],
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
    let mut inside = Grid::filled(fit.used[0].rows(), fit.used[0].columns(), false);
    region.pixels.iter().for_each(|&(x, y)| inside.row_mut(y)[x] = true);
    let beside = around(&inside, region, options);
    let mut used_px = 0;
    for (side, used) in sides.iter().zip(&fit.used) {
        let mut add = |&(x, y): &(usize, usize), wanted: Level| {
            let Some(sample) = side.field.sample(x, y).filter(|_| used.at(x, y) == wanted) else { return 0 };
            let rest = sample.height_mm - fit.levels.upper_mm(&sample.row);
            let (u, v) = ((x as f64 - centre_x_px) / scale, (y as f64 - centre_y_px) / scale);
            let lowered = if wanted == Level::Lower { -1.0 } else { 0.0 };
            sums.add(&[1.0, lowered, u, v], rest, sample.sigma_mm.powi(-2));
            1
        };
        let own: usize = region.pixels.iter().map(|pixel| add(pixel, region.value)).sum();
        used_px = used_px.max(own);
        beside.iter().for_each(|pixel| _ = add(pixel, region.value.other()));
    }
    let heights = sides[0].field.heights;
    let level = sums.solve(2)?;
    let tilted = sums.solve(4).filter(|tilted| tilted.inverse[(1, 1)] < STANDS_IN * level.inverse[(1, 1)]);
    let solution = tilted.unwrap_or(level);
    let alone = solution.inverse[(1, 1)];
    let scatter = raised_by.map(|factor| Scatter { variance: factor.variance * alone, ..factor });
    Some(Part {
        centre_x_px,
        centre_y_px,
        area_px,
        area_mm2: area_px as f64 * heights.pixel_mm().powi(2),
        used_px,
        depth: depth(solution.values[1], scatter, heights.geometry.scale.together()),
    })
}

/// Pixels near the region: as far from it as it is wide, in the mean.
fn around(inside: &Grid<bool>, region: &Region, options: &StepsOptions) -> Vec<(usize, usize)> {
    let (rows, columns) = (inside.rows(), inside.columns());
    let mut reached = inside.clone();
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
        found.extend(&next);
        front = next;
    }
    found
}
