//! Why a pixel has its number: its line in the EPI, the intensities along it, and the cost of other lines.

use serde::Serialize;

use super::levelled::{is_levelled, shown_heights};
use super::view::ResultsView;
use crate::panel::PanelError;
#[cfg(test)]
use crate::panel::page_type_tests;
use crate::panel::questions::Framed;
use crate::panel::requests::requests;
use crate::pipeline::OpenedResults;
use crate::results::{ResultMap, reason};
use epirig_core::choice::Choice as _;
use epirig_core::grid::Grid;
use epirig_core::volume::Volume;
use epirig_matcher::inspect::{EpiLines, line_profile};
use epirig_matcher::{DisparityRange, Matcher, Validity};

requests! {
    /// A pixel; its heights may be levelled, by what is told as in `LevelledQuery`.
    Pixel { x: usize, y: usize, levelled_by: Option<String> }
}

/// Columns of the EPI that are shown beside those that the line crosses.
const MARGIN_PX: f64 = 24.0;

/// All about a pixel.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct PixelInfo {
    rows: usize,
    columns: usize,
    x: usize,
    y: usize,
    x_mm: Option<f64>,
    y_mm: Option<f64>,
    #[cfg_attr(test, ts(as = "page_type_tests::Names<Validity>"))]
    answer: Validity,
    reason: String,
    values: Vec<PixelValue>,
    better_than: Option<f64>,
    epi: EpiWindow,
    tau: Vec<f64>,
    reference: usize,
    line: Option<PixelLine>,
    neighbours: Vec<Neighbour>,
    intensity: Option<Intensity>,
    cost: Option<PixelCost>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct PixelValue {
    id: &'static str,
    title: &'static str,
    unit: &'static str,
    value: Option<f64>,
    sigma: Option<f64>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct EpiWindow {
    first_column: usize,
    low: f32,
    high: f32,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct PixelLine {
    column: usize,
    disparity_px: f64,
    sigma_px: f64,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct Neighbour {
    column: usize,
    row: usize,
    disparity_px: f64,
    agrees: bool,
}

/// The paper's figure 5a: DN in each frame along the line, and along the lines of the neighbours in disparity.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct Intensity {
    #[cfg_attr(test, ts(as = "Vec<Option<f32>>"))]
    along: Vec<f32>,
    #[cfg_attr(test, ts(as = "Vec<Option<f32>>"))]
    left: Vec<f32>,
    #[cfg_attr(test, ts(as = "Vec<Option<f32>>"))]
    right: Vec<f32>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct PixelCost {
    disparity_px: Vec<f64>,
    #[cfg_attr(test, ts(as = "Vec<Option<f32>>"))]
    cost: Vec<f32>,
    scale: &'static str,
    chosen_px: Option<f64>,
}

/// Everything about a pixel of the reference frame.
pub(super) fn explain(view: &ResultsView, asked: &Pixel) -> Result<Framed<PixelInfo>, PanelError> {
    let &Pixel { x, y, .. } = asked;
    let opened = view.results()?;
    let (rows, columns) = (opened.disparity.rows(), opened.disparity.columns());
    if x >= columns || y >= rows {
        let (last_x, last_y) = (columns - 1, rows - 1);
        let message = format!("there is no pixel ({x}, {y}); the last is ({last_x}, {last_y})");
        return Err(PanelError::NotThere(message));
    }
    let disparity_px = f64::from(opened.disparity.at(x, y));
    let line = disparity_px.is_finite().then(|| PixelLine {
        column: x,
        disparity_px,
        sigma_px: f64::from(opened.sigma.at(x, y)),
    });
    // The cost's window sees rows above and below.
    let reach = opened.matched.settings.window_px / 2;
    let top = y.saturating_sub(reach);
    let volume = view.epis.rows(top..y + reach + 1)?;
    let reference = opened.matched.reference;
    let lines = EpiLines::new(volume.tau(), reference, columns);
    let (first, end) = crossed(&lines, x, line.as_ref());
    let window = epi(&volume, y - top, first..end);
    let known = || window.iter().copied().filter(|value| value.is_finite());
    let answer = answer_at(view, x, y);
    let place = opened.heights.as_ref().map(|heights| heights.lateral_mm(x, y));
    let explained = PixelInfo {
        rows: volume.frames(),
        columns: end - first,
        x,
        y,
        x_mm: place.map(|place| place.0),
        y_mm: place.map(|place| place.1),
        answer,
        reason: reason(answer),
        values: values(view, asked)?,
        better_than: line.as_ref().map(|line| share_with_larger_sigma(&opened.sigma, line.sigma_px)),
        epi: EpiWindow {
            first_column: first,
            low: known().fold(f32::INFINITY, f32::min),
            high: known().fold(f32::NEG_INFINITY, f32::max),
        },
        tau: lines.offsets().to_vec(),
        reference,
        neighbours: neighbours(opened, x, y),
        intensity: line.as_ref().map(|line| intensity(&volume, &lines, x, y - top, line.disparity_px)),
        cost: Some(cost(view, volume, (x, y - top), line.as_ref())?),
        line,
    };
    Ok(Framed(explained, window))
}

/// What the matcher answered at a pixel.
pub(super) fn answer_at(view: &ResultsView, x: usize, y: usize) -> Validity {
    let class = view.maps.shown(ResultMap::Mask.row().id).and_then(|mask| mask.value(x, y));
    let answer = class.and_then(|class| Validity::ALL.get(class as usize).copied());
    let is_known = || view.results.as_ref().is_some_and(|opened| opened.disparity.at(x, y).is_finite());
    answer.unwrap_or_else(|| if is_known() { Validity::Found } else { Validity::Ambiguous })
}

/// Standard uncertainty of the value of a map at a pixel, if there is a map of it.
pub(super) fn sigma_at(view: &ResultsView, id: &str, x: usize, y: usize) -> Option<f64> {
    view.maps.shown(view.maps.shown(id)?.row.sigma?.row().id)?.value(x, y)
}

/// Columns that the line crosses, with a margin; those beside the pixel without a line.
fn crossed(lines: &EpiLines, x: usize, line: Option<&PixelLine>) -> (usize, usize) {
    let disparity_px = line.map_or(0.0, |line| line.disparity_px);
    let ends = [x as f64 - disparity_px * lines.tau_before(), x as f64 + disparity_px * lines.tau_after()];
    let first = ends[0].min(ends[1]) - MARGIN_PX;
    let end = ends[0].max(ends[1]) + MARGIN_PX + 1.0;
    let inside = |place: f64| place.clamp(0.0, lines.columns() as f64) as usize;
    let (first, end) = (inside(first.floor()), inside(end.ceil()));
    // The pixel itself is always shown.
    (first.min(x), end.max(x + 1))
}

/// Row `y` of all frames in these columns: frames x columns.
fn epi(volume: &Volume, y: usize, columns: std::ops::Range<usize>) -> Vec<f32> {
    let mut row = vec![0.0; volume.columns()];
    let mut window = Vec::with_capacity(volume.frames() * columns.len());
    for t in 0..volume.frames() {
        volume.copy_row(y, t, &mut row);
        window.extend_from_slice(&row[columns.clone()]);
    }
    window
}

fn values(view: &ResultsView, asked: &Pixel) -> Result<Vec<PixelValue>, PanelError> {
    let &Pixel { x, y, .. } = asked;
    let shown = view.maps.numbers().filter(|map| !map.id.ends_with("sigma"));
    let shown = shown.map(|map| {
        let value = match asked.levelled_by.as_deref().filter(|_| is_levelled(map.id)) {
            Some(by) => {
                Some(f64::from(shown_heights(view, map.id, Some(by))?.at(x, y))).filter(|mm| mm.is_finite())
            }
            None => map.value(x, y),
        };
        let sigma = sigma_at(view, map.id, x, y).filter(|_| value.is_some());
        Ok(PixelValue { id: map.id, title: map.row.title, unit: map.row.unit(), value, sigma })
    });
    shown.collect()
}

fn share_with_larger_sigma(map: &Grid<f32>, sigma_px: f64) -> f64 {
    let known = map.values().iter().filter(|sigma| sigma.is_finite());
    let (larger, all) = known.fold((0_usize, 0_usize), |(larger, all), sigma| {
        (larger + usize::from(f64::from(*sigma) > sigma_px), all + 1)
    });
    larger as f64 / all.max(1) as f64
}

/// The eight neighbours that have answers. One agrees if the difference is within what both sigmas explain,
/// and a slope of one pixel in disparity per pixel.
fn neighbours(OpenedResults { disparity, sigma, .. }: &OpenedResults, x: usize, y: usize) -> Vec<Neighbour> {
    let own = (disparity.at(x, y), sigma.at(x, y));
    let near = |place: usize, count: usize| place.saturating_sub(1)..(place + 2).min(count);
    let places = near(y, disparity.rows())
        .flat_map(|row| near(x, disparity.columns()).map(move |column| (column, row)));
    let others = places.filter(|place| *place != (x, y));
    let known = others.filter(|&(column, row)| disparity.at(column, row).is_finite());
    known
        .map(|(column, row)| {
            let (value, sigma) = (disparity.at(column, row), sigma.at(column, row));
            let limit = LIMIT_SIGMAS * sigma.hypot(own.1);
            let agrees = own.0.is_nan() || (value - own.0).abs() <= limit;
            Neighbour { column, row, disparity_px: f64::from(value), agrees }
        })
        .collect()
}

/// A difference beyond three standard deviations is none of chance.
const LIMIT_SIGMAS: f32 = 3.0;

/// Intensities along the line, and along those with one px less and more of disparity, which meet the last
/// frame one column before and after: the paper's j - 1 and j + 1 with i fixed.
fn intensity(volume: &Volume, lines: &EpiLines, x: usize, y: usize, disparity_px: f64) -> Intensity {
    let along = |shift: f64| {
        line_profile(volume, lines, x as f64 + shift * lines.tau_before(), y, disparity_px + shift)
    };
    Intensity { along: along(0.0), left: along(-1.0), right: along(1.0) }
}

fn cost(
    view: &ResultsView,
    volume: Volume,
    (x, y): (usize, usize),
    line: Option<&PixelLine>,
) -> Result<PixelCost, PanelError> {
    let opened = view.results()?;
    let matched = &opened.matched;
    let range = DisparityRange { minimum_px: matched.minimum_px, maximum_px: matched.maximum_px };
    let options = matched.options();
    let scale = if options.method.compares_intensities() { "DN^2" } else { "1 - correlation" };
    let matcher = Matcher::new(volume, options)?;
    let (candidates, costs) =
        matcher.costs_of_row(y, matched.reference, range, matched.ordering_constraint)?;
    Ok(PixelCost {
        disparity_px: (0..costs.candidates()).map(|k| candidates.disparity_px(k as f64)).collect(),
        cost: (0..costs.candidates()).map(|k| costs.at(k, x)).collect(),
        scale,
        chosen_px: line.map(|line| line.disparity_px),
    })
}
