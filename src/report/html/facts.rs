//! The verdict, and what was measured, with what, how good.

use super::contents::Report;
use super::markup::{Markup, data, inline, joined, pairs, paragraph, with};
use crate::calibrate::LensSource;
use crate::number::{fixed, moment, plain, share, sigma, significant, with_interval, with_sigma};
use crate::results::scale_in_words;
use epirig_core::statistics::upper_median;
use epirig_data::sequence::{CameraRecord, Event, Origin};

/// What is said at once: how deep, how sure, and whether the scan can be trusted.
pub(super) fn verdict(report: &Report<'_>) -> Markup {
    let when = format!(
        "Sequence {}, begun {}; this report was made {}.",
        report.name,
        moment(&report.scan.record.created),
        moment(&report.made)
    );
    let conclusion = &report.surface.conclusion;
    let class = if conclusion.as_planned == Some(false) { "verdict unplanned" } else { "verdict" };
    let sentence = with("p", &[("class", class)], typographic(&conclusion.sentence));
    joined([sentence, ended(report), paragraph(when)])
}

/// A sentence of a terminal as a sentence on paper.
fn typographic(sentence: &str) -> String {
    let mut letters = sentence.replace("+-", "\u{b1}").chars().collect::<Vec<_>>();
    letters.iter_mut().take(1).for_each(|first| first.make_ascii_uppercase());
    letters.into_iter().chain(['.']).collect()
}

/// How the scan ended, in red words if not well.
fn ended(report: &Report<'_>) -> Markup {
    let (how, words) = (&report.matched.scan_ended, &report.scan.end_in_words);
    match words {
        Some(words) => {
            let warning = format!("Warning: {words} (recorded as {how})");
            with("p", &[("class", "bad"), ("role", "note")], inline("strong", &[], warning))
        }
        None => paragraph(format!(
            "The scan is {how}: all {} planned frames are there.",
            report.scan.record.frames
        )),
    }
}

pub(super) fn facts(report: &Report<'_>, height: Markup) -> Markup {
    joined([
        height,
        pairs("Result", result(report)),
        pairs("What was measured", object(report)),
        pairs("With what", rig(report)),
        pairs("How good", quality(report)),
    ])
}

fn result(report: &Report<'_>) -> Vec<(&'static str, Markup)> {
    let surface = report.surface;
    let mut rows: Vec<(&str, Markup)> = Vec::new();
    if let Some(levels) = &surface.levels {
        let (depth_mm, combined) = (levels.depth.depth_mm, levels.budget.combined.as_ref());
        let interval = with_interval(depth_mm, combined.map(|sum| sum.half_width_95_mm), "mm");
        let how = match combined {
            Some(sum) => format!(" (95 % coverage, k = {})", fixed(sum.coverage_factor, 2)),
            None => " (too few independent parts)".to_owned(),
        };
        let what = if levels.raised { "height of the raised parts" } else { "depth of the hollows" };
        rows.push((what, joined([data(depth_mm, interval), how.into()])));
    }
    if let Some(planned_mm) = surface.conclusion.planned_mm {
        let met = match surface.conclusion.as_planned {
            Some(true) => ", within the interval",
            Some(false) => ", outside of the interval",
            None => "",
        };
        rows.push(("planned", format!("{planned_mm} mm{met}").into()));
    }
    rows.push(("scale", scale_in_words(surface.scale_sigma).into()));
    rows
}

fn object(report: &Report<'_>) -> Vec<(&'static str, Markup)> {
    let (record, surface) = (report.scan.record, report.surface);
    let (rows, columns) = (report.maps.rest_mm.rows(), report.maps.rest_mm.columns());
    let (width_mm, height_mm) = (columns as f64 * surface.pixel_mm, rows as f64 * surface.pixel_mm);
    vec![
        ("sequence", report.name.as_str().into()),
        ("begun", moment(&record.created).into()),
        (
            "frames",
            format!(
                "{} of {} planned, {} x {} px, {} bit",
                report.scan.frames.len(),
                record.frames,
                record.columns,
                record.rows,
                record.bit_depth
            )
            .into(),
        ),
        ("distance", surface.distance_in_words().into()),
        (
            "field of view there",
            format!(
                "{} x {} mm; a pixel is {} wide",
                fixed(width_mm, 1),
                fixed(height_mm, 1),
                plain(surface.pixel_mm, "mm")
            )
            .into(),
        ),
    ]
}

fn rig(report: &Report<'_>) -> Vec<(&'static str, Markup)> {
    let record = report.scan.record;
    let (mut rows, mut camera_settings): (Vec<(&str, Markup)>, Vec<_>) = Default::default();
    match &record.origin {
        Origin::Captured { stage, camera, configuration, simulator, .. } => {
            rows.push(("stage", stage.as_str().into()));
            rows.push(("camera", camera.as_str().into()));
            if simulator.is_some() {
                rows.push(("simulated", "yes: no hardware was used".into()));
            }
            camera_settings = configuration.iter().flat_map(camera_rows).collect();
        }
        Origin::Imported { folder, conversions, findings, .. } => {
            rows.push(("images from", folder.as_str().into()));
            if !conversions.is_empty() {
                rows.push(("converted", conversions.join("; ").into()));
            }
            if !findings.is_empty() {
                rows.push(("found at import", findings.join("; ").into()));
            }
        }
        Origin::Rectified { folder, sequence_uid, .. } => {
            rows.push(("rectified frames of", format!("{folder}, uid {sequence_uid}").into()));
        }
    }
    let positions: Option<Vec<f64>> =
        report.scan.frames.iter().map(|frame| frame.reported_mm.or(frame.commanded_mm)).collect();
    let ends = positions.as_ref().and_then(|all| Some((*all.first()?, *all.last()?)));
    let by_stage =
        ends.map(|(first, last)| format!("{} mm by the stage, taken as exact", fixed(last - first, 3)));
    let part = report.calibration.as_ref().map(|part| part.record);
    let measured = part.and_then(|found| {
        let baseline_mm = found.positions.baseline_mm?;
        Some(match found.positions.baseline_sigma_mm {
            Some(sigma_mm) => with_sigma(baseline_mm, Some(sigma_mm), "mm"),
            None => format!("{} mm, taken as exact", fixed(baseline_mm, 3)),
        })
    });
    rows.push(("baseline", measured.or(by_stage).unwrap_or_else(|| "not known".to_owned()).into()));
    rows.push(("focal length", focal_length(report).into()));
    rows.extend(camera_settings);
    rows
}

fn focal_length(report: &Report<'_>) -> String {
    if let Some(part) = &report.calibration {
        let lens = &part.record.lens;
        let source = match lens.source {
            LensSource::BoardFrames => "from board frames".to_owned(),
            LensSource::File => format!("from the file {}", lens.file.as_deref().unwrap_or("(no name)")),
            LensSource::DataSheet => "from the data sheet".to_owned(),
            LensSource::Unknown => "not known".to_owned(),
        };
        let length_px = lens.estimate.lens.focal_length_x_px;
        let sigma_px = lens.estimate.sigma()[0];
        return match sigma_px > 0.0 {
            true => format!("{}, {source}", with_sigma(length_px, Some(sigma_px), "px")),
            false => format!("{} px, {source}, taken as exact", fixed(length_px, 2)),
        };
    }
    match report.scan.record.intrinsics {
        Some(lens) => match report.surface.scale_sigma.focal_length.filter(|relative| *relative > 0.0) {
            Some(relative) => {
                let sigma_px = relative * lens.focal_length_px;
                format!("{}, as stated", with_sigma(lens.focal_length_px, Some(sigma_px), "px"))
            }
            None => format!("{} px, as stated, taken as exact", fixed(lens.focal_length_px, 2)),
        },
        None => "not known".to_owned(),
    }
}

fn camera_rows(camera: &CameraRecord) -> Vec<(&'static str, Markup)> {
    let rate = camera.rate_hz.map_or(String::new(), |rate| format!(", {} frames per second", fixed(rate, 1)));
    let exposure = camera.exposure_us.map(|us| match us >= 1000.0 {
        true => format!("{} ms", significant(1e-3 * us, 3)),
        false => format!("{} \u{b5}s", significant(us, 3)),
    });
    let controls: Vec<String> =
        camera.controls.iter().map(|(name, value)| format!("{name} = {value}")).collect();
    let mut rows: Vec<(&str, Markup)> = vec![
        ("picture format", format!("{}, {} x {}{rate}", camera.format, camera.columns, camera.rows).into()),
        ("exposure", exposure.unwrap_or_else(|| "not known".to_owned()).into()),
        ("frames averaged to one", camera.averaged.to_string().into()),
    ];
    if !controls.is_empty() {
        rows.push(("controls of the camera", controls.join(", ").into()));
    }
    rows
}

fn quality(report: &Report<'_>) -> Vec<(&'static str, Markup)> {
    let (matched, surface) = (report.matched, report.surface);
    let field = &surface.field;
    let used = field.used_px as f64 / (field.answered_px.max(1)) as f64;
    let known = |value: Option<f64>, unit: &str| match value {
        Some(value) => sigma(value, unit),
        None => "not known".to_owned(),
    };
    let mut sigmas: Vec<f32> =
        report.maps.sigma_mm.values().iter().copied().filter(|sigma| sigma.is_finite()).collect();
    let sigma_mm = upper_median(&mut sigmas).map(f64::from);
    let retakes = report.scan.events.iter().filter(|event| matches!(event, Event::Retake(_))).count();
    let mut rows: Vec<(&str, Markup)> = vec![
        ("pixels with an answer", share(matched.answered).into()),
        (
            "heights used",
            format!(
                "{} of {}; left out: {} of the target, {} uncertain, {} apart, {} at the rim, {} outliers",
                share(used),
                field.answered_px,
                field.target_px,
                field.uncertain_px,
                field.apart_px,
                field.rim_px,
                field.outlier_px
            )
            .into(),
        ),
        ("standard uncertainty of a disparity, median", known(matched.median_sigma_px, "px").into()),
        ("standard uncertainty of a height, median", known(sigma_mm, "mm").into()),
        ("attempts that were retaken", retakes.to_string().into()),
    ];
    if let Some(locking) = &matched.pixel_locking {
        let words = match locking.worst_bias_px > 0.0 {
            true => format!(
                "largest predicted bias {}; it matters for {} of the answered pixels",
                sigma(locking.worst_bias_px, "px"),
                share(locking.share_locked)
            ),
            false => "no bias is predicted".to_owned(),
        };
        rows.push(("pixel locking", words.into()));
    }
    if let Some(light) = matched.light.and_then(|light| light.in_words()) {
        rows.push(("light that changed, taken off", light.into()));
    }
    rows
}
