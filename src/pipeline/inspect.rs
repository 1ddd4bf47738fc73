//! Analyses a surface, and writes files and pictures.

use super::{OpenedResults, PipelineError};
use crate::profile::ReportProfile;
use crate::report::csv::{number, table};
use crate::report::{Chart, MapPicture, Marks, Millimetres, Series, Window, class_picture};
use crate::results::{
    Conclusion, FieldSummary, LevelsSummary, Region, ResultMap, ResultsFolder, ResultsKind, SurfaceSummary,
    USED_CLASSES, names,
};
use epirig_core::grid::Grid;
use epirig_data::formats::MapFacts;

use epirig_matcher::{EQUAL_DISCS_PX, GROWN_DISCS_PX, MatchOptions};
use epirig_surface::conformity::{Specification, SurfaceValues};
use epirig_surface::{
    Extent, Filters, Geometry, HalfHeights, Heights, Profile, ProfileLine, Steps, StepsOptions, SurfaceError,
    TrendKind, find_extent, find_outliers, find_steps, fit_trend, profile,
};

/// Questions about a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceQuestions {
    /// Form, and options of the search for two levels.
    pub steps: StepsOptions,
    /// Region of the picture.
    pub region: Region,
    /// Whether the calibration's target belongs to the surface.
    pub with_target: bool,
    /// Line of the profile; `None` is the middle row of the region that is used.
    pub line: Option<((f64, f64), (f64, f64))>,
    /// Width over which the profile is averaged, across the line, in px.
    pub profile_width_px: usize,
    /// Filters of the roughness.
    pub filters: Filters,
    /// Limits that the surface is compared with, and the rule.
    pub specification: Specification,
    /// What the report says beside the results.
    pub report: ReportProfile,
}

impl SurfaceQuestions {
    /// The questions of `epirig surface` without options, of results.
    pub fn usual(opened: &OpenedResults) -> Self {
        let steps = steps_options(&opened.matched.settings, TrendKind::Quadric);
        let filters = Filters::default();
        Self {
            steps,
            region: Region::default(),
            with_target: false,
            line: None,
            profile_width_px: 1,
            filters,
            specification: opened.specification.clone(),
            report: opened.report.clone(),
        }
    }
}

/// The options of the search for two levels in results that were matched with `matched`.
pub fn steps_options(matched: &MatchOptions, trend: TrendKind) -> StepsOptions {
    // A height is made of what the cost's window and the fit's discs see, whichever is larger;
    // halves are measured in equal discs. Discs that grow know of walls, but noise hides low ones
    // from them.
    let window_px = matched.window_px.max(EQUAL_DISCS_PX);
    let steps = StepsOptions::for_window(trend, window_px);
    if matched.wanted_sigma_px.is_some() && !matched.quick {
        steps.with_grown_window(GROWN_DISCS_PX)
    } else {
        steps
    }
}

/// What was found out about a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceAnswers {
    /// The numbers of `surface.json`.
    pub summary: SurfaceSummary,
    /// Heights of the region after removal of the form, without outliers, in mm; NaN elsewhere.
    pub rest_mm: Grid<f32>,
    /// The same between the cut-offs of the filters; `None` without a filter.
    pub filtered_mm: Option<Grid<f32>>,
    /// The profile.
    pub profile: Profile,
    /// Grey values of `used.png`, those of [`USED_CLASSES`].
    pub used: Grid<u8>,
}

/// Answers `questions` about the `heights` of the results `opened`, and of the `halves` of their frames if those
/// are known.
///
/// # Errors
/// [`PipelineError::Surface`] if form or profile cannot be computed. A surface with one level is not an
/// error.
pub fn analyse_surface(
    heights: &Heights,
    halves: Option<&[HalfHeights; 2]>,
    opened: &OpenedResults,
    questions: &SurfaceQuestions,
) -> Result<SurfaceAnswers, PipelineError> {
    let matched = &opened.matched;
    let target = if questions.with_target { None } else { opened.target() };
    let all = &match &target {
        None => heights.clone(),
        Some(target) => heights.only(&target.map(|covered| !covered)),
    };
    let filters = questions.filters;
    filters.check(all.pixel_mm())?;
    let inside = questions.region.inside(all.height_mm.rows(), all.height_mm.columns());
    let target_px = answered(heights, inside.as_ref()) - answered(all, inside.as_ref());
    let mut extent =
        find_extent(all, inside.as_ref(), (questions.steps.margin_px, questions.steps.rim_px()))?;
    let heights = &all.only(&extent.used);
    let halves = halves.map(|halves| halves.each_ref().map(|half| half.only(&extent.used)));
    let (trend, steps) = match find_steps(heights, halves.as_ref(), &questions.steps) {
        Ok(steps) => (steps.trend.clone(), Ok(steps)),
        Err(
            reason @ (SurfaceError::OneLevel { .. }
            | SurfaceError::NoValley { .. }
            | SurfaceError::TooNarrow { .. }),
        ) => (fit_trend(heights, questions.steps.trend)?, Err(reason)),
        Err(error) => return Err(error.into()),
    };
    let mut rest_mm = trend.removed_from(heights);
    let steps = steps.as_ref();
    let outliers = find_outliers(&rest_mm, heights, steps.ok(), questions.steps.least_area_px);
    let outlier_px = leave_out(&outliers, &mut rest_mm, &mut extent);
    let pixel_mm = heights.pixel_mm();
    let filtered_mm = filters.any().then(|| filters.applied(&rest_mm, pixel_mm));
    let (levels, no_levels) = match steps {
        Ok(steps) => (Some(levels(steps, &rest_mm, heights, (&filters, halves.is_some()))), None),
        Err(reason) => (None, Some(reason.to_string())),
    };
    let Geometry { principal_point_x_px, principal_point_y_px, scale, .. } = heights.geometry;
    let roughness = filters
        .roughness_behind(filtered_mm.as_ref().unwrap_or(&rest_mm), &heights.sigma_mm)
        .ok_or(SurfaceError::TooFewPixels { pixels: 0, what: "the roughness" })?;
    let of_levels = levels.as_ref().and_then(|levels| levels.roughness.as_ref());
    let conformity = questions.specification.judge(&SurfaceValues {
        levels: levels.as_ref().map(|levels| (&levels.depth, &levels.budget, &levels.parts[..])),
        trend: &trend,
        roughness: of_levels.or(Some(&roughness)),
        scale_sigma: scale.together(),
    });
    let step = match &levels {
        Some(levels) => Ok((levels.raised, levels.depth.depth_mm, levels.budget.combined)),
        None => Err(no_levels.as_deref().unwrap_or_default()),
    };
    let summary = SurfaceSummary {
        format: ResultsKind::Surface.format(),
        program: concat!("epirig ", env!("CARGO_PKG_VERSION")).to_owned(),
        sequence_uid: matched.sequence_uid.clone(),
        matched_blake3: opened.files.record_hash().to_owned(),
        conclusion: Conclusion::of(step, scale, opened.planned_mm).with_verdict(conformity.as_ref()),
        conformity,
        scan_ended: matched.scan_ended.clone(),
        distance_mm: heights.distance_mm,
        pixel_mm,
        origin_px: (principal_point_x_px, principal_point_y_px),
        scale_sigma: scale,
        field: FieldSummary {
            region: questions.region.rectangle,
            mask: questions.region.mask.as_ref().map(|mask| mask.facts.clone()),
            answered_px: extent.answered_px,
            target_px,
            used_px: extent.used_px,
            uncertain_px: extent.uncertain_px,
            apart_px: extent.apart_px,
            rim_px: extent.rim_px,
            outlier_px,
        },
        tilt_deg: trend.tilt_deg(),
        bow_mm: trend.bow_mm(),
        levels,
        no_levels,
        filters,
        roughness,
        trend,
    };
    let (from_px, to_px) = questions.line.unwrap_or_else(|| middle_row(&extent.used));
    let line = ProfileLine { from_px, to_px, width_px: questions.profile_width_px };
    let correlation_px = steps.map_or(f64::INFINITY, |steps| steps.correlation.length_px());
    let profile = profile(heights, &rest_mm, line, correlation_px)?;
    let used = used_values(all, &extent, steps.ok());
    Ok(SurfaceAnswers { summary, rest_mm, filtered_mm, profile, used })
}

/// Number of pixels that have a height, of those `inside` if that is given.
fn answered(heights: &Heights, inside: Option<&Grid<bool>>) -> usize {
    let known = heights.height_mm.values().iter().map(|height| height.is_finite());
    match inside {
        None => known.filter(|&known| known).count(),
        Some(inside) => known.zip(inside.values()).filter(|&(known, &inside)| known && inside).count(),
    }
}

/// Takes the outliers out of the heights and of the extent; their number.
fn leave_out(outliers: &Grid<bool>, rest_mm: &mut Grid<f32>, extent: &mut Extent) -> usize {
    let mut count = 0;
    let places = rest_mm.values_mut().iter_mut().zip(extent.used.values_mut());
    for ((height, used), _) in places.zip(outliers.values()).filter(|&(_, &outlier)| outlier) {
        (*height, *used) = (f32::NAN, false);
        count += 1;
    }
    extent.used_px -= count;
    count
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
    let [on_a_level, beside, left_out, none] = USED_CLASSES.map(|class| class.value);
    let mut values = heights.height_mm.map(|height| if height.is_finite() { left_out } else { none });
    for (index, value) in values.values_mut().iter_mut().enumerate() {
        if extent.used.values()[index] {
            let on_level = steps.is_none_or(|steps| steps.used.values()[index]);
            *value = if on_level { on_a_level } else { beside };
        }
    }
    values
}

fn levels(
    steps: &Steps,
    rest_mm: &Grid<f32>,
    heights: &Heights,
    (filters, by_halves): (&Filters, bool),
) -> LevelsSummary {
    let mut about = rest_mm.clone();
    for (height, &lower) in about.values_mut().iter_mut().zip(steps.lower.values()) {
        *height += if lower { steps.depth.depth_mm as f32 } else { 0.0 };
    }
    // Pixels of the other level, and those near the walls, are not seen by the filters.
    let roughness_of = |lower: Option<bool>| {
        let counts = |x, y| steps.used.at(x, y) && lower.is_none_or(|lower| steps.lower.at(x, y) == lower);
        filters.roughness(&about, &heights.sigma_mm, heights.pixel_mm(), counts)
    };
    LevelsSummary {
        depth: steps.depth,
        budget: steps.budget.clone(),
        by_halves,
        raised: steps.raised,
        margin_px: steps.margin_px,
        by_margin: steps.by_margin.clone(),
        on_plateaus: steps.on_plateaus,
        wall_width_mm: steps.wall_width_px.map(|width_px| width_px * heights.pixel_mm()),
        correlation_reach_px: steps.correlation.reach_px(),
        roughness: roughness_of(None),
        upper: roughness_of(Some(false)),
        lower: roughness_of(Some(true)),
        parts: steps.parts.clone(),
    }
}

/// Writes the files of `answers` about `heights` into `folder`; the frames were taken at `taken`, as in RFC
/// 3339. The photograph is shown beside the heights.
pub(super) fn write_answers(
    folder: &ResultsFolder,
    heights: &Heights,
    answers: &SurfaceAnswers,
    (taken, photograph): (&str, Option<&Grid<f32>>),
) -> Result<(), PipelineError> {
    let SurfaceAnswers { summary, rest_mm, filtered_mm, profile, used } = answers;
    let source = format!("sequence {}", summary.sequence_uid);
    let maps =
        [(ResultMap::HeightWithoutForm, Some(rest_mm)), (ResultMap::HeightFiltered, filtered_mm.as_ref())];
    for (map, values) in maps {
        let Some(values) = values else { continue };
        let facts = map.row().facts(Some(summary.pixel_mm), Some(&source));
        folder.write_map(map.row().file, values, &MapFacts { taken: Some(taken.to_owned()), ..facts })?;
    }
    folder.write(&format!("{}.csv", names::PROFILE), profile_csv(profile));
    if let Some(levels) = &summary.levels {
        folder.write(names::HOLLOWS, parts_csv(levels));
    }
    let millimetres = Some(Millimetres::of(heights));
    let picture = MapPicture::of(ResultMap::HeightWithoutForm, rest_mm).in_mm(millimetres).beside(photograph);
    folder.write_picture(names::HEIGHT, &picture.picture()?)?;
    let window = Window::whole(used.rows(), used.columns());
    let pixels = class_picture(ResultMap::Used, used, (&window, millimetres))?;
    folder.write_picture(names::PIXELS, &pixels)?;
    folder.write_picture(&format!("{}.png", names::PROFILE), &chart(profile, summary).picture()?)?;
    folder.write_grey(ResultMap::Used.row().file, used)?;
    folder.set_record(summary.clone());
    Ok(())
}

/// `profile.csv`: a line for each point.
pub fn profile_csv(profile: &Profile) -> String {
    let rows = profile.points.iter().map(|point| {
        [point.x_px, point.y_px, point.distance_mm, point.height_mm, point.sigma_mm].map(number).join(",")
    });
    table("x_px,y_px,distance_mm,height_mm,sigma_mm", rows)
}

fn parts_csv(levels: &LevelsSummary) -> String {
    let rows = levels.parts.iter().map(|part| {
        let known = |value: Option<f64>| number(value.unwrap_or(f64::NAN));
        let depth = &part.depth;
        [
            number(part.centre_x_px),
            number(part.centre_y_px),
            part.area_px.to_string(),
            number(part.area_mm2),
            part.used_px.to_string(),
            number(depth.depth_mm),
            known(depth.sigma_mm),
            known(depth.half_width_95_mm),
            number(depth.scale_sigma_mm),
        ]
        .join(",")
    });
    let head =
        "centre_x_px,centre_y_px,area_px,area_mm2,used_px,depth_mm,sigma_mm,half_width_95_mm,scale_sigma_mm";
    table(head, rows)
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
        title: format!("Height after removal of the form from ({from_x}, {from_y}) to ({to_x}, {to_y}) px"),
        x_label: "distance (mm)".to_owned(),
        y_label: "height (mm)".to_owned(),
        // The range is wide enough that noise does not look like relief.
        least_y_span: 6.0 * summary.roughness.sq_noise_mm.unwrap_or(0.0),
        series,
        ..Chart::default()
    }
}
