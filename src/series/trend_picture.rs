//! A trend as a picture: the values with their limits, above their moving ranges.

use image::RgbImage;
use image::imageops::replace;

use super::Trend;
use crate::report::{Chart, Marks, ReportError, Series};

/// Name of the horizontal axis: sequences count from 1.
const SEQUENCES: &str = "sequence, in the order in which they were begun";

impl Trend {
    /// The control chart; without one, two axes without values.
    ///
    /// # Errors
    /// [`ReportError`] if the text cannot be drawn.
    pub fn picture(&self) -> Result<RgbImage, ReportError> {
        let [values, ranges] = self.charts();
        let (values, ranges) = (values.picture()?, ranges.picture()?);
        let mut both = RgbImage::new(values.width(), values.height() + ranges.height());
        replace(&mut both, &values, 0, 0);
        replace(&mut both, &ranges, 0, i64::from(values.height()));
        Ok(both)
    }

    fn charts(&self) -> [Chart; 2] {
        let of = |what: &str, series| Chart {
            title: format!("{what} of {} sequences", self.values.len()),
            x_label: SEQUENCES.to_owned(),
            y_label: match self.unit {
                "" => self.measure.to_string(),
                unit => format!("{} ({unit})", self.measure),
            },
            series,
            ..Chart::default()
        };
        [
            of(&format!("Control chart: {}", self.measure), self.lines()),
            of(&format!("Moving range: {}", self.measure), self.range_lines()),
        ]
    }

    fn lines(&self) -> Vec<Series> {
        let number = |index: usize| (index + 1) as f64;
        let count = self.values.len();
        let level = |name: &str, y: f64, marks: Marks| Series {
            marks,
            ..Series::line(name, vec![(1.0, y), (number(count.saturating_sub(1)), y)])
        };
        let points = self.values.iter().enumerate().map(|(index, value)| (number(index), value.value));
        let sigmas = self.values.iter().map(|value| value.sigma.unwrap_or(f64::NAN)).collect();
        let mut lines = vec![Series {
            marks: Marks::DotsWithBars(sigmas),
            ..Series::line("value, standard uncertainty", points.collect())
        }];
        let Some(chart) = &self.chart else { return lines };
        let conspicuous = chart.conspicuous().map(|index| (number(index), chart.points[index].value));
        lines.push(Series::dots("marked", conspicuous.collect()));
        lines.push(level("mean", chart.centre, Marks::Line));
        lines.push(two_levels("limits of control", chart.lower, chart.upper, number(count - 1)));
        if let Some(change) = chart.change {
            let last_before = number(change.first) - 0.5;
            let means = vec![
                (1.0, change.before),
                (last_before, change.before),
                (last_before, change.after),
                (number(count - 1), change.after),
            ];
            lines.push(Series::line("mean before and after a change", means));
        }
        if self.lower_limit.is_some() || self.upper_limit.is_some() {
            let limit = |limit: Option<f64>| limit.unwrap_or(f64::NAN);
            let (lower, upper) = (limit(self.lower_limit), limit(self.upper_limit));
            lines.push(two_levels("tolerance", lower, upper, number(count - 1)));
        }
        lines
    }

    fn range_lines(&self) -> Vec<Series> {
        let Some(chart) = &self.chart else { return Vec::new() };
        let count = chart.points.len() as f64;
        let numbered = chart.points.iter().zip(1..);
        let ranges =
            numbered.map(|(point, number)| (f64::from(number), point.moving_range.unwrap_or(f64::NAN)));
        let level = |y: f64| vec![(1.0, y), (count, y)];
        vec![
            Series::dots("moving range", ranges.collect()),
            Series::line("mean", level(chart.mean_range)),
            Series { marks: Marks::Dashed, ..Series::line("limit", level(chart.upper_range)) },
        ]
    }
}

/// Two dashed lines, from the first sequence to the last.
fn two_levels(name: &str, lower: f64, upper: f64, last: f64) -> Series {
    let apart = (f64::NAN, f64::NAN);
    let points = vec![(1.0, lower), (last, lower), apart, (1.0, upper), (last, upper)];
    Series { marks: Marks::Dashed, ..Series::line(name, points) }
}
