//! The figures of the paper, drawn from a volume and its maps.

use image::RgbImage;

use super::ReportError;
use super::chart::{Chart, Series};
use super::cost_image::cost_picture;
use crate::results::names;
use epirig_core::grid::Grid;
use epirig_core::volume::Volume;
use epirig_matcher::inspect::{Candidates, CostTable, EpiLines, line_profile};
use epirig_matcher::{DisparityMaps, Validity};

/// A figure as a picture, with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Name for files, without extension.
    pub name: &'static str,
    /// The picture.
    pub picture: RgbImage,
    /// The numbers, as comma-separated values.
    pub csv: String,
}

/// Data of the figures: one row of the reference frame, with the costs of its candidates.
#[derive(Debug, Clone, Copy)]
pub struct FigureRow<'a> {
    /// The row.
    pub y: usize,
    /// All frames of this row alone: 1 x columns x frames.
    pub epi: &'a Volume,
    /// Its candidates.
    pub candidates: Candidates,
    /// Their costs.
    pub costs: &'a CostTable,
    /// True disparity in the reference frame, if known; rows x columns, in px.
    pub truth: Option<&'a Grid<f32>>,
}

/// Number of lines in the figure of aligned profiles.
const ALIGNED_LINES: usize = 6;
/// Lines whose maximum is below half a grey level have no maximum to be normalised by: it is rounding.
const LEAST_MAXIMUM_DN: f32 = 0.5;

/// The paper's figures for one row: cost image with the mapping (3b), intensity profiles of a line and of its
/// neighbours (5a), profiles normalised to their maxima and aligned by image position (5b) and disparity along
/// the row (6). All but the first are missing if no pixel of the row has an answer. The lines of 5b are spread over
/// the row; those that are black in all frames are left out, and the figure is missing if all are.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn.
pub fn paper_figures(maps: &DisparityMaps, row: FigureRow<'_>) -> Result<Vec<Figure>, ReportError> {
    let lines = EpiLines::new(row.epi.tau(), maps.reference, row.epi.columns());
    let mut figures = vec![cost_image(maps, row)?];
    let answered: Vec<usize> =
        (0..row.epi.columns()).filter(|&x| maps.validity.at(x, row.y) == Validity::Found).collect();
    if answered.is_empty() {
        return Ok(figures);
    }
    figures.push(neighbour_profiles(maps, row, &lines, &answered)?);
    figures.extend(aligned_profiles(maps, row, &lines, &answered)?);
    figures.push(disparity_along_row(maps, row)?);
    Ok(figures)
}

/// Columns x disparities, bright where the cost is low (logarithmic), the found mapping in red.
fn cost_image(maps: &DisparityMaps, row: FigureRow<'_>) -> Result<Figure, ReportError> {
    let costs = row.costs;
    let (count, columns) = (costs.candidates(), costs.columns());
    let mut brightness = Grid::filled(count, columns, f32::NAN);
    for k in 0..count {
        for (value, cost) in brightness.row_mut(k).iter_mut().zip(costs.row(k)) {
            *value = -(cost + 1e-3).log10();
        }
    }
    let disparity_px = |k: usize| row.candidates.disparity_px(k as f64);
    let mapping = maps.disparity.row(row.y);
    let half_step_px = 0.5 * row.candidates.disparity_step_px();
    let edges_px = (disparity_px(0) - half_step_px, disparity_px(count - 1) + half_step_px);
    let title = format!("Cost of the candidates of row {}: bright is low; the result in red", row.y);
    let picture = cost_picture(&title, &brightness, edges_px, mapping)?;
    let number = |value: f32| if value.is_nan() { "nan".to_owned() } else { value.to_string() };
    let mut csv = "disparity_px".to_owned();
    (0..columns).for_each(|x| csv.push_str(&format!(",x={x}")));
    csv.push_str("\nresult");
    mapping.iter().for_each(|&disparity| csv.push_str(&format!(",{}", number(disparity))));
    csv.push('\n');
    for k in 0..count {
        csv.push_str(&disparity_px(k).to_string());
        costs.row(k).iter().for_each(|&cost| {
            csv.push_str(&if cost.is_nan() { ",nan".to_owned() } else { format!(",{cost:.3}") })
        });
        csv.push('\n');
    }
    Ok(Figure { name: names::COST_IMAGE, picture, csv })
}

fn neighbour_profiles(
    maps: &DisparityMaps,
    FigureRow { y, epi, .. }: FigureRow<'_>,
    lines: &EpiLines,
    answered: &[usize],
) -> Result<Figure, ReportError> {
    // The pixel with the smallest sigma, away from the border so that its neighbours are visible too.
    let x = answered
        .iter()
        .copied()
        .min_by(|&a, &b| maps.sigma.at(a, y).total_cmp(&maps.sigma.at(b, y)))
        .unwrap_or(answered[0]);
    let disparity = f64::from(maps.disparity.at(x, y));
    let series = [(0.0, "(i, j)"), (1.0, "(i, j + 1)"), (-1.0, "(i, j - 1)")].map(|(shift, name)| {
        // j changes while i is fixed: in the reference frame the line then moves by its share.
        let column = x as f64 + shift * lines.tau_before();
        let profile = line_profile(epi, lines, column, 0, disparity + shift);
        let points = profile.iter().enumerate().map(|(t, &value)| (t as f64, f64::from(value))).collect();
        Series::line(name, points)
    });
    let chart = Chart {
        title: format!(
            "Intensity along the line of pixel ({x}, {y}), d = {disparity:.3} px, and along its neighbours"
        ),
        x_label: "frame".to_owned(),
        y_label: "intensity (DN)".to_owned(),
        least_y_span: 10.0,
        series: series.to_vec(),
        ..Chart::default()
    };
    Ok(Figure { name: names::INTENSITY_PROFILES, picture: chart.picture()?, csv: chart.csv() })
}

fn aligned_profiles(
    maps: &DisparityMaps,
    FigureRow { y, epi, .. }: FigureRow<'_>,
    lines: &EpiLines,
    answered: &[usize],
) -> Result<Option<Figure>, ReportError> {
    let chosen =
        (0..ALIGNED_LINES).map(|index| answered[(2 * index + 1) * answered.len() / (2 * ALIGNED_LINES)]);
    let normalised = |x: usize| {
        let disparity = f64::from(maps.disparity.at(x, y));
        let profile = line_profile(epi, lines, x as f64, 0, disparity);
        let maximum = profile.iter().copied().fold(0.0, f32::max);
        let columns = lines.offsets().iter().map(|tau| x as f64 + disparity * tau);
        let points = columns.zip(profile.iter().map(|value| f64::from(value / maximum))).collect();
        let name = format!("i = {:.0}", x as f64 - disparity * lines.tau_before());
        (maximum >= LEAST_MAXIMUM_DN).then(|| Series::line(name, points))
    };
    let series: Vec<Series> = chosen.filter_map(normalised).collect();
    if series.is_empty() {
        return Ok(None);
    }
    let chart = Chart {
        title: "Intensities along lines, over their maxima, aligned by position in the image".to_owned(),
        x_label: "column (px)".to_owned(),
        y_label: "intensity / maximum".to_owned(),
        least_y_span: 0.3,
        series,
        ..Chart::default()
    };
    Ok(Some(Figure { name: names::ALIGNED_PROFILES, picture: chart.picture()?, csv: chart.csv() }))
}

fn disparity_along_row(maps: &DisparityMaps, row: FigureRow<'_>) -> Result<Figure, ReportError> {
    let along = |map: &Grid<f32>, name: &str| {
        let points = map.row(row.y).iter().enumerate().map(|(x, &value)| (x as f64, f64::from(value)));
        Series::line(name, points.collect())
    };
    let mut series = vec![along(&maps.disparity, "measured")];
    series.extend(row.truth.map(|truth| along(truth, "truth")));
    let chart = Chart {
        title: format!("Disparity along row {}", row.y),
        x_label: "column (px)".to_owned(),
        y_label: "disparity (px)".to_owned(),
        least_y_span: 0.05,
        series,
        ..Chart::default()
    };
    Ok(Figure { name: names::DISPARITY_ALONG_ROW, picture: chart.picture()?, csv: chart.csv() })
}
