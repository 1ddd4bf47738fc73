//! The stations of the matcher in their order: range, costs, mapping, sub-pixel fit, verdict for each pixel.

use rayon::prelude::*;

use super::cost::{Band, CostTable, band_costs};
use super::lines::{Hypotheses, Lines, SeenRule};
use super::mapping::{OrderingLimits, neutral_cost, optimal_mapping};
use super::maps::{Answer, DisparityMaps, OrderingUsed};
use super::options::{DisparityRange, HiddenPoints, MatchError, MatchOptions, Ordering};
use super::range::{Survey, survey};
use super::refine::{Fit, Fitted, fit};
use super::winner::{confidences, parabola_vertex, winners};
use crate::plane::Plane;
use crate::progress::Progress;
use crate::volume::Volume;

/// Rows matched together, if their costs are few enough: they share the samples of their windows.
const BAND_ROWS: usize = 8;
/// Costs that a band holds at most, unless one row has more; 64 MiB.
const BAND_COSTS: usize = 1 << 24;
/// Where texture is weak the window of the fit grows as far as this.
const LARGEST_FIT_WINDOW_PX: usize = 21;
/// Gauss-Newton steps: from half a raster step two come within a thousandth of a pixel of the end; the third confirms.
const FIT_STEPS: usize = 2;

/// Disparity of every pixel of the reference frame.
///
/// The result does not depend on the number of threads.
///
/// # Errors
/// [`MatchError`] if the options do not suit the volume, or no range was given and none is to be found.
pub fn match_volume(
    volume: &Volume,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<DisparityMaps, MatchError> {
    options.check(volume.rows(), volume.columns(), volume.frames())?;
    let reference = options.reference_index(volume)?;
    let lines = Lines::new(volume.tau(), reference, volume.columns());
    let (range, ordering) = range_and_ordering(volume, &lines, options, progress)?;
    let hypotheses = Hypotheses::covering(range, options.raster_px);
    options.check_search(&hypotheses)?;
    let rule = seen_rule(volume, options, ordering);

    let (rows, columns) = (volume.rows(), volume.columns());
    progress.begin("matching", rows as u64);
    let band_rows = (BAND_COSTS / (columns * hypotheses.count())).clamp(1, BAND_ROWS);
    let bands: Vec<_> = (0..rows).step_by(band_rows).map(|y| y..(y + band_rows).min(rows)).collect();
    let matched: Vec<MatchedRow> = bands
        .into_par_iter()
        .flat_map_iter(|answered| {
            let count = answered.len();
            let band = Band::new(volume, answered, options);
            let tables = band_costs(&band, &lines, &hypotheses, rule, options);
            let rows: Vec<_> =
                tables.iter().map(|costs| match_row(costs, &lines, &hypotheses, ordering, options)).collect();
            progress.advance(count as u64);
            rows
        })
        .collect();
    progress.end();
    let mut planes: [Plane<f32>; 3] = std::array::from_fn(|_| Plane::filled(rows, columns, f32::NAN));
    for (y, row) in matched.iter().enumerate() {
        for (plane, values) in planes.iter_mut().zip([&row.disparity, &row.cost, &row.confidence]) {
            plane.row_mut(y).copy_from_slice(values);
        }
    }
    let [guess, cost, confidence] = planes;
    let searched: Vec<Answer> = matched.iter().flat_map(|row| row.answer.iter().copied()).collect();
    drop(matched);

    let steps = if options.refine { FIT_STEPS } else { 0 };
    let fit_options = Fit {
        window_px: options.refine_window_px,
        wanted_sigma_px: options.wanted_sigma_px,
        largest_window_px: LARGEST_FIT_WINDOW_PX.max(options.refine_window_px),
        steps,
        rule,
    };
    progress.begin("refining", (rows * steps.max(1)) as u64);
    let fitted = fit(volume, &lines, &guess, fit_options, || progress.advance(1));
    progress.end();

    let verdicts = Verdicts { range, ordering, options };
    let mut maps = DisparityMaps {
        disparity: fitted.map(|value| value.disparity_px),
        sigma: fitted.map(|value| value.sigma_px),
        cost,
        confidence,
        answer: Plane::filled(rows, columns, Answer::Found),
        reference,
        range,
        range_found: options.range.is_none(),
        ordering,
    };
    for (index, value) in fitted.values().iter().enumerate() {
        let answer = verdicts.verdict(*value, searched[index], maps.confidence.values()[index]);
        maps.answer.values_mut()[index] = answer;
        if answer != Answer::Found {
            maps.disparity.values_mut()[index] = f32::NAN;
            maps.sigma.values_mut()[index] = f32::NAN;
        }
    }
    Ok(maps)
}

/// Costs of all candidates of row `y` as they were when `options` led to `maps`, for pictures of the search.
///
/// # Errors
/// [`MatchError`] if the options do not suit the volume.
///
/// # Panics
/// If `y` lies outside the volume.
pub fn row_costs(
    volume: &Volume,
    y: usize,
    maps: &DisparityMaps,
    options: &MatchOptions,
) -> Result<(Hypotheses, CostTable), MatchError> {
    options.check(volume.rows(), volume.columns(), volume.frames())?;
    let lines = Lines::new(volume.tau(), maps.reference, volume.columns());
    let hypotheses = Hypotheses::covering(maps.range, options.raster_px);
    let rule = seen_rule(volume, options, maps.ordering);
    let band = Band::new(volume, y..y + 1, options);
    let costs = band_costs(&band, &lines, &hypotheses, rule, options).swap_remove(0);
    Ok((hypotheses, costs))
}

fn seen_rule(volume: &Volume, options: &MatchOptions, ordering: OrderingUsed) -> SeenRule {
    let hidden_points = match (options.hidden_points, ordering) {
        (HiddenPoints::Automatic, OrderingUsed::Free) => HiddenPoints::OneSide,
        (HiddenPoints::Automatic, OrderingUsed::Strict) => HiddenPoints::None,
        (stated, _) => stated,
    };
    SeenRule::new(volume.frames(), options.minimum_visible, hidden_points)
}

fn range_and_ordering(
    volume: &Volume,
    lines: &Lines,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<(DisparityRange, OrderingUsed), MatchError> {
    let surveyed = if options.range.is_none() || options.ordering == Ordering::Automatic {
        progress.begin("looking at a few rows", 1);
        let found = survey(volume, lines, options);
        progress.end();
        found
    } else {
        None
    };
    let range = options.range.or(surveyed.map(|survey| survey.range)).ok_or(MatchError::NoRange)?;
    let ordered = surveyed.is_none_or(|Survey { ordered, .. }| ordered);
    let ordering = match options.ordering {
        Ordering::Strict => OrderingUsed::Strict,
        Ordering::Free => OrderingUsed::Free,
        Ordering::Automatic if ordered => OrderingUsed::Strict,
        Ordering::Automatic => OrderingUsed::Free,
    };
    Ok((range, ordering))
}

struct MatchedRow {
    disparity: Vec<f32>,
    cost: Vec<f32>,
    confidence: Vec<f32>,
    answer: Vec<Answer>,
}

/// Whether the candidates around `k` show it to be the best, `reach` of them on each side.
///
/// Near a candidate that leaves the image nothing shows that: the right one may have left. Nor is it shown if `k` costs more
/// than an unknown candidate is taken to cost (`neutral`) while others have left the image, or if it is an end of the
/// range; a range of one or two candidates has only ends, and is believed.
fn bracketed(costs: &CostTable, k: usize, x: usize, reach: usize, neutral: f32) -> Answer {
    let last = costs.hypotheses() - 1;
    let near = k.saturating_sub(reach)..=(k + reach).min(last);
    let gone = |k: usize| costs.at(k, x).is_nan();
    let some_gone = gone(0) || gone(last);
    if near.into_iter().any(gone) || (some_gone && costs.at(k, x) > neutral) {
        Answer::LeavesImage
    } else if last > 1 && (k == 0 || k == last) {
        Answer::BeyondRange
    } else {
        Answer::Found
    }
}

fn match_row(
    costs: &CostTable,
    lines: &Lines,
    hypotheses: &Hypotheses,
    ordering: OrderingUsed,
    options: &MatchOptions,
) -> MatchedRow {
    let columns = costs.columns();
    let neutral = neutral_cost(costs);
    let chosen: Vec<u16> = match (ordering, neutral) {
        (_, None) => vec![0; columns],
        (OrderingUsed::Strict, Some(neutral)) => {
            optimal_mapping(costs, OrderingLimits::new(lines, options.raster_px), neutral)
        }
        (OrderingUsed::Free, _) => winners(costs).into_iter().map(|winner| winner.unwrap_or(0)).collect(),
    };
    // A rival is a candidate that ends at least a pixel away.
    let apart = (1.0 / (options.raster_px * lines.tau_before().max(lines.tau_after()))).ceil() as usize;
    let confidence = confidences(costs, &chosen, apart.max(2), options.method.resolution());
    let mut disparity = vec![f32::NAN; columns];
    let mut cost = vec![f32::NAN; columns];
    let mut answer = vec![Answer::LeavesImage; columns];
    for (x, &k) in chosen.iter().enumerate() {
        cost[x] = costs.at(k.into(), x);
        answer[x] = bracketed(costs, k.into(), x, 2 * apart, neutral.unwrap_or(f32::INFINITY));
        if answer[x] == Answer::Found {
            let index = f64::from(k) + parabola_vertex(costs, k.into(), x);
            disparity[x] = hypotheses.disparity_px(index) as f32;
        }
    }
    MatchedRow { disparity, cost, confidence, answer }
}

struct Verdicts<'a> {
    range: DisparityRange,
    ordering: OrderingUsed,
    options: &'a MatchOptions,
}

impl Verdicts<'_> {
    fn verdict(&self, fitted: Fitted, searched: Answer, confidence: f32) -> Answer {
        let ambiguous = f64::from(confidence) < self.options.minimum_confidence;
        // The fit may leave the raster, but not the range by more than a step of it can.
        let disparity = f64::from(fitted.disparity_px);
        let outside = disparity < self.range.minimum_px - 1.0 || disparity > self.range.maximum_px + 1.0;
        if searched != Answer::Found {
            searched
        } else if fitted.sigma_px.is_nan() || f64::from(fitted.sigma_px) > self.options.maximum_sigma_px {
            Answer::NoTexture
        } else if outside {
            Answer::BeyondRange
        } else if self.ordering == OrderingUsed::Free && ambiguous {
            Answer::Ambiguous
        } else {
            Answer::Found
        }
    }
}
