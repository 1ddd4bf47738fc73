//! Charts of lines and dots, and their numbers as a table.

use image::RgbImage;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::ReportError;
use super::axis::Axis;
use super::canvas::{Drawn, FONT, drawn, say, use_own_font};
use super::csv::{number, table};
use super::heading::{COLOURS, Entry, Sample, draw_heading, heading_height};

const WIDTH: u32 = 960;
const HEIGHT: u32 = 480;
/// Margins around the axes, in px.
const LEFT: i32 = 84;
/// Series with more points than this have small dots, which do not merge.
const MANY: usize = 1000;

/// Colour of the line along zero: darker than the grid below it.
const ZERO: RGBColor = RGBColor(90, 90, 90);

/// Share of a line's colour in its band.
const BAND: f64 = 0.25;
/// Length of dashes and of the gaps between them, in px.
const DASH: i32 = 8;
const GAP: i32 = 5;

/// What charts are drawn by: plotters asks for these bounds.
trait Backend: DrawingBackend<ErrorType: 'static> {}

impl<B: DrawingBackend<ErrorType: 'static>> Backend for B {}

type Axes<'a, B> = ChartContext<'a, B, Cartesian2d<Axis, Axis>>;

/// How a series is drawn.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Marks {
    /// A line through the points, interrupted where one is unknown.
    #[default]
    Line,
    /// The same, dashed.
    Dashed,
    /// A line in a band of one standard uncertainty to both sides: in the unit of y, one for each point; NaN
    /// for no band.
    Band(Vec<f64>),
    /// A dot for each point.
    Dots,
    /// A dot for each point with an error bar of one standard uncertainty to both sides: in the unit of y,
    /// one for each point; NaN for no bar.
    DotsWithBars(Vec<f64>),
}

/// A line or a kind of dots in a chart.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Name, with the unit where it differs from the axis.
    pub name: String,
    /// Points (x, y); y is NaN where it is unknown. Only finite ones are drawn.
    pub points: Vec<(f64, f64)>,
    /// How the points are drawn.
    pub marks: Marks,
    /// Text beside each point; empty for none.
    pub labels: Vec<String>,
}

impl Series {
    /// A line.
    pub fn line(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points, ..Self::default() }
    }

    /// Dots.
    pub fn dots(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { marks: Marks::Dots, ..Self::line(name, points) }
    }

    /// Standard uncertainty of a point; NaN if there is none.
    fn sigma(&self, index: usize) -> f64 {
        match &self.marks {
            Marks::DotsWithBars(sigmas) | Marks::Band(sigmas) => {
                sigmas.get(index).copied().unwrap_or(f64::NAN)
            }
            Marks::Line | Marks::Dashed | Marks::Dots => f64::NAN,
        }
    }

    /// Known points with half the height of their bars, which is finite and at least 0.
    fn known(&self) -> impl Iterator<Item = (usize, (f64, f64), f64)> {
        let is_known = |(_, (x, y)): &(usize, (f64, f64))| x.is_finite() && y.is_finite();
        let bar = |sigma: f64| if sigma.is_finite() { sigma.max(0.0) } else { 0.0 };
        let all = self.points.iter().copied().enumerate().filter(is_known);
        all.map(move |(index, point)| (index, point, bar(self.sigma(index))))
    }

    fn entry(&self, colour: RGBColor) -> Entry {
        let sample = match self.marks {
            Marks::Line => Sample::Line(18),
            Marks::Dashed => Sample::Dashed(2 * DASH + GAP),
            Marks::Band(_) => Sample::Band(18),
            Marks::Dots => Sample::Dot,
            Marks::DotsWithBars(_) => Sample::DotWithBar,
        };
        Entry { name: self.name.clone(), sample, colour }
    }
}

/// Series over a common axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Name and unit of the horizontal axis.
    pub x_label: String,
    /// Name and unit of the vertical axis.
    pub y_label: String,
    /// Least span of the vertical axis, so that noise does not look like signal; 0 for no limit.
    pub least_y_span: f64,
    /// Whether the vertical axis includes 0, with a line along it.
    pub zero_line: bool,
    /// The series; later ones are drawn over earlier ones.
    pub series: Vec<Series>,
}

impl Chart {
    /// The chart as a picture; without any known point it says so.
    ///
    /// # Errors
    /// [`ReportError`] if the text cannot be drawn.
    pub fn picture(&self) -> Result<RgbImage, ReportError> {
        drawn(&self.title, (WIDTH, HEIGHT), |area| self.draw(area))
    }

    /// The chart as SVG.
    ///
    /// # Errors
    /// As [`picture`](Self::picture).
    pub fn svg(&self) -> Result<String, ReportError> {
        use_own_font();
        let mut text = String::new();
        let area = SVGBackend::with_string(&mut text, (WIDTH, HEIGHT)).into_drawing_area();
        let drawn = area.fill(&WHITE).map_err(say).and_then(|()| self.draw(&area));
        drawn.map_err(|reason| ReportError::new(&self.title, reason))?;
        drop(area);
        Ok(text)
    }

    /// The numbers of the chart: one line per point with series, x, y, and the standard uncertainty if any is
    /// shown; `nan` where unknown.
    pub fn csv(&self) -> String {
        let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
        let uncertain = |series: &Series| matches!(series.marks, Marks::DotsWithBars(_) | Marks::Band(_));
        let bars = self.series.iter().any(uncertain);
        let last = if bars { ",standard deviation" } else { "" };
        let head = format!("series,{},{}{last}", quoted(&self.x_label), quoted(&self.y_label));
        let row = |series: &Series, index: usize, (x, y): (f64, f64)| {
            let bar = if bars { format!(",{}", number(series.sigma(index))) } else { String::new() };
            format!("{},{x},{}{bar}", quoted(&series.name), number(y))
        };
        let rows = self.series.iter().flat_map(|series| {
            series.points.iter().enumerate().map(move |(index, point)| row(series, index, *point))
        });
        table(&head, rows)
    }

    fn draw<B: Backend>(&self, area: &DrawingArea<B, Shift>) -> Drawn {
        let known = || self.series.iter().flat_map(Series::known);
        let x_axis = Axis::around(known().map(|(_, point, _)| point.0), 0.0);
        let zero = if self.zero_line { known().next().map(|_| 0.0) } else { None };
        let ends = known().flat_map(|(_, (_, y), sigma)| [y - sigma, y + sigma]);
        let y_axis = Axis::around(ends.chain(zero), self.least_y_span);
        let (x_format, y_format) = (x_axis.tick_format(), y_axis.tick_format());
        let coloured = || self.series.iter().zip(COLOURS.into_iter().cycle());
        let legend: Vec<Entry> = match self.series.len() {
            0 | 1 => Vec::new(),
            _ => coloured().map(|(series, colour)| series.entry(colour)).collect(),
        };
        draw_heading(area, &self.title, &legend, LEFT)?;
        let (_, body) = area.split_vertically(heading_height(&legend));
        let mut axes = ChartBuilder::on(&body)
            .margin(12)
            .margin_top(4)
            .x_label_area_size(44)
            .y_label_area_size(LEFT - 12)
            .build_cartesian_2d(x_axis, y_axis)
            .map_err(say)?;
        axes.configure_mesh()
            .x_desc(&self.x_label)
            .y_desc(&self.y_label)
            .x_label_formatter(&x_format)
            .y_label_formatter(&y_format)
            .label_style((FONT, 14))
            .axis_desc_style((FONT, 16))
            .light_line_style(WHITE)
            .draw()
            .map_err(say)?;
        if self.zero_line {
            let line = PathElement::new(vec![(x_axis.at(0.0), 0.0), (x_axis.at(1.0), 0.0)], ZERO);
            axes.draw_series([line]).map_err(say)?;
        }
        for (series, colour) in coloured() {
            series.draw(&mut axes, colour)?;
            series.draw_labels(&mut axes, colour, x_axis.at(0.9))?;
        }
        if known().next().is_none() {
            let style = TextStyle::from((FONT, 16)).pos(Pos::new(HPos::Center, VPos::Center));
            area.draw_text("no value to show", &style, (WIDTH as i32 / 2, HEIGHT as i32 / 2)).map_err(say)?;
        }
        area.present().map_err(say)
    }
}

impl Series {
    fn draw<B: Backend>(&self, axes: &mut Axes<'_, B>, colour: RGBColor) -> Drawn {
        if let Marks::Line | Marks::Dashed | Marks::Band(_) = self.marks {
            return self.draw_lines(axes, colour);
        }
        let bars = self.known().filter(|(_, _, sigma)| *sigma > 0.0).map(|(_, (x, y), sigma)| {
            PathElement::new(vec![(x, y - sigma), (x, y + sigma)], colour.stroke_width(1))
        });
        axes.draw_series(bars).map_err(say)?;
        let size = if self.points.len() > MANY { 1 } else { 3 };
        let dots = self.known().map(|(_, point, _)| Circle::new(point, size, colour.filled()));
        axes.draw_series(dots).map_err(say)?;
        Ok(())
    }

    fn draw_lines<B: Backend>(&self, axes: &mut Axes<'_, B>, colour: RGBColor) -> Drawn {
        let mut known = self.known().peekable();
        while let Some((first, point, sigma)) = known.next() {
            let mut piece = vec![(point, sigma)];
            let mut last = first;
            while let Some((index, point, sigma)) = known.next_if(|(index, ..)| *index == last + 1) {
                piece.push((point, sigma));
                last = index;
            }
            let line = || piece.iter().map(|(point, _)| *point);
            let style = colour.stroke_width(2);
            match self.marks {
                Marks::Dashed => axes.draw_series(DashedLineSeries::new(line(), DASH, GAP, style)).map(drop),
                _ => axes.draw_series(LineSeries::new(line(), style)).map(drop),
            }
            .map_err(say)?;
            let upper = piece.iter().map(|((x, y), sigma)| (*x, y + sigma));
            let lower = piece.iter().rev().map(|((x, y), sigma)| (*x, y - sigma));
            if piece.iter().any(|(_, sigma)| *sigma > 0.0) {
                let band = Polygon::new(upper.chain(lower).collect::<Vec<_>>(), colour.mix(BAND).filled());
                axes.draw_series([band]).map_err(say)?;
            }
        }
        Ok(())
    }

    /// Labels are right of their points; left of them beyond `turn`.
    fn draw_labels<B: Backend>(&self, axes: &mut Axes<'_, B>, colour: RGBColor, turn: f64) -> Drawn {
        let labels = self.known().filter_map(|(index, point, _)| {
            let (side, aside) = if point.0 > turn { (HPos::Right, -7) } else { (HPos::Left, 7) };
            let style = TextStyle::from((FONT, 14)).color(&colour).pos(Pos::new(side, VPos::Center));
            let label = self.labels.get(index)?.clone();
            Some(EmptyElement::at(point) + Text::new(label, (aside, 0), style))
        });
        axes.draw_series(labels).map_err(say)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn chart(series: Vec<Series>) -> Chart {
        let text = |text: &str| text.to_owned();
        Chart {
            title: text("t"),
            x_label: text("x (px)"),
            y_label: text("y (px)"),
            series,
            ..Chart::default()
        }
    }

    /// Pixels of a colour below title and legend.
    fn count(picture: &RgbImage, colour: RGBColor) -> usize {
        let colour = image::Rgb([colour.0, colour.1, colour.2]);
        picture.enumerate_pixels().filter(|(_, y, pixel)| *y > 60 && **pixel == colour).count()
    }

    #[test]
    fn a_chart_shows_its_line_and_tells_its_numbers() {
        let chart = chart(vec![Series::line("s", vec![(0.0, 0.0), (1.0, f64::NAN), (2.0, 4.0), (3.0, 9.0)])]);
        assert!(count(&chart.picture().unwrap(), COLOURS[0]) > 50);
        assert_eq!(
            chart.csv(),
            "series,\"x (px)\",\"y (px)\"\n\"s\",0,0\n\"s\",1,nan\n\"s\",2,4\n\"s\",3,9\n"
        );
        let empty = Chart { series: Vec::new(), ..chart };
        assert!(empty.svg().unwrap().contains("no value to show"));
    }

    #[test]
    fn dots_stand_apart_and_bars_reach_a_standard_deviation_to_both_sides() {
        let points = vec![(0.0, 0.0), (1.0, 10.0), (2.0, 5.0), (3.0, f64::NAN)];
        let dots = chart(vec![Series::dots("a", points.clone())]);
        // Three discs of radius 3, whose edges may be mixed with the ground.
        let discs = count(&dots.picture().unwrap(), COLOURS[0]);
        assert!((3 * 13..=3 * 45).contains(&discs), "{discs}");
        let bars =
            Series { marks: Marks::DotsWithBars(vec![f64::NAN, 1.0, 2.0, 1.0]), ..dots.series[0].clone() };
        let bars = chart(vec![bars]);
        let picture = bars.picture().unwrap();
        let column = |x: u32| (60..HEIGHT).filter(|&y| picture.get_pixel(x, y).0 == [0, 114, 178]).count();
        let tallest = (0..WIDTH).map(column).max().unwrap();
        // The axis spans 11 by the bar of the second point, with 8 % of air, over about 380 rows: four units
        // are 128 rows.
        assert!((120..=140).contains(&tallest), "{tallest}");
        let csv = "series,\"x (px)\",\"y (px)\",standard deviation\n\"a\",0,0,nan\n\"a\",1,10,1\n\"a\",2,5,2\n\"a\",3,nan,1\n";
        assert_eq!(bars.csv(), csv);
    }

    #[test]
    fn the_zero_line_is_shown_even_if_all_values_are_far_from_it() {
        let far = chart(vec![Series::dots("a", vec![(0.0, 10.0), (1.0, 11.0)])]);
        let grey = |picture: &RgbImage| {
            let row = |y: u32| (0..WIDTH).filter(|&x| picture.get_pixel(x, y).0 == [90; 3]).count();
            (0..HEIGHT).map(row).max().unwrap()
        };
        assert!(grey(&far.picture().unwrap()) < 100);
        let with_zero = Chart { zero_line: true, ..far };
        assert!(grey(&with_zero.picture().unwrap()) > 800);
    }

    /// Any number, and those that break arithmetic more often than chance would have it.
    fn any_number() -> impl Strategy<Value = f64> {
        let hard = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MAX,
            f64::MIN,
            f64::MIN_POSITIVE,
            5e-324,
            f64::from(f32::MIN_POSITIVE),
            0.0,
            1.0,
            1e16,
            1e16 + 2.0,
        ];
        prop_oneof![any::<f64>(), any::<f32>().prop_map(f64::from), prop::sample::select(hard.to_vec())]
    }

    proptest! {
        /// Plotters looks for ticks without end if an end of its axis is infinite, or too near to the other one.
        #[test]
        fn a_chart_of_any_numbers_is_drawn(
            points in prop::collection::vec((any_number(), any_number()), 0..6),
            offset in any_number(),
            sigmas in prop::collection::vec(any_number(), 0..6),
            (kind, least_y_span, zero_line) in (0..5, prop::sample::select(vec![0.0, 0.3]), any::<bool>()),
        ) {
            let marks = match kind {
                0 => Marks::Line,
                1 => Marks::Dashed,
                2 => Marks::Band(sigmas),
                3 => Marks::Dots,
                _ => Marks::DotsWithBars(sigmas),
            };
            let near = points.iter().map(|(x, y)| (*x, 1.0 + y / offset)).collect();
            let series = vec![Series { marks, ..Series::line("a", points) }, Series::line("b", near)];
            let chart = Chart { least_y_span, zero_line, ..chart(series) };
            prop_assert!(chart.picture().is_ok() && chart.svg().is_ok());
        }
    }

    #[test]
    fn labels_stand_beside_their_points() {
        let plain = chart(vec![Series::dots("a", vec![(0.0, 0.0), (1.0, 1.0)])]);
        let mut labelled = plain.clone();
        labelled.series[0].labels = vec![String::new(), "17".to_owned()];
        let (plain, labelled) = (plain.picture().unwrap(), labelled.picture().unwrap());
        let changed: Vec<u32> = plain
            .enumerate_pixels()
            .filter(|(x, y, pixel)| labelled.get_pixel(*x, *y) != *pixel)
            .map(|(x, _, _)| x)
            .collect();
        assert!(changed.len() > 20 && changed.iter().all(|&x| x > WIDTH - 100), "{changed:?}");
    }

    #[test]
    fn a_band_reaches_a_standard_deviation_to_both_sides_and_dashes_have_gaps() {
        let points = vec![(0.0, 0.0), (1.0, 0.0), (2.0, f64::NAN), (3.0, 0.0), (4.0, 10.0)];
        let sigmas = vec![1.0, 1.0, 1.0, 2.0, f64::NAN];
        let band = Series { marks: Marks::Band(sigmas), ..Series::line("a", points.clone()) };
        let band = chart(vec![band]);
        assert!(band.csv().ends_with("\"a\",3,0,2\n\"a\",4,10,nan\n"));
        let picture = band.picture().unwrap();
        // The axis spans 12 with 8 % of air over 384 rows; between the first two points the band is 2 high, of
        // which the line takes 2 or 3 rows.
        let is_mixed = |pixel: &image::Rgb<u8>| pixel.0[0] > 0 && pixel.0[2] > pixel.0[0].saturating_add(20);
        let rows = (60..HEIGHT).filter(|&y| is_mixed(picture.get_pixel(150, y))).count();
        assert!((54..=60).contains(&rows), "{rows}");
        let svg = band.svg().unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("<polygon") && svg.trim_end().ends_with("</svg>"));
        let line =
            |marks: Marks| chart(vec![Series { marks, ..Series::line("a", vec![(0.0, 0.0), (1.0, 0.0)]) }]);
        let inked = |marks: Marks| count(&line(marks).picture().unwrap(), COLOURS[0]);
        let (whole, dashed) = (inked(Marks::Line), inked(Marks::Dashed));
        assert!(dashed > whole / 2 && dashed < 3 * whole / 4, "{dashed} of {whole}");
    }

    #[test]
    fn svg_escapes_what_it_is_given() {
        let hostile =
            Chart { title: "<script>&\"".to_owned(), ..chart(vec![Series::line("s", vec![(0.0, 1.0)])]) };
        let svg = hostile.svg().unwrap();
        assert!(!svg.contains("<script>") && svg.contains("&lt;script&gt;&amp;"), "{svg}");
    }
}
