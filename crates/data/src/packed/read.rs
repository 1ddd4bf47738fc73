//! Reading a packed volume, whole or some of its rows.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::PackedError;
use super::layout::{
    ARRAY, CHECKSUM, CHUNK_ROWS, FORMAT_VERSION, Group, METADATA, PackedRecord, Shard, array_text, shard_name,
};
use crate::storage::{LARGEST_RECORD, RecordError, open_file, parse_record, read_text};
use epirig_core::fault::Fault as _;
use epirig_core::frame::{Frame, Samples};
use epirig_core::progress::{Progress, Uncounted};
use epirig_core::rows::{RowSource, RowsError};
use epirig_core::tau::Tau;
use epirig_core::volume::{Filling, Volume, VolumeError, VolumeShape};

/// Rows of a frame that are read in one go, where all are wanted: some chunks.
const STRIP_ROWS: usize = 16 * CHUNK_ROWS;
/// What to do about a frame that is damaged.
const PACK_AGAIN: &str = "remove the volume, and run `epirig pack` again";

/// A packed volume that is whole.
#[derive(Debug)]
pub struct PackedVolume {
    folder: PathBuf,
    record: PackedRecord,
    shape: VolumeShape,
}

impl PackedVolume {
    /// Opens the volume `folder`.
    ///
    /// # Errors
    /// [`PackedError`] if there is none that is whole, or its record contradicts it.
    pub fn open(folder: &Path) -> Result<Self, PackedError> {
        let record = Self::record_of(folder)?;
        let shape = record.shape(folder)?;
        let path = folder.join(ARRAY).join(METADATA);
        let text = read_text(&path, LARGEST_RECORD).map_err(RecordError::from)?;
        // Whatever else an array may be, this one was written by us.
        let value = |text: &str| serde_json::from_str::<serde_json::Value>(text).ok();
        match value(&text) == value(&array_text(&shape)) {
            true => Ok(Self { folder: folder.to_owned(), record, shape }),
            false => Err(PackedError::contradiction(folder, "its array is not the one of its record")),
        }
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
        let frames: Vec<usize> = (0..self.shape.tau.frames()).collect();
        self.pieces(std::slice::from_ref(&rows), &frames, self.shape.tau.clone(), progress)
    }

    /// These rows of these frames, in their order, as a volume whose frames lie at `tau`. `progress` counts the frames.
    ///
    /// # Errors
    /// As [`rows`](Self::rows).
    ///
    /// # Panics
    /// If a row or a frame lies outside the volume, or `tau` has another number of frames.
    pub fn some_rows(
        &self,
        rows: &[usize],
        frames: &[usize],
        tau: Tau,
        progress: &dyn Progress,
    ) -> Result<Volume, PackedError> {
        let pieces: Vec<Range<usize>> =
            rows.chunk_by(|y, next| next == &(y + 1)).map(|piece| piece[0]..piece[0] + piece.len()).collect();
        self.pieces(&pieces, frames, tau, progress)
    }

    /// Equalises the brightness of frames as they are read, by a factor for each.
    ///
    /// # Panics
    /// If there are not as many factors as frames.
    pub fn set_frame_gains(&mut self, gains: Vec<f32>) {
        assert_eq!(gains.len(), self.shape.tau.frames());
        self.shape.frame_gains = gains;
    }

    /// These pieces of these frames, one below the other.
    fn pieces(
        &self,
        pieces: &[Range<usize>],
        frames: &[usize],
        tau: Tau,
        progress: &dyn Progress,
    ) -> Result<Volume, PackedError> {
        assert_eq!(tau.frames(), frames.len());
        let frame_gains = frames.iter().map(|&t| self.shape.frame_gains[t]).collect();
        let rows = pieces.iter().map(Range::len).sum();
        let mut volume = VolumeShape { tau, frame_gains, ..self.shape.clone() }.of_rows(rows);
        let filling = volume.filling();
        let put = |(place, &t): (usize, &usize)| -> Result<(), PackedError> {
            progress.unless_cancelled()?;
            put(&filling, place, &self.stored(t, pieces)?, self.shape.fine)?;
            progress.advance(1);
            Ok(())
        };
        // Of several frames that fail, the first in their order, whichever thread was faster.
        let failures = frames.par_iter().enumerate().filter_map(|frame| put(frame).err());
        match failures.find_first(|_| true) {
            Some(failure) => Err(failure),
            None => Ok(volume),
        }
    }

    /// These pieces of frame `t`, one below the other, as they are stored.
    fn stored(&self, t: usize, pieces: &[Range<usize>]) -> Result<Frame, PackedError> {
        let damaged = |reason: String| {
            let folder = self.folder.clone();
            PackedError::Frame { folder, frame: t, reason, advice: PACK_AGAIN }
        };
        let path = self.folder.join(shard_name(t));
        let mut file = open_file(&path).map_err(|error| damaged(error.to_string()))?;
        let depth = self.shape.stored_bit_depth();
        let row_bytes = self.shape.columns * if depth <= 8 { 1 } else { 2 };
        let mut asked = Vec::new();
        for rows in pieces {
            assert!(rows.start <= rows.end && rows.end <= self.shape.rows);
            let chunks = rows.start / CHUNK_ROWS..rows.end.div_ceil(CHUNK_ROWS);
            let data = data_of(&mut file, Shard::of(&self.shape), chunks.clone()).map_err(damaged)?;
            let first = (rows.start - chunks.start * CHUNK_ROWS) * row_bytes;
            asked.extend_from_slice(&data[first..first + rows.len() * row_bytes]);
        }
        let samples = match depth {
            ..=8 => Samples::U8(asked),
            _ => Samples::U16(
                asked.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect(),
            ),
        };
        let rows = pieces.iter().map(Range::len).sum();
        Ok(Frame::new(rows, self.shape.columns, depth, samples)?)
    }
}

impl RowSource for PackedVolume {
    fn shape(&self) -> VolumeShape {
        self.shape.clone()
    }

    fn rows(
        &self,
        rows: &[usize],
        frames: &[usize],
        tau: Tau,
        progress: &dyn Progress,
    ) -> Result<Volume, RowsError> {
        Ok(self.some_rows(rows, frames, tau, &Uncounted(progress))?)
    }

    fn each_row(&self, t: usize, take: &mut dyn FnMut(usize, &[f32])) -> Result<(), RowsError> {
        let mut row = vec![0.0; self.shape.columns];
        for first in (0..self.shape.rows).step_by(STRIP_ROWS) {
            let strip = first..(first + STRIP_ROWS).min(self.shape.rows);
            let read = || -> Result<Volume, PackedError> {
                // A volume has two frames at least.
                let (tau, frame_gains) = (Tau::equidistant(2)?, vec![self.shape.frame_gains[t]; 2]);
                let shape = VolumeShape { tau, frame_gains, ..self.shape.clone() };
                let mut volume = shape.of_rows(strip.len());
                let stored = self.stored(t, std::slice::from_ref(&strip))?;
                put(&volume.filling(), 0, &stored, self.shape.fine)?;
                Ok(volume)
            };
            let volume = read()?;
            for y in 0..strip.len() {
                volume.copy_row(y, 0, &mut row);
                take(first + y, &row);
            }
        }
        Ok(())
    }
}

impl From<PackedError> for RowsError {
    fn from(error: PackedError) -> Self {
        match error {
            PackedError::Cancelled(cancelled) => cancelled.into(),
            error => Self::Unread { message: error.message(), blame: error.blame() },
        }
    }
}

fn put(filling: &Filling<'_>, t: usize, frame: &Frame, fine: bool) -> Result<(), VolumeError> {
    if fine { filling.insert_counts(t, frame) } else { filling.insert(t, frame) }
}

/// The data of some chunks of a shard, or what is wrong with it.
fn data_of(file: &mut File, shard: Shard, chunks: Range<usize>) -> Result<Vec<u8>, String> {
    let (expected, end) = (shard.index(), shard.place(shard.chunks).start);
    let length = file.metadata().map_err(|error| error.to_string())?.len();
    if length != end + expected.len() as u64 {
        return Err(format!("it has {length} bytes, not {}", end + expected.len() as u64));
    }
    let mut read = |place: Range<u64>| -> Result<Vec<u8>, String> {
        let mut bytes = vec![0; (place.end - place.start) as usize];
        let found = file.seek(SeekFrom::Start(place.start)).and_then(|_| file.read_exact(&mut bytes));
        found.map(|()| bytes).map_err(|error| error.to_string())
    };
    if read(end..length)? != expected {
        return Err("its index was changed".to_owned());
    }
    let mut data = Vec::with_capacity(chunks.len() * shard.data);
    // Neighbouring chunks are one piece of the file.
    let bytes = read(shard.place(chunks.start).start..shard.place(chunks.end).start)?;
    for (chunk, bytes) in chunks.zip(bytes.chunks_exact(shard.data + CHECKSUM)) {
        let (own, checksum) = bytes.split_at(shard.data);
        if crc32c::crc32c(own).to_le_bytes() != checksum {
            return Err(format!("rows {} and on were changed", chunk * CHUNK_ROWS));
        }
        data.extend_from_slice(own);
    }
    Ok(data)
}
