//! The files of results as they are read: each must be the one whose hash stands in their record.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::Deserialize;

use super::kind::ResultsKind;
use super::maps::{Look, MapRow, ResultMap};
use super::read::{LARGEST_MAP, decoded, grey, parsed, record_bytes, summary_in};
use super::{MatchSummary, ResultsError};
use epirig_core::grid::Grid;
use epirig_data::storage::{hash, is_there, read_inside};

/// Bytes of the largest file: a few times the largest map.
const LARGEST_FILE: u64 = 4 * LARGEST_MAP;

/// Results of one kind in a folder. Their record holds the hash of each file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResultFiles {
    folder: PathBuf,
    kind: ResultsKind,
    /// Hash of each file, by its name.
    files: BTreeMap<String, String>,
    /// Hash of the record itself.
    record: String,
}

/// What every record has of its files.
#[derive(Deserialize)]
struct Bound {
    files: BTreeMap<String, String>,
    /// Hash of the record of the results that these were made of; `None` if they were made of no results.
    #[serde(default)]
    matched_blake3: Option<String>,
}

/// What `compare.json` tells of its maps.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct CompareFacts {
    /// Uid of the first sequence.
    pub first_uid: String,
    /// Uid of the second sequence.
    pub second_uid: String,
    /// Width of a pixel, in mm.
    pub pixel_mm: f64,
    /// Column and row where x and y are zero.
    pub origin_px: (f64, f64),
}

impl ResultFiles {
    /// The results of this kind in `folder`.
    ///
    /// # Errors
    /// [`ResultsError`] if their record is missing, of another version, or invalid.
    pub fn open(folder: &Path, kind: ResultsKind) -> Result<Self, ResultsError> {
        Ok(Self::of(folder, kind, record_bytes(folder, kind)?)?.0)
    }

    /// Those of `epirig match`, with their summary.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_match(folder: &Path) -> Result<(Self, MatchSummary), ResultsError> {
        let bytes = record_bytes(folder, ResultsKind::Match)?;
        let summary = summary_in(folder, bytes.clone())?;
        Ok((Self::of(folder, ResultsKind::Match, bytes)?.0, summary))
    }

    /// Those of `epirig compare`, with what `compare.json` tells of their maps.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_compare(folder: &Path) -> Result<(Self, CompareFacts), ResultsError> {
        let kind = ResultsKind::Compare;
        let bytes = record_bytes(folder, kind)?;
        let facts = parsed(folder, kind, bytes.clone())?;
        Ok((Self::of(folder, kind, bytes)?.0, facts))
    }

    /// The results whose record these bytes are.
    fn of(folder: &Path, kind: ResultsKind, bytes: Vec<u8>) -> Result<(Self, Bound), ResultsError> {
        let record = hash(&bytes);
        let mut bound: Bound = parsed(folder, kind, bytes)?;
        let files = std::mem::take(&mut bound.files);
        Ok((Self { folder: folder.to_owned(), kind, files, record }, bound))
    }

    /// The surface that `epirig surface` has put beside these results; `None` if there is none.
    ///
    /// # Errors
    /// [`ResultsError`] if its record cannot be read, or is of other results.
    pub fn surface(&self) -> Result<Option<Self>, ResultsError> {
        let (folder, kind) = (self.folder.join("surface"), ResultsKind::Surface);
        let path = folder.join(kind.summary());
        if !is_there(&path).map_err(ResultsError::io("look at", &path))? {
            return Ok(None);
        }
        let (surface, bound) = Self::of(&folder, kind, record_bytes(&folder, kind)?)?;
        match bound.matched_blake3.as_ref() == Some(&self.record) {
            true => Ok(Some(surface)),
            false => {
                let reason = format!("it is of other results than {}", self.folder.display());
                Err(ResultsError::BadSummary { path, reason, kind })
            }
        }
    }

    /// Hash of the record.
    pub fn record_hash(&self) -> &str {
        &self.record
    }

    /// Hash of a file, as the record has it; `None` if there is no such file among the results.
    pub fn hash_of(&self, name: &str) -> Option<&str> {
        self.files.get(name).map(String::as_str)
    }

    /// The bytes of a file or of the record; `None` if it is not there.
    ///
    /// # Errors
    /// [`ResultsError::Changed`] if it is another one than when it was written; [`ResultsError::Read`].
    pub fn bytes(&self, name: &str) -> Result<Option<Vec<u8>>, ResultsError> {
        let record = (name == self.kind.summary()).then_some(&self.record);
        let Some(wanted) = record.or(self.files.get(name)) else { return Ok(None) };
        match read_inside(&self.folder, name, LARGEST_FILE) {
            Ok(bytes) if hash(&bytes) == *wanted => Ok(Some(bytes)),
            Ok(_) => Err(ResultsError::Changed { path: self.folder.join(name), kind: self.kind }),
            Err(error) if error.is_missing() => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// A map of this kind of results, of classes as their grey values; `None` if it is not there.
    ///
    /// # Errors
    /// As [`bytes`](Self::bytes); [`ResultsError::Format`] or [`ResultsError::Picture`] if it is no map.
    pub fn map(&self, map: ResultMap) -> Result<Option<Grid<f32>>, ResultsError> {
        let MapRow { file, look, .. } = map.row();
        let Some(bytes) = self.bytes(file)? else { return Ok(None) };
        let path = self.folder.join(file);
        Ok(Some(match look {
            Look::Classes(_) => grey(&path, &bytes)?.map(f32::from),
            _ => decoded(&path, &bytes)?,
        }))
    }

    /// A map that the results are nothing without.
    ///
    /// # Errors
    /// As [`map`](Self::map), and [`ResultsError::Missing`].
    pub fn needed_map(&self, map: ResultMap) -> Result<Grid<f32>, ResultsError> {
        self.map(map)?.ok_or_else(|| self.missing(map.row().file))
    }

    /// The files that are there, the record first, each with its size in bytes.
    pub fn sizes(&self) -> Vec<(String, u64)> {
        let names = [self.kind.summary()].into_iter().chain(self.files.keys().map(String::as_str));
        let size = |name: &str| {
            let facts = fs::symlink_metadata(self.folder.join(name)).ok()?;
            facts.is_file().then(|| (name.to_owned(), facts.len()))
        };
        names.filter_map(size).collect()
    }

    /// Compares all files with their hashes: what is wrong with each that differs or is missing.
    pub fn check(&self) -> Vec<ResultsError> {
        let wrong = |name: &String| match self.bytes(name) {
            Ok(Some(_)) => None,
            Ok(None) => Some(self.missing(name)),
            Err(error) => Some(error),
        };
        self.files.par_iter().filter_map(|(name, _)| wrong(name)).collect()
    }

    fn missing(&self, name: &str) -> ResultsError {
        ResultsError::Missing { path: self.folder.join(name), kind: self.kind }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    /// As another `epirig match --overwrite` does meanwhile.
    #[test]
    fn files_and_hash_are_of_one_record_while_it_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (record, made) = (folder.path().join("match.json"), folder.path().join("made"));
        let format = ResultsKind::Match.format();
        let text =
            |files: &str| format!("{{\"format\": {format}, \"files\": {{\"cost.tiff\": \"{files}\"}}}}");
        let records = ["one", "other"].map(|files| (files, hash(text(files).as_bytes())));
        let replace = |files: &str| {
            fs::write(&made, text(files)).unwrap();
            fs::rename(&made, &record).unwrap();
        };
        replace("one");
        let ended = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !ended.load(Ordering::SeqCst) {
                    records.iter().for_each(|(files, _)| replace(files));
                }
            });
            let opened: Vec<_> =
                (0..2000).map(|_| ResultFiles::open(folder.path(), ResultsKind::Match)).collect();
            ended.store(true, Ordering::SeqCst);
            for files in opened.into_iter().map(Result::unwrap) {
                let of = files.hash_of("cost.tiff").unwrap();
                assert!(records.contains(&(of, files.record_hash().to_owned())), "{of}");
            }
        });
    }
}
