//! Step heights, their uncertainty budget, form and roughness.

use super::contents::Report;
use super::markup::{cells, data, pair, pairs, table};
use crate::number::{fixed, plain, share, sigma, significant, with_interval};
use crate::results::{LevelsSummary, scale_in_words};
use epirig_core::choice::Choice as _;
use epirig_surface::{Contribution, Depth, Evaluation, Filters, Roughness};
use maud::{Markup, html};

pub(super) fn steps(report: &Report<'_>) -> Markup {
    let surface = report.surface;
    html! {
        @if let Some(levels) = &surface.levels {
            (depths(levels))
            h3 { "Uncertainty budget" }
            (budget(levels))
            (left_out(levels, report))
            (margins(levels))
            @if let Some(words) = levels.misfit() { p { "Note: " (words) "." } }
        } @else {
            @let reason = surface.no_levels.as_deref().unwrap_or("the reason is not recorded");
            p { "There is no step height: " (reason) "." }
        }
        h3 { "Form and roughness" }
        (form(report))
        (roughness(report))
    }
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
    let area_mm2: f64 = levels.parts.iter().map(|part| part.area_mm2).sum();
    let used: usize = levels.parts.iter().map(|part| part.used_px).sum();
    let rows = html! {
        (cells("all together", [&depth(&levels.depth), &"", &significant(area_mm2, 4), &used]))
        @for (index, part) in levels.parts.iter().enumerate() {
            @let middle = format!("{}, {}", fixed(part.centre_x_px, 0), fixed(part.centre_y_px, 0));
            (cells(index + 1, [&depth(&part.depth), &middle, &significant(part.area_mm2, 4), &part.used_px]))
        }
    };
    html! {
        (table(caption, &[what, step, "middle (px)", "area (mm\u{b2})", "pixels used"], rows))
        p {
            "These intervals (95 % coverage, Student's t) hold the scatter between independent parts of the \
             field alone. So they tell how parts differ; errors that all parts share, such as that of the \
             scale, are in the budget below. Errors of pixels more than " (levels.correlation_reach_px)
            " px apart are independent. Pixels nearer than " (levels.margin_px) " px to a wall are left out."
        }
    }
}

fn budget(levels: &LevelsSummary) -> Markup {
    let sum = &levels.budget.combined;
    let rows = html! {
        @for part in &levels.budget.contributions { (contribution(part)) }
        @if let Some(sum) = sum {
            (cells("combined standard uncertainty", [&"", &sigma(sum.sigma_mm, "mm"), &"100 %"]))
        }
    };
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
    let head = ["contribution", "type", "standard uncertainty", "share of the variance"];
    html! {
        (table("Contributions to the uncertainty of the depth over all parts", &head, rows))
        p {
            (expanded) " A contribution of 0 mm is no larger than noise explains, or was stated as exact."
        }
    }
}

/// Degrees of freedom; with more than these, Student's t is the normal distribution.
fn degrees(effective: f64) -> String {
    const MANY: f64 = 1000.0;
    if effective > MANY { format!("more than {}", fixed(MANY, 0)) } else { fixed(effective, 0) }
}

fn contribution(part: &Contribution) -> Markup {
    let (kind, unknown) = match part.evaluation {
        Evaluation::A => ("A", "not known"),
        Evaluation::B => ("B", "not known; taken as exact"),
    };
    let sigma = part.sigma_mm.map_or(unknown.to_owned(), |sigma_mm| sigma(sigma_mm, "mm"));
    cells(part.name, [&kind, &sigma, &part.share.map_or("not known".to_owned(), share)])
}

/// What the budget does not hold.
fn left_out(levels: &LevelsSummary, report: &Report<'_>) -> Markup {
    let locking = report.matched.pixel_locking.as_ref().filter(|found| found.worst_bias_px > 0.0);
    let disparity_px = report.matched.median_disparity_px.unwrap_or(f64::NAN);
    let height_per_px_mm = (report.surface.distance_mm / disparity_px).abs();
    html! {
        p { "Not in this budget:" }
        ul {
            li {
                "errors that are the same in all parts of the field and follow the hollows, which no form \
                 explains"
            }
            li { "differences between scans: this is one scan" }
            @if report.surface.scale_sigma.baseline.is_some() {
                li { "the stage's own millimetre (its lead screw), in which the baseline is counted" }
            }
            @for part in levels.budget.contributions.iter().filter(|part| part.sigma_mm.is_none()) {
                li { (part.name) ": not known" }
            }
            @if report.calibration.is_none() {
                li {
                    "distortion, vignetting, and the direction of the stage axis: the frames were matched as \
                     captured, without a calibration"
                }
            }
            @if let Some(locking) = locking {
                li {
                    "pixel locking, which is in the uncertainty of single heights: its largest predicted \
                     bias of a height is " (sigma(locking.worst_bias_px * height_per_px_mm, "mm"))
                }
            }
        }
    }
}

fn margins(levels: &LevelsSummary) -> Markup {
    let rows = html! {
        @for at in &levels.by_margin {
            @let used = if at.margin_px == levels.margin_px { " (used)" } else { "" };
            @let depth = data(at.depth_mm, with_interval(at.depth_mm, at.half_width_95_mm, "mm"));
            (cells(format!("{} px{used}", at.margin_px), [&depth, &at.used_px]))
        }
    };
    let head = ["left out at the walls", "depth, 95 % by scatter alone", "pixels used"];
    html! {
        (table("Depth for other distances from the walls", &head, rows))
        p {
            "If the depth still grows with the distance, windows of the matcher reach across the walls, and \
             the depth is too small."
        }
        @if let Some(on) = levels.on_plateaus {
            p {
                "On the plateaus of ISO 5436-1: "
                (with_interval(on.depth.depth_mm, on.depth.half_width_95_mm, "mm"))
                " (95 % by scatter alone), from " (on.used_px) " pixels. That is the central third of each \
                 part, and the level around it from a third of its width to its width. Parts are "
                (fixed(on.width_px, 0)) " px wide (median)."
            }
        }
        @if let Some(width_mm) = levels.wall_width_mm {
            p {
                "In the map the walls look " (plain(width_mm, "mm")) " wide, from 10 % to 90 % of the depth. Blur and \
                 the windows of the match are part of that."
            }
        }
    }
}

fn form(report: &Report<'_>) -> Markup {
    let surface = report.surface;
    let (along_x, along_y) = surface.tilt_deg;
    let trend = &surface.trend;
    let rows = html! {
        (pair("form", trend.kind.name()))
        (pair("tilt along x, along y", format!("{} deg, {} deg", fixed(along_x, 4), fixed(along_y, 4))))
        (pair("bow over the field", plain(surface.bow_mm, "mm")))
        (pair("pixels fitted, left out", format!("{}, {}", trend.pixels, trend.outliers)))
    };
    pairs("Form that was removed", rows)
}

fn roughness(report: &Report<'_>) -> Markup {
    let row = |name: &str, rough: &Roughness| {
        let mm = |value: f64| fixed(value, 4);
        let noise = rough.sq_noise_mm.map_or("not known".to_owned(), mm);
        let (skewness, kurtosis) = (fixed(rough.ssk, 2), fixed(rough.sku, 2));
        let [sa, sq, sz] = [rough.sa_mm, rough.sq_mm, rough.sz_mm].map(mm);
        cells(name, [&sa, &sq, &sz, &skewness, &kurtosis, &noise])
    };
    let levels = report.surface.levels.iter().flat_map(|levels| {
        [
            ("about the two levels", &levels.roughness),
            ("upper level", &levels.upper),
            ("lower level", &levels.lower),
        ]
    });
    let rows = html! {
        (row("whole field, hollows included", &report.surface.roughness))
        @for (name, rough) in levels { @if let Some(rough) = rough { (row(name, rough)) } }
    };
    html! {
        (table(
            "Roughness after removal of the form (ISO 25178-2); Sa, Sq and Sz in mm",
            &["region", "Sa", "Sq", "Sz", "Ssk", "Sku", "Sq by sigma"],
            rows,
        ))
        p { (filters_in_words(report.surface.filters)) }
        p {
            "Scale: " (scale_in_words(report.surface.scale_sigma))
            ". Sa, Sq and Sz share its uncertainty. Ssk and Sku are ratios of heights, which need no scale."
        }
        p {
            (report.surface.field.outlier_px)
            " outliers were left out: few connected pixels, more than eight standard deviations above the \
             upper or below the lower level."
        }
    }
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
