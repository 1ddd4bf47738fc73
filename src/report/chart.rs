//! Line charts, with the same numbers as a table.

use image::RgbImage;
use plotters::prelude::*;

use super::{FONT, ReportError, register_font};

const WIDTH: u32 = 960;
const HEIGHT: u32 = 480;
/// Colours that people with any colour vision tell apart (Wong 2011).
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(60, 60, 60),
];

/// One line of a chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name, with the unit where it differs from the axis.
    pub name: String,
    /// Points (x, y); the line is interrupted where y is NaN.
    pub points: Vec<(f64, f64)>,
}

/// Lines over a common axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// Name and unit of the horizontal axis.
    pub x_label: String,
    /// Name and unit of the vertical axis.
    pub y_label: String,
    /// The vertical axis spans at least this much, so that noise does not look like signal; 0 for no limit.
    pub least_y_span: f64,
    /// The lines.
    pub series: Vec<Series>,
}

impl Chart {
    /// The chart as a picture.
    ///
    /// # Errors
    /// [`ReportError`] if it cannot be drawn, as when no point is known.
    pub fn picture(&self) -> Result<RgbImage, ReportError> {
        register_font();
        let mut raw = vec![255; (WIDTH * HEIGHT * 3) as usize];
        self.draw(&mut raw).map_err(|reason| ReportError::new(&self.title, reason))?;
        RgbImage::from_raw(WIDTH, HEIGHT, raw)
            .ok_or_else(|| ReportError::new(&self.title, "its size does not fit"))
    }

    /// The chart's numbers: one line a point with series, x and y; `nan` where unknown.
    pub fn csv(&self) -> String {
        let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
        let mut text = format!("series,{},{}\n", quoted(&self.x_label), quoted(&self.y_label));
        for series in &self.series {
            for (x, y) in &series.points {
                let y = if y.is_nan() { "nan".to_owned() } else { y.to_string() };
                text.push_str(&format!("{},{x},{y}\n", quoted(&series.name)));
            }
        }
        text
    }

    fn draw(&self, raw: &mut [u8]) -> Result<(), String> {
        fn say(error: impl std::fmt::Display) -> String {
            error.to_string()
        }
        let known = || self.series.iter().flat_map(|series| &series.points).filter(|point| !point.1.is_nan());
        let x_range = span(known().map(|point| point.0), 0.0)?;
        let y_range = span(known().map(|point| point.1), self.least_y_span)?;
        let (x_format, y_format) = (tick_format(&x_range), tick_format(&y_range));
        let area = BitMapBackend::with_buffer(raw, (WIDTH, HEIGHT)).into_drawing_area();
        let mut chart = ChartBuilder::on(&area)
            .caption(&self.title, (FONT, 20))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(72)
            .build_cartesian_2d(x_range, y_range)
            .map_err(say)?;
        chart
            .configure_mesh()
            .x_desc(&self.x_label)
            .y_desc(&self.y_label)
            .x_label_formatter(&x_format)
            .y_label_formatter(&y_format)
            .label_style((FONT, 14))
            .axis_desc_style((FONT, 16))
            .light_line_style(WHITE)
            .draw()
            .map_err(say)?;
        for (index, series) in self.series.iter().enumerate() {
            let colour = COLOURS[index % COLOURS.len()];
            let mut named = false;
            for piece in series.points.split(|point| point.1.is_nan()).filter(|piece| !piece.is_empty()) {
                let line = LineSeries::new(piece.iter().copied(), colour.stroke_width(2));
                let drawn = chart.draw_series(line).map_err(say)?;
                if !named {
                    let mark =
                        move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], colour.stroke_width(2));
                    drawn.label(&series.name).legend(mark);
                    named = true;
                }
            }
        }
        if self.series.len() > 1 {
            chart
                .configure_series_labels()
                .position(SeriesLabelPosition::UpperRight)
                .label_font((FONT, 14))
                .background_style(WHITE.mix(0.8))
                .border_style(BLACK.mix(0.3))
                .draw()
                .map_err(say)?;
        }
        area.present().map_err(say)
    }
}

/// From the least to the greatest value with some air, at least `least` wide; an error if there is none.
fn span(values: impl Iterator<Item = f64>, least: f64) -> Result<std::ops::Range<f64>, String> {
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return Err("there is no value to show".to_owned());
    }
    let air = if high > low { 0.04 * (high - low) } else { 0.5 };
    let missing = 0.5 * (least - (high - low) - 2.0 * air).max(0.0);
    Ok(low - air - missing..high + air + missing)
}

/// Writes a tick with as many decimals as tell it from the next.
pub(super) fn tick_format(range: &std::ops::Range<f64>) -> impl Fn(&f64) -> String + use<> {
    let decimals = (1.0 - (range.end - range.start).log10()).ceil().clamp(0.0, 6.0) as usize;
    move |tick| format!("{tick:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_shows_its_line_and_tells_its_numbers() {
        let chart = Chart {
            title: "square".to_owned(),
            x_label: "x (px)".to_owned(),
            y_label: "y (px)".to_owned(),
            least_y_span: 0.0,
            series: vec![Series {
                name: "s".to_owned(),
                points: vec![(0.0, 0.0), (1.0, f64::NAN), (2.0, 4.0), (3.0, 9.0)],
            }],
        };
        let picture = chart.picture().unwrap();
        let blue = image::Rgb([COLOURS[0].0, COLOURS[0].1, COLOURS[0].2]);
        assert!(picture.pixels().filter(|&&pixel| pixel == blue).count() > 50);
        assert_eq!(chart.csv().lines().nth(2), Some("\"s\",1,nan"));
        let empty = Chart { series: Vec::new(), ..chart };
        assert!(empty.picture().is_err());
    }
}
