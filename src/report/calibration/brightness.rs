//! Figures of the flat field and the brightness of the frames.

use super::cells::{Cells, rgb};
use crate::report::chart::{Chart, Marks, Series};
use crate::report::csv::table;
use crate::report::{Figure, MapPicture, ReportError, ValueRange};
use epirig_calibration::photometry::{CellGrid, FlatField, FlatModel, FrameGains, Maps};
use epirig_core::grid::Grid;

/// Least span of the gain's colours, in %, so that an even field looks even.
const LEAST_GAIN_SPAN: f32 = 1.0;
/// Residual with full colour, in %, unless there are larger ones: a tenth of a DN at 100 DN.
const FULL_COLOUR_PERCENT: f64 = 0.1;

/// The gain over the frame; `None` if its map was not kept.
pub(super) fn flat_field(field: &FlatField, maps: &Maps) -> Result<Option<Figure>, ReportError> {
    let percent = |gain: f32| 100.0 * gain;
    let (percent, range): (_, fn(&Grid<f32>) -> ValueRange) = match (&field.model, &maps.flat_field) {
        (FlatModel::Polynomial(polynomial), _) => (polynomial.image().map(percent), whole_range),
        // A few defective pixels must not take all colours.
        (FlatModel::PerPixel, Some(map)) => (map.map(percent), |map| ValueRange::of(map, LEAST_GAIN_SPAN)),
        (FlatModel::PerPixel, None) => return Ok(None),
    };
    let range = range(&percent);
    let picture = MapPicture::new(&percent, "Flat field: brightness over its mean", "%", range).picture()?;
    let grid = CellGrid::of(&percent);
    let cells = grid.cells().iter().map(|cell| {
        let (columns, rows) = (&cell.columns, &cell.rows);
        let (right, bottom) = (columns.end - 1, rows.end - 1);
        format!("{},{right},{},{bottom},{}", columns.start, rows.start, cell.mean)
    });
    let csv = table("first_column,last_column,first_row,last_row,mean_gain_percent", cells);
    Ok(Some(Figure { name: "flat-field", picture, csv }))
}

/// The full range of a smooth map, which shows its darkest corner too.
fn whole_range(map: &Grid<f32>) -> ValueRange {
    let ends = (f32::INFINITY, f32::NEG_INFINITY);
    let (low, high) =
        map.values().iter().fold(ends, |(low, high), value| (low.min(*value), high.max(*value)));
    let missing = (LEAST_GAIN_SPAN - (high - low)).max(0.0);
    ValueRange { low: low - 0.5 * missing, high: high + 0.5 * missing }
}

/// Residuals of the flat-field model in the cells.
pub(super) fn flat_field_residuals(
    field: &FlatField,
    (rows, columns): (usize, usize),
) -> Result<Option<Figure>, ReportError> {
    let values = &field.residual_percent;
    if values.iter().all(Vec::is_empty) {
        return Ok(None);
    }
    let rms = field.residual_rms_percent;
    let title = format!("Flat field: flat frames minus model in each cell (%), rms {rms:.3} %");
    let cells = Cells { title, rows, columns, values };
    let csv = cells.csv("residual_percent");
    let largest =
        values.iter().flatten().fold(FULL_COLOUR_PERCENT, |largest, value| largest.max(value.abs()));
    // Red is too bright.
    let colour = |value: f64| rgb(colorous::RED_BLUE.eval_continuous(0.5 - 0.5 * value / largest));
    let picture = cells.picture(colour, |value| signed(value, 2))?;
    Ok(Some(Figure { name: "flat-field-residuals", picture, csv }))
}

/// A number with its sign, or without if it rounds to 0.
fn signed(value: f64, decimals: usize) -> String {
    let text = format!("{value:+.decimals$}");
    if text[1..].chars().all(|c| c == '0' || c == '.') { text[1..].to_owned() } else { text }
}

/// The brightness of every frame.
pub(super) fn frame_gains(gains: &FrameGains) -> Result<Option<Figure>, ReportError> {
    if gains.gain.is_empty() {
        return Ok(None);
    }
    let points = gains.gain.iter().enumerate().map(|(frame, gain)| (frame as f64, 100.0 * (gain - 1.0)));
    let sigmas: Vec<f64> = gains.sigma.iter().map(|sigma| 100.0 * sigma).collect();
    let frames = gains.gain.iter().zip(&gains.sigma).enumerate();
    let csv =
        table("frame,gain,sigma", frames.map(|(frame, (gain, sigma))| format!("{frame},{gain},{sigma}")));
    let chart = Chart {
        title: format!(
            "Brightness of every frame, corrected by division; rms {:.3} %; bars: one standard uncertainty",
            100.0 * gains.flicker
        ),
        x_label: "frame".to_owned(),
        y_label: "too bright by (%)".to_owned(),
        least_y_span: 0.1,
        zero_line: true,
        series: vec![Series {
            marks: Marks::DotsWithBars(sigmas),
            ..Series::line("frame", points.collect())
        }],
    };
    Ok(Some(Figure { name: "frame-gains", picture: chart.picture()?, csv }))
}
