//! Which pixels lie on which level: a division by smoothed heights.

use super::super::SurfaceError;
use super::super::height::Heights;
use super::super::smooth::{mean_around, without_spikes};
use super::super::trend::{Field, at};
use super::depth::{Fit, Side, fit};
use super::levels::{Levels, Point, two_levels};
use super::options::StepsOptions;
use super::plateaus::Plateaus;
use super::regions::{Level, clear_of_walls, count, without_small_parts};
use epirig_core::grid::Grid;
use epirig_core::statistics::{SIGMA_OF_MEDIAN, quantile};

/// Smoothing that is tried, as the reach to each side in px: as little as will do, since it takes the edges
/// off narrow hollows.
const REACHES: [usize; 6] = [0, 1, 2, 4, 8, 16];
/// Depth over the scatter of smoothed heights at which 3 in 1000 pixels fall on the wrong side of the middle,
/// and more smoothing gains nothing ...
const CLEAR: f64 = 6.0;
/// ... and the least that is accepted: then 2 in 100 do, few of which are connected. One Gaussian level cut
/// in two gives 2.7.
const LEAST: f64 = 4.0;
/// Most rounds of fitting and dividing again; three or four are enough.
const ROUNDS: usize = 12;
/// Points that the search for levels looks at: they then are known to a fiftieth of the scatter, and the fit
/// to all pixels does the rest.
const POINTS: usize = 8_000;
/// Share of the pixels clear of the walls that a larger margin has to leave: with fewer the noise is doubled.
pub(super) const ROOM: f64 = 0.25;
/// A pixel this many times its neighbourhood's scatter off is a wrong answer, not a wall.
const SPIKE: f64 = 8.0;

/// The clearest division by any of several maps of the same surface: the first one that is clear, or else the
/// clearest. Windows that grow with the noise smooth shallow and narrow hollows away, which smaller ones show.
pub(super) fn divided(fields: &[&Field<'_>], options: &StepsOptions) -> Result<Divided, SurfaceError> {
    clearest(fields.iter().map(|field| divided_by_one(field, options))).map(|(divided, _)| divided)
}

/// A division, and the depth over the scatter of the smoothed heights; or why there is none.
type Trial = Result<(Divided, f64), SurfaceError>;

/// The first trial that is clear, or else the clearest one.
fn clearest(trials: impl Iterator<Item = Trial>) -> Trial {
    let mut best: Option<(Divided, f64)> = None;
    let mut refused: Option<SurfaceError> = None;
    for trial in trials {
        match trial {
            Ok((divided, clearness)) => {
                if best.as_ref().is_none_or(|(_, before)| clearness > *before) {
                    best = Some((divided, clearness));
                }
                if clearness >= CLEAR {
                    break;
                }
            }
            Err(error) => refused = plainer(refused, error),
        }
    }
    let no_levels = SurfaceError::OneLevel { depth_mm: 0.0, scatter_mm: 0.0 };
    best.ok_or(refused.unwrap_or(no_levels))
}

/// The clearest division of a field, by as little smoothing as will do.
fn divided_by_one(field: &Field<'_>, options: &StepsOptions) -> Trial {
    let start = field.robust()?;
    let clean = without_spikes(&field.heights.height_mm, spike_limit(field.heights));
    let (rows, columns) = (clean.rows(), clean.columns());
    let reaches = REACHES.into_iter().filter(|reach| 16 * (2 * reach + 1) <= rows.min(columns).max(16));
    clearest(reaches.map(|reach| {
        let (divided, clearness) = divide(field, &start, &mean_around(&clean, reach), reach, options)?;
        let depth_mm = divided.levels_found.depth_mm;
        let one_level = SurfaceError::OneLevel { depth_mm, scatter_mm: depth_mm / clearness };
        if clearness >= LEAST { Ok((divided, clearness)) } else { Err(one_level) }
    }))
}

/// Of two reasons the one that says more: levels that were seen, or else the clearest division.
fn plainer(before: Option<SurfaceError>, now: SurfaceError) -> Option<SurfaceError> {
    let clearness = |error: &SurfaceError| match *error {
        SurfaceError::OneLevel { depth_mm, scatter_mm } => depth_mm / scatter_mm.max(f64::MIN_POSITIVE),
        SurfaceError::NoValley { .. } => f64::MAX,
        _ => f64::INFINITY,
    };
    before.filter(|before| clearness(before) >= clearness(&now)).or(Some(now))
}

/// A field divided into two levels.
pub(super) struct Divided {
    pub(super) levels: Grid<Level>,
    /// What lies clear of the walls, and the margin that was left out.
    pub(super) clear: Grid<Level>,
    pub(super) margin_px: usize,
    /// By how much more the margin was larger, as smoothing may have moved the walls, in px.
    moved_px: usize,
    /// Trend and depth by the heights that divided.
    pub(super) levels_found: Levels,
}

impl Divided {
    /// The levels without what lies nearer than this to walls that smoothing may have moved.
    pub(super) fn clear_by(&self, margin_px: usize) -> Grid<Level> {
        clear_of_walls(&self.levels, margin_px + self.moved_px)
    }

    /// The plateaus of ISO 5436-1 of all parts on a level that are wide enough to leave out this margin.
    pub(super) fn plateaus(&self, of_parts: Level, margin_px: usize) -> Plateaus {
        Plateaus::of(&self.levels, of_parts, margin_px + self.moved_px)
    }

    /// Pixels of the upper and of the lower level that this leaves.
    pub(super) fn counts(&self, margin_px: usize) -> [usize; 2] {
        let clear = self.clear_by(margin_px);
        [Level::Upper, Level::Lower].map(|level| count(&clear, level))
    }
}

/// Divides by the smoothed heights; their scatter is that of those that lie clear of the walls.
fn divide(
    field: &Field<'_>,
    start: &[f64],
    smoothed: &Grid<f32>,
    reach: usize,
    options: &StepsOptions,
) -> Trial {
    let points = points(field, smoothed);
    let one_level = SurfaceError::OneLevel { depth_mm: 0.0, scatter_mm: scatter_about(start, &points) };
    let mut levels = two_levels(&points, start).ok_or(one_level.clone())?;
    // A part smaller than the square of the smoothing cannot be distinguished from its noise.
    let least_area_px = options.least_area_px.max(2 * (2 * reach + 1).pow(2));
    let mut divided: Option<Divided> = None;
    let mut scatter_mm = 0.0;
    for _ in 0..ROUNDS {
        let mut map = label(field, smoothed, &levels);
        without_small_parts(&mut map, least_area_px);
        if divided.as_ref().is_some_and(|before| before.levels == map) {
            break;
        }
        // Smoothing moves a wall by up to its reach, to where the noise that is then measured puts it.
        let (clear, mut margin_px) = roomy(&map, reach, options);
        let mut sides = [Side { field, clear }];
        let mut fitted = fit(&sides);
        let mut moved_px = reach;
        if fitted.is_none() && reach > 0 {
            (margin_px, moved_px) = (options.margin_px, 0);
            sides[0].clear = clear_of_walls(&map, options.margin_px);
            fitted = fit(&sides);
        }
        let Some(fit) = fitted else {
            let Levels { depth_mm, .. } = levels;
            let narrow = SurfaceError::TooNarrow { margin_px: options.margin_px, depth_mm };
            return Err(if levels.are_two(&points) { narrow } else { one_level });
        };
        if fit.levels.depth_mm <= 0.0 {
            return Err(one_level);
        }
        levels = fit.levels.clone();
        scatter_mm = smoothed_scatter(field, smoothed, &fit);
        let [Side { clear, .. }] = sides;
        divided = Some(Divided { levels: map, clear, margin_px, moved_px, levels_found: fit.levels });
    }
    let divided = divided.ok_or(one_level)?;
    let depth_mm = levels.depth_mm;
    let clearness = depth_mm / scatter_mm.max(f64::MIN_POSITIVE);
    if levels.are_two(&points) {
        Ok((divided, clearness))
    } else if clearness >= LEAST {
        Err(SurfaceError::NoValley { depth_mm })
    } else {
        Err(SurfaceError::OneLevel { depth_mm, scatter_mm })
    }
}

/// The levels clear of the walls, and the margin: the grown one if it leaves the share [`ROOM`] of the pixels
/// that the smallest one leaves on both levels, else the smallest. `reach` is added to either.
fn roomy(map: &Grid<Level>, reach: usize, options: &StepsOptions) -> (Grid<Level>, usize) {
    let least = clear_of_walls(map, options.margin_px + reach);
    if options.grown_margin_px > options.margin_px {
        let grown = clear_of_walls(map, options.grown_margin_px + reach);
        let enough = |wanted| count(&grown, wanted) as f64 >= ROOM * count(&least, wanted) as f64;
        if enough(Level::Upper) && enough(Level::Lower) {
            return (grown, options.grown_margin_px);
        }
    }
    (least, options.margin_px)
}

/// Some points of the smoothed field, spread evenly but on no grid, which could miss stripes.
fn points(field: &Field<'_>, smoothed: &Grid<f32>) -> Vec<Point> {
    let every = (smoothed.rows() * smoothed.columns()).div_ceil(POINTS);
    let mut points: Vec<Point> = Vec::new();
    for y in 0..smoothed.rows() {
        // Steps of the golden ratio spread the first columns over all of a row's residues.
        let first = ((y as f64 * 0.618_034).fract() * every as f64) as usize;
        for x in (first..smoothed.columns()).step_by(every) {
            if let Some(sample) = field.sample(x, y).filter(|_| !smoothed.at(x, y).is_nan()) {
                points.push(Point { row: sample.row, height_mm: f64::from(smoothed.at(x, y)) });
            }
        }
    }
    points
}

/// How far points scatter about a trend, in mm, unless they are few that lie far off.
fn scatter_about(trend: &[f64], points: &[Point]) -> f64 {
    let mut off: Vec<f64> =
        points.iter().map(|point| (point.height_mm - at(trend, &point.row)).abs()).collect();
    SIGMA_OF_MEDIAN * quantile(&mut off, 0.5).unwrap_or(0.0)
}

fn label(field: &Field<'_>, smoothed: &Grid<f32>, levels: &Levels) -> Grid<Level> {
    let mut map = Grid::filled(smoothed.rows(), smoothed.columns(), Level::Unknown);
    for sample in field.samples() {
        let height_mm = f64::from(smoothed.at(sample.x, sample.y));
        if !height_mm.is_nan() {
            let low = levels.is_low(&sample.row, height_mm);
            map.row_mut(sample.y)[sample.x] = if low { Level::Lower } else { Level::Upper };
        }
    }
    map
}

/// Standard deviation of the smoothed heights about their level, clear of the walls.
fn smoothed_scatter(field: &Field<'_>, smoothed: &Grid<f32>, fit: &Fit) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for sample in field.samples() {
        let level = fit.used[0].at(sample.x, sample.y);
        if level != Level::Unknown {
            let lowered = if level == Level::Lower { fit.levels.depth_mm } else { 0.0 };
            let height_mm = f64::from(smoothed.at(sample.x, sample.y));
            sum += (height_mm - fit.levels.upper_mm(&sample.row) + lowered).powi(2);
            count += 1.0;
        }
    }
    f64::sqrt(sum / f64::max(count, 1.0))
}

/// How far a pixel may lie off its neighbours: walls are steep, but few. From the differences of neighbours,
/// of which half are noise alone.
fn spike_limit(heights: &Heights) -> f32 {
    let map = &heights.height_mm;
    let mut differences: Vec<f64> = (0..map.rows())
        .flat_map(|y| map.row(y).windows(2).map(|pair| f64::from((pair[1] - pair[0]).abs())))
        .filter(|difference| difference.is_finite())
        .collect();
    let neighbours = SIGMA_OF_MEDIAN * quantile(&mut differences, 0.5).unwrap_or(0.0);
    let mut sigmas: Vec<f64> = heights
        .sigma_mm
        .values()
        .iter()
        .map(|&sigma| f64::from(sigma))
        .filter(|sigma| sigma.is_finite())
        .collect();
    let stated = quantile(&mut sigmas, 0.5).unwrap_or(0.0);
    (SPIKE * neighbours.max(stated)) as f32
}
