//! Reads results.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use super::{FORMAT_VERSION, MatchSettings, MatchSummary, ResultsError, ResultsKind};
use epirig_core::grid::{Grid, MOST_PIXELS};
use epirig_data::formats::MapFormat;
use epirig_data::storage::{
    ReadError, RealDisk, RecordError, is_scratch, read_file, read_inside, read_named, read_record, recover,
};
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

/// Reads a grey picture, such as `mask.png`.
///
/// # Errors
/// [`ResultsError`] if it cannot be read, or is no grey picture of 8 bit.
pub fn read_grey(path: &Path) -> Result<Grid<u8>, ResultsError> {
    let wrong = |reason: String| ResultsError::Picture { path: path.to_owned(), reason };
    let bytes = read_file(path, LARGEST_MAP)?;
    let image = image::load_from_memory_with_format(&bytes, image::ImageFormat::Png);
    let grey = match image.map_err(|error| wrong(error.to_string()))? {
        image::DynamicImage::ImageLuma8(grey) => grey,
        _ => return Err(wrong("it is no grey picture of 8 bit".to_owned())),
    };
    let (rows, columns) = (grey.height() as usize, grey.width() as usize);
    Grid::from_values(rows, columns, grey.into_raw()).ok_or_else(|| wrong("its size is wrong".to_owned()))
}

/// The files of the results in `folder`, each with its size in bytes.
///
/// # Errors
/// [`ResultsError::Io`] if the folder cannot be looked into.
pub fn result_files(folder: &Path) -> Result<Vec<(String, u64)>, ResultsError> {
    let mut found = Vec::new();
    for name in ResultsKind::Match.names() {
        let path = folder.join(&name);
        match fs::symlink_metadata(&path) {
            Ok(facts) if facts.is_file() => found.push((name, facts.len())),
            Ok(_) => {}
            Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {}
            Err(source) => return Err(ResultsError::Io { action: "look at", path, source }),
        }
    }
    Ok(found)
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

/// The bytes of a file of the results in `folder`; `None` if results have no such file.
///
/// # Errors
/// [`ResultsError::Read`].
pub fn read_result(folder: &Path, name: &str) -> Result<Option<Vec<u8>>, ResultsError> {
    /// Of a surface as points: a few times the largest map.
    const LARGEST: u64 = 4 * LARGEST_MAP;
    match ResultsKind::Match.names().iter().any(|known| known == name) {
        true => Ok(Some(read_inside(folder, name, LARGEST)?)),
        false => Ok(None),
    }
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
    let shares = [
        summary.answered,
        summary.leaves_image,
        summary.beyond_range,
        summary.no_texture,
        summary.ambiguous,
        summary.outside,
    ];
    let in_unit = |value: &f64| (0.0..=1.0).contains(value);
    let taus = [summary.tau_before, summary.tau_after];
    if !shares.iter().chain(&taus).all(in_unit) || summary.maximum_px < summary.minimum_px {
        let reason = "its shares, tau or range are impossible".to_owned();
        return Err(ResultsError::BadSummary { path, reason });
    }
    Ok(summary)
}
