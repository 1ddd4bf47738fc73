//! Settings, versions and hashes: what it takes to repeat the measurement, and to see that nothing changed.

use serde_json::Value;

use super::contents::Report;
use super::markup::{Markup, inline, joined, paragraph, table};
use crate::number::{fixed, moment};

pub(super) fn settings(report: &Report<'_>) -> Markup {
    joined([matcher(report), versions(report), hashes(report)])
}

/// Every key of the record, so that none is forgotten.
fn matcher(report: &Report<'_>) -> Markup {
    let matched = report.matched;
    // Numbers and text always serialise as JSON.
    let record = serde_json::to_value(matched.options()).unwrap_or_default();
    let settings = record.as_object().into_iter().flatten().filter(|(key, _)| *key != "range");
    let mut rows: Vec<Vec<Markup>> =
        settings.map(|(key, value)| vec![key.as_str().into(), in_words(value).into()]).collect();
    let found = if matched.range_found { "found from the data" } else { "given" };
    rows.push(vec![
        "range".into(),
        format!("{} to {} px, {found}", fixed(matched.minimum_px, 3), fixed(matched.maximum_px, 3)).into(),
    ]);
    rows.push(vec!["positions from".into(), matched.positions.as_str().into()]);
    let region = report.surface.field.region;
    let region = region.map_or("the whole picture".to_owned(), |region| {
        format!("columns {} to {}, rows {} to {}", region.left, region.right, region.top, region.bottom)
    });
    rows.push(vec!["region of the surface".into(), region.into()]);
    if let Some(mask) = &report.surface.field.mask {
        rows.push(vec!["mask of the surface".into(), format!("{} px inside", mask.inside_px).into()]);
    }
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
    let mut rows: Vec<Vec<Markup>> = vec![
        vec!["scan".into(), record.program.as_str().into(), moment(&record.created).into()],
        vec!["match".into(), report.matched.program.as_str().into(), "".into()],
        vec![
            "surface and report".into(),
            report.surface.program.as_str().into(),
            moment(&report.made).into(),
        ],
    ];
    if let Some(part) = &report.calibration {
        rows.insert(1, vec!["calibration".into(), part.record.program.as_str().into(), "".into()]);
    }
    table("Versions of the program", &["step", "version", "when"], rows)
}

fn hashes(report: &Report<'_>) -> Markup {
    let code = |text: &str| inline("code", &[], text);
    let mut rows: Vec<Vec<Markup>> = vec![vec!["uid of the sequence".into(), code(&report.scan.record.uid)]];
    rows.extend(report.map_hashes.iter().map(|(file, hash)| vec![(*file).into(), code(hash)]));
    rows.extend(
        report.surface.field.mask.iter().map(|mask| vec![mask.file.as_str().into(), code(&mask.blake3)]),
    );
    if let Some(part) = &report.calibration {
        let inputs = &part.record.inputs;
        let [scan, dark, flat, board] = inputs.counts;
        rows.push(vec!["calibration.json".into(), code(&part.record.hash())]);
        rows.push(vec![format!("{scan} frames of the scan").into(), code(&inputs.frames)]);
        let others =
            [(dark, "dark", &inputs.dark), (flat, "flat", &inputs.flat), (board, "board", &inputs.board)];
        let there = others.into_iter().filter(|(count, ..)| *count > 0);
        rows.extend(
            there.map(|(count, kind, hash)| vec![format!("{count} {kind} frames").into(), code(hash)]),
        );
    }
    joined([
        table("Names and hashes (BLAKE3)", &["of", "hash"], rows),
        paragraph("The hash of every single frame is in journal.jsonl of the sequence."),
    ])
}
