//! Settings, versions and hashes: what it takes to repeat the measurement, and to see that nothing changed.

use serde_json::Value;

use super::contents::Report;
use super::markup::{cells, table};
use crate::number::{fixed, moment};
use maud::{Markup, html};

pub(super) fn settings(report: &Report<'_>) -> Markup {
    html! { (matcher(report)) (versions(report)) (hashes(report)) }
}

/// Every key of the record, so that none is forgotten.
fn matcher(report: &Report<'_>) -> Markup {
    let matched = report.matched;
    // Numbers and text always serialise as JSON.
    let record = serde_json::to_value(matched.options()).unwrap_or_default();
    let found = if matched.range_found { "found from the data" } else { "given" };
    let range = format!("{} to {} px, {found}", fixed(matched.minimum_px, 3), fixed(matched.maximum_px, 3));
    let region = report.surface.field.region;
    let region = region.map_or("the whole picture".to_owned(), |region| {
        format!("columns {} to {}, rows {} to {}", region.left, region.right, region.top, region.bottom)
    });
    let rows = html! {
        @for (key, value) in record.as_object().into_iter().flatten().filter(|(key, _)| *key != "range") {
            (cells(key, [&in_words(value)]))
        }
        (cells("range", [&range]))
        (cells("positions from", [&matched.positions]))
        (cells("region of the surface", [&region]))
        @if let Some(mask) = &report.surface.field.mask {
            (cells("mask of the surface", [&format!("{} px inside", mask.inside_px)]))
        }
    };
    table("Settings of the matcher and of the surface", &["setting", "value"], rows)
}

fn in_words(value: &Value) -> String {
    match value {
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        Value::Null => "none".to_owned(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

fn versions(report: &Report<'_>) -> Markup {
    let record = report.scan.record;
    let rows = html! {
        (cells("scan", [&record.program, &moment(&record.created)]))
        @if let Some(part) = &report.calibration { (cells("calibration", [&part.record.program, &""])) }
        (cells("match", [&report.matched.program, &""]))
        (cells("surface and report", [&report.surface.program, &moment(&report.made)]))
    };
    table("Versions of the program", &["step", "version", "when"], rows)
}

fn hashes(report: &Report<'_>) -> Markup {
    let row = |of: &str, hash: &str| cells(of, [&html! { code { (hash) } }]);
    let rows = html! {
        (row("uid of the sequence", &report.scan.record.uid))
        @for (file, hash) in &report.map_hashes { (row(file, hash)) }
        @if let Some(mask) = &report.surface.field.mask { (row(&mask.file, &mask.blake3)) }
        @if let Some(part) = &report.calibration {
            @let inputs = &part.record.inputs;
            @let [scan, dark, flat, board] = inputs.counts;
            (row("calibration.json", &part.record.hash()))
            (row(&format!("{scan} frames of the scan"), &inputs.frames))
            @if dark > 0 { (row(&format!("{dark} dark frames"), &inputs.dark)) }
            @if flat > 0 { (row(&format!("{flat} flat frames"), &inputs.flat)) }
            @if board > 0 { (row(&format!("{board} board frames"), &inputs.board)) }
        }
    };
    html! {
        (table("Names and hashes (BLAKE3)", &["of", "hash"], rows))
        p { "The hash of every single frame is in journal.jsonl of the sequence." }
    }
}
