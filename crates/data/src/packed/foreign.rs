//! Frames of Zarr arrays that other software wrote, version 2 or 3.

use std::path::{Path, PathBuf};

use zarrs::array::{Array, DataType};
use zarrs::array_subset::ArraySubset;
use zarrs::filesystem::FilesystemStore;

use super::PackedError;
use super::read::{open, samples};
use crate::storage::{is_there, read_text};
use epirig_core::frame::Frame;

/// Records of arrays and groups, by the versions of the specification.
const RECORDS: [&str; 3] = ["zarr.json", ".zarray", ".zgroup"];
/// More than any record of an array has.
const LARGEST_RECORD: u64 = 1 << 20;
/// What to do about a frame that is damaged.
const WRITE_AGAIN: &str = "write the array again";

/// Whether a folder is a Zarr array or group.
pub fn is_zarr(folder: &Path) -> bool {
    RECORDS.iter().any(|name| is_there(&folder.join(name)).unwrap_or(false))
}

/// An array of frames x rows x columns, of uint8 or uint16; other dimensions have one element.
pub struct ForeignArray {
    folder: PathBuf,
    array: Array<FilesystemStore>,
    /// The dimensions of frames, rows and columns.
    dimensions: [usize; 3],
    narrow: bool,
}

impl ForeignArray {
    /// Opens the array `folder`; of a group its only array, or the whole resolution of its OME-NGFF image.
    ///
    /// # Errors
    /// [`PackedError::NoArray`], [`PackedError::Several`] or [`PackedError::Kind`].
    pub fn open(folder: &Path) -> Result<Self, PackedError> {
        let folder = array_in(folder)?;
        let array = open(&folder, "/")?;
        let kind = |found: String| PackedError::Kind { folder: folder.clone(), found };
        let narrow = match array.data_type() {
            DataType::UInt8 => true,
            DataType::UInt16 => false,
            other => return Err(kind(format!("samples of the kind {other}"))),
        };
        let shape = array.shape();
        let many: Vec<usize> = (0..shape.len()).filter(|&dimension| shape[dimension] > 1).collect();
        let dimensions = <[usize; 3]>::try_from(many).map_err(|_| kind(format!("the shape {shape:?}")))?;
        Ok(Self { folder, array, dimensions, narrow })
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.array.shape()[self.dimensions[0]] as usize
    }

    /// Frame `t`, of 8 or 16 bit.
    ///
    /// # Errors
    /// [`PackedError::Frame`] if it cannot be read.
    pub fn frame(&self, t: usize) -> Result<Frame, PackedError> {
        let shape = self.array.shape();
        let mut ranges: Vec<_> = shape.iter().map(|&count| 0..count).collect();
        ranges[self.dimensions[0]] = t as u64..t as u64 + 1;
        let read = samples(&self.array, &ArraySubset::new_with_ranges(&ranges), self.narrow);
        let samples = read.map_err(|reason| {
            let folder = self.folder.clone();
            PackedError::Frame { folder, frame: t, reason, advice: WRITE_AGAIN }
        })?;
        let [_, rows, columns] = self.dimensions.map(|dimension| shape[dimension] as usize);
        Ok(Frame::new(rows, columns, if self.narrow { 8 } else { 16 }, samples)?)
    }
}

/// The folder of the array that `folder` is or holds.
fn array_in(folder: &Path) -> Result<PathBuf, PackedError> {
    let mut arrays = Vec::new();
    if is_array(folder) {
        return Ok(folder.to_owned());
    }
    let entries = std::fs::read_dir(folder).map_err(PackedError::io("look into", folder))?;
    for entry in entries {
        let path = entry.map_err(PackedError::io("look into", folder))?.path();
        if is_array(&path) {
            arrays.push(path.file_name().unwrap_or_default().to_string_lossy().into_owned());
        }
    }
    arrays.sort();
    // Of an OME-NGFF image the first dataset, which is called 0 nearly everywhere, is the whole resolution.
    if let Some(whole) =
        arrays.iter().find(|name| *name == "0").or_else(|| arrays.first().filter(|_| arrays.len() == 1))
    {
        return Ok(folder.join(whole));
    }
    match arrays.is_empty() {
        true => Err(PackedError::no_array(folder, "there is no array in it")),
        false => Err(PackedError::Several { folder: folder.to_owned(), arrays }),
    }
}

/// Whether a folder is an array by its record.
fn is_array(folder: &Path) -> bool {
    let says_array = |text: String| {
        let record: Option<serde_json::Value> = serde_json::from_str(&text).ok();
        record.is_some_and(|record| record["node_type"] == "array")
    };
    folder.join(RECORDS[1]).is_file()
        || read_text(&folder.join(RECORDS[0]), LARGEST_RECORD).is_ok_and(says_array)
}
