//! Writing the folder of results.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use image::{GrayImage, ImageBuffer, ImageFormat, PixelWithColorType};
use serde::Serialize;

use super::place::check_target;
use super::read::format_of;
use super::writer::{Waiting, Writer, held};
use super::{ResultsError, ResultsKind};
use epirig_core::grid::Grid;
use epirig_data::formats::MapFacts;
use epirig_data::storage::{Disk, RealDisk, Scratch, hash, put_in_place, recover};

/// A picture as PNG, for the file `path`.
///
/// # Errors
/// [`ResultsError::Picture`] if it cannot be encoded.
pub fn encoded_picture<P>(path: &Path, picture: &ImageBuffer<P, Vec<u8>>) -> Result<Vec<u8>, ResultsError>
where
    P: PixelWithColorType<Subpixel = u8>,
{
    let mut bytes = Cursor::new(Vec::new());
    match picture.write_to(&mut bytes, ImageFormat::Png) {
        Ok(()) => Ok(bytes.into_inner()),
        Err(error) => Err(ResultsError::Picture { path: path.to_owned(), reason: error.to_string() }),
    }
}

/// A folder of results while it is written, beside its final place. [`ResultsFolder::commit`] moves it there
/// as a whole. If it is dropped before, nothing is left.
///
/// The record of the results is written last, with the hash of each other file, so that no file can be exchanged
/// unnoticed.
///
/// Files are written by a thread of their own, while the next ones are made. So a file that cannot be written
/// is an error of `commit`.
pub struct ResultsFolder {
    target: PathBuf,
    kind: ResultsKind,
    overwrite: bool,
    /// Comes before the folder that it writes to: it is dropped first.
    writer: Writer,
    scratch: Scratch,
    /// Hash of each file, by its name.
    files: Mutex<BTreeMap<String, String>>,
    record: Mutex<Option<Box<dyn Record>>>,
}

/// A record of results, without its files.
trait Record: Send {
    /// As JSON, with the hashes of `files` in it.
    fn with(&self, files: &BTreeMap<String, String>) -> serde_json::Result<String>;
}

impl<T: Serialize + Send> Record for T {
    fn with(&self, files: &BTreeMap<String, String>) -> serde_json::Result<String> {
        #[derive(Serialize)]
        struct Bound<'a, T> {
            #[serde(flatten)]
            record: &'a T,
            files: &'a BTreeMap<String, String>,
        }
        serde_json::to_string_pretty(&Bound { record: self, files })
    }
}

impl ResultsFolder {
    /// Prepares to write `target`. Fails before any work if `target` may not be written.
    ///
    /// # Errors
    /// [`ResultsError`] if `target` is not empty and `overwrite` is not set, if it holds anything but results
    /// of this kind, or if its parent cannot be written.
    pub fn create(target: &Path, kind: ResultsKind, overwrite: bool) -> Result<Self, ResultsError> {
        let mut disk = RealDisk;
        if target.file_name().is_none() {
            return Err(ResultsError::NoName(target.to_owned()));
        }
        recover(&mut disk, target).map_err(ResultsError::io("bring back", target))?;
        check_target(target, kind, overwrite)?;
        let refused = |path: &Path| ResultsError::io("make a folder in", path);
        let scratch = Scratch::beside(target).map_err(|(path, source)| refused(&path)(source))?;
        let building = scratch.path().join(BUILDING);
        disk.make_folder(&building).map_err(refused(&building))?;
        Ok(Self {
            target: target.to_owned(),
            kind,
            overwrite,
            writer: Writer::to(Box::new(disk)),
            scratch,
            files: Mutex::default(),
            record: Mutex::default(),
        })
    }

    /// Makes a folder for what is needed until the results are written, on the same disk. It is removed with this.
    ///
    /// # Errors
    /// [`ResultsError`] if it cannot be made.
    pub fn working_folder(&self) -> Result<PathBuf, ResultsError> {
        let folder = self.scratch.path().join(WORKING);
        RealDisk.make_folder(&folder).map_err(ResultsError::io("make a folder in", &folder))?;
        Ok(folder)
    }

    fn building(&self) -> PathBuf {
        self.scratch.path().join(BUILDING)
    }

    /// Writes `bytes` as file `name`, which may be in a subfolder.
    pub fn write(&self, name: &str, bytes: impl Into<Vec<u8>>) {
        let bytes = bytes.into();
        held(&self.files).insert(name.to_owned(), hash(&bytes));
        self.put(name, bytes);
    }

    fn put(&self, name: &str, bytes: Vec<u8>) {
        // Errors name the final place, not the temporary one.
        let (path, named) = (self.building().join(name), self.target.join(name));
        self.writer.write(Waiting { path, named, bytes });
    }

    /// Writes a map, and what its format can hold of `facts`; the extension of its name gives the format.
    ///
    /// # Errors
    /// [`ResultsError`] if the extension is unknown or the map cannot be encoded.
    pub fn write_map(&self, name: &str, map: &Grid<f32>, facts: &MapFacts) -> Result<(), ResultsError> {
        let path = self.target.join(name);
        let encoded = format_of(&path)?.encode_with(map, facts);
        self.write(name, encoded.map_err(|source| ResultsError::Format { path, source })?);
        Ok(())
    }

    /// Writes a picture as PNG.
    ///
    /// # Errors
    /// [`ResultsError`] if it cannot be encoded.
    pub fn write_picture<P>(&self, name: &str, picture: &ImageBuffer<P, Vec<u8>>) -> Result<(), ResultsError>
    where
        P: PixelWithColorType<Subpixel = u8>,
    {
        self.write(name, encoded_picture(&self.target.join(name), picture)?);
        Ok(())
    }

    /// Writes grey values as PNG.
    ///
    /// # Errors
    /// [`ResultsError`] if it cannot be encoded.
    pub fn write_grey(&self, name: &str, values: &Grid<u8>) -> Result<(), ResultsError> {
        let size = (values.columns() as u32, values.rows() as u32);
        let mask = GrayImage::from_raw(size.0, size.1, values.values().to_vec()).unwrap_or_default();
        self.write_picture(name, &mask)
    }

    /// Takes the record of the results, which [`commit`](Self::commit) writes.
    pub fn set_record(&self, record: impl Serialize + Send + 'static) {
        *held(&self.record) = Some(Box::new(record));
    }

    /// Writes the record, if there is one, waits until all files are written, moves the folder to its final
    /// place, and replaces what was there.
    ///
    /// # Errors
    /// [`ResultsError`] of the first file that could not be written, or of the move; the former folder stays
    /// if the new one cannot replace it.
    pub fn commit(mut self) -> Result<(), ResultsError> {
        if let Some(record) = held(&self.record).take() {
            let (name, kind) = (self.kind.summary(), self.kind);
            let text = record.with(&held(&self.files)).map_err(|error| ResultsError::BadSummary {
                path: self.target.join(name),
                reason: error.to_string(),
                kind,
            })?;
            self.put(name, (text + "\n").into_bytes());
        }
        let building = self.building();
        let mut disk = self.writer.finish()?;
        // The place may have been filled since the work began.
        check_target(&self.target, self.kind, self.overwrite)?;
        let placed = put_in_place(&mut **disk, &building, &self.target);
        placed.map_err(ResultsError::io("put in place", &self.target))
    }
}

/// Names of the folders in the scratch folder.
const BUILDING: &str = "results";
const WORKING: &str = "working";
