//! How the scan went: its end, closure, positions, brightness, and what was taken again.

use super::contents::Report;
use super::markup::{cells, pair, pairs, table};
use super::picture::Picture;
use crate::number::{fixed, moment, percent, plain, sigma, with_sigma};
use crate::report::{Chart, ReportError, Series};
use epirig_data::sequence::{ComparisonRecord, Event, TimesRecord};
use maud::{Markup, html};

/// Rows of a list of retakes; a scan with more has one fault, which the first of them tell.
const MOST_RETAKES: usize = 200;

pub(super) fn scan(report: &Report<'_>) -> Result<Markup, ReportError> {
    Ok(html! {
        (end(report))
        (positions(report)?)
        (brightness(report)?)
        h3 { "Frames that were taken again" }
        (retakes(report))
        (resumed(report))
    })
}

fn end(report: &Report<'_>) -> Markup {
    let rows = html! {
        (pair("recorded as", &report.matched.scan_ended))
        @if let Some(stop) = report.scan.stop {
            (pair("at", moment(&stop.stopped)))
            @if let Some(reason) = &stop.reason { (pair("reason", reason)) }
            @if let Some(closure) = &stop.closure {
                (pair("home found again at", in_mm(closure.home_shift_mm)))
                (pair("first frame taken again", compared(closure.comparison.as_ref())))
            }
            @if let Some(taken) = &stop.times { (pair("time", times(taken))) }
        }
    };
    pairs("End of the scan", rows)
}

fn in_mm(shift_mm: Option<f64>) -> String {
    shift_mm.map_or("not known".to_owned(), |mm| sigma(mm, "mm"))
}

fn compared(found: Option<&ComparisonRecord>) -> String {
    let Some(found) = found else { return "not compared".to_owned() };
    format!(
        "moved along x by {}; along y by {}; light {} of before",
        with_sigma(found.x_px, Some(found.sigma_px), "px"),
        with_sigma(found.y_px, Some(found.sigma_px), "px"),
        percent(found.light)
    )
}

fn times(times: &TimesRecord) -> Markup {
    let seconds = |value: f64| format!("{} s", fixed(value, 1));
    html! {
        (seconds(times.total_s)) ": moving " (seconds(times.moving_s))
        ", settling " (seconds(times.settling_s)) ", exposing " (seconds(times.exposing_s))
    }
}

/// Reported minus planned positions, if both are known.
fn positions(report: &Report<'_>) -> Result<Markup, ReportError> {
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
        return Ok(html! { p { "The stage reported no positions, so none can be compared with the plan." } });
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
    let what = "Chart of the reported minus the planned position of every frame, in um";
    Ok(Picture::chart(&chart)?.figure(what, words))
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
    let events = report.scan.events.iter();
    let all: Vec<_> = events
        .filter_map(|event| if let Event::Retake(retake) = event { Some(retake) } else { None })
        .collect();
    if all.is_empty() {
        return html! { p { "No frame was taken again." } };
    }
    let rows = html! {
        @for retake in all.iter().take(MOST_RETAKES) {
            (cells(retake.index, [&retake.attempt, &retake.reason, &moment(&retake.at)]))
        }
    };
    let caption = match all.len() {
        count if count > MOST_RETAKES => format!("The first {MOST_RETAKES} of {count} attempts that failed"),
        count => format!("{count} attempts that failed"),
    };
    table(&caption, &["frame", "attempt", "why it was not good", "when"], rows)
}

fn resumed(report: &Report<'_>) -> Markup {
    let events = report.scan.events.iter();
    let all: Vec<_> = events
        .filter_map(|event| if let Event::Resumed(resumed) = event { Some(resumed) } else { None })
        .collect();
    if all.is_empty() {
        return html! {};
    }
    let tolerance = |mm: Option<f64>| mm.map_or("as before".to_owned(), |mm| plain(mm, "mm"));
    let rows = html! {
        @for resumed in all {
            (cells(moment(&resumed.at), [
                &resumed.after,
                &in_mm(resumed.home_shift_mm),
                &compared(resumed.comparison.as_ref()),
                &tolerance(resumed.position_tolerance_mm),
            ]))
        }
    };
    let head =
        ["resumed at", "after", "home found again at", "last good frame taken again", "tolerance from here"];
    table("Interruptions of the scan", &head, rows)
}
