//! Figures of the straightness of rows, and of the positioning error of the stage.

use crate::calibrate::Calibration;
use crate::report::chart::{Chart, Marks, Series};
use crate::report::csv::{number, table};
use crate::report::{Figure, ReportError};
use epirig_calibration::stage_axis::{PositioningError, StageAxis, TrackResidual};

/// Number of parts of the columns over which residuals are averaged, and least number of residuals in a part:
/// the mean of 25 has a fifth of the noise of one.
const PARTS: usize = 24;
const LEAST_IN_PART: usize = 25;

/// Distance of every corner from its row, over the column; `None` without residuals.
pub(super) fn rows(stage_axis: &StageAxis, calibration: &Calibration) -> Result<Option<Figure>, ReportError> {
    let (lens, camera) = (&calibration.mapping.lens, &calibration.mapping.camera);
    // Tracks are in units of the focal length along x.
    let scale = camera.focal_length_px / lens.focal_length_x_px;
    let column = |residual: &TrackResidual| scale * residual.column_px + camera.principal_point_x_px;
    let points: Vec<(f64, f64)> =
        stage_axis.residuals.iter().map(|residual| (column(residual), residual.across_px)).collect();
    if points.is_empty() {
        return Ok(None);
    }
    let rows = stage_axis.residuals.iter().map(|residual| {
        let TrackResidual { frame, corner, along_px, across_px, .. } = residual;
        format!("{frame},{corner},{},{along_px},{across_px}", column(residual))
    });
    let csv = table("frame,corner,column_px,along_px,across_px", rows);
    let mut series = vec![Series::dots("one corner in one frame", points.clone())];
    let means = means(&points);
    if means.iter().any(|mean| !mean.1.is_nan()) {
        series.push(Series::line(format!("mean of each {PARTS}th of the columns"), means));
    }
    let chart = Chart {
        title: format!(
            "Drift in rows: distance of every corner from its row after rectification; rms {:.4} px",
            stage_axis.rows_rms_px()
        ),
        x_label: "rectified column (px)".to_owned(),
        y_label: "below its row (px)".to_owned(),
        least_y_span: 0.02,
        zero_line: true,
        series,
    };
    Ok(Some(Figure { name: "rows", picture: chart.picture()?, csv }))
}

/// Means of x and y in parts of equal width; NaN in parts with too few points.
fn means(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let ends = points
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), point| (low.min(point.0), high.max(point.0)));
    let width = (ends.1 - ends.0) / PARTS as f64;
    let mut sums = [(0_usize, 0.0, 0.0); PARTS];
    for (x, y) in points {
        // If all points have one column there is only one part.
        let part = if width > 0.0 { (((x - ends.0) / width) as usize).min(PARTS - 1) } else { 0 };
        let (count, sum_x, sum_y) = sums[part];
        sums[part] = (count + 1, sum_x + x, sum_y + y);
    }
    let mean = |(part, (count, x, y)): (usize, (usize, f64, f64))| match count >= LEAST_IN_PART {
        true => (x / count as f64, y / count as f64),
        false => (ends.0 + (part as f64 + 0.5) * width, f64::NAN),
    };
    sums.into_iter().enumerate().map(mean).collect()
}

/// Measured minus reported position of every frame; `None` if no frame shows the target.
pub(super) fn positioning_error(positioning: &PositioningError) -> Result<Option<Figure>, ReportError> {
    if positioning.frames.iter().all(|frame| frame.sigma_mm.is_none()) {
        return Ok(None);
    }
    let mut csv = "frame,reported_mm,measured_mm,measured_less_reported_um,sigma_um,outlier\n".to_owned();
    let is_outlier = |frame: usize| positioning.outliers.contains(&frame);
    let (mut errors, mut sigmas) = (Vec::new(), Vec::new());
    for (index, frame) in positioning.frames.iter().enumerate() {
        let sigma_um = frame.sigma_mm.map_or(f64::NAN, |sigma_mm| 1000.0 * sigma_mm);
        let (measured_mm, error_um) = match frame.sigma_mm {
            Some(_) => (frame.measured_mm, positioning.error_um(index)),
            None => (f64::NAN, f64::NAN),
        };
        let numbers = [frame.reported_mm, measured_mm, error_um, sigma_um].map(number).join(",");
        csv.push_str(&format!("{index},{numbers},{}\n", is_outlier(index)));
        errors.push((index, error_um));
        sigmas.push(sigma_um);
    }
    let part = |name: &str, outliers: bool| {
        let chosen = || errors.iter().filter(|(frame, _)| is_outlier(*frame) == outliers);
        Series {
            marks: Marks::DotsWithBars(chosen().map(|(frame, _)| sigmas[*frame]).collect()),
            labels: if outliers {
                chosen().map(|(frame, _)| frame.to_string()).collect()
            } else {
                Vec::new()
            },
            ..Series::line(name, chosen().map(|&(frame, error_um)| (frame as f64, error_um)).collect())
        }
    };
    let mut series = vec![part("a frame, with one standard uncertainty of the measurement", false)];
    if !positioning.outliers.is_empty() {
        series.push(part("outlier, with the number of the frame", true));
    }
    let chart = Chart {
        title: format!(
            "Stage: measured minus reported position; rms {:.2} um, largest {:.1} um",
            positioning.rms_um, positioning.largest_um
        ),
        x_label: "frame".to_owned(),
        y_label: "measured minus reported (um)".to_owned(),
        least_y_span: 2.0,
        zero_line: true,
        series,
    };
    Ok(Some(Figure { name: "positioning-error", picture: chart.picture()?, csv }))
}
