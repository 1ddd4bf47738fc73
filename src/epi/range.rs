//! The range of disparities, found from the data.
//!
//! A few rows, spread over the image, are searched over all disparities that keep a point in view (at most 1.25 times the
//! image's width), on a coarse raster and with few frames. Pixels whose best candidate stands out vote; the range is what the votes cover, without stragglers.

use rayon::prelude::*;

use super::cost::{Band, band_costs};
use super::lines::{Hypotheses, Lines, SeenRule};
use super::options::{DisparityRange, HiddenPoints, MatchOptions, Ordering};
use super::winner::{confidences, winners};
use crate::tau::Tau;
use crate::volume::Volume;

/// Rows that are searched.
const SAMPLED_ROWS: usize = 24;
/// Frames that are searched: enough that chance does not find a line.
const SAMPLED_FRAMES: usize = 33;
/// A vote counts if its candidate's cost is at most this share of the best one elsewhere.
const CLEAR_SHARE: f32 = 0.5;
/// A vote is a straggler if fewer than this share of all votes lie near it.
const STRAGGLER_SHARE: f64 = 0.004;
/// "Near", in px at the end of the baseline.
const NEAR_PX: f64 = 4.0;
/// Depth edges that no strictly increasing mapping allows are real from this share of neighbouring votes on.
const UNORDERED_SHARE: f64 = 0.01;

/// What the sampled rows show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Survey {
    /// The disparities that occur, with a margin.
    pub range: DisparityRange,
    /// Whether neighbouring votes keep their order in the first and the last frame.
    pub ordered: bool,
}

/// Looks at a few rows of `volume`; `None` if no disparity stands out.
///
/// A range given in `options` is kept and only the order is looked at.
pub fn survey(volume: &Volume, lines: &Lines, options: &MatchOptions) -> Option<Survey> {
    let frames = sampled_frames(volume.frames(), lines.reference());
    let thinned = thin(volume, &frames, options.window_px.max(5))?;
    let reference = frames.iter().position(|&t| t == lines.reference())?;
    let survey_lines = Lines::new(thinned.volume.tau(), reference, volume.columns());
    // One pixel of shift at the end of the baseline that is farther from the reference.
    let step = (1.0 / lines.tau_before().max(lines.tau_after())).clamp(1.0, 2.0);
    let limit = options.largest_disparity_px(volume.columns()).min(1.25 * volume.columns() as f64).min(15_000.0);
    let whole = options.range.unwrap_or(DisparityRange { minimum_px: -limit, maximum_px: limit });
    let hypotheses = Hypotheses::covering(whole, step);
    let survey_options =
        MatchOptions { window_px: options.window_px.max(5), ..options.clone() };
    // Until the order is known, points may be hidden on one side.
    let hidden_points = match (options.hidden_points, options.ordering) {
        (HiddenPoints::Automatic, Ordering::Strict) => HiddenPoints::None,
        (HiddenPoints::Automatic, _) => HiddenPoints::OneSide,
        (stated, _) => stated,
    };
    let rule = SeenRule::new(frames.len(), options.minimum_visible, hidden_points);
    let votes: Vec<Vec<Option<f64>>> = thinned
        .centres
        .par_iter()
        .map(|&y| row_votes(&thinned.volume, y, &survey_lines, &hypotheses, rule, &survey_options))
        .collect();
    let mut all: Vec<f64> = votes.iter().flatten().flatten().copied().collect();
    all.sort_unstable_by(f64::total_cmp);
    let near = NEAR_PX * step;
    let kept = without_stragglers(&all, near);
    let (&minimum, &maximum) = (kept.first()?, kept.last()?);
    let margin = 2.0 * step + 0.02 * (maximum - minimum);
    let range = options
        .range
        .unwrap_or(DisparityRange { minimum_px: minimum - margin, maximum_px: maximum + margin });
    Some(Survey { range, ordered: is_ordered(&votes, lines, (minimum, maximum), step) })
}

struct Thinned {
    volume: Volume,
    /// Rows of the thinned volume in the middle of each sampled band.
    centres: Vec<usize>,
}

/// Frames spread evenly over the sequence, with the reference frame and both ends among them.
fn sampled_frames(frames: usize, reference: usize) -> Vec<usize> {
    let count = frames.min(SAMPLED_FRAMES);
    let mut chosen: Vec<usize> = (0..count).map(|index| index * (frames - 1) / (count - 1)).collect();
    if let Err(place) = chosen.binary_search(&reference) {
        chosen.insert(place, reference);
    }
    chosen
}

/// Copies the sampled rows, with the rows around them that windows reach, and the sampled frames into a small volume.
fn thin(volume: &Volume, frames: &[usize], window_px: usize) -> Option<Thinned> {
    let half = window_px / 2;
    let bands = SAMPLED_ROWS.min(volume.rows().div_ceil(window_px)).max(1);
    let mut rows = Vec::new();
    let mut centres = Vec::new();
    for band in 0..bands {
        let y = (2 * band + 1) * volume.rows() / (2 * bands);
        let first = y.saturating_sub(half);
        centres.push(rows.len() + y - first);
        rows.extend(first..(y + half + 1).min(volume.rows()));
    }
    let positions: Vec<f64> = frames.iter().map(|&t| volume.tau().values()[t]).collect();
    let tau = Tau::from_positions(&positions).ok()?;
    Some(Thinned { volume: volume.selected(&rows, frames, tau), centres })
}

fn row_votes(
    volume: &Volume,
    y: usize,
    lines: &Lines,
    hypotheses: &Hypotheses,
    rule: SeenRule,
    options: &MatchOptions,
) -> Vec<Option<f64>> {
    let band = Band::new(volume, y..y + 1, options);
    let tables = band_costs(&band, lines, hypotheses, rule, options);
    let winners = winners(&tables[0]);
    let chosen: Vec<u16> = winners.iter().map(|winner| winner.unwrap_or(0)).collect();
    let confidences = confidences(&tables[0], &chosen, 3, options.method.resolution());
    let vote = |(winner, confidence): (&Option<u16>, &f32)| {
        let clear = *confidence >= 1.0 - CLEAR_SHARE || hypotheses.count() <= 3;
        winner.filter(|_| clear).map(|k| hypotheses.disparity_px(k.into()))
    };
    winners.iter().zip(&confidences).map(vote).collect()
}

fn without_stragglers(sorted: &[f64], near: f64) -> Vec<f64> {
    let least = (STRAGGLER_SHARE * sorted.len() as f64).max(3.0);
    let neighbours = |value: f64| {
        let first = sorted.partition_point(|&other| other < value - near);
        let end = sorted.partition_point(|&other| other <= value + near);
        end - first
    };
    sorted.iter().copied().filter(|&value| neighbours(value) as f64 >= least).collect()
}

fn is_ordered(votes: &[Vec<Option<f64>>], lines: &Lines, kept: (f64, f64), step: f64) -> bool {
    let (mut pairs, mut unordered) = (0_usize, 0_usize);
    for row in votes {
        let inside = |vote: &Option<f64>| vote.filter(|&value| value >= kept.0 && value <= kept.1);
        let known: Vec<(usize, f64)> =
            row.iter().enumerate().filter_map(|(x, vote)| Some((x, inside(vote)?))).collect();
        for pair in known.windows(2) {
            let columns = (pair[1].0 - pair[0].0) as f64;
            let rise = pair[1].1 - pair[0].1;
            // Votes lie on a coarse raster: two steps of it are no depth edge.
            let slack = 2.0 * step;
            pairs += 1;
            let crosses_last = columns + (rise + slack) * lines.tau_after() <= 0.0;
            let crosses_first = columns - (rise - slack) * lines.tau_before() <= 0.0;
            unordered += usize::from(crosses_last || crosses_first);
        }
    }
    (unordered as f64) < UNORDERED_SHARE * pairs.max(1) as f64
}
