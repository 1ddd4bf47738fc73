//! The search space of one EPI as a picture with axes.

use image::RgbImage;
use plotters::prelude::*;

use super::axis::Axis;
use super::map_picture::ValueRange;
use super::{FONT, ReportError, register_font};
use epirig_core::grid::Grid;

const WIDTH: u32 = 1100;
const HEIGHT: u32 = 620;

/// Brightness over columns and disparities, with a mapping drawn over it.
pub(super) struct CostImage<'a> {
    pub(super) title: String,
    /// Candidates x columns, the smallest disparity first; NaN where there is no cost.
    pub(super) brightness: Grid<f32>,
    /// Disparity at the lower edge of the picture, in px.
    pub(super) lowest_px: f64,
    /// Disparity at the upper edge, in px.
    pub(super) highest_px: f64,
    /// Disparity of each column, NaN where there is none.
    pub(super) mapping: &'a [f32],
}

impl CostImage<'_> {
    pub(super) fn picture(&self) -> Result<RgbImage, ReportError> {
        register_font();
        let mut raw = vec![255; (WIDTH * HEIGHT * 3) as usize];
        self.draw(&mut raw).map_err(|reason| ReportError::new(&self.title, reason))?;
        RgbImage::from_raw(WIDTH, HEIGHT, raw)
            .ok_or_else(|| ReportError::new(&self.title, "its size is wrong"))
    }

    fn draw(&self, raw: &mut [u8]) -> Result<(), String> {
        fn say(error: impl std::fmt::Display) -> String {
            error.to_string()
        }
        let columns = self.brightness.columns();
        let x_axis = Axis::between(-0.5, columns as f64 - 0.5);
        let y_axis = Axis::between(self.lowest_px, self.highest_px);
        let y_format = y_axis.tick_format();
        let area = BitMapBackend::with_buffer(raw, (WIDTH, HEIGHT)).into_drawing_area();
        let mut chart = ChartBuilder::on(&area)
            .caption(&self.title, (FONT, 20))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(72)
            .build_cartesian_2d(x_axis, y_axis)
            .map_err(say)?;
        chart
            .configure_mesh()
            .disable_mesh()
            .x_desc("column (px)")
            .y_desc("disparity (px)")
            .x_label_formatter(&|x| format!("{x:.0}"))
            .y_label_formatter(&y_format)
            .label_style((FONT, 14))
            .axis_desc_style((FONT, 16))
            .draw()
            .map_err(say)?;
        let plot = chart.plotting_area();
        let (width, height) = plot.dim_in_pixel();
        let pixels = plot.strip_coord_spec();
        let range = ValueRange::of(&self.brightness, 0.1);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let column = x as usize * columns / width as usize;
            let k = (height - 1 - y) as usize * self.brightness.rows() / height as usize;
            let value = self.brightness.at(column, k);
            let grey = (range.share(value).clamp(0.0, 1.0) * 255.0) as u8;
            let colour = if value.is_nan() { RGBColor(70, 70, 110) } else { RGBColor(grey, grey, grey) };
            pixels.draw_pixel((x as i32, y as i32), &colour).map_err(say)?;
        }
        let points: Vec<(f64, f64)> =
            self.mapping.iter().enumerate().map(|(x, &disparity)| (x as f64, f64::from(disparity))).collect();
        // A jump between surfaces is not drawn as a line.
        let jump = 0.1 * (self.highest_px - self.lowest_px);
        let connected = |a: &(f64, f64), b: &(f64, f64)| (a.1 - b.1).abs() < jump;
        for piece in points.chunk_by(connected).filter(|piece| !piece[0].1.is_nan()) {
            let style = RGBColor(230, 30, 30).stroke_width(2);
            chart.draw_series(LineSeries::new(piece.iter().copied(), style)).map_err(say)?;
        }
        area.present().map_err(say)
    }
}
