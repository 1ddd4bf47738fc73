//! One quantity from sequence to sequence, with its control chart.

use std::path::Path;

use rayon::prelude::*;
use serde::Serialize;

use super::measure::{Known, Measured};
use super::{ControlChart, Measure, Series};
use epirig_core::choice::Choice as _;

/// One quantity over the sequences of a series, in the order in which they were begun.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trend {
    /// The quantity.
    pub measure: Measure,
    /// Its unit; empty for a share.
    pub unit: &'static str,
    /// The sequences in which it was measured.
    pub values: Vec<TrendValue>,
    /// Its lower limit, by which the newest surface that has limits was judged, in the unit.
    pub lower_limit: Option<f64>,
    /// Its upper limit.
    pub upper_limit: Option<f64>,
    /// The control chart of the values; `None` for fewer than two.
    pub chart: Option<ControlChart>,
}

/// A value with the sequence that it comes from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrendValue {
    /// Name of the sequence, as in the list of the series.
    pub sequence: String,
    /// When it was begun, as in RFC 3339.
    pub begun: String,
    /// The value.
    pub value: f64,
    /// Its standard uncertainty; `None` if that is not known.
    pub sigma: Option<f64>,
    /// The part of it that differs from scan to scan, by noise; `None` if that is not known.
    pub scatter: Option<f64>,
}

/// The trends of a series.
#[derive(Debug, Clone, PartialEq)]
pub struct Trends {
    /// Of every quantity that two or more sequences have.
    pub trends: Vec<Trend>,
    /// What could not be read, and of which sequence or folder.
    pub problems: Vec<String>,
}

impl Trends {
    /// Of the series below `folder`. Limits of the charts come from the first `baseline` values, or from all of them.
    pub fn of(folder: &Path, series: &Series, baseline: Option<usize>) -> Self {
        let of = |name: &String| Known::of(&folder.join(name));
        let read: Vec<_> = series.entries.par_iter().map(|entry| of(&entry.name)).collect();
        let mut problems = series.closed.clone();
        let mut known = Vec::new();
        for (entry, read) in series.entries.iter().zip(read) {
            let (found, more) = read.unzip();
            let all = entry.problem.iter().cloned().chain(more.unwrap_or_default());
            problems.extend(all.map(|problem| format!("{}: {problem}", entry.name)));
            known.push(found);
        }
        let trends = Measure::ALL.iter().map(|&measure| Trend::of(measure, series, &known, baseline));
        Self { trends: trends.filter(|trend| trend.chart.is_some()).collect(), problems }
    }
}

impl Trend {
    fn of(measure: Measure, series: &Series, known: &[Option<Known>], baseline: Option<usize>) -> Self {
        let read =
            || series.entries.iter().zip(known).filter_map(|(entry, known)| Some((entry, known.as_ref()?)));
        let values: Vec<TrendValue> = read()
            .filter_map(|(entry, known)| {
                let Measured { value, sigma, scatter } = measure.of(known)?;
                let (sequence, begun) = (entry.name.clone(), entry.created.clone());
                Some(TrendValue { sequence, begun, value, sigma, scatter })
            })
            .collect();
        let limits = read().rev().find_map(|(_, known)| known.limits(measure));
        let (lower_limit, upper_limit) = limits.unwrap_or_default();
        let numbers: Vec<f64> = values.iter().map(|value| value.value).collect();
        let chart = ControlChart::of(&numbers, baseline);
        Self { measure, unit: measure.unit(), values, lower_limit, upper_limit, chart }
    }
}
