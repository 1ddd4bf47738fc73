//! Records in JSON: which key of which line is wrong, and whether the version is ours.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::DeserializeOwned;
use thiserror::Error;

use super::ReadError;
use super::read::{read_file, text};

/// More than any record has, but for a journal, which grows with the frames.
pub const LARGEST_RECORD: u64 = 64 << 20;

/// Why a record is not understood.
#[derive(Debug, Error)]
pub enum RecordError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It is of another version of the format.
    #[error("{} has format version {found}, this program reads version {expected}", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// Version found; 0 if it tells none.
        found: u64,
        /// Version understood.
        expected: u32,
    },
    /// It is no such record.
    #[error("{}: {fault}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// The fault and its place.
        fault: RecordFault,
    },
}

/// A fault in the text of a record, and its place.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{key}{}{reason}", if key.is_empty() { "" } else { ": " })]
pub struct RecordFault {
    /// Line, from 1; 0 if it is not known.
    pub line: usize,
    /// Path of the key, such as `positions_mm[3]`; empty where the text itself is wrong.
    pub key: String,
    /// What is wrong.
    pub reason: String,
}

/// The record that a text is.
///
/// # Errors
/// The key and what is wrong with it.
///
/// ```
/// let fault = epirig_data::storage::parse_record::<Vec<u8>>("[1,\n\"two\"]").unwrap_err();
/// assert_eq!((fault.line, fault.key.as_str()), (2, "[1]"));
/// ```
pub fn parse_record<T: DeserializeOwned>(text: &str) -> Result<T, RecordFault> {
    let fault = |key: String, error: serde_json::Error| {
        let said = error.to_string();
        // The line is reported separately, and columns of a journal line are of no use.
        let reason = in_words(said.split(" at line ").next().unwrap_or_default());
        RecordFault { line: error.line(), key, reason }
    };
    // Some editors put a mark of its order of bytes before a text.
    let mut text = serde_json::Deserializer::from_str(text.trim_start_matches('\u{feff}'));
    let record = serde_path_to_error::deserialize(&mut text).map_err(|error| {
        let key = Some(error.path().to_string()).filter(|key| key != "." && error.inner().is_data());
        fault(key.unwrap_or_default(), error.into_inner())
    })?;
    text.end().map_err(|error| fault(String::new(), error))?;
    Ok(record)
}

/// What serde says, without names of types: they mean nothing to whoever reads a record.
fn in_words(said: &str) -> String {
    let Some((found, expected)) = said.split_once(", expected ") else { return said.to_owned() };
    let expected = match expected {
        "u8" => "a whole number from 0 to 255",
        "u16" => "a whole number from 0 to 65535",
        "u32" | "u64" | "usize" => "a whole number from 0 on",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "f32" | "f64" => "a number",
        "a boolean" => "true or false",
        "a sequence" => "a list",
        "a map" => "an object",
        other if other.starts_with("enum ") || other.starts_with("variant ") => "one of its words",
        other if ["struct ", "internally tagged ", "unit "].iter().any(|word| other.starts_with(word)) => {
            "an object"
        }
        other => other,
    };
    let found = match found {
        "invalid type: sequence" => "invalid type: list",
        "invalid type: map" => "invalid type: object",
        other => other,
    };
    format!("{found}, expected {expected}")
}

/// Reads a record of this version.
///
/// # Errors
/// [`RecordError`].
pub fn read_record<T: DeserializeOwned>(path: &Path, version: u32) -> Result<T, RecordError> {
    record_in(path, read_file(path, LARGEST_RECORD)?, version)
}

/// The record in `bytes`, which were read from `path`.
///
/// # Errors
/// [`RecordError`].
pub fn record_in<T: DeserializeOwned>(path: &Path, bytes: Vec<u8>, version: u32) -> Result<T, RecordError> {
    record_of_kinds::<T, serde::de::IgnoredAny>(path, bytes, version)
}

/// The same of a record with parts of one of several kinds. `Keys` has the keys of all kinds, each optional:
/// it finds which key is wrong, and where.
///
/// # Errors
/// [`RecordError`].
pub fn record_of_kinds<T: DeserializeOwned, Keys: DeserializeOwned>(
    path: &Path,
    bytes: Vec<u8>,
    version: u32,
) -> Result<T, RecordError> {
    /// The keys that all records have. Other keys of another version would only confuse.
    #[derive(Deserialize)]
    struct Head {
        #[serde(default)]
        format: u64,
    }
    let text = text(bytes, path)?;
    let content = |fault| RecordError::Content { path: path.to_owned(), fault };
    let head: Head = parse_record(&text).map_err(content)?;
    if head.format != u64::from(version) {
        return Err(RecordError::Version { path: path.to_owned(), found: head.format, expected: version });
    }
    parse_record(&text).map_err(|fault: RecordFault| {
        let closer = parse_record::<Keys>(&text).err().filter(|closer| closer.key.starts_with(&fault.key));
        content(closer.unwrap_or(fault))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Deserialize)]
    struct Inner {
        #[serde(rename = "number")]
        _number: u8,
    }

    #[derive(Debug, Deserialize)]
    struct Outer {
        #[serde(rename = "inner")]
        _inner: Vec<Inner>,
    }

    #[test]
    fn faults_say_where_they_are() {
        let fault = |text: &str| parse_record::<Outer>(text).unwrap_err();
        let wrong = fault("{\"inner\": [{\"number\": 1},\n{\"number\": -1}]}");
        assert_eq!((wrong.line, wrong.key.as_str()), (2, "inner[1].number"));
        assert!(wrong.reason.ends_with("`-1`, expected a whole number from 0 to 255"), "{wrong}");
        let missing = fault("{\"inner\": [{}]}");
        assert!(missing.to_string().contains("inner[0]: missing field `number`"), "{missing}");
        let torn = fault("{\"inner\": [\n");
        assert!(torn.key.is_empty() && torn.line == 2, "{torn:?}");
        assert!(fault("{\"inner\": []} more").reason.contains("trailing"));
        // Deep nesting ends at the parser's bound.
        assert!(fault(&"[".repeat(1_000_000)).line == 1);
    }

    #[test]
    fn versions_come_first() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("record.json");
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            read_record::<Outer>(&path, 2)
        };
        assert!(matches!(read("{\"format\": 1}"), Err(RecordError::Version { found: 1, expected: 2, .. })));
        assert!(matches!(read("{}"), Err(RecordError::Version { found: 0, .. })));
        assert!(matches!(read("{\"format\": 2}"), Err(RecordError::Content { .. })));
        assert!(read("{\"format\": 2, \"inner\": [], \"unknown\": 1}").is_ok());
    }
}
