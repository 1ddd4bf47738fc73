//! Figures of the residuals of the lens model, and of the part of the frame that the board views cover.

use plotters::style::RGBColor;

use super::cells::{Cells, rgb};
use crate::report::csv::table;
use crate::report::frame_picture::{FramePicture, Stroke, frame_scale};
use crate::report::heading::{COLOURS, Entry, Sample};
use crate::report::{Figure, ReportError};
use epirig_calibration::lens::views::{LensCalibration, PointResidual};

/// Cells across and down, as [`Coverage`](epirig_calibration::lens::views::Coverage) counts them.
const CELLS: usize = 10;
/// Longest stroke of a residual of RMS size, in px of the picture; after rounding of the magnification, two
/// fifths of it remain at least. A few hundred such strokes are visible and seldom cross.
const TYPICAL_STROKE: f64 = 24.0;
/// Longest stroke of a rejected point, in px of the picture: gross errors would cross the whole picture.
const LONGEST_REJECTED_STROKE: f64 = 60.0;
/// Largest magnification: residuals below a thousandth of a pixel are rounding.
const MOST_MAGNIFICATION: f64 = 20_000.0;
const NOTHING: RGBColor = RGBColor(205, 205, 205);

/// Points of all views with their residuals; `None` if there is no point.
pub(super) fn residuals(lens: &LensCalibration) -> Result<Option<Figure>, ReportError> {
    let points = || lens.residuals.iter().flatten();
    if points().next().is_none() {
        return Ok(None);
    }
    let (rows, columns) = (lens.estimate.rows, lens.estimate.columns);
    let scale = frame_scale(rows, columns);
    let magnification = round_below((TYPICAL_STROKE / scale / lens.rms_px).clamp(1.0, MOST_MAGNIFICATION));
    let reference_px = round_below(3.0 * TYPICAL_STROKE / scale / magnification);
    let reference = (reference_px * magnification * scale).round() as i32;
    let rejected = points().filter(|point| point.rejected).count();
    let mut legend = vec![Entry {
        name: format!("{reference_px} px; {} corners in {} views", points().count(), lens.residuals.len()),
        sample: Sample::Line(reference),
        colour: COLOURS[0],
    }];
    if rejected > 0 {
        legend.push(Entry {
            name: format!("{rejected} rejected, long strokes cut"),
            sample: Sample::Ring,
            colour: COLOURS[1],
        });
    }
    // Rejected points are drawn last, on top.
    let mut shown: Vec<&PointResidual> = points().collect();
    shown.sort_by_key(|point| point.rejected);
    let stroke = |point: &&PointResidual| {
        let length = point.dx_px.hypot(point.dy_px) * magnification * scale;
        let cut = if point.rejected { (LONGEST_REJECTED_STROKE / length).min(1.0) } else { 1.0 };
        Stroke {
            from_px: (point.x_px, point.y_px),
            by_px: (cut * magnification * point.dx_px, cut * magnification * point.dy_px),
            colour: COLOURS[usize::from(point.rejected)],
            ring: point.rejected,
        }
    };
    let picture = FramePicture {
        title: format!(
            "Lens: observed minus predicted corners, magnified {magnification} times; rms {:.3} px",
            lens.rms_px
        ),
        rows,
        columns,
        cells: Vec::new(),
        strokes: shown.iter().map(stroke).collect(),
        legend,
    };
    let rows = lens.residuals.iter().enumerate().flat_map(|(view, points)| {
        points.iter().enumerate().map(move |(index, point)| {
            let PointResidual { x_px, y_px, dx_px, dy_px, rejected } = point;
            format!("{view},{index},{x_px},{y_px},{dx_px},{dy_px},{rejected}")
        })
    });
    let csv = table("view,point,x_px,y_px,dx_px,dy_px,rejected", rows);
    Ok(Some(Figure { name: "lens-residuals", picture: picture.picture()?, csv }))
}

/// Number of points in each cell, without rejected ones; `None` if there are none.
pub(super) fn coverage(lens: &LensCalibration) -> Result<Option<Figure>, ReportError> {
    let (rows, columns) = (lens.estimate.rows, lens.estimate.columns);
    let mut values = vec![vec![0.0; CELLS]; CELLS];
    for point in lens.residuals.iter().flatten().filter(|point| !point.rejected) {
        // Pixels extend half a pixel to each side of their centres.
        let cell = |place: f64, size: usize| {
            ((place + 0.5) / size as f64 * CELLS as f64).clamp(0.0, CELLS as f64 - 1.0) as usize
        };
        values[cell(point.y_px, rows)][cell(point.x_px, columns)] += 1.0;
    }
    let most = values.iter().flatten().copied().fold(0.0, f64::max);
    if most == 0.0 {
        return Ok(None);
    }
    let title = format!(
        "Lens: corners in each cell; {:.0} % of the cells have corners, which reach {:.0} % of the radius",
        100.0 * lens.coverage.cells,
        100.0 * lens.coverage.radius
    );
    let cells = Cells { title, rows, columns, values: &values };
    let csv = cells.csv("corners");
    let colour = |count: f64| match count {
        0.0 => NOTHING,
        _ => rgb(colorous::VIRIDIS.eval_continuous(count / most)),
    };
    Ok(Some(Figure {
        name: "lens-coverage",
        picture: cells.picture(colour, |count| format!("{count:.0}"))?,
        csv,
    }))
}

/// The largest of 1, 2 and 5 times a power of ten up to `value`, which is positive.
fn round_below(value: f64) -> f64 {
    let decade = 10.0_f64.powf(value.log10().floor());
    let factor = [5.0, 2.0].into_iter().find(|factor| factor * decade <= value * (1.0 + 1e-9)).unwrap_or(1.0);
    // Negative powers of ten are not exact: 5 times 10^-3 must give 0.005.
    if decade < 1.0 { factor / (1.0 / decade).round() } else { factor * decade }
}

#[cfg(test)]
mod tests {
    use super::round_below;

    #[test]
    fn round_numbers_are_one_two_or_five() {
        for (value, round) in
            [(1.0, 1.0), (1.9, 1.0), (2.0, 2.0), (49.0, 20.0), (999.0, 500.0), (0.0071, 0.005)]
        {
            assert_eq!(round_below(value), round);
        }
    }
}
