//! The verdict, and what was measured, with what, how good.

use super::contents::Report;
use super::limits;
use super::markup::{data, pair, pairs};
use super::picture::Picture;
use crate::calibrate::LensSource;
use crate::number::{fixed, moment, plain, share, sigma, significant, with_interval, with_sigma};
use crate::results::scale_in_words;
use epirig_core::statistics::upper_median;
use epirig_data::sequence::{CameraRecord, Event, Origin};
use epirig_surface::conformity::Verdict;
use maud::{Markup, html};

/// The picture at the top, if one is asked for.
pub(super) fn logo(report: &Report<'_>) -> Markup {
    let source = report.logo.as_ref().map(|file| file.clone().and_then(|file| Picture::logo(&file)));
    html! {
        @match source {
            None => {}
            Some(Ok(source)) => img.logo src=(source) alt="";
            Some(Err(why)) => p.bad role="note" { "There is no logo: " (why) "." }
        }
    }
}

/// What is said at once: how deep, how sure, and whether the scan can be trusted.
pub(super) fn verdict(report: &Report<'_>) -> Markup {
    let conclusion = &report.surface.conclusion;
    let unplanned = conclusion.as_planned == Some(false);
    let ended = &report.matched.scan_ended;
    html! {
        p.verdict.unplanned[unplanned] { (typographic(&conclusion.sentence)) }
        @if let Some(words) = &conclusion.verdict_sentence {
            p.verdict.unplanned[conclusion.verdict != Some(Verdict::Pass)] { (typographic(words)) }
        }
        @match &report.scan.end_in_words {
            Some(words) => p.bad role="note" { strong { "Warning: " (words) " (recorded as " (ended) ")" } }
            None => p {
                "The scan is " (ended) ": all " (report.scan.record.frames) " planned frames are there."
            }
        }
        p {
            "Sequence " (report.name) ", begun " (moment(&report.scan.record.created))
            "; this report was made " (moment(&report.made)) "."
        }
    }
}

/// A sentence of a terminal as a sentence on paper.
fn typographic(sentence: &str) -> String {
    let mut letters = sentence.replace("+-", "\u{b1}").chars().collect::<Vec<_>>();
    letters.iter_mut().take(1).for_each(|first| first.make_ascii_uppercase());
    letters.into_iter().chain(['.']).collect()
}

pub(super) fn facts(report: &Report<'_>, height: Markup) -> Markup {
    html! {
        (height)
        (pairs("Result", result(report)))
        @if let Some(conformity) = &report.surface.conformity { (limits::limits(conformity)) }
        @if !report.stated.is_empty() {
            (pairs("As stated", html! { @for (name, text) in &report.stated { (pair(name, text)) } }))
        }
        (pairs("What was measured", object(report)))
        (pairs("With what", rig(report)))
        (pairs("How good", quality(report)))
    }
}

fn result(report: &Report<'_>) -> Markup {
    let surface = report.surface;
    let depth = surface.levels.as_ref().map(|levels| {
        let (depth_mm, combined) = (levels.depth.depth_mm, levels.budget.combined.as_ref());
        let interval = with_interval(depth_mm, combined.map(|sum| sum.half_width_95_mm), "mm");
        let how = match combined {
            Some(sum) => format!(" (95 % coverage, k = {})", fixed(sum.coverage_factor, 2)),
            None => " (too few independent parts)".to_owned(),
        };
        let what = if levels.raised { "height of the raised parts" } else { "depth of the hollows" };
        pair(what, html! { (data(depth_mm, interval)) (how) })
    });
    let met = match surface.conclusion.as_planned {
        Some(true) => ", within the interval",
        Some(false) => ", outside of the interval",
        None => "",
    };
    html! {
        @if let Some(depth) = depth { (depth) }
        @if let Some(planned_mm) = surface.conclusion.planned_mm {
            (pair("planned", format!("{planned_mm} mm{met}")))
        }
        (pair("scale", scale_in_words(surface.scale_sigma)))
    }
}

fn object(report: &Report<'_>) -> Markup {
    let (record, surface) = (report.scan.record, report.surface);
    let (rows, columns) = (report.maps.rest_mm.rows(), report.maps.rest_mm.columns());
    let (width_mm, height_mm) = (columns as f64 * surface.pixel_mm, rows as f64 * surface.pixel_mm);
    html! {
        (pair("sequence", &report.name))
        (pair("begun", moment(&record.created)))
        (pair("frames", html! {
            (report.scan.frames.len()) " of " (record.frames) " planned, "
            (record.columns) " x " (record.rows) " px, " (record.bit_depth) " bit"
        }))
        (pair("distance", surface.distance_in_words()))
        (pair("field of view there", html! {
            (fixed(width_mm, 1)) " x " (fixed(height_mm, 1)) " mm; a pixel is "
            (plain(surface.pixel_mm, "mm")) " wide"
        }))
    }
}

fn rig(report: &Report<'_>) -> Markup {
    html! {
        @match &report.scan.record.origin {
            Origin::Captured { stage, camera, configuration, simulator, .. } => {
                (pair("stage", stage))
                (pair("camera", camera))
                @if simulator.is_some() { (pair("simulated", "yes: no hardware was used")) }
                (optics(report))
                @if let Some(camera) = configuration { (camera_rows(camera)) }
            }
            Origin::Imported { folder, conversions, findings, .. } => {
                (pair("images from", folder))
                @if !conversions.is_empty() { (pair("converted", conversions.join("; "))) }
                @if !findings.is_empty() { (pair("found at import", findings.join("; "))) }
                (optics(report))
            }
            Origin::Rectified { folder, sequence_uid, .. } => {
                (pair("rectified frames of", format!("{folder}, uid {sequence_uid}")))
                (optics(report))
            }
        }
    }
}

fn optics(report: &Report<'_>) -> Markup {
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
    html! {
        (pair("baseline", measured.or(by_stage).unwrap_or_else(|| "not known".to_owned())))
        (pair("focal length", focal_length(report)))
    }
}

fn focal_length(report: &Report<'_>) -> String {
    if let Some(part) = &report.calibration {
        let lens = &part.record.lens;
        let source = match lens.source {
            LensSource::BoardFrames => "from board frames".to_owned(),
            LensSource::File => format!("from the file {}", lens.file.as_deref().unwrap_or("(no name)")),
            LensSource::DataSheet => "from the data sheet".to_owned(),
            LensSource::Texture => "from the texture of frames that turned".to_owned(),
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

fn camera_rows(camera: &CameraRecord) -> Markup {
    let rate = camera.rate_hz.map_or(String::new(), |rate| format!(", {} frames per second", fixed(rate, 1)));
    let exposure = camera.exposure_us.map(|us| match us >= 1000.0 {
        true => format!("{} ms", significant(1e-3 * us, 3)),
        false => format!("{} \u{b5}s", significant(us, 3)),
    });
    let controls: Vec<String> =
        camera.controls.iter().map(|(name, value)| format!("{name} = {value}")).collect();
    let format = format!("{}, {} x {}{rate}", camera.format, camera.columns, camera.rows);
    html! {
        (pair("picture format", format))
        (pair("exposure", exposure.unwrap_or_else(|| "not known".to_owned())))
        (pair("frames averaged to one", camera.averaged))
        @if !controls.is_empty() { (pair("controls of the camera", controls.join(", "))) }
    }
}

fn quality(report: &Report<'_>) -> Markup {
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
    html! {
        (pair("pixels with an answer", share(matched.answered)))
        (pair("heights used", html! {
            (share(used)) " of " (field.answered_px) "; left out: " (field.target_px) " of the target, "
            (field.uncertain_px) " uncertain, " (field.apart_px) " apart, " (field.rim_px) " at the rim, "
            (field.outlier_px) " outliers"
        }))
        (pair("standard uncertainty of a disparity, median", known(matched.median_sigma_px, "px")))
        (pair("standard uncertainty of a height, median", known(sigma_mm, "mm")))
        (pair("attempts that were retaken", retakes))
        @if let Some(locking) = &matched.pixel_locking {
            (pair("pixel locking", html! {
                @if locking.worst_bias_px > 0.0 {
                    "largest predicted bias " (sigma(locking.worst_bias_px, "px")) "; it matters for "
                    (share(locking.share_locked)) " of the answered pixels"
                } @else {
                    "no bias is predicted"
                }
            }))
        }
        @if let Some(words) = matched.light.and_then(|light| light.in_words()) {
            (pair("light that changed, taken off", words))
        }
    }
}
