//! One quantity over many sequences, as a control chart.

use std::collections::HashSet;
use std::path::Path;

use serde::Serialize;

use crate::panel::error::PanelError;
use crate::panel::requests::requests;
use crate::series::{Change, Measure, Series, Trend, TrendValue, Trends};
use epirig_core::choice::Choice as _;

requests! {
    /// Which quantity is asked for, and of which sequences.
    TrendQuestion {
        #[cfg_attr(test, ts(as = "crate::panel::page_type_tests::Names<Measure>"))]
        measure: Measure,
        /// Names in the list of the sequences.
        sequences: Vec<String>,
    }
}

/// What of the sequences can be followed, and one of it.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct SeriesTrend {
    /// The quantities that two or more of the sequences have.
    offered: Vec<Offered>,
    /// The chart of the quantity that was asked for; `None` if it is not offered.
    chart: Option<SeriesChart>,
    /// What could not be read, and of which sequence.
    problems: Vec<String>,
}

/// A quantity that can be followed.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct Offered {
    #[cfg_attr(test, ts(as = "crate::panel::page_type_tests::Names<Measure>"))]
    measure: Measure,
    /// What it is, in a sentence.
    meaning: &'static str,
}

/// A control chart of single values.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct SeriesChart {
    #[cfg_attr(test, ts(as = "crate::panel::page_type_tests::Names<Measure>"))]
    measure: Measure,
    /// Its unit; empty for a share.
    unit: &'static str,
    /// The values, in the order in which the sequences were begun.
    points: Vec<SeriesPoint>,
    mean: f64,
    /// Limits of control: three times the scatter beside the mean.
    lower: f64,
    upper: f64,
    /// Standard deviation of a value, by the differences of neighbours.
    scatter: f64,
    /// Where the mean has changed; `None` if that may be chance.
    change: Option<MeanChange>,
    /// Limits by which the newest surface was judged.
    lower_limit: Option<f64>,
    upper_limit: Option<f64>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct SeriesPoint {
    /// Name of the sequence.
    sequence: String,
    /// When it was begun, as in RFC 3339.
    begun: String,
    value: f64,
    /// Its standard uncertainty; `None` if that is not known.
    sigma: Option<f64>,
    /// The rules of a steady process that it breaks, in words.
    rules: Vec<&'static str>,
}

/// A change of the mean.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct MeanChange {
    /// Number of the first value after it, from 0.
    first: usize,
    /// Its earliest and latest place, with 95 % coverage.
    earliest: usize,
    latest: usize,
    before: f64,
    after: f64,
}

/// The trend of the sequences below `folder` that the question names. Only records are read.
pub(in crate::panel) fn trend(folder: &Path, asked: TrendQuestion) -> Result<SeriesTrend, PanelError> {
    let TrendQuestion { measure, sequences } = asked;
    let wanted: HashSet<String> = sequences.into_iter().collect();
    let mut series = Series::below(folder)?;
    series.entries.retain(|entry| wanted.contains(&entry.name));
    let Trends { trends, problems } = Trends::of(folder, &series, None);
    let offered = |trend: &Trend| Offered { measure: trend.measure, meaning: trend.measure.help() };
    let offered = trends.iter().map(offered).collect();
    let chart = trends.into_iter().find(|trend| trend.measure == measure).and_then(chart);
    Ok(SeriesTrend { offered, chart, problems })
}

fn chart(trend: Trend) -> Option<SeriesChart> {
    let Trend { measure, unit, values, lower_limit, upper_limit, chart } = trend;
    let chart = chart?;
    let point = |(value, point): (TrendValue, &crate::series::ChartPoint)| SeriesPoint {
        sequence: value.sequence,
        begun: value.begun,
        value: value.value,
        sigma: value.sigma,
        rules: point.patterns.iter().map(|pattern| pattern.in_words()).collect(),
    };
    let change = |Change { first, earliest, latest, before, after, .. }: Change| MeanChange {
        first,
        earliest,
        latest,
        before,
        after,
    };
    Some(SeriesChart {
        measure,
        unit,
        points: values.into_iter().zip(&chart.points).map(point).collect(),
        mean: chart.centre,
        lower: chart.lower,
        upper: chart.upper,
        scatter: chart.sigma,
        change: chart.change.map(change),
        lower_limit,
        upper_limit,
    })
}
