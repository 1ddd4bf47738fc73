//! Writing a packed volume: frame by frame, each once and whole, in any number of runs.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

use super::PackedError;
use super::layout::{ARRAY, METADATA, PackedRecord, Shard, array_text, group_text, shard_name};
use super::read::PackedVolume;
use crate::storage::{Disk, RealDisk, Scratch, is_there, open_file, read_record, write_whole};
use epirig_core::frame::Samples;
use epirig_core::volume::VolumeShape;

/// The record of a volume that is not whole. It is locked by the program that packs.
const IN_THE_MAKING: &str = "packing.json";

/// Packs one volume. The group's record, by which readers know it, comes last.
pub struct PackWriter {
    folder: PathBuf,
    disk: Box<dyn Disk>,
    record: PackedRecord,
    shard: Shard,
    /// Samples of a frame.
    samples: usize,
    /// Locked as long as this lives.
    _lock: File,
}

impl PackWriter {
    /// Begins the volume `folder`, or goes on with it where an earlier run was interrupted. A volume of the same
    /// sequence by another calibration, or of other frames, is replaced.
    ///
    /// # Errors
    /// [`PackedError::Taken`] if something else is there, [`PackedError::Busy`] if another program packs it,
    /// [`PackedError::Io`] if it cannot be written.
    pub fn begin(folder: &Path, record: PackedRecord, shape: &VolumeShape) -> Result<Self, PackedError> {
        Self::begin_on(Box::new(RealDisk), folder, record, shape)
    }

    /// The same on a given disk.
    ///
    /// # Errors
    /// As [`begin`](Self::begin).
    pub fn begin_on(
        mut disk: Box<dyn Disk>,
        folder: &Path,
        record: PackedRecord,
        shape: &VolumeShape,
    ) -> Result<Self, PackedError> {
        let marker = folder.join(IN_THE_MAKING);
        let is_there = |path: &Path| is_there(path).map_err(PackedError::io("look at", path));
        let held = is_there(&marker)?.then(|| lock(folder, &marker)).transpose()?;
        let is_same =
            |_: &File| read_record(&marker, record.format).is_ok_and(|found: PackedRecord| found == record);
        let held = match held.filter(is_same) {
            Some(held) => held,
            None => {
                if is_there(folder)? && !is_there(&marker)? && !is_replaceable(folder, &record)? {
                    return Err(PackedError::Taken(folder.to_owned()));
                }
                make(&mut *disk, folder, &record, array_text(shape).as_bytes())?;
                lock(folder, &marker)?
            }
        };
        let (shard, samples) = (Shard::of(shape), shape.rows * shape.columns);
        Ok(Self { folder: folder.to_owned(), disk, record, shard, samples, _lock: held })
    }

    /// Whether frame `t` is packed already.
    ///
    /// # Errors
    /// [`PackedError::Io`] if the disk does not say.
    pub fn has(&self, t: usize) -> Result<bool, PackedError> {
        let path = self.path(t);
        is_there(&path).map_err(PackedError::io("look at", path))
    }

    /// Packs frame `t`: its samples as the volume stores them, rows x columns.
    ///
    /// # Errors
    /// [`PackedError::Io`] if it cannot be written; there is no part of it then.
    ///
    /// # Panics
    /// If the samples are of another kind or number than the volume's.
    pub fn put(&mut self, t: usize, samples: Samples) -> Result<(), PackedError> {
        assert_eq!(samples.len(), self.samples);
        let mut data = match samples {
            Samples::U8(values) => values,
            Samples::U16(values) => values.into_iter().flat_map(u16::to_le_bytes).collect(),
        };
        let Shard { chunks, data: size } = self.shard;
        // The last chunk may reach beyond the image.
        data.resize(chunks * size, 0);
        let mut bytes = Vec::with_capacity(data.len() + chunks * 32);
        for chunk in data.chunks_exact(size) {
            bytes.extend_from_slice(chunk);
            bytes.extend(crc32c::crc32c(chunk).to_le_bytes());
        }
        bytes.extend(self.shard.index());
        self.put_file(&self.path(t), &bytes)
    }

    /// Ends the volume: from now on it is read.
    ///
    /// # Errors
    /// [`PackedError::Frame`] if a frame was not packed, [`PackedError::Io`] if the record cannot be written.
    pub fn finish(mut self) -> Result<(), PackedError> {
        for t in 0..self.record.tau.len() {
            if !self.has(t)? {
                let (folder, reason) = (self.folder.clone(), "it was not packed".to_owned());
                return Err(PackedError::Frame {
                    folder,
                    frame: t,
                    reason,
                    advice: "run `epirig pack` again",
                });
            }
        }
        let (path, text) = (self.folder.join(METADATA), group_text(&self.record));
        self.put_file(&path, text.as_bytes())?;
        let marker = self.folder.join(IN_THE_MAKING);
        self.disk.remove(&marker).map_err(PackedError::io("remove", marker))
    }

    /// The file of frame `t`.
    fn path(&self, t: usize) -> PathBuf {
        self.folder.join(shard_name(t))
    }

    /// Writes a whole file, with the folders that it needs.
    fn put_file(&mut self, path: &Path, bytes: &[u8]) -> Result<(), PackedError> {
        let missing = path.ancestors().skip(1).take_while(|folder| !folder.is_dir());
        let missing: Vec<&Path> = missing.collect();
        missing.into_iter().rev().try_for_each(|folder| make_folder(&mut *self.disk, folder))?;
        write_whole(&mut *self.disk, path, bytes).map_err(PackedError::io("write", path))
    }
}

fn make_folder(disk: &mut dyn Disk, folder: &Path) -> Result<(), PackedError> {
    disk.make_folder(folder).map_err(PackedError::io("make the folder", folder))
}

/// Whether a folder without a volume in the making may be replaced: it is empty, or a volume of the same sequence.
fn is_replaceable(folder: &Path, record: &PackedRecord) -> Result<bool, PackedError> {
    let mut entries = std::fs::read_dir(folder).map_err(PackedError::io("look into", folder))?;
    let found = PackedVolume::record_of(folder);
    Ok(entries.next().is_none() || found.is_ok_and(|found| found.sequence_uid == record.sequence_uid))
}

/// Makes a volume without frames in place of what is there: beside it first, so that a folder is never between two
/// states.
fn make(
    disk: &mut dyn Disk,
    folder: &Path,
    record: &PackedRecord,
    metadata: &[u8],
) -> Result<(), PackedError> {
    let scratch = Scratch::beside(folder);
    let scratch = scratch.map_err(|(path, source)| PackedError::io("make a folder in", path)(source))?;
    let (new, former) = (scratch.path().join("new"), scratch.path().join("former"));
    let text = serde_json::to_vec(record).map_err(std::io::Error::other);
    let text = text.map_err(PackedError::io("write", folder))?;
    let files = [(new.join(IN_THE_MAKING), text), (new.join(ARRAY).join(METADATA), metadata.to_vec())];
    make_folder(disk, &new)?;
    make_folder(disk, &new.join(ARRAY))?;
    for (path, bytes) in files {
        write_whole(disk, &path, &bytes).map_err(PackedError::io("write", &path))?;
    }
    if is_there(folder).map_err(PackedError::io("look at", folder))? {
        disk.rename(folder, &former).map_err(PackedError::io("replace", folder))?;
    }
    disk.rename(&new, folder).map_err(PackedError::io("make the folder", folder))
}

/// Locks the marker against other programs, if the file system has locks.
fn lock(folder: &Path, marker: &Path) -> Result<File, PackedError> {
    let file = open_file(marker).map_err(|error| PackedError::Record(error.into()))?;
    match file.try_lock() {
        Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(PackedError::Busy(folder.to_owned())),
    }
}
