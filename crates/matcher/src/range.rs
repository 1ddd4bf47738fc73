//! Range survey: the range of disparities, found from the data.
//!
//! A few rows, spread over the image, are searched over all disparities that keep a point in view (at most
//! 1.25 times the image's width), at a coarse disparity step. Pixels whose best candidate is significant
//! count. The range covers their disparities, without outliers.

use std::ops::RangeInclusive;

use rayon::prelude::*;

use super::aggregation::rows::spread_rows;
use super::candidates::Candidates;
use super::candidates::DisparityRange;
use super::cost::exhaustive::{Band, band_costs};
use super::lines::{EpiLines, SeenRule};
use super::options::{MatchOptions, Occlusion, OrderingConstraint, Search};
use super::search::survey::RowSurvey;
use super::search::winner::{confidences, winners};
use epirig_core::progress::Progress;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;

/// Rows that are searched.
const SAMPLED_ROWS: usize = 24;
/// Half of the columns over which costs are averaged, with three rows, rounded down.
const HALF_WINDOW_COLUMNS: usize = 3;
/// Frames that an exhaustive search looks at: enough that chance does not find a line.
const SAMPLED_FRAMES: usize = 33;
/// A pixel counts if its best candidate is this much better than the best one elsewhere ...
const SIGNIFICANT_CONFIDENCE: f32 = 0.5;
/// ... or, where noise drowns the texture so that fewer than the share below are, this much: with some
/// hundred degrees of freedom in a window, chance differences of two variances stay below it.
const NOISY_CONFIDENCE: f32 = 0.25;
/// Share of the pixels that must count.
const SIGNIFICANT_SHARE: f64 = 0.02;
/// A disparity is an outlier if fewer than this share of all lie within the tolerance.
const OUTLIER_SHARE: f64 = 0.004;
/// The tolerance, in px at the end of the baseline.
const TOLERANCE_PX: f64 = 4.0;
/// A crossing of points counts if this many pixels on each side of it agree.
const SUPPORT: usize = 3;
/// A jump occludes the points between two surfaces if no more than this share of the columns between them is
/// left at the end of the baseline.
const OCCLUDED_SHARE: f64 = 0.4;
/// Crossings make a scene unordered if this share of the rows, and at least two, hold one.
const UNORDERED_SHARE: f64 = 0.05;

/// The result of the range survey.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Survey {
    /// The disparities that occur, with a margin.
    pub(crate) range: DisparityRange,
    /// Whether neighbouring pixels keep their order in the first and the last frame.
    pub(crate) ordered: bool,
}

/// Surveys a few rows of `volume`; `None` if no disparity is significant.
///
/// A range given in `options` is kept, and only the order is surveyed.
pub(crate) fn survey(
    volume: &Volume,
    lines: &EpiLines,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Option<Survey> {
    // One pixel of shift at the end of the baseline that is farther from the reference.
    let step = (1.0 / lines.tau_before().max(lines.tau_after())).clamp(1.0, 2.0);
    // Beyond 1.25 image widths few points stay in view; 15000 px keep the candidates' indices in 16 bit.
    let limit =
        options.largest_disparity_px(volume.columns()).min(1.25 * volume.columns() as f64).min(15_000.0);
    let whole = options.range.unwrap_or(DisparityRange { minimum_px: -limit, maximum_px: limit });
    let candidates = Candidates::covering(whole, step);
    // Until the order is known, points may be occluded on one side.
    let occlusion = match (options.occlusion, options.ordering_constraint) {
        (Occlusion::Automatic, OrderingConstraint::On) => Occlusion::None,
        (Occlusion::Automatic, _) => Occlusion::OneSide,
        (stated, _) => stated,
    };
    let mut surveyed = match options.search_used() {
        Search::Factorised => factorised((volume, lines), candidates, occlusion, options, progress),
        Search::Exhaustive => exhaustive((volume, lines), candidates, occlusion, options, progress)?,
    };
    if candidates.count() <= 3 {
        // A search over this few candidates has no rivals, so confidence means nothing.
        surveyed.iter_mut().flatten().flatten().for_each(|pixel| pixel.1 = 1.0);
    }
    let significant = |least: f32| -> Vec<Vec<Option<f64>>> {
        let admitted = |pixel: &Surveyed| pixel.filter(|pixel| pixel.1 >= least).map(|pixel| pixel.0);
        surveyed.iter().map(|row| row.iter().map(admitted).collect()).collect()
    };
    let mut disparities = significant(SIGNIFICANT_CONFIDENCE);
    let significant_pixels = disparities.iter().flatten().flatten().count() as f64;
    if significant_pixels < SIGNIFICANT_SHARE * (surveyed.len() * volume.columns()) as f64 {
        disparities = significant(NOISY_CONFIDENCE);
    }
    let mut all: Vec<f64> = disparities.iter().flatten().flatten().copied().collect();
    all.sort_unstable_by(f64::total_cmp);
    let tolerance = TOLERANCE_PX * step;
    let kept = without_outliers(&all, tolerance);
    let (&minimum, &maximum) = (kept.first()?, kept.last()?);
    let margin = 2.0 * step + 0.02 * (maximum - minimum);
    let range = options
        .range
        .unwrap_or(DisparityRange { minimum_px: minimum - margin, maximum_px: maximum + margin });
    Some(Survey { range, ordered: is_ordered(&disparities, lines, minimum..=maximum, step) })
}

/// Disparity in px of a pixel's best candidate, and how much better it is than its rivals.
type Surveyed = Option<(f64, f32)>;

/// The survey in all frames: if some were left out, equidistant ones would show a repetitive texture at wrong
/// disparities.
fn factorised(
    (volume, lines): (&Volume, &EpiLines),
    candidates: Candidates,
    occlusion: Occlusion,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Vec<Vec<Surveyed>> {
    let rule = SeenRule::new(volume.frames(), options.min_visible, occlusion);
    let half_columns = (options.window_px / 2).max(HALF_WINDOW_COLUMNS);
    let survey = RowSurvey::new(volume, lines, candidates, rule, half_columns);
    let of_row = |y| if progress.cancelled() { Vec::new() } else { survey.of_row(y) };
    sampled_rows(volume.rows(), 3).into_par_iter().map(of_row).collect()
}

/// The survey by any method, in some frames; `None` if the sampled frames make no sequence.
fn exhaustive(
    (volume, lines): (&Volume, &EpiLines),
    candidates: Candidates,
    occlusion: Occlusion,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Option<Vec<Vec<Surveyed>>> {
    let frames = sampled_frames(volume.frames(), lines.reference());
    let thinned = thin(volume, &frames, options.window_px.max(5))?;
    let reference = frames.iter().position(|&t| t == lines.reference())?;
    let survey_lines = EpiLines::new(thinned.volume.tau(), reference, volume.columns());
    let survey_options = MatchOptions { window_px: options.window_px.max(5), ..options.clone() };
    let rule = SeenRule::new(frames.len(), options.min_visible, occlusion);
    let surveyed = |&y: &usize| match progress.cancelled() {
        true => Vec::new(),
        false => survey_row(&thinned.volume, y, &survey_lines, &candidates, rule, &survey_options),
    };
    Some(thinned.centres.par_iter().map(surveyed).collect())
}

struct Thinned {
    volume: Volume,
    /// Rows of the thinned volume in the middle of each sampled band.
    centres: Vec<usize>,
}

/// Frames spread over the sequence, with the reference frame and both ends among them. They are not
/// equidistant if any are left out: multiples of a common step would show a repetitive texture at wrong
/// disparities.
fn sampled_frames(frames: usize, reference: usize) -> Vec<usize> {
    let count = frames.min(SAMPLED_FRAMES);
    let step = (frames - 1) as f64 / (count - 1) as f64;
    // Fractions of multiples of the golden ratio never repeat.
    let astray = |index: usize| (0.618_034 * index as f64).fract() - 0.5;
    let place = |index: usize| {
        let inner = index > 0 && index + 1 < count;
        (step * index as f64 + if inner { (step - 1.0) * astray(index) } else { 0.0 }).round() as usize
    };
    let mut chosen: Vec<usize> = (0..count).map(place).collect();
    if let Err(place) = chosen.binary_search(&reference) {
        chosen.insert(place, reference);
    }
    chosen
}

/// Rows spread evenly over the image, whose windows of `window_px` rows hardly overlap.
fn sampled_rows(rows: usize, window_px: usize) -> Vec<usize> {
    let bands = SAMPLED_ROWS.min(rows.div_ceil(window_px)).max(1);
    spread_rows(rows, bands).collect()
}

/// Copies the sampled rows, with the rows around them that windows reach, and the sampled frames into a small
/// volume.
fn thin(volume: &Volume, frames: &[usize], window_px: usize) -> Option<Thinned> {
    let half = window_px / 2;
    let mut rows = Vec::new();
    let mut centres = Vec::new();
    for y in sampled_rows(volume.rows(), window_px) {
        let first = y.saturating_sub(half);
        centres.push(rows.len() + y - first);
        rows.extend(first..(y + half + 1).min(volume.rows()));
    }
    let positions: Vec<f64> = frames.iter().map(|&t| volume.tau().values()[t]).collect();
    let tau = Tau::from_positions(&positions).ok()?;
    Some(Thinned { volume: volume.selected(&rows, frames, tau), centres })
}

fn survey_row(
    volume: &Volume,
    y: usize,
    lines: &EpiLines,
    candidates: &Candidates,
    rule: SeenRule,
    options: &MatchOptions,
) -> Vec<Surveyed> {
    let band = Band::new(volume, y..y + 1, options);
    let tables = band_costs(&band, lines, candidates, rule, options);
    let winners = winners(&tables[0]);
    let chosen: Vec<u16> = winners.iter().map(|winner| winner.unwrap_or(0)).collect();
    let confidences = confidences(&tables[0], &chosen, 3, options.method.resolution());
    let surveyed =
        |(winner, &own): (&Option<u16>, &f32)| winner.map(|k| (candidates.disparity_px(k.into()), own));
    winners.iter().zip(&confidences).map(surveyed).collect()
}

fn without_outliers(sorted: &[f64], tolerance: f64) -> Vec<f64> {
    let least = (OUTLIER_SHARE * sorted.len() as f64).max(3.0);
    let neighbours = |value: f64| {
        let first = sorted.partition_point(|&other| other < value - tolerance);
        let end = sorted.partition_point(|&other| other <= value + tolerance);
        end - first
    };
    sorted.iter().copied().filter(|&value| neighbours(value) as f64 >= least).collect()
}

fn is_ordered(
    disparities: &[Vec<Option<f64>>],
    lines: &EpiLines,
    kept: RangeInclusive<f64>,
    step: f64,
) -> bool {
    // The disparity step of the survey is coarse: two steps are no depth edge.
    let slack = 2.0 * step;
    let crosses = |row: &Vec<Option<f64>>| {
        let inside = |pixel: &Option<f64>| pixel.filter(|value| kept.contains(value));
        let known: Vec<(usize, f64)> =
            row.iter().enumerate().filter_map(|(x, pixel)| Some((x, inside(pixel)?))).collect();
        known.windows(2 * SUPPORT).any(|run| {
            let (left, right) = run.split_at(SUPPORT);
            let (a, b) = (left[SUPPORT - 1], right[0]);
            let agree =
                |side: &[(usize, f64)], value: f64| side.iter().all(|pixel| (pixel.1 - value).abs() <= slack);
            let columns = (b.0 - a.0) as f64;
            let rise = b.1 - a.1;
            let crosses_last = columns + (rise + slack) * lines.tau_after() <= 0.0;
            let crosses_first = columns - (rise - slack) * lines.tau_before() <= 0.0;
            // A jump that closes most of the columns between two surfaces occludes the points there in a part
            // of the frames.
            let left_over = (columns + rise * lines.tau_after()).min(columns - rise * lines.tau_before());
            let occludes = rise.abs() > 2.0 * slack && left_over <= OCCLUDED_SHARE * columns;
            (crosses_last || crosses_first || occludes) && agree(left, a.1) && agree(right, b.1)
        })
    };
    let unordered = disparities.iter().filter(|row| crosses(row)).count();
    unordered < 2.max((UNORDERED_SHARE * disparities.len() as f64).ceil() as usize)
}
