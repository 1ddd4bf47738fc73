//! How the scan went: its end, closure, positions, brightness, and what was taken again.

use super::contents::Report;
use super::markup::{Markup, element, joined, pairs, paragraph, table};
use super::picture::Picture;
use crate::number::{fixed, moment, percent, plain, sigma, with_sigma};
use crate::report::{Chart, ReportError, Series};
use epirig_data::sequence::{ClosureRecord, ComparisonRecord, Event, ResumedRecord, TimesRecord};

/// Rows of a list of retakes; a scan with more has one fault, which the first of them tell.
const MOST_RETAKES: usize = 200;

pub(super) fn scan(report: &Report<'_>) -> Result<Markup, ReportError> {
    let mut parts = vec![end(report)];
    parts.extend(positions(report)?);
    parts.push(brightness(report)?);
    parts.push(element("h3", "Frames that were taken again"));
    parts.push(retakes(report));
    parts.extend(resumed(report));
    Ok(joined(parts))
}

fn end(report: &Report<'_>) -> Markup {
    let mut rows: Vec<(&str, Markup)> = vec![("recorded as", report.matched.scan_ended.as_str().into())];
    if let Some(stop) = report.scan.stop {
        rows.push(("at", moment(&stop.stopped).into()));
        rows.extend(stop.reason.iter().map(|reason| ("reason", Markup::from(reason.as_str()))));
        rows.extend(stop.closure.iter().flat_map(closure));
        rows.extend(stop.times.iter().flat_map(times));
    }
    pairs("End of the scan", rows)
}

fn closure(closure: &ClosureRecord) -> Vec<(&'static str, Markup)> {
    let home = closure.home_shift_mm.map_or("not known".to_owned(), |mm| sigma(mm, "mm"));
    let compared = closure.comparison.as_ref().map_or("not compared".to_owned(), comparison);
    vec![("home found again at", home.into()), ("first frame taken again", compared.into())]
}

fn comparison(found: &ComparisonRecord) -> String {
    format!(
        "moved along x by {}; along y by {}; light {} of before",
        with_sigma(found.x_px, Some(found.sigma_px), "px"),
        with_sigma(found.y_px, Some(found.sigma_px), "px"),
        percent(found.light)
    )
}

fn times(times: &TimesRecord) -> Vec<(&'static str, Markup)> {
    let seconds = |value: f64| format!("{} s", fixed(value, 1));
    let parts = format!(
        "{}: moving {}, settling {}, exposing {}",
        seconds(times.total_s),
        seconds(times.moving_s),
        seconds(times.settling_s),
        seconds(times.exposing_s)
    );
    vec![("time", parts.into())]
}

/// Reported minus planned positions, if both are known.
fn positions(report: &Report<'_>) -> Result<Option<Markup>, ReportError> {
    let points: Vec<(f64, f64)> = report
        .scan
        .frames
        .iter()
        .filter_map(|frame| {
            let error_mm = frame.reported_mm? - frame.commanded_mm?;
            Some((frame.index as f64, 1000.0 * error_mm))
        })
        .collect();
    if points.is_empty() {
        return Ok(Some(paragraph(
            "The stage reported no positions, so none can be compared with the plan.",
        )));
    }
    let largest_um = points.iter().map(|(_, um)| um.abs()).fold(0.0, f64::max);
    let chart = Chart {
        title: "Stage: reported minus planned position".to_owned(),
        x_label: "frame".to_owned(),
        y_label: "reported minus planned (um)".to_owned(),
        least_y_span: 2.0,
        zero_line: true,
        series: vec![Series::dots("frame", points)],
    };
    let words = format!(
        "Reported minus planned position of every frame; the largest difference is {}. Where the frames truly stood \
         is known only if a target shows it: see the calibration.",
        sigma(largest_um, "\u{b5}m")
    );
    Ok(Some(
        Picture::chart(&chart)?
            .figure("Chart of the reported minus the planned position of every frame, in um", words),
    ))
}

fn brightness(report: &Report<'_>) -> Result<Markup, ReportError> {
    let points: Vec<(f64, f64)> =
        report.scan.frames.iter().map(|frame| (frame.index as f64, frame.mean_dn)).collect();
    let saturated = report.scan.frames.iter().filter(|frame| frame.saturated > 0).count();
    let chart = Chart {
        title: "Mean intensity of every frame, as captured".to_owned(),
        x_label: "frame".to_owned(),
        y_label: "mean intensity (DN)".to_owned(),
        least_y_span: 1.0,
        zero_line: false,
        series: vec![Series::dots("frame", points)],
    };
    let words = format!(
        "Mean intensity of every frame, before any correction. It also changes with what is in view. {saturated} frames \
         have samples at full scale."
    );
    Ok(Picture::chart(&chart)?.figure("Chart of the mean intensity of every frame, in DN", words))
}

fn retakes(report: &Report<'_>) -> Markup {
    let all: Vec<_> = report
        .scan
        .events
        .iter()
        .filter_map(|event| match event {
            Event::Retake(retake) => Some(retake),
            _ => None,
        })
        .collect();
    if all.is_empty() {
        return paragraph("No frame was taken again.");
    }
    let rows = all.iter().take(MOST_RETAKES).map(|retake| {
        let cells =
            [retake.index.to_string(), retake.attempt.to_string(), retake.reason.clone(), moment(&retake.at)];
        cells.map(Markup::from).to_vec()
    });
    let caption = match all.len() {
        count if count > MOST_RETAKES => format!("The first {MOST_RETAKES} of {count} attempts that failed"),
        count => format!("{count} attempts that failed"),
    };
    table(&caption, &["frame", "attempt", "why it was not good", "when"], rows)
}

fn resumed(report: &Report<'_>) -> Option<Markup> {
    let all: Vec<&ResumedRecord> = report
        .scan
        .events
        .iter()
        .filter_map(|event| match event {
            Event::Resumed(resumed) => Some(resumed),
            _ => None,
        })
        .collect();
    let rows = all.iter().map(|resumed| {
        let home = resumed.home_shift_mm.map_or("not known".to_owned(), |mm| sigma(mm, "mm"));
        let tolerance = resumed.position_tolerance_mm.map_or("as before".to_owned(), |mm| plain(mm, "mm"));
        let compared = resumed.comparison.as_ref().map_or("not compared".to_owned(), comparison);
        vec![
            moment(&resumed.at).into(),
            resumed.after.as_str().into(),
            home.into(),
            compared.into(),
            tolerance.into(),
        ]
    });
    let head =
        ["resumed at", "after", "home found again at", "last good frame taken again", "tolerance from here"];
    (!all.is_empty()).then(|| table("Interruptions of the scan", &head, rows))
}
