//! Two results of one sequence, compared.

use serde::Serialize;

use super::mesh::{blocks_for, means};
use super::view::ResultsView;
use crate::panel::PanelError;
use crate::panel::questions::Framed;
use crate::panel::requests::requests;
use crate::pipeline::{OpenedResults, open_results};
use crate::results::results_beside;
use epirig_core::grid::Grid;
use epirig_core::statistics::upper_median;

/// Most pixels of a comparison that are sent.
const MOST: usize = 1 << 20;

requests! {
    /// What is to be compared.
    CompareQuery {
        /// Name of the other results.
        #[serde(default)]
        with: String,
        /// Heights, if it begins so, else disparities.
        map: Option<String>,
    }
}

/// How the differences are spread.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct CompareInfo {
    rows: usize,
    columns: usize,
    step: usize,
    unit: &'static str,
    count: usize,
    #[cfg_attr(test, ts(as = "Option<f64>"))]
    mean: f64,
    #[cfg_attr(test, ts(as = "Option<f64>"))]
    median: f64,
    #[cfg_attr(test, ts(as = "Option<f64>"))]
    standard_deviation: f64,
    in_sigma: InSigma,
    /// How another scan lay; `None` for other results of the same frames.
    scan: Option<OtherScan>,
}

/// Shares of the differences within one and two combined standard uncertainties.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct InSigma {
    one: f64,
    two: f64,
}

/// How the object lay in the other scan.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct OtherScan {
    /// How far the middle of its picture lies to the right and down.
    pub(super) shift_px: (f64, f64),
    pub(super) turn_deg: f64,
    /// Connected places where the difference exceeds three sigma.
    pub(super) places: usize,
}

/// This map less that of the results in the folder `with`, and the same in combined sigmas.
pub(super) fn compare(view: &ResultsView, asked: &CompareQuery) -> Result<Framed<CompareInfo>, PanelError> {
    let name = asked.with.as_str();
    // Names come from the sequence's folder alone, so none leads out of it.
    if !results_beside(view.sequence.folder()).iter().any(|known| known == name) {
        return Err(PanelError::NotThere(format!("there are no results \"{name}\" of this sequence")));
    }
    let other = open_results(&view.sequence, &view.sequence.folder().join(name))?;
    let own = view.results()?;
    let as_heights = asked.map.as_ref().is_some_and(|map| map.starts_with("height"));
    let (unit, maps) = if as_heights { ("mm", heights(own).zip(heights(&other))) } else { ("px", None) };
    let unit = if maps.is_some() { unit } else { "px" };
    let [first, second] = maps.map_or([disparity(own), disparity(&other)], |(first, second)| [first, second]);
    let size = |map: &Grid<f32>| (map.rows(), map.columns());
    if size(first.0) != size(second.0) {
        let message = format!("the results \"{name}\" are of another size: match both the same way");
        return Err(PanelError::Wrong(message));
    }
    let mut difference = first.0.clone();
    let mut in_sigmas = first.0.clone();
    for index in 0..difference.values().len() {
        let by = first.0.values()[index] - second.0.values()[index];
        difference.values_mut()[index] = by;
        in_sigmas.values_mut()[index] = by / first.1.values()[index].hypot(second.1.values()[index]);
    }
    Ok(differences(&difference, &in_sigmas, unit, None))
}

/// What the page is told of a difference.
pub(super) fn differences(
    difference: &Grid<f32>,
    in_sigmas: &Grid<f32>,
    unit: &'static str,
    scan: Option<OtherScan>,
) -> Framed<CompareInfo> {
    let mut known: Vec<f32> = difference.values().iter().copied().filter(|value| value.is_finite()).collect();
    let count = known.len();
    let mean = known.iter().map(|value| f64::from(*value)).sum::<f64>() / count.max(1) as f64;
    let square = known.iter().map(|value| (f64::from(*value) - mean).powi(2)).sum::<f64>();
    let median = upper_median(&mut known).map_or(f64::NAN, f64::from);
    let within = |limit: f32| {
        in_sigmas.values().iter().filter(|value| value.abs() <= limit).count() as f64 / count.max(1) as f64
    };
    let step = blocks_for(difference, MOST);
    let shown = means(difference, step);
    let facts = CompareInfo {
        rows: shown.rows(),
        columns: shown.columns(),
        step,
        unit,
        count,
        mean,
        median,
        standard_deviation: (square / count.max(1) as f64).sqrt(),
        in_sigma: InSigma { one: within(1.0), two: within(2.0) },
        scan,
    };
    let mut values = shown.values().to_vec();
    values.extend_from_slice(means(in_sigmas, step).values());
    Framed(facts, values)
}

/// A map and its sigma.
type WithSigma<'a> = (&'a Grid<f32>, &'a Grid<f32>);

fn heights(opened: &OpenedResults) -> Option<WithSigma<'_>> {
    opened.heights.as_ref().map(|heights| (&heights.height_mm, &heights.sigma_mm))
}

fn disparity(opened: &OpenedResults) -> WithSigma<'_> {
    (&opened.disparity, &opened.sigma)
}
