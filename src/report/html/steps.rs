//! Step heights, their uncertainty budget, form and roughness.

use super::contents::Report;
use super::markup::{Markup, data, element, joined, list, pairs, paragraph, table};
use crate::number::{fixed, plain, share, sigma, significant, with_interval};
use crate::results::{LevelsSummary, scale_in_words};
use epirig_core::choice::Choice as _;
use epirig_surface::{Contribution, Depth, Evaluation, Filters, Roughness};

pub(super) fn steps(report: &Report<'_>) -> Markup {
    let levels = match &report.surface.levels {
        Some(levels) => joined([
            depths(levels),
            element("h3", "Uncertainty budget"),
            budget(levels),
            left_out(levels, report),
            margins(levels),
            levels.misfit().map_or_else(|| joined([]), |words| paragraph(format!("Note: {words}."))),
        ]),
        None => {
            let reason = report.surface.no_levels.as_deref().unwrap_or("the reason is not recorded");
            paragraph(format!("There is no step height: {reason}."))
        }
    };
    joined([levels, element("h3", "Form and roughness"), form(report), roughness(report)])
}

fn depths(levels: &LevelsSummary) -> Markup {
    let (what, step, caption) = match levels.raised {
        true => {
            ("part", "height, 95 % by scatter alone", "Height of the raised parts over the level around them")
        }
        false => {
            ("hollow", "depth, 95 % by scatter alone", "Depth of the hollows below the level around them")
        }
    };
    let depth =
        |depth: &Depth| data(depth.depth_mm, with_interval(depth.depth_mm, depth.half_width_95_mm, "mm"));
    let used: usize = levels.parts.iter().map(|part| part.used_px).sum();
    let all = vec![
        "all together".into(),
        depth(&levels.depth),
        "".into(),
        significant(levels.parts.iter().map(|part| part.area_mm2).sum(), 4).into(),
        used.to_string().into(),
    ];
    let parts = levels.parts.iter().enumerate().map(|(index, part)| {
        vec![
            (index + 1).to_string().into(),
            depth(&part.depth),
            format!("{}, {}", fixed(part.centre_x_px, 0), fixed(part.centre_y_px, 0)).into(),
            significant(part.area_mm2, 4).into(),
            part.used_px.to_string().into(),
        ]
    });
    joined([
        table(
            caption,
            &[what, step, "middle (px)", "area (mm\u{b2})", "pixels used"],
            std::iter::once(all).chain(parts),
        ),
        paragraph(format!(
            "These intervals (95 % coverage, Student's t) hold the scatter between independent parts of the field alone. So \
             they tell how parts differ; errors that all parts share, such as that of the scale, are in the budget below. \
             Errors of pixels more than {} px apart are independent. Pixels nearer than {} px to a wall are left out.",
            levels.correlation_reach_px, levels.margin_px
        )),
    ])
}

fn budget(levels: &LevelsSummary) -> Markup {
    let sum = &levels.budget.combined;
    let mut rows: Vec<Vec<Markup>> = levels.budget.contributions.iter().map(contribution).collect();
    if let Some(sum) = sum {
        rows.push(vec![
            "combined standard uncertainty".into(),
            "".into(),
            sigma(sum.sigma_mm, "mm").into(),
            "100 %".into(),
        ]);
    }
    let expanded = match sum {
        Some(sum) => format!(
            "Depth with all contributions of this table: {} (95 % coverage, k = {}, {} effective degrees of freedom).",
            with_interval(levels.depth.depth_mm, Some(sum.half_width_95_mm), "mm"),
            fixed(sum.coverage_factor, 2),
            degrees(sum.degrees_of_freedom)
        ),
        None => "The scatter is not known: the field has too few independent parts. So there is no combined \
                 uncertainty."
            .to_owned(),
    };
    joined([
        table(
            "Contributions to the uncertainty of the depth over all parts",
            &["contribution", "type", "standard uncertainty", "share of the variance"],
            rows,
        ),
        paragraph(format!(
            "{expanded} A contribution of 0 mm is no larger than noise explains, or was stated as exact."
        )),
    ])
}

/// Degrees of freedom; with more than these, Student's t is the normal distribution.
fn degrees(effective: f64) -> String {
    const MANY: f64 = 1000.0;
    if effective > MANY { format!("more than {}", fixed(MANY, 0)) } else { fixed(effective, 0) }
}

fn contribution(part: &Contribution) -> Vec<Markup> {
    let kind = match part.evaluation {
        Evaluation::A => "A",
        Evaluation::B => "B",
    };
    let unknown = match part.evaluation {
        Evaluation::A => "not known",
        Evaluation::B => "not known; taken as exact",
    };
    vec![
        part.name.into(),
        kind.into(),
        part.sigma_mm.map_or(unknown.to_owned(), |sigma_mm| sigma(sigma_mm, "mm")).into(),
        part.share.map_or("not known".to_owned(), share).into(),
    ]
}

/// What the budget does not hold.
fn left_out(levels: &LevelsSummary, report: &Report<'_>) -> Markup {
    let mut items: Vec<Markup> = vec![
        "errors that are the same in all parts of the field and follow the hollows, which no form explains"
            .into(),
        "differences between scans: this is one scan".into(),
    ];
    if report.surface.scale_sigma.baseline.is_some() {
        items.push("the stage's own millimetre (its lead screw), in which the baseline is counted".into());
    }
    let unknown = levels.budget.contributions.iter().filter(|part| part.sigma_mm.is_none());
    items.extend(unknown.map(|part| format!("{}: not known", part.name).into()));
    if report.calibration.is_none() {
        items.push(
            "distortion, vignetting, and the direction of the stage axis: the frames were matched as captured, \
             without a calibration"
                .into(),
        );
    }
    let locking = report.matched.pixel_locking.as_ref();
    if let Some(locking) = locking.filter(|found| found.worst_bias_px > 0.0) {
        let bias_mm = locking.worst_bias_px * height_per_px(report);
        items.push(
            format!(
                "pixel locking, which is in the uncertainty of single heights: its largest predicted bias of a height is {}",
                sigma(bias_mm, "mm")
            )
            .into(),
        );
    }
    joined([paragraph("Not in this budget:"), list(items)])
}

/// Height of one pixel of disparity, in mm.
fn height_per_px(report: &Report<'_>) -> f64 {
    report
        .matched
        .median_disparity_px
        .map_or(f64::NAN, |disparity_px| (report.surface.distance_mm / disparity_px).abs())
}

fn margins(levels: &LevelsSummary) -> Markup {
    let rows = levels.by_margin.iter().map(|at| {
        let used = if at.margin_px == levels.margin_px { " (used)" } else { "" };
        vec![
            format!("{} px{used}", at.margin_px).into(),
            data(at.depth_mm, with_interval(at.depth_mm, at.half_width_95_mm, "mm")),
            at.used_px.to_string().into(),
        ]
    });
    let plateaus = levels.on_plateaus.map_or_else(|| joined([]), |on| {
        paragraph(format!(
            "On the plateaus of ISO 5436-1: {} (95 % by scatter alone), from {} pixels. That is the central third of each part, and the level \
             around it from a third of its width to its width. Parts are {} px wide (median).",
            with_interval(on.depth.depth_mm, on.depth.half_width_95_mm, "mm"),
            on.used_px,
            fixed(on.width_px, 0),
        ))
    });
    joined([
        table(
            "Depth for other distances from the walls",
            &["left out at the walls", "depth, 95 % by scatter alone", "pixels used"],
            rows,
        ),
        paragraph(
            "If the depth still grows with the distance, windows of the matcher reach across the walls, and the \
             depth is too small.",
        ),
        plateaus,
    ])
}

fn form(report: &Report<'_>) -> Markup {
    let surface = report.surface;
    let (along_x, along_y) = surface.tilt_deg;
    pairs(
        "Form that was removed",
        [
            ("form", surface.trend.kind.name().into()),
            ("tilt along x, along y", format!("{} deg, {} deg", fixed(along_x, 4), fixed(along_y, 4)).into()),
            ("bow over the field", plain(surface.bow_mm, "mm").into()),
            (
                "pixels fitted, left out",
                format!("{}, {}", surface.trend.pixels, surface.trend.outliers).into(),
            ),
        ],
    )
}

fn roughness(report: &Report<'_>) -> Markup {
    let row = |name: &str, rough: &Roughness| {
        let mm = |value: f64| fixed(value, 4).into();
        let noise = rough.sq_noise_mm.map_or("not known".into(), mm);
        let shape = |value: f64| fixed(value, 2).into();
        vec![
            name.into(),
            mm(rough.sa_mm),
            mm(rough.sq_mm),
            mm(rough.sz_mm),
            shape(rough.ssk),
            shape(rough.sku),
            noise,
        ]
    };
    let mut rows = vec![row("whole field, hollows included", &report.surface.roughness)];
    if let Some(levels) = &report.surface.levels {
        let regions = [
            ("about the two levels", &levels.roughness),
            ("upper level", &levels.upper),
            ("lower level", &levels.lower),
        ];
        rows.extend(regions.iter().filter_map(|(name, rough)| Some(row(name, rough.as_ref()?))));
    }
    joined([
        table(
            "Roughness after removal of the form (ISO 25178-2); Sa, Sq and Sz in mm",
            &["region", "Sa", "Sq", "Sz", "Ssk", "Sku", "Sq by sigma"],
            rows,
        ),
        paragraph(filters_in_words(report.surface.filters)),
        paragraph(format!(
            "Scale: {}. Sa, Sq and Sz share its uncertainty. Ssk and Sku are ratios of heights, which need no scale.",
            scale_in_words(report.surface.scale_sigma)
        )),
        paragraph(format!(
            "{} outliers were left out: few connected pixels, more than eight standard deviations above the upper \
             or below the lower level.",
            report.surface.field.outlier_px
        )),
    ])
}

fn filters_in_words(filters: Filters) -> String {
    match (filters.s_filter_mm, filters.l_filter_mm) {
        (None, None) => {
            "No S-filter and no L-filter were applied: the values hold noise and waviness.".to_owned()
        }
        (s_filter, l_filter) => {
            let cutoff = |name: &str, mm: Option<f64>, without: &str| match mm {
                Some(mm) => {
                    format!("The {name} has a cut-off of {} mm (Gaussian, ISO 16610-61).", significant(mm, 4))
                }
                None => format!("There is no {name}: the values hold {without}."),
            };
            [cutoff("S-filter", s_filter, "noise"), cutoff("L-filter", l_filter, "waviness")].join(" ")
        }
    }
}
