//! Reading results back.

use std::fs;
use std::path::Path;

use super::{FORMAT_VERSION, MatchSummary, ResultsError};
use crate::formats::MapFormat;
use crate::plane::Plane;

/// Reads a map, whose format the file's ending tells.
///
/// # Errors
/// [`ResultsError`] if the file cannot be read, or is no map.
pub fn read_map(path: &Path) -> Result<Plane<f32>, ResultsError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let format = MapFormat::from_extension(&extension)
        .ok_or_else(|| ResultsError::UnknownFormat { path: path.to_owned() })?;
    let bytes = read(path)?;
    format.decode(&bytes).map_err(|source| ResultsError::Format { path: path.to_owned(), source })
}

/// Reads `match.json` of a folder of results.
///
/// # Errors
/// [`ResultsError`] if it is missing, of another version or not to be understood.
pub fn read_summary(folder: &Path) -> Result<MatchSummary, ResultsError> {
    let path = folder.join("match.json");
    let bytes = read(&path)?;
    let bad = |reason: String| ResultsError::BadSummary { path: path.clone(), reason };
    let summary: MatchSummary = serde_json::from_slice(&bytes).map_err(|error| bad(error.to_string()))?;
    if summary.format == FORMAT_VERSION {
        Ok(summary)
    } else {
        Err(bad(format!("format version {}, not {FORMAT_VERSION}", summary.format)))
    }
}

fn read(path: &Path) -> Result<Vec<u8>, ResultsError> {
    fs::read(path).map_err(|source| ResultsError::Io { action: "read", path: path.to_owned(), source })
}
