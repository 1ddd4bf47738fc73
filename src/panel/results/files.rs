//! Files that can be taken away, and the pictures of the calibration.

use serde::Serialize;

use super::view::ResultsView;
use crate::calibrate::{calibration_pictures, read_calibration_picture};
use crate::panel::PanelError;
use crate::results::ResultFiles;
use epirig_server::Reply;

/// Before the names of the files of the surface.
const SURFACE: &str = "surface/";

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct Download {
    name: String,
    title: String,
    bytes: u64,
}

/// The files of the results.
pub(super) fn downloads(view: &ResultsView) -> Vec<Download> {
    let Some(results) = &view.results else { return Vec::new() };
    let surface = view.surface.iter().flat_map(ResultFiles::sizes);
    let surface = surface.map(|(name, bytes)| (format!("{SURFACE}{name}"), bytes));
    let files = results.files.sizes().into_iter().chain(surface);
    let titled = |name: &str| match name.rsplit_once('.') {
        Some((_, ending)) => format!("{}, {}", title(name), ending.to_uppercase()),
        None => title(name),
    };
    files.map(|(name, bytes)| Download { title: titled(&name), name, bytes }).collect()
}

/// One of them.
pub(super) fn download(view: &ResultsView, name: &str) -> Result<Reply, PanelError> {
    let own = view.results.as_ref().map(|results| (&results.files, name));
    let of_surface = name.strip_prefix(SURFACE).and_then(|name| Some((view.surface.as_ref()?, name)));
    let found = of_surface.or(own).map(|(files, name)| files.bytes(name)).transpose();
    let bytes = found?.flatten();
    let bytes =
        bytes.ok_or_else(|| PanelError::NotThere(format!("there is no file {name} in the results")))?;
    let media_type = match name.rsplit_once('.').map(|(_, ending)| ending) {
        Some("png") => "image/png",
        Some("csv") => "text/csv; charset=utf-8",
        Some("json") => "application/json",
        Some("tiff") => "image/tiff",
        _ => "application/octet-stream",
    };
    Ok(Reply::of(media_type, bytes))
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct CalibrationInfo {
    figures: Vec<CalibrationFigure>,
    notes: Vec<String>,
    needs: Vec<String>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct CalibrationFigure {
    name: String,
    title: String,
}

/// The pictures and remarks of the calibration that the results were made with.
pub(super) fn calibration(view: &ResultsView) -> Option<CalibrationInfo> {
    let (calibration, _) = view.results.as_ref()?.calibration.as_ref()?;
    let names = calibration_pictures(view.sequence.folder());
    Some(CalibrationInfo {
        figures: names.into_iter().map(|name| CalibrationFigure { title: title(&name), name }).collect(),
        notes: calibration.notes.clone(),
        needs: calibration.needs.clone(),
    })
}

/// A picture of the calibration, by its name with `.png`.
pub(super) fn calibration_picture(view: &ResultsView, name: &str) -> Result<Reply, PanelError> {
    let folder = view.sequence.folder();
    let name = name.strip_suffix(".png").unwrap_or(name);
    if !calibration_pictures(folder).iter().any(|known| known == name) {
        return Err(PanelError::NotThere(format!("the calibration has no picture {name}")));
    }
    Ok(Reply::of("image/png", read_calibration_picture(folder, name)?))
}

/// A name as a person reads it.
fn title(name: &str) -> String {
    let base = name.rsplit_once('/').map_or(name, |(_, base)| base);
    let words = base.split_once('.').map_or(base, |(words, _)| words).replace(['-', '_'], " ");
    let mut letters = words.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}
