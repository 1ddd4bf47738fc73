//! Reads results.

use std::path::Path;

use super::{FORMAT_VERSION, MatchSettings, MatchSummary, ResultsError};
use epirig_core::grid::{Grid, MOST_PIXELS};
use epirig_data::formats::MapFormat;
use epirig_data::storage::{ReadError, RealDisk, RecordError, read_file, read_named, read_record, recover};
use epirig_matcher::LARGEST_WINDOW_PX;

/// Size of the largest map as uncompressed 64 bit numbers, in bytes.
const LARGEST_MAP: u64 = 8 * MOST_PIXELS as u64 + (1 << 16);

/// Reads a map; the extension of the file gives its format.
///
/// # Errors
/// [`ResultsError`] if the file cannot be read, or is not a map.
pub fn read_map(path: &Path) -> Result<Grid<f32>, ResultsError> {
    decoded(path, read_file)
}

/// Reads a map that an option names, which may also be a pipe.
///
/// # Errors
/// As [`read_map`].
pub fn read_named_map(path: &Path) -> Result<Grid<f32>, ResultsError> {
    decoded(path, read_named)
}

fn decoded(
    path: &Path,
    read: fn(&Path, u64) -> Result<Vec<u8>, ReadError>,
) -> Result<Grid<f32>, ResultsError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let format = MapFormat::from_extension(&extension)
        .ok_or_else(|| ResultsError::UnknownFormat { path: path.to_owned() })?;
    let bytes = read(path, LARGEST_MAP)?;
    format.decode(&bytes).map_err(|source| ResultsError::Format { path: path.to_owned(), source })
}

/// Reads `match.json` of a folder of results.
///
/// # Errors
/// [`ResultsError`] if it is missing, has another version or is invalid.
pub fn read_summary(folder: &Path) -> Result<MatchSummary, ResultsError> {
    // A killed program may have left the results set aside.
    recover(&mut RealDisk, folder).map_err(|source| ResultsError::Io {
        action: "bring back",
        path: folder.to_owned(),
        source,
    })?;
    let path = folder.join("match.json");
    let summary: MatchSummary = read_record(&path, FORMAT_VERSION).map_err(|error| match error {
        RecordError::Read(error) => error.into(),
        RecordError::Version { path, found, expected } => {
            let reason = format!("it has format version {found}, this program reads version {expected}");
            ResultsError::BadSummary { path, reason }
        }
        RecordError::Content { path, fault } => {
            ResultsError::BadSummary { path, reason: format!("line {}: {fault}", fault.line) }
        }
    })?;
    let MatchSettings { window_px, fit_window_px, .. } = summary.settings;
    if window_px.max(fit_window_px) > LARGEST_WINDOW_PX {
        let reason = format!("windows of {window_px} and {fit_window_px} px are impossible");
        return Err(ResultsError::BadSummary { path, reason });
    }
    let shares =
        [summary.answered, summary.leaves_image, summary.beyond_range, summary.no_texture, summary.ambiguous];
    let in_unit = |value: &f64| (0.0..=1.0).contains(value);
    let taus = [summary.tau_before, summary.tau_after];
    if !shares.iter().chain(&taus).all(in_unit) || summary.maximum_px < summary.minimum_px {
        let reason = "its shares, tau or range are impossible".to_owned();
        return Err(ResultsError::BadSummary { path, reason });
    }
    Ok(summary)
}
