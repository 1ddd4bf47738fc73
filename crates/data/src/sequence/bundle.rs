//! A sequence as one file for a colleague, who can repeat the measurement with it.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::Path;

use serde::Serialize;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::error::SequenceError;
use super::reader::{JOURNAL, LARGEST_JOURNAL, START, STOP, Sequence};
use super::record::FrameKind;
use crate::storage::{Disk as _, RealDisk, hash, is_in_the_making, is_scratch, read_inside};
use epirig_core::progress::Progress;

/// The list of the files, each with its hash.
const LIST: &str = "bundle.json";
/// More than any file beside the frames has.
const LARGEST_FILE: u64 = LARGEST_JOURNAL;

/// What a bundle holds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Bundle {
    /// Version of the program that made it.
    pub version: String,
    /// Name of the sequence.
    pub sequence_uid: String,
    /// BLAKE3 of each file, by its name in the folder of the sequence.
    pub files: BTreeMap<String, String>,
}

/// Writes `sequence` as the zip archive `out`: its records and all frames that they name, with a list of their
/// hashes. Frames are checked against the journal. `also` names files and folders of the sequence that go with it,
/// such as results; one that is not there is left out.
///
/// # Errors
/// [`SequenceError`] naming the file that cannot be used, or if `out` exists or cannot be written; there is no file
/// then.
pub fn bundle(
    sequence: &Sequence,
    also: &[&str],
    out: &Path,
    progress: &dyn Progress,
) -> Result<Bundle, SequenceError> {
    let frames: Vec<_> = sequence.frames().to_vec().into_iter().chain(calibration_frames(sequence)).collect();
    let mut others = vec![START.to_owned(), JOURNAL.to_owned()];
    others.extend(sequence.stop().map(|_| STOP.to_owned()));
    for name in also {
        add_files(sequence.folder(), name, &mut others)?;
    }
    let scratch = super::writer::scratch_beside(out)?;
    let (made, folder) = (scratch.path().join("bundle.zip"), sequence.name());
    let write = SequenceError::io("write", out);
    let mut bundle = Bundle {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        sequence_uid: sequence.record().uid.clone(),
        files: BTreeMap::new(),
    };
    progress.begin("bundling", (others.len() + frames.len()) as u64);
    let mut archive =
        Archive { writer: ZipWriter::new(File::create_new(&made).map_err(write)?), folder, out };
    let named = others.iter().map(|name| (name.as_str(), None));
    for (name, frame) in named.chain(frames.iter().map(|frame| (frame.file.as_str(), Some(frame)))) {
        progress.unless_cancelled()?;
        let bytes = match frame {
            Some(frame) => sequence.bytes(frame)?,
            None => read_inside(sequence.folder(), name, LARGEST_FILE)?,
        };
        archive.add(name, &bytes)?;
        bundle.files.insert(name.to_owned(), hash(&bytes));
        progress.advance(1);
    }
    let list = serde_json::to_vec_pretty(&bundle).map_err(|error| archive.failed(error.into()))?;
    archive.add(LIST, &list)?;
    archive.finish()?;
    let put = RealDisk.sync(&made).and_then(|()| RealDisk.rename_new(&made, out));
    put.map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => SequenceError::Exists(out.to_owned()),
        _ => SequenceError::io("write", out)(error),
    })?;
    progress.end();
    Ok(bundle)
}

fn calibration_frames(sequence: &Sequence) -> impl Iterator<Item = super::FrameRecord> {
    FrameKind::CALIBRATION.iter().flat_map(|&kind| sequence.calibration_frames(kind))
}

/// Adds the files of a file or folder `name` of the sequence, which is none of ours in the making.
fn add_files(root: &Path, name: &str, files: &mut Vec<String>) -> Result<(), SequenceError> {
    let path = root.join(name);
    if path.is_file() {
        files.push(name.to_owned());
    }
    if !path.is_dir() {
        return Ok(());
    }
    let mut entries = Vec::new();
    for entry in fs::read_dir(&path).map_err(SequenceError::io("look into", &path))? {
        let entry = entry.map_err(SequenceError::io("look into", &path))?.file_name();
        if !is_scratch(&entry) && !is_in_the_making(&entry) {
            entries.push(entry.to_string_lossy().into_owned());
        }
    }
    entries.sort();
    entries.into_iter().try_for_each(|entry| add_files(root, &format!("{name}/{entry}"), files))
}

struct Archive<'a> {
    writer: ZipWriter<File>,
    /// Folder of all files in it.
    folder: String,
    out: &'a Path,
}

impl Archive<'_> {
    fn failed(&self, error: io::Error) -> SequenceError {
        SequenceError::io("write", self.out)(error)
    }

    fn add(&mut self, name: &str, bytes: &[u8]) -> Result<(), SequenceError> {
        // Images are packed already. The same files give the same bytes: no time of writing.
        let method =
            if name.ends_with(".png") { CompressionMethod::Stored } else { CompressionMethod::Deflated };
        let options = SimpleFileOptions::default()
            .compression_method(method)
            .last_modified_time(DateTime::default())
            .large_file(bytes.len() as u64 > u32::MAX.into());
        let name = format!("{}/{name}", self.folder);
        let begun = self.writer.start_file(name, options).map_err(io::Error::from);
        begun.and_then(|()| self.writer.write_all(bytes)).map_err(|error| self.failed(error))
    }

    fn finish(self) -> Result<(), SequenceError> {
        let Self { writer, out, .. } = self;
        writer.finish().map(drop).map_err(|error| SequenceError::io("write", out)(error.into()))
    }
}
