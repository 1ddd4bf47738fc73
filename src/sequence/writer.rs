//! Making a sequence, frame by frame, so that what the journal names is on disk.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::error::SequenceError;
use super::pixels::encode_png;
use super::record::{
    Event, ExitStatus, ExposureRecord, FORMAT_VERSION, FrameRecord, SequenceRecord, StopRecord,
};
use crate::frame::Frame;

/// What is known of a frame besides its pixels.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FrameFacts {
    /// Position that was asked for, in mm.
    pub commanded_mm: Option<f64>,
    /// Position that the stage reported, in mm.
    pub reported_mm: Option<f64>,
    /// The camera's own count of frames.
    pub camera_sequence: Option<u32>,
    /// How it was taken.
    pub exposure: Option<ExposureRecord>,
    /// File that the frame was made of.
    pub source: Option<String>,
}

/// Writes a new sequence: temporary file, fsync, rename, fsync of the folder, and only then the journal line.
#[derive(Debug)]
pub struct SequenceWriter {
    folder: PathBuf,
    journal: File,
    frames: usize,
}

impl SequenceWriter {
    /// Makes the folder and its start record.
    ///
    /// # Errors
    /// [`SequenceError`] if the folder exists and is not empty, or cannot be written.
    pub fn create(folder: &Path, record: &SequenceRecord) -> Result<Self, SequenceError> {
        refuse_existing(folder)?;
        let frames = folder.join("frames");
        fs::create_dir_all(&frames).map_err(SequenceError::io("make the folder", &frames))?;
        write_record(&folder.join("sequence.json"), record)?;
        let path = folder.join("journal.jsonl");
        let journal = OpenOptions::new().create_new(true).append(true).open(&path);
        let journal = journal.map_err(SequenceError::io("write", &path))?;
        Ok(Self { folder: folder.to_owned(), journal, frames: 0 })
    }

    /// Adds the next frame.
    ///
    /// # Errors
    /// [`SequenceError::Io`] if it cannot be written; the journal does not name it then.
    pub fn add(&mut self, frame: &Frame, facts: FrameFacts) -> Result<(), SequenceError> {
        let encoded = encode_png(frame).map_err(|error| SequenceError::Io {
            action: "encode",
            path: self.folder.join(frame_file(self.frames)),
            source: std::io::Error::other(error),
        })?;
        self.add_encoded(frame, &encoded, facts)
    }

    /// Adds the next frame as the bytes of a grey PNG that decodes to `frame`.
    ///
    /// # Errors
    /// As [`SequenceWriter::add`].
    pub(super) fn add_encoded(
        &mut self,
        frame: &Frame,
        encoded: &[u8],
        facts: FrameFacts,
    ) -> Result<(), SequenceError> {
        let path = self.folder.join(frame_file(self.frames));
        write_atomically(&path, encoded)?;
        self.record(frame, encoded, facts)
    }

    /// Adds the next frame as a symbolic link to the grey PNG `target`, whose bytes are `encoded`.
    ///
    /// # Errors
    /// As [`SequenceWriter::add`].
    pub(super) fn add_link(
        &mut self,
        frame: &Frame,
        target: &Path,
        encoded: &[u8],
        facts: FrameFacts,
    ) -> Result<(), SequenceError> {
        let path = self.folder.join(frame_file(self.frames));
        link(target, &path).map_err(SequenceError::io("link", &path))?;
        self.record(frame, encoded, facts)
    }

    fn record(&mut self, frame: &Frame, encoded: &[u8], facts: FrameFacts) -> Result<(), SequenceError> {
        let event = Event::Frame(FrameRecord {
            index: self.frames,
            file: frame_file(self.frames),
            blake3: blake3::hash(encoded).to_hex().to_string(),
            bytes: encoded.len() as u64,
            commanded_mm: facts.commanded_mm,
            reported_mm: facts.reported_mm,
            camera_sequence: facts.camera_sequence,
            exposure: facts.exposure,
            written: now(),
            mean_dn: frame.samples().mean(),
            saturated: frame.samples().count_at_least(frame.full_scale()),
            source: facts.source,
        });
        let path = self.folder.join("journal.jsonl");
        let mut line = serde_json::to_string(&event)
            .map_err(|error| SequenceError::io("write", &path)(std::io::Error::other(error)))?;
        line.push('\n');
        let written = self.journal.write_all(line.as_bytes()).and_then(|()| self.journal.sync_data());
        written.map_err(SequenceError::io("write", &path))?;
        self.frames += 1;
        Ok(())
    }

    /// Writes how it ended.
    ///
    /// # Errors
    /// [`SequenceError::Io`] if that cannot be written.
    pub fn finish(self, exit_status: ExitStatus) -> Result<(), SequenceError> {
        let record = StopRecord { format: FORMAT_VERSION, exit_status, frames: self.frames, stopped: now() };
        write_record(&self.folder.join("stop.json"), &record)
    }
}

/// A fresh name for a sequence, and the time.
pub(crate) fn new_uid() -> String {
    uuid::Uuid::now_v7().to_string()
}

/// The time, as in RFC 3339.
pub(crate) fn now() -> String {
    jiff::Timestamp::now().to_string()
}

pub(crate) fn refuse_existing(folder: &Path) -> Result<(), SequenceError> {
    match fs::read_dir(folder) {
        Ok(mut entries) => match entries.next() {
            Some(_) => Err(SequenceError::Exists { path: folder.to_owned() }),
            None => Ok(()),
        },
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(SequenceError::io("look into", folder)(error)),
    }
}

fn frame_file(index: usize) -> String {
    format!("frames/{index:04}.png")
}

pub(super) fn write_record(path: &Path, record: &impl serde::Serialize) -> Result<(), SequenceError> {
    let text = serde_json::to_string_pretty(record)
        .map_err(|error| SequenceError::io("write", path)(std::io::Error::other(error)))?;
    write_atomically(path, (text + "\n").as_bytes())
}

fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), SequenceError> {
    let write = || {
        let mut file = atomic_write_file::AtomicWriteFile::open(path)?;
        file.write_all(bytes)?;
        file.commit()
    };
    write().map_err(SequenceError::io("write", path))
}

#[cfg(unix)]
fn link(target: &Path, path: &Path) -> std::io::Result<()> {
    std::os::unix::fs::symlink(fs::canonicalize(target)?, path)
}

#[cfg(not(unix))]
fn link(target: &Path, path: &Path) -> std::io::Result<()> {
    fs::hard_link(target, path)
}
