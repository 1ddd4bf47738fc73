//! Reading a packed volume, whole or some of its rows.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;
use zarrs::array::Array;
use zarrs::array_subset::ArraySubset;
use zarrs::filesystem::FilesystemStore;

use super::PackedError;
use super::layout::{ARRAY, FORMAT_VERSION, Group, METADATA, PackedRecord};
use crate::storage::{LARGEST_RECORD, RecordError, parse_record, read_text};
use epirig_core::frame::{Frame, Samples};
use epirig_core::progress::Progress;
use epirig_core::volume::{Volume, VolumeShape};

/// What to do about a frame that is damaged.
const PACK_AGAIN: &str = "remove the volume, and run `epirig pack` again";

/// A packed volume that is whole.
pub struct PackedVolume {
    folder: PathBuf,
    record: PackedRecord,
    shape: VolumeShape,
    array: Array<FilesystemStore>,
}

impl PackedVolume {
    /// Opens the volume `folder`.
    ///
    /// # Errors
    /// [`PackedError`] if there is none that is whole, or its record contradicts it.
    pub fn open(folder: &Path) -> Result<Self, PackedError> {
        let record = Self::record_of(folder)?;
        let array = open(folder, &format!("/{ARRAY}"))?;
        let bytes = if record.fine || record.bit_depth > 8 { 2 } else { 1 };
        let kind = array.data_type().fixed_size();
        let shape = match *array.shape() {
            [frames, rows, columns] if frames == record.tau.len() as u64 && kind == Some(bytes) => {
                let [rows, columns] = [rows, columns].map(usize::try_from);
                let size = rows.ok().zip(columns.ok());
                let (rows, columns) =
                    size.ok_or_else(|| PackedError::contradiction(folder, "its frames are too large"))?;
                record.shape(rows, columns, folder)?
            }
            _ => return Err(PackedError::contradiction(folder, "its array is not the one of its record")),
        };
        Ok(Self { folder: folder.to_owned(), record, shape, array })
    }

    /// The record of the volume `folder`.
    ///
    /// # Errors
    /// [`PackedError::Record`] if there is none, or it is not ours.
    pub fn record_of(folder: &Path) -> Result<PackedRecord, PackedError> {
        let path = folder.join(METADATA);
        let text = read_text(&path, LARGEST_RECORD).map_err(RecordError::from)?;
        let group: Group =
            parse_record(&text).map_err(|fault| RecordError::Content { path: path.clone(), fault })?;
        let (record, expected) = (group.attributes.epirig, FORMAT_VERSION);
        match record.format == expected {
            true => Ok(record),
            false => Err(RecordError::Version { path, found: record.format.into(), expected }.into()),
        }
    }

    /// What it is made of.
    pub fn record(&self) -> &PackedRecord {
        &self.record
    }

    /// Its shape.
    pub fn shape(&self) -> &VolumeShape {
        &self.shape
    }

    /// These rows of all frames. `progress` counts the frames.
    ///
    /// # Errors
    /// [`PackedError::Frame`] naming the first frame that is missing or damaged; [`PackedError::Cancelled`].
    ///
    /// # Panics
    /// If the rows lie outside the volume.
    pub fn rows(&self, rows: Range<usize>, progress: &dyn Progress) -> Result<Volume, PackedError> {
        assert!(rows.start <= rows.end && rows.end <= self.shape.rows);
        let mut volume = self.shape.of_rows(rows.len());
        let filling = volume.filling();
        let put = |t: usize| -> Result<(), PackedError> {
            progress.unless_cancelled()?;
            let frame = self.frame(t, rows.clone())?;
            match self.shape.fine {
                true => filling.insert_counts(t, &frame)?,
                false => filling.insert(t, &frame)?,
            }
            progress.advance(1);
            Ok(())
        };
        // Of several frames that fail, the first in their order, whichever thread was faster.
        let failures = (0..self.shape.tau.frames()).into_par_iter().filter_map(|t| put(t).err());
        match failures.find_first(|_| true) {
            Some(failure) => Err(failure),
            None => Ok(volume),
        }
    }

    /// These rows of frame `t`, as they are stored.
    fn frame(&self, t: usize, rows: Range<usize>) -> Result<Frame, PackedError> {
        let columns = self.shape.columns;
        let (t_range, y_range) = (t as u64..t as u64 + 1, rows.start as u64..rows.end as u64);
        let subset = ArraySubset::new_with_ranges(&[t_range, y_range, 0..columns as u64]);
        let depth = self.shape.stored_bit_depth();
        let samples = samples(&self.array, &subset, depth <= 8).and_then(|samples| {
            // A file that is missing counts as zeros in Zarr.
            let key = self.array.chunk_key(&[t as u64, 0, 0]);
            match self.folder.join(key.as_str()).is_file() {
                true => Ok(samples),
                false => Err("there is no file".to_owned()),
            }
        });
        let samples = samples.map_err(|reason| {
            let folder = self.folder.clone();
            PackedError::Frame { folder, frame: t, reason, advice: PACK_AGAIN }
        })?;
        Ok(Frame::new(rows.len(), columns, depth, samples)?)
    }
}

/// Opens an array of a folder.
pub(super) fn open(folder: &Path, path: &str) -> Result<Array<FilesystemStore>, PackedError> {
    let store = FilesystemStore::new(folder).map_err(|error| PackedError::no_array(folder, error))?;
    Array::open(Arc::new(store), path).map_err(|error| PackedError::no_array(folder, error))
}

/// The samples of a part of an array, or what the reader says.
pub(super) fn samples(
    array: &Array<FilesystemStore>,
    subset: &ArraySubset,
    narrow: bool,
) -> Result<Samples, String> {
    match narrow {
        true => array.retrieve_array_subset_elements(subset).map(Samples::U8),
        false => array.retrieve_array_subset_elements(subset).map(Samples::U16),
    }
    .map_err(|error| error.to_string())
}
