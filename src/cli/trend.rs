//! `epirig trend`.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::choice::choice;
use super::csv_table::{csv_table, refuse_both};
use super::files::{refuse_taken, write_new};
use super::{CliError, Talk};
use crate::number::{ascii, moment, significant};
use crate::results::encoded_picture;
use crate::series::{Change, ControlChart, Measure, Series, Trend, Trends};
use epirig_core::choice::Choice as _;

/// Values beyond chance that are printed; CSV and JSON have all.
const PRINTED: usize = 12;

/// Follow depth and rig over many sequences, with control charts
///
/// For each quantity that two or more sequences have: its mean, its scatter, whether it is steady, and where it has
/// changed. Only records are read, no frames and no maps.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig trend tiles
  epirig trend tiles --picture depth.png
  epirig trend tiles --measure noise --picture noise.png
  epirig trend tiles --baseline 20 --csv > trend.csv

The scatter comes from the differences of neighbours, and the limits of control stand three of it
beside the mean (ISO 7870-2). Of a steady process about two values in a hundred are marked by chance.")]
pub(super) struct TrendVerb {
    /// Folder to look below
    #[arg(default_value = ".")]
    folder: PathBuf,
    /// The quantity whose values are looked at one by one, and drawn
    #[arg(long, value_parser = choice::<Measure>(), default_value_t = Measure::Depth)]
    measure: Measure,
    /// Make limits of the first N sequences, which are known to be good [default: of all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..))]
    baseline: Option<u32>,
    /// Draw the control chart of --measure into a PNG file; an existing file is refused
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Print a table of comma-separated values, a line for each value of each quantity
    #[arg(long)]
    csv: bool,
}

#[derive(Serialize)]
struct TrendOutput<'a> {
    trends: &'a [Trend],
    /// Sequences of which not everything could be read, with the reason.
    problems: &'a [String],
}

/// A line of the table.
#[derive(Serialize)]
struct Row<'a> {
    measure: Measure,
    unit: &'a str,
    sequence: &'a str,
    begun: &'a str,
    value: f64,
    sigma: Option<f64>,
    moving_range: Option<f64>,
    /// Names of the patterns that end here, with spaces between.
    patterns: String,
}

impl TrendVerb {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        refuse_both("trend", self.csv, talk)?;
        self.picture.as_deref().map(refuse_taken).transpose()?;
        let series = Series::below(&self.folder)?;
        let Trends { trends, problems } =
            Trends::of(&self.folder, &series, self.baseline.map(|count| count as usize));
        for problem in &problems {
            talk.say(&format!("note: {problem}"));
        }
        let looked_at = trends.iter().find(|trend| trend.measure == self.measure);
        if let Some(path) = &self.picture {
            let trend = looked_at.ok_or_else(|| self.nothing_to_draw(&trends))?;
            draw(trend, path)?;
        }
        if self.csv {
            return talk.print(&csv_table(rows(&trends))?);
        }
        talk.result(&TrendOutput { trends: &trends, problems: &problems }, || match trends.is_empty() {
            true => format!(
                "{} sequences below {}: too few for a trend, which needs two that are calibrated, matched or measured\n",
                series.entries.len(),
                self.folder.display()
            ),
            false => described(&trends, looked_at),
        })
    }

    fn nothing_to_draw(&self, trends: &[Trend]) -> CliError {
        let known: Vec<&str> = trends.iter().map(|trend| trend.measure.name()).collect();
        let instead = match known.is_empty() {
            true => "none has another quantity: calibrate, match and measure them first".to_owned(),
            false => format!("give --measure {}", known.join(" or ")),
        };
        CliError::usage(format!(
            "there is no chart of {}: fewer than two sequences below {} have it; {instead}",
            self.measure,
            self.folder.display(),
        ))
    }
}

fn draw(trend: &Trend, path: &Path) -> Result<(), CliError> {
    write_new(path, &encoded_picture(path, &trend.picture()?)?)
}

/// All quantities in a table, and then the values of one that are not by chance.
fn described(trends: &[Trend], looked_at: Option<&Trend>) -> String {
    let mut text = format!(
        "{:<11} {:>5} {:>11} {:>9} {:<3} {:>6}  change\n",
        "", "count", "mean", "scatter", "", "marked"
    );
    for trend in trends {
        let Some(chart) = &trend.chart else { continue };
        let (mean, scatter) = (rounded(chart.centre, chart.sigma), significant(chart.sigma, 2));
        let line = format!(
            "{:<11} {:>5} {:>11} {:>9} {:<3} {:>6}  {}",
            trend.measure,
            trend.values.len(),
            ascii(&mean),
            scatter,
            trend.unit,
            chart.conspicuous().count(),
            chart.change.map_or_else(|| "none".to_owned(), |change| changed(trend, chart, change))
        );
        text.push_str(line.trim_end());
        text.push('\n');
    }
    if let Some((trend, chart)) = looked_at.and_then(|trend| Some((trend, trend.chart.as_ref()?))) {
        text.push_str(&marked(trend, chart));
    }
    text
}

/// The size of a change and its place.
fn changed(trend: &Trend, chart: &ControlChart, change: Change) -> String {
    let by = change.after - change.before;
    let sign = if by > 0.0 { "+" } else { "" };
    let name = |index: usize| &trend.values[index].sequence;
    let place = match change.earliest == change.latest {
        true => format!("at {}", name(change.first)),
        false => format!("at {} ({} to {})", name(change.first), name(change.earliest), name(change.latest)),
    };
    format!("{sign}{} {place}", ascii(&rounded(by, chart.sigma)))
}

/// The values that end a pattern.
fn marked(trend: &Trend, chart: &ControlChart) -> String {
    let unit = if trend.unit.is_empty() { String::new() } else { format!(" {}", trend.unit) };
    let limits = [chart.lower, chart.upper].map(|limit| ascii(&rounded(limit, chart.sigma)));
    let mut text = format!("\n{}: limits of control {} to {}{unit}\n", trend.measure, limits[0], limits[1]);
    let places: Vec<usize> = chart.conspicuous().collect();
    for &index in places.iter().take(PRINTED) {
        let (value, point) = (&trend.values[index], &chart.points[index]);
        let words: Vec<&str> = point.patterns.iter().map(|pattern| pattern.in_words()).collect();
        let begun: String = moment(&value.begun).chars().take(16).collect();
        let shown = ascii(&rounded(value.value, chart.sigma));
        text.push_str(&format!("  {}  {begun}  {shown}{unit}: {}\n", value.sequence, words.join("; ")));
    }
    if places.len() > PRINTED {
        text.push_str(&format!("  and {} more, which --csv and --json have\n", places.len() - PRINTED));
    }
    text
}

/// A value to the second digit of the scatter.
fn rounded(value: f64, scatter: f64) -> String {
    match scatter > 0.0 {
        true => {
            let digits = 2 + (value.abs().max(scatter) / scatter).log10().floor() as i32;
            significant(value, digits)
        }
        false => significant(value, 6),
    }
}

/// A row for each value of each quantity.
fn rows(trends: &[Trend]) -> impl Iterator<Item = Row<'_>> {
    let charts = trends.iter().filter_map(|trend| Some((trend, trend.chart.as_ref()?)));
    charts.flat_map(|(trend, chart)| {
        trend.values.iter().zip(&chart.points).map(|(value, point)| Row {
            measure: trend.measure,
            unit: trend.unit,
            sequence: &value.sequence,
            begun: &value.begun,
            value: value.value,
            sigma: value.sigma,
            moving_range: point.moving_range,
            patterns: point.patterns.iter().map(|pattern| pattern.name()).collect::<Vec<_>>().join(" "),
        })
    })
}
