//! The search space of one EPI as a picture with axes.

use image::RgbImage;
use plotters::prelude::*;

use super::ReportError;
use super::axis::Axis;
use super::canvas::{FONT, drawn, say};
use super::map_picture::ValueRange;
use epirig_core::grid::Grid;

const WIDTH: u32 = 1100;
const HEIGHT: u32 = 620;

/// Brightness of candidates x columns, the smallest disparity first and NaN where there is no cost, from
/// disparity `lowest_px` at the lower edge to `highest_px` at the upper. The `mapping` drawn over it has the
/// disparity of each column, NaN where there is none.
pub(super) fn cost_picture(
    title: &str,
    brightness: &Grid<f32>,
    (lowest_px, highest_px): (f64, f64),
    mapping: &[f32],
) -> Result<RgbImage, ReportError> {
    drawn(title, (WIDTH, HEIGHT), |area| {
        let columns = brightness.columns();
        let x_axis = Axis::between(-0.5, columns as f64 - 0.5);
        let y_axis = Axis::between(lowest_px, highest_px);
        let y_format = y_axis.tick_format();
        let mut chart = ChartBuilder::on(area)
            .caption(title, (FONT, 20))
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
        let range = ValueRange::of(brightness, 0.1);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let column = x as usize * columns / width as usize;
            let k = (height - 1 - y) as usize * brightness.rows() / height as usize;
            let value = brightness.at(column, k);
            let grey = (range.share(value).clamp(0.0, 1.0) * 255.0) as u8;
            let colour = if value.is_nan() { RGBColor(70, 70, 110) } else { RGBColor(grey, grey, grey) };
            pixels.draw_pixel((x as i32, y as i32), &colour).map_err(say)?;
        }
        let points: Vec<(f64, f64)> =
            mapping.iter().enumerate().map(|(x, &disparity)| (x as f64, f64::from(disparity))).collect();
        // A jump between surfaces is not drawn as a line.
        let jump = 0.1 * (highest_px - lowest_px);
        let connected = |a: &(f64, f64), b: &(f64, f64)| (a.1 - b.1).abs() < jump;
        for piece in points.chunk_by(connected).filter(|piece| !piece[0].1.is_nan()) {
            let style = RGBColor(230, 30, 30).stroke_width(2);
            chart.draw_series(LineSeries::new(piece.iter().copied(), style)).map_err(say)?;
        }
        Ok(())
    })
}
