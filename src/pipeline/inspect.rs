//! Analyses a surface, and writes files and pictures.

use super::PipelineError;
use crate::report::{Chart, Marks, Series, ValueRange, map_picture};
use crate::results::{
    FieldSummary, LevelsSummary, MatchSettings, MatchSummary, ResultsFolder, SurfaceSummary,
};
use epirig_core::grid::Grid;
use epirig_data::formats::{Vertex, gsf, ply};

use epirig_matcher::LARGEST_GROWN_WINDOW_PX;
use epirig_matcher::surface::{
    Extent, Heights, Line, Profile, Rectangle, Steps, StepsOptions, SurfaceError, TrendKind, find_extent,
    find_steps, fit_trend, profile, roughness,
};

/// Version of `surface.json`.
const FORMAT_VERSION: u32 = 3;

/// Questions about a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceQuestions {
    /// Form, and options of the search for two levels.
    pub steps: StepsOptions,
    /// Region of the picture; `None` is all of it.
    pub region: Option<Rectangle>,
    /// Line of the profile; `None` is the middle row of the region that is used.
    pub line: Option<((f64, f64), (f64, f64))>,
    /// Width over which the profile is averaged, across the line, in px.
    pub profile_width_px: usize,
}

/// The options of the search for two levels in results that were matched with `settings`.
pub fn steps_options(settings: &MatchSettings, trend: TrendKind) -> StepsOptions {
    /// Within three pixels of walls, the error of fits in hollows exceeds the noise.
    const GROWN_ACROSS_WALLS_PX: usize = 7;
    // A height is made of what the cost's and the fit's window see, whichever is larger. Windows that grow do
    // so along the surface, but noise hides low walls from them.
    let window_px = settings.window_px.max(settings.fit_window_px);
    if settings.wanted_sigma_px.is_some() {
        StepsOptions::for_window(trend, window_px.max(GROWN_ACROSS_WALLS_PX))
            .with_grown_window(LARGEST_GROWN_WINDOW_PX)
    } else {
        StepsOptions::for_window(trend, window_px)
    }
}

/// What was found out about a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceAnswers {
    /// The numbers of `surface.json`.
    pub summary: SurfaceSummary,
    /// Heights of the region after removal of the form, in mm; NaN elsewhere.
    pub rest_mm: Grid<f32>,
    /// The profile.
    pub profile: Profile,
    /// Grey values of `used.png`: 0 no height; 80 a height that is not used; 160 used, but not for the levels
    /// (too near to a wall, or an outlier); 255 used.
    pub used: Grid<u8>,
}

/// Answers `questions` about the heights of the results `matched`.
///
/// # Errors
/// [`PipelineError::Surface`] if form or profile cannot be computed. A surface with one level is not an
/// error.
pub fn analyse_surface(
    heights: &Heights,
    matched: &MatchSummary,
    questions: &SurfaceQuestions,
) -> Result<SurfaceAnswers, PipelineError> {
    let all = heights;
    let extent = find_extent(all, questions.region, questions.steps.margin_px)?;
    let heights = &all.only(&extent.used);
    let (trend, steps) = match find_steps(heights, &questions.steps) {
        Ok(steps) => (steps.trend.clone(), Ok(steps)),
        Err(reason @ (SurfaceError::OneLevel { .. } | SurfaceError::TooNarrow { .. })) => {
            (fit_trend(heights, questions.steps.trend)?, Err(reason))
        }
        Err(error) => return Err(error.into()),
    };
    let rest_mm = trend.removed_from(heights);
    let steps = steps.as_ref();
    let summary = SurfaceSummary {
        format: FORMAT_VERSION,
        program: concat!("epirig ", env!("CARGO_PKG_VERSION")).to_owned(),
        sequence_uid: matched.sequence_uid.clone(),
        scan_ended: matched.scan_ended.clone(),
        distance_mm: heights.distance_mm,
        pixel_mm: heights.pixel_mm(),
        field: FieldSummary {
            region: questions.region,
            answered_px: extent.answered_px,
            used_px: extent.used_px,
            uncertain_px: extent.uncertain_px,
            apart_px: extent.apart_px,
            rim_px: extent.rim_px,
        },
        tilt_deg: trend.tilt_deg(),
        bow_mm: trend.bow_mm(),
        levels: steps.ok().map(|steps| levels(steps, &rest_mm, heights)),
        no_levels: steps.err().map(ToString::to_string),
        roughness: roughness(&rest_mm, &heights.sigma_mm, |_, _| true)
            .ok_or(SurfaceError::TooFewPixels { pixels: 0, what: "the roughness" })?,
        trend,
    };
    let (from_px, to_px) = questions.line.unwrap_or_else(|| middle_row(&extent.used));
    let line = Line { from_px, to_px, width_px: questions.profile_width_px };
    let correlation_px = steps.map_or(f64::INFINITY, |steps| steps.correlation.length_px());
    let profile = profile(heights, &rest_mm, line, correlation_px)?;
    let used = used_values(all, &extent, steps.ok());
    Ok(SurfaceAnswers { summary, rest_mm, profile, used })
}

/// The row with as many used pixels above as below, from the first to the last column of the region.
fn middle_row(used: &Grid<bool>) -> ((f64, f64), (f64, f64)) {
    let columns = used.columns();
    let places: Vec<usize> = (0..used.values().len()).filter(|&index| used.values()[index]).collect();
    let y = places.get(places.len() / 2).map_or(0, |index| index / columns) as f64;
    let left = places.iter().map(|index| index % columns).min().unwrap_or(0);
    let right = places.iter().map(|index| index % columns).max().unwrap_or(0);
    ((left as f64, y), (right as f64, y))
}

fn used_values(heights: &Heights, extent: &Extent, steps: Option<&Steps>) -> Grid<u8> {
    let mut values = heights.height_mm.map(|height| if height.is_finite() { 80 } else { 0 });
    for (index, value) in values.values_mut().iter_mut().enumerate() {
        if extent.used.values()[index] {
            let on_level = steps.is_none_or(|steps| steps.used.values()[index]);
            *value = if on_level { 255 } else { 160 };
        }
    }
    values
}

fn levels(steps: &Steps, rest_mm: &Grid<f32>, heights: &Heights) -> LevelsSummary {
    let mut about = rest_mm.clone();
    for (height, &lower) in about.values_mut().iter_mut().zip(steps.lower.values()) {
        *height += if lower { steps.depth.depth_mm as f32 } else { 0.0 };
    }
    LevelsSummary {
        depth: steps.depth,
        raised: steps.raised,
        margin_px: steps.margin_px,
        by_margin: steps.by_margin.clone(),
        correlation_reach_px: steps.correlation.reach_px(),
        roughness: roughness(&about, &heights.sigma_mm, |x, y| steps.used.at(x, y)),
        parts: steps.parts.clone(),
    }
}

/// Writes the files of `answers` about `heights` into `folder`.
pub(super) fn write_answers(
    folder: &ResultsFolder,
    heights: &Heights,
    answers: &SurfaceAnswers,
) -> Result<(), PipelineError> {
    let SurfaceAnswers { summary, rest_mm, profile, used } = answers;
    folder.write_map("height_mm.tiff", rest_mm)?;
    let title = format!("Height after the trend, sequence {}", summary.sequence_uid);
    folder.write("height.gsf", gsf(rest_mm, summary.pixel_mm, &title));
    folder.write("surface.ply", points(heights, &summary.sequence_uid));
    folder.write("profile.csv", profile_csv(profile));
    if let Some(levels) = &summary.levels {
        folder.write("hollows.csv", parts_csv(levels));
    }
    let range = ValueRange::of(rest_mm, 0.01);
    folder.write_picture("height.png", &map_picture(rest_mm, "Height after the trend", "mm", range)?)?;
    folder.write_picture("profile.png", &chart(profile, summary).picture()?)?;
    folder.write_grey("used.png", used)?;
    folder.write_json("surface.json", summary)?;
    Ok(())
}

/// Vertices with x to the right, y up and z towards the camera, and two triangles between any four neighbours
/// that have heights.
fn points(heights: &Heights, sequence_uid: &str) -> Vec<u8> {
    let (rows, columns) = (heights.height_mm.rows(), heights.height_mm.columns());
    let mut numbers = Grid::filled(rows, columns, None);
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for y in 0..rows {
        for x in 0..columns {
            let (height_mm, sigma_mm) = (heights.height_mm.at(x, y), heights.sigma_mm.at(x, y));
            if height_mm.is_nan() {
                continue;
            }
            let (x_mm, y_mm) = heights.lateral_mm(x, y);
            numbers.row_mut(y)[x] = Some(vertices.len() as u32);
            vertices.push(Vertex { place_mm: [x_mm as f32, -y_mm as f32, height_mm], sigma_mm });
            if x == 0 || y == 0 {
                continue;
            }
            let corners =
                (numbers.at(x - 1, y - 1), numbers.at(x - 1, y), numbers.at(x, y), numbers.at(x, y - 1));
            if let (Some(a), Some(b), Some(c), Some(d)) = corners {
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    let source = format!("source: epirig {}, sequence {sequence_uid}", env!("CARGO_PKG_VERSION"));
    let axes = format!(
        "x to the right, y up, z towards the camera from the level {} mm away; no trend removed",
        heights.distance_mm
    );
    ply(&vertices, &triangles, &[&source, &axes])
}

fn number(value: f64) -> String {
    if value.is_nan() { "nan".to_owned() } else { value.to_string() }
}

/// `profile.csv`: a line for each point.
pub fn profile_csv(profile: &Profile) -> String {
    let mut text = "x_px,y_px,distance_mm,height_mm,sigma_mm\n".to_owned();
    for point in &profile.points {
        let fields = [point.x_px, point.y_px, point.distance_mm, point.height_mm, point.sigma_mm].map(number);
        text.push_str(&(fields.join(",") + "\n"));
    }
    text
}

fn parts_csv(levels: &LevelsSummary) -> String {
    let mut text = "centre_x_px,centre_y_px,area_px,area_mm2,used_px,depth_mm,sigma_mm,half_width_95_mm,scale_sigma_mm\n".to_owned();
    for part in &levels.parts {
        let known = |value: Option<f64>| number(value.unwrap_or(f64::NAN));
        let depth = &part.depth;
        let fields = [
            number(part.centre_x_px),
            number(part.centre_y_px),
            part.area_px.to_string(),
            number(part.area_mm2),
            part.used_px.to_string(),
            number(depth.depth_mm),
            known(depth.sigma_mm),
            known(depth.half_width_95_mm),
            number(depth.scale_sigma_mm),
        ];
        text.push_str(&(fields.join(",") + "\n"));
    }
    text
}

/// The profile between the two levels, as in the paper's last figure.
pub(super) fn chart(profile: &Profile, summary: &SurfaceSummary) -> Chart {
    let along = |height: &dyn Fn(f64) -> f64| {
        profile.points.iter().map(|point| (point.distance_mm, height(point.height_mm))).collect()
    };
    let mut series = Vec::new();
    // The profile is drawn over the levels.
    if let Some(levels) = &summary.levels {
        let level = |name, height_mm: f64| Series {
            marks: Marks::Dashed,
            ..Series::line(name, along(&|_| height_mm))
        };
        series.push(level("upper level", 0.0));
        series.push(level("lower level", -levels.depth.depth_mm));
    }
    let sigmas = profile.points.iter().map(|point| point.sigma_mm).collect();
    series.push(Series {
        marks: Marks::Band(sigmas),
        ..Series::line("height, with one standard uncertainty to both sides", along(&|height| height))
    });
    let ((from_x, from_y), (to_x, to_y)) = (profile.line.from_px, profile.line.to_px);
    Chart {
        title: format!("Height after the trend from ({from_x}, {from_y}) to ({to_x}, {to_y}) px"),
        x_label: "distance (mm)".to_owned(),
        y_label: "height (mm)".to_owned(),
        // The range is wide enough that noise does not look like relief.
        least_y_span: 6.0 * summary.roughness.sq_noise_mm,
        series,
        ..Chart::default()
    }
}
