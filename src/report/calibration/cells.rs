//! A frame divided into cells with one number each.

use image::RgbImage;
use plotters::style::RGBColor;

use crate::report::ReportError;
use crate::report::csv::table;
use crate::report::frame_picture::{ColouredCell, FramePicture};

/// Numbers of the cells of a frame.
pub(super) struct Cells<'a> {
    pub(super) title: String,
    pub(super) rows: usize,
    pub(super) columns: usize,
    /// A list for each row of cells; all lists have the same length.
    pub(super) values: &'a [Vec<f64>],
}

impl Cells<'_> {
    /// Each cell in the colour of its value, with the value as text.
    pub(super) fn picture(
        self,
        colour: impl Fn(f64) -> RGBColor,
        text: impl Fn(f64) -> String,
    ) -> Result<RgbImage, ReportError> {
        let edge = |index: usize, count: usize, size: usize| (index * size) as f64 / count as f64 - 0.5;
        let mut cells = Vec::new();
        for (y, row) in self.values.iter().enumerate() {
            let rows_px = edge(y, self.values.len(), self.rows)..edge(y + 1, self.values.len(), self.rows);
            for (x, &value) in row.iter().enumerate() {
                cells.push(ColouredCell {
                    columns_px: edge(x, row.len(), self.columns)..edge(x + 1, row.len(), self.columns),
                    rows_px: rows_px.clone(),
                    colour: colour(value),
                    text: text(value),
                });
            }
        }
        let (strokes, legend) = (Vec::new(), Vec::new());
        FramePicture { title: self.title, rows: self.rows, columns: self.columns, cells, strokes, legend }
            .picture()
    }

    /// One line per cell: its column and row of cells from 0, and its value, named `what`.
    pub(super) fn csv(&self, what: &str) -> String {
        let rows =
            self.values.iter().enumerate().flat_map(|(y, row)| {
                row.iter().enumerate().map(move |(x, value)| format!("{x},{y},{value}"))
            });
        table(&format!("cell_column,cell_row,{what}"), rows)
    }
}

pub(super) fn rgb(colour: colorous::Color) -> RGBColor {
    RGBColor(colour.r, colour.g, colour.b)
}
