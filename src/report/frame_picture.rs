//! Drawings over a frame: coloured cells with numbers, dots and strokes, with axes in pixels of the frame.

use std::ops::Range;

use image::RgbImage;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::ReportError;
use super::axis::Axis;
use super::canvas::{Canvas, Drawn, FONT, drawn, say};
use super::heading::{Entry, draw_heading, heading_height};

/// Largest size of the drawn frame, in px.
const MOST_WIDTH: f64 = 800.0;
const MOST_HEIGHT: f64 = 640.0;
/// Margins of the frame, in px: for axes, and for titles over narrow frames.
const LEFT: u32 = 76;
const RIGHT: u32 = 24;
const BELOW: u32 = 56;
const LEAST_WIDTH: u32 = 760;

/// A part of the frame in one colour, with a short text in its middle.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ColouredCell {
    /// Columns from edge to edge, in px.
    pub(super) columns_px: Range<f64>,
    /// Rows from edge to edge, in px.
    pub(super) rows_px: Range<f64>,
    pub(super) colour: RGBColor,
    pub(super) text: String,
}

/// A dot with a stroke from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stroke {
    /// Place of the dot in the frame, in px.
    pub(super) from_px: (f64, f64),
    /// Columns and rows to the end of the stroke, in px of the frame. The stroke is cut at the border of the
    /// frame.
    pub(super) by_px: (f64, f64),
    pub(super) colour: RGBColor,
    /// Whether the dot is a large circle.
    pub(super) ring: bool,
}

/// A frame with the drawings over it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FramePicture {
    pub(super) title: String,
    pub(super) rows: usize,
    pub(super) columns: usize,
    pub(super) cells: Vec<ColouredCell>,
    pub(super) strokes: Vec<Stroke>,
    pub(super) legend: Vec<Entry>,
}

/// Pixels of the picture per pixel of the frame.
pub(super) fn frame_scale(rows: usize, columns: usize) -> f64 {
    (MOST_WIDTH / columns.max(1) as f64).min(MOST_HEIGHT / rows.max(1) as f64)
}

impl FramePicture {
    pub(super) fn picture(&self) -> Result<RgbImage, ReportError> {
        let scale = frame_scale(self.rows, self.columns);
        let width = (self.columns as f64 * scale).round().max(1.0) as u32;
        let height = (self.rows as f64 * scale).round().max(1.0) as u32;
        let full = ((width + LEFT + RIGHT).max(LEAST_WIDTH), height + heading_height(&self.legend) + BELOW);
        drawn(&self.title, full, |area| self.draw(area, full.0, width))
    }

    fn draw(&self, area: &Canvas<'_>, full_width: u32, width: u32) -> Drawn {
        draw_heading(area, &self.title, &self.legend, LEFT as i32)?;
        let (_, body) = area.split_vertically(heading_height(&self.legend));
        let (right, bottom) = (self.columns as f64 - 0.5, self.rows as f64 - 0.5);
        let mut axes = ChartBuilder::on(&body)
            .x_label_area_size(BELOW - 8)
            .margin_bottom(8)
            .y_label_area_size(LEFT - 8)
            .margin_left(8)
            .margin_right(full_width - width - LEFT)
            .build_cartesian_2d(Axis::between(-0.5, right), Axis::between(bottom, -0.5))
            .map_err(say)?;
        for cell in &self.cells {
            let corners =
                [(cell.columns_px.start, cell.rows_px.start), (cell.columns_px.end, cell.rows_px.end)];
            axes.draw_series([Rectangle::new(corners, cell.colour.filled())]).map_err(say)?;
        }
        axes.draw_series(self.cells.iter().map(|cell| cell.label(width, right + 0.5))).map_err(say)?;
        let strokes = self.strokes.iter().map(|stroke| {
            let (share, (x, y), by) = (stroke.share_inside(right, bottom), stroke.from_px, stroke.by_px);
            let end = (x + share * by.0, y + share * by.1);
            PathElement::new(vec![stroke.from_px, end], stroke.colour.stroke_width(1))
        });
        axes.draw_series(strokes).map_err(say)?;
        let dots = self.strokes.iter().map(|stroke| {
            let (size, style) = match stroke.ring {
                true => (4, stroke.colour.stroke_width(1)),
                false => (1, stroke.colour.filled()),
            };
            Circle::new(stroke.from_px, size, style)
        });
        axes.draw_series(dots).map_err(say)?;
        // Last, so that the frame's border covers cells at the edge.
        axes.configure_mesh()
            .disable_mesh()
            .x_desc("column (px)")
            .y_desc("row (px)")
            .x_label_formatter(&|x| format!("{x:.0}"))
            .y_label_formatter(&|y| format!("{y:.0}"))
            .label_style((FONT, 14))
            .axis_desc_style((FONT, 16))
            .draw()
            .map_err(say)?;
        let border = Rectangle::new([(-0.5, -0.5), (right, bottom)], BLACK.mix(0.6));
        axes.draw_series([border]).map_err(say)?;
        Ok(())
    }
}

impl ColouredCell {
    /// The text in black or white, whichever is readable; six letters fit into the cell.
    fn label(&self, width: u32, columns: f64) -> Text<'static, (f64, f64), String> {
        let RGBColor(red, green, blue) = self.colour;
        // Luma of Rec. 601.
        let luma = 0.299 * f64::from(red) + 0.587 * f64::from(green) + 0.114 * f64::from(blue);
        let ink = if luma > 128.0 { &BLACK } else { &WHITE };
        let cell_width = (self.columns_px.end - self.columns_px.start) / columns * f64::from(width);
        let style = TextStyle::from((FONT, (cell_width / 4.0).clamp(8.0, 15.0)))
            .color(ink)
            .pos(Pos::new(HPos::Center, VPos::Center));
        let middle = |range: &Range<f64>| 0.5 * (range.start + range.end);
        Text::new(self.text.clone(), (middle(&self.columns_px), middle(&self.rows_px)), style)
    }
}

impl Stroke {
    /// Share of the stroke inside the frame, whose edges are at -0.5 and at `right` and `bottom`.
    fn share_inside(&self, right: f64, bottom: f64) -> f64 {
        let along = |from: f64, by: f64, end: f64| {
            let room = if by > 0.0 { end - from } else { from + 0.5 };
            if by == 0.0 { 1.0 } else { (room / by.abs()).clamp(0.0, 1.0) }
        };
        along(self.from_px.0, self.by_px.0, right).min(along(self.from_px.1, self.by_px.1, bottom))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLUE: RGBColor = RGBColor(0, 114, 178);

    fn frame(cells: Vec<ColouredCell>, strokes: Vec<Stroke>) -> FramePicture {
        FramePicture { title: "t".to_owned(), rows: 300, columns: 400, cells, strokes, legend: Vec::new() }
    }

    #[test]
    fn a_cell_lies_where_it_is_in_the_frame() {
        let cell =
            ColouredCell { columns_px: 99.5..199.5, rows_px: -0.5..49.5, colour: BLUE, text: String::new() };
        let picture = frame(vec![cell], Vec::new()).picture().unwrap();
        // 400 columns become 800: two pixels for one.
        let (left, top) = (LEFT, heading_height(&[]));
        let inside = |x: u32, y: u32| picture.get_pixel(left + x, top + y).0 == [0, 114, 178];
        assert!(inside(205, 5) && inside(395, 95));
        assert!(!inside(195, 5) && !inside(405, 5) && !inside(205, 105));
    }

    #[test]
    fn a_stroke_ends_where_it_leaves_the_frame() {
        let stroke = |from_px, by_px| Stroke { from_px, by_px, colour: BLUE, ring: false };
        let share = |from_px, by_px| stroke(from_px, by_px).share_inside(399.5, 299.5);
        assert_eq!(share((100.0, 100.0), (50.0, -50.0)), 1.0);
        assert_eq!(share((389.5, 100.0), (40.0, 0.0)), 0.25);
        assert_eq!(share((100.0, 19.5), (0.0, -40.0)), 0.5);
        assert_eq!(share((100.0, 100.0), (0.0, 0.0)), 1.0);
        let picture = frame(Vec::new(), vec![stroke((100.0, 100.0), (50.0, 0.0))]).picture().unwrap();
        let top = heading_height(&[]);
        let drawn = (0..800).filter(|&x| picture.get_pixel(LEFT + x, top + 201).0 == [0, 114, 178]).count();
        assert!((95..=105).contains(&drawn), "{drawn}");
    }
}
