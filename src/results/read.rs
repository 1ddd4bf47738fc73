//! Reads results.

use std::fs;
use std::path::Path;

use serde::de::DeserializeOwned;

use super::{MatchSummary, ResultsError, ResultsKind};
use epirig_core::choice::Choice as _;
use epirig_core::grid::{Grid, MOST_PIXELS};
use epirig_data::formats::MapFormat;
use epirig_data::storage::{
    LARGEST_RECORD, RealDisk, RecordError, hash, is_scratch, read_file, read_named, record_in, recover,
};
use epirig_matcher::{LARGEST_WINDOW_PX, Validity};

/// Size of the largest map as uncompressed 64 bit numbers, in bytes.
pub(super) const LARGEST_MAP: u64 = 8 * MOST_PIXELS as u64 + (1 << 16);

/// Reads a map that a person names, which may also be a pipe; the extension of the file gives its format.
///
/// # Errors
/// [`ResultsError`] if the file cannot be read, or is not a map.
pub fn read_map(path: &Path) -> Result<Grid<f32>, ResultsError> {
    format_of(path)?;
    decoded(path, &read_named(path, LARGEST_MAP)?)
}

/// Names of the folders in the folder of a sequence that hold results of `epirig match`, sorted.
pub fn results_beside(sequence: &Path) -> Vec<String> {
    let entries = fs::read_dir(sequence).into_iter().flatten().flatten();
    let folders = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()));
    let matched = folders.filter(|entry| entry.path().join(ResultsKind::Match.summary()).is_file());
    let mut names: Vec<String> = matched.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.retain(|name| !is_scratch(name.as_ref()));
    names.sort();
    names
}

/// The format that the extension of a file gives.
pub(super) fn format_of(path: &Path) -> Result<MapFormat, ResultsError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    MapFormat::from_extension(&extension).ok_or_else(|| ResultsError::UnknownFormat(path.to_owned()))
}

/// The map in the bytes of the file `path`.
pub(super) fn decoded(path: &Path, bytes: &[u8]) -> Result<Grid<f32>, ResultsError> {
    let map = format_of(path)?.decode(bytes);
    map.map_err(|source| ResultsError::Format { path: path.to_owned(), source })
}

/// The grey picture of 8 bit in the bytes of the file `path`.
pub(super) fn grey(path: &Path, bytes: &[u8]) -> Result<Grid<u8>, ResultsError> {
    let wrong = |reason: String| ResultsError::Picture { path: path.to_owned(), reason };
    let image = image::load_from_memory_with_format(bytes, image::ImageFormat::Png);
    let grey = match image.map_err(|error| wrong(error.to_string()))? {
        image::DynamicImage::ImageLuma8(grey) => grey,
        _ => return Err(wrong("it is no grey picture of 8 bit".to_owned())),
    };
    let (rows, columns) = (grey.height() as usize, grey.width() as usize);
    Grid::from_values(rows, columns, grey.into_raw()).ok_or_else(|| wrong("its size is wrong".to_owned()))
}

/// The bytes of the record of the results of this kind in `folder`. Other results may take the place of these
/// at any time: all that is to be known of the record comes from one reading.
pub(super) fn record_bytes(folder: &Path, kind: ResultsKind) -> Result<Vec<u8>, ResultsError> {
    // A killed program may have left the results set aside.
    recover(&mut RealDisk, folder).map_err(ResultsError::io("bring back", folder))?;
    Ok(read_file(&folder.join(kind.summary()), LARGEST_RECORD)?)
}

/// The hash of the record of the results of this kind in `folder`, by which results made of them know them.
///
/// # Errors
/// [`ResultsError`] if it is missing or cannot be read.
pub fn record_hash(folder: &Path, kind: ResultsKind) -> Result<String, ResultsError> {
    Ok(hash(&record_bytes(folder, kind)?))
}

/// The record that these bytes are.
pub(super) fn parsed<T: DeserializeOwned>(
    folder: &Path,
    kind: ResultsKind,
    bytes: Vec<u8>,
) -> Result<T, ResultsError> {
    let bad = |path, reason| ResultsError::BadSummary { path, reason, kind };
    record_in(&folder.join(kind.summary()), bytes, kind.format()).map_err(|error| match error {
        RecordError::Read(error) => error.into(),
        RecordError::Version { path, found, expected } => {
            bad(path, format!("it has format version {found}, this program reads version {expected}"))
        }
        RecordError::Content { path, fault } => bad(path, format!("line {}: {fault}", fault.line)),
    })
}

/// What the bytes of `match.json` in `folder` say.
pub(super) fn summary_in(folder: &Path, bytes: Vec<u8>) -> Result<MatchSummary, ResultsError> {
    let kind = ResultsKind::Match;
    let summary: MatchSummary = parsed(folder, kind, bytes)?;
    let bad = |reason| ResultsError::BadSummary { path: folder.join(kind.summary()), reason, kind };
    let window_px = summary.settings.window_px;
    if window_px > LARGEST_WINDOW_PX {
        return Err(bad(format!("a window of {window_px} px is impossible")));
    }
    let shares = Validity::ALL.iter().map(|&validity| summary.share(validity));
    let in_unit = |value: f64| (0.0..=1.0).contains(&value);
    if !shares.chain([summary.tau_before, summary.tau_after]).all(in_unit)
        || summary.maximum_px < summary.minimum_px
    {
        return Err(bad("its shares, tau or range are impossible".to_owned()));
    }
    Ok(summary)
}
