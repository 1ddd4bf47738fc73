//! Frames of Zarr arrays that other software wrote, version 2 or 3.

mod codecs;
mod metadata;

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::PackedError;
use crate::storage::{is_there, read_file};
use codecs::{Stored, strides};
use epirig_core::frame::{Frame, Samples};
use metadata::{ArrayMetadata, MOST_SAMPLES, RECORDS, array_record};

/// What to do about a frame that is damaged.
const WRITE_AGAIN: &str = "write the array again";
/// More bytes than a chunk may have.
const LARGEST_CHUNK: u64 = 1 << 31;

/// Whether a folder is a Zarr array or group.
pub fn is_zarr(folder: &Path) -> bool {
    RECORDS.iter().any(|name| is_there(&folder.join(name)).unwrap_or(false))
}

/// An array of frames x rows x columns, of uint8 or uint16; other dimensions have one element.
#[derive(Debug)]
pub struct ForeignArray {
    folder: PathBuf,
    metadata: ArrayMetadata,
    /// The dimensions of frames, rows and columns.
    dimensions: [usize; 3],
    /// The frames that were unpacked last: the number of their chunk, and bytes of frames x rows x columns.
    latest: Mutex<Option<(usize, Vec<u8>)>>,
}

impl ForeignArray {
    /// Opens the array `folder`; of a group its only array, or the whole resolution of its OME-NGFF image.
    ///
    /// # Errors
    /// [`PackedError::NoArray`], [`PackedError::Several`] or [`PackedError::Kind`].
    pub fn open(folder: &Path) -> Result<Self, PackedError> {
        let folder = array_in(folder)?;
        let record =
            array_record(&folder).ok_or_else(|| PackedError::no_array(&folder, "it has no record"))?;
        let metadata = ArrayMetadata::read(&record).map_err(|reason| match reason {
            metadata::Unread::Kind(found) => PackedError::Kind { folder: folder.clone(), found },
            metadata::Unread::Record(reason) => PackedError::no_array(&folder, reason),
        })?;
        let shape = &metadata.shape;
        let many: Vec<usize> = (0..shape.len()).filter(|&dimension| shape[dimension] > 1).collect();
        let dimensions = <[usize; 3]>::try_from(many).map_err(|_| {
            let found = format!("the shape {shape:?}");
            PackedError::Kind { folder: folder.clone(), found }
        })?;
        let [_, rows, columns] = dimensions.map(|dimension| shape[dimension]);
        if rows.checked_mul(columns).is_none_or(|pixels| pixels > MOST_SAMPLES) {
            let found = format!("frames of {rows} x {columns}, larger than any image");
            return Err(PackedError::Kind { folder, found });
        }
        Ok(Self { folder, metadata, dimensions, latest: Mutex::default() })
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.metadata.shape[self.dimensions[0]]
    }

    /// Frame `t`, of 8 or 16 bit.
    ///
    /// # Errors
    /// [`PackedError::Frame`] if it cannot be read.
    ///
    /// # Panics
    /// If there is no such frame.
    pub fn frame(&self, t: usize) -> Result<Frame, PackedError> {
        assert!(t < self.frames());
        let [frames, rows, columns] = self.dimensions.map(|dimension| self.metadata.shape[dimension]);
        let together = self.metadata.chunk[self.dimensions[0]];
        let (block, place) = (t / together, t % together);
        // Frames of one chunk are unpacked once.
        let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        if latest.as_ref().is_none_or(|(found, _)| *found != block) {
            *latest = None;
            let some = together.min(frames - block * together);
            let unpacked = self.block(block, some).map_err(|reason| {
                let folder = self.folder.clone();
                PackedError::Frame { folder, frame: t, reason, advice: WRITE_AGAIN }
            })?;
            *latest = Some((block, unpacked));
        }
        let size = rows * columns * self.metadata.sample_bytes;
        let bytes = latest.as_ref().map_or(&[][..], |(_, bytes)| &bytes[place * size..(place + 1) * size]);
        let (depth, samples) = match self.metadata.sample_bytes {
            1 => (8, Samples::U8(bytes.to_vec())),
            _ => {
                let pairs = bytes.chunks_exact(2);
                (16, Samples::U16(pairs.map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect()))
            }
        };
        Ok(Frame::new(rows, columns, depth, samples)?)
    }

    /// The first `some` frames of all chunks whose frames have the number `block`, or what is wrong with one.
    fn block(&self, block: usize, some: usize) -> Result<Vec<u8>, String> {
        let metadata = &self.metadata;
        let [_, rows, columns] = self.dimensions.map(|dimension| metadata.shape[dimension]);
        let [_, high, wide] = self.dimensions.map(|dimension| metadata.chunk[dimension]);
        let sample = metadata.sample_bytes;
        let [later, below, beside] = self.dimensions.map(|dimension| strides(&metadata.chunk)[dimension]);
        let mut out = room([some, rows, columns, sample])?;
        for across in 0..rows.div_ceil(high) {
            for along in 0..columns.div_ceil(wide) {
                let mut index = vec![0; metadata.shape.len()];
                let places = self.dimensions.into_iter().zip([block, across, along]);
                places.for_each(|(dimension, place)| index[dimension] = place);
                let chunk = self.chunk(&index)?;
                let (top, left) = (across * high, along * wide);
                for t in 0..some {
                    for y in 0..high.min(rows - top) {
                        let first = ((t * rows + top + y) * columns + left) * sample;
                        let to = out[first..].chunks_exact_mut(sample).take(wide.min(columns - left));
                        for (x, to) in to.enumerate() {
                            let from = (t * later + y * below + x * beside) * sample;
                            to.copy_from_slice(&chunk[from..from + sample]);
                        }
                    }
                }
            }
        }
        Ok(out)
    }

    /// The samples of a chunk; one that is not there has the fill value.
    fn chunk(&self, index: &[usize]) -> Result<Vec<u8>, String> {
        let metadata = &self.metadata;
        let name = metadata.chunk_name(index);
        let stored = match read_file(&self.folder.join(&name), LARGEST_CHUNK) {
            Ok(bytes) => Some(bytes),
            Err(error) if error.is_missing() => None,
            Err(error) => return Err(error.to_string()),
        };
        let what =
            Stored { shape: &metadata.chunk, sample_bytes: metadata.sample_bytes, fill: metadata.fill };
        match stored {
            Some(bytes) => {
                codecs::unpack(bytes, &metadata.codecs, what).map_err(|reason| format!("{name}: {reason}"))
            }
            None => Ok(what.filled()),
        }
    }
}

/// Zeros for so many bytes, if there is memory for them: their number comes from a record that may be wrong.
fn room(sizes: [usize; 4]) -> Result<Vec<u8>, String> {
    let bytes = sizes.into_iter().try_fold(1_usize, |product, size| product.checked_mul(size));
    let mut out = Vec::new();
    let reserved = bytes.and_then(|bytes| out.try_reserve_exact(bytes).ok().map(|()| bytes));
    let [frames, rows, columns, _] = sizes;
    let bytes =
        reserved.ok_or_else(|| format!("there is no memory for {frames} x {rows} x {columns} samples"))?;
    out.resize(bytes, 0);
    Ok(out)
}

/// The folder of the array that `folder` is or holds.
fn array_in(folder: &Path) -> Result<PathBuf, PackedError> {
    if array_record(folder).is_some() {
        return Ok(folder.to_owned());
    }
    let mut arrays = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(PackedError::io("look into", folder))? {
        let path = entry.map_err(PackedError::io("look into", folder))?.path();
        if array_record(&path).is_some() {
            arrays.push(path.file_name().unwrap_or_default().to_string_lossy().into_owned());
        }
    }
    arrays.sort();
    // Of an OME-NGFF image the first dataset, which is called 0 nearly everywhere, is the whole resolution.
    let is_whole = |name: &&String| *name == "0" || arrays.len() == 1;
    match arrays.iter().find(is_whole) {
        Some(name) => Ok(folder.join(name)),
        None if arrays.is_empty() => Err(PackedError::no_array(folder, "there is no array in it")),
        None => Err(PackedError::Several { folder: folder.to_owned(), arrays }),
    }
}
