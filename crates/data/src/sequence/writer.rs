//! Writing a sequence frame by frame, so that every frame in the journal is on disk.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::Path;
use std::sync::Arc;

use tracing::{debug, info};

use super::clock::now;
use super::error::SequenceError;
use super::lock::lock;
use super::pixels::encode_png;
use super::reader::{JOURNAL, START, STOP, Sequence};
use super::record::{
    CertificateRecord, ClosureRecord, Event, ExitStatus, ExposureRecord, FORMAT_VERSION, FrameKind,
    FrameRecord, Origin, SequenceRecord, StopRecord, TimesRecord,
};
use crate::storage::{Disk, HeldFolder, RealDisk, Scratch, hash, is_own_folder, put_in_place, write_whole};
use epirig_core::choice::Choice as _;
use epirig_core::frame::Frame;

/// What to do where frames are missing.
pub(super) const TAKE_AGAIN: &str = "put it back, or `epirig resume` takes the frames again";

/// Facts about a frame besides its pixels.
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
    /// Why it is good.
    pub certificate: Option<CertificateRecord>,
    /// File that the frame was made of.
    pub source: Option<String>,
    /// When the camera of an imported frame took it, by its own clock.
    pub taken: Option<jiff::civil::DateTime>,
}

/// Facts about the end of a sequence besides its status.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StopFacts {
    /// Why it ended before it was complete.
    pub reason: Option<String>,
    /// Findings of re-homing.
    pub closure: Option<ClosureRecord>,
    /// Where the time went.
    pub times: Option<TimesRecord>,
}

/// Writes a sequence: temporary file, fsync, rename, fsync of the folder, and only then the journal line.
///
/// It writes into the folder that it has made, or was given to resume, and nowhere else: before each file it
/// looks whether that folder and its journal are still the same.
pub struct SequenceWriter {
    pub(super) folder: Arc<HeldFolder>,
    /// Its folders of frames, as far as this writer has written into them.
    pub(super) places: BTreeMap<FrameKind, HeldFolder>,
    pub(super) disk: Box<dyn Disk>,
    /// Open and locked as long as this lives: a second program would mix its lines with ours.
    pub(super) journal: File,
    /// Length of the journal up to its latest whole line.
    pub(super) journal_bytes: u64,
    /// Length of a line that failed, of which any part may follow; 0 if none does.
    pub(super) torn_bytes: u64,
    /// The frames that the journal names, with the sizes of their files.
    pub(super) named: BTreeMap<(FrameKind, usize), u64>,
}

impl SequenceWriter {
    /// Makes the folder and its start record.
    ///
    /// # Errors
    /// [`SequenceError`] if the folder exists and is not empty, or cannot be written.
    pub fn create(folder: &Path, record: &SequenceRecord) -> Result<Self, SequenceError> {
        Self::create_on(Box::new(RealDisk), folder, record)
    }

    /// The same on a given disk.
    ///
    /// The folder is there with its start record and an empty journal, or not at all.
    ///
    /// # Errors
    /// As [`create`](Self::create).
    pub fn create_on(
        mut disk: Box<dyn Disk>,
        folder: &Path,
        record: &SequenceRecord,
    ) -> Result<Self, SequenceError> {
        refuse_existing(folder)?;
        let scratch = scratch_beside(folder)?;
        let building = scratch.path().join("sequence");
        let mut make = || {
            disk.make_folder(&building)?;
            disk.make_folder(&building.join(FrameKind::Scan.folder()))?;
            disk.write(&building.join(JOURNAL), b"")?;
            disk.sync(&building.join(JOURNAL))
        };
        make().map_err(SequenceError::io("make the folder", folder))?;
        write_record(&mut *disk, &building.join(START), record)?;
        let held = HeldFolder::open(&building).map_err(SequenceError::io("open the folder", folder))?;
        let journal = lock(&building)?;
        publish(&mut *disk, &building, folder)?;
        let held = Arc::new(held.renamed(folder));
        info!(folder = %folder.display(), uid = record.uid, frames = record.frames, "sequence begun");
        let (places, named) = (BTreeMap::new(), BTreeMap::new());
        Ok(Self { folder: held, places, disk, journal, journal_bytes: 0, torn_bytes: 0, named })
    }

    /// The folder, which may get another name while it is written.
    pub fn folder(&self) -> Arc<HeldFolder> {
        Arc::clone(&self.folder)
    }

    /// Adds the frame after the last one.
    ///
    /// # Errors
    /// [`SequenceError::Io`] if it cannot be written; the journal does not name it then.
    /// [`SequenceError::Disturbed`] if another program has changed the sequence.
    pub fn add(&mut self, frame: &Frame, facts: FrameFacts) -> Result<(), SequenceError> {
        self.put(FrameKind::Scan, self.next_index(), frame, facts)
    }

    /// Writes the frame `index`. One that is there is superseded.
    ///
    /// # Errors
    /// As [`SequenceWriter::add`].
    pub fn put(
        &mut self,
        kind: FrameKind,
        index: usize,
        frame: &Frame,
        facts: FrameFacts,
    ) -> Result<(), SequenceError> {
        let encoded = encode_png(frame).map_err(|error| SequenceError::Io {
            action: "encode",
            path: self.folder.name().join(kind.file(index)),
            source: std::io::Error::other(error),
        })?;
        self.put_encoded(kind, index, frame, &encoded, facts)
    }

    fn next_index(&self) -> usize {
        let scan = self.named.keys().filter(|(kind, _)| *kind == FrameKind::Scan);
        scan.map(|(_, index)| index + 1).max().unwrap_or(0)
    }

    /// Writes the frame `index` as the bytes of a grey PNG that decodes to `frame`.
    ///
    /// # Errors
    /// As [`SequenceWriter::add`].
    pub(super) fn put_encoded(
        &mut self,
        kind: FrameKind,
        index: usize,
        frame: &Frame,
        encoded: &[u8],
        facts: FrameFacts,
    ) -> Result<(), SequenceError> {
        self.check()?;
        self.make_place(kind)?;
        let name = kind.file(index);
        let written = write_whole(&mut *self.disk, &self.folder.path().join(&name), encoded);
        self.or_disturbed(written, &name)?;
        self.record(kind, index, frame, encoded, facts)
    }

    /// Adds the frame `index` as another name of the grey PNG `target`, whose bytes are `encoded`: no second
    /// copy is made.
    ///
    /// # Errors
    /// As [`SequenceWriter::add`]; and if both are not on the same file system.
    pub(super) fn put_link(
        &mut self,
        kind: FrameKind,
        index: usize,
        frame: &Frame,
        (target, encoded): (&Path, &[u8]),
        facts: FrameFacts,
    ) -> Result<(), SequenceError> {
        self.check()?;
        self.make_place(kind)?;
        let root = self.folder.path();
        let linked = self.disk.link(target, &root.join(kind.file(index)));
        let linked = linked.and_then(|()| self.disk.sync(&root.join(kind.folder())));
        linked.map_err(|source| SequenceError::CannotLink { path: target.to_owned(), source })?;
        self.record(kind, index, frame, encoded, facts)
    }

    /// The folder of such frames: made, if it is not there, and then the same to the end.
    fn make_place(&mut self, kind: FrameKind) -> Result<(), SequenceError> {
        let (root, name) = (self.folder.path(), kind.folder());
        let (place, told) = (root.join(name), self.folder.name().join(name));
        if let Some(place) = self.places.get(&kind) {
            let what = format!("{name} was removed or replaced");
            let is_in_place = place.is_in_place().map_err(SequenceError::io("look at", told))?;
            return if is_in_place { Ok(()) } else { Err(self.disturbed(what, TAKE_AGAIN)) };
        }
        if !is_own_folder(&place).map_err(SequenceError::io("write into", &told))? {
            let made = self.disk.make_folder(&place).and_then(|()| self.disk.sync(&root));
            self.or_disturbed(made, name)?;
        }
        let held = HeldFolder::open(&place).map_err(SequenceError::io("open the folder", &told))?;
        self.places.insert(kind, held);
        Ok(())
    }

    fn record(
        &mut self,
        kind: FrameKind,
        index: usize,
        frame: &Frame,
        encoded: &[u8],
        facts: FrameFacts,
    ) -> Result<(), SequenceError> {
        let record = FrameRecord {
            index,
            file: kind.file(index),
            blake3: hash(encoded),
            bytes: encoded.len() as u64,
            commanded_mm: facts.commanded_mm,
            reported_mm: facts.reported_mm,
            camera_sequence: facts.camera_sequence,
            exposure: facts.exposure,
            certificate: facts.certificate,
            supersedes: self.named.contains_key(&(kind, index)),
            written: now(),
            mean_dn: frame.samples().mean(),
            saturated: frame.samples().count_at_least(frame.full_scale()),
            source: facts.source,
            taken: facts.taken.map(|time| time.to_string()),
        };
        self.note(&match kind {
            FrameKind::Scan => Event::Frame(record),
            FrameKind::Dark => Event::Dark(record),
            FrameKind::Flat => Event::Flat(record),
            FrameKind::Board => Event::Board(record),
        })?;
        self.named.insert((kind, index), encoded.len() as u64);
        debug!(kind = kind.folder(), index, bytes = encoded.len(), "frame written");
        Ok(())
    }

    /// Adds a line to the journal.
    ///
    /// # Errors
    /// [`SequenceError::Io`] if it cannot be written; [`SequenceError::Disturbed`] if another program has
    /// changed the sequence.
    pub fn note(&mut self, event: &Event) -> Result<(), SequenceError> {
        self.check()?;
        let path = self.folder.path().join(JOURNAL);
        let mut line = serde_json::to_string(event).map_err(|error| {
            SequenceError::io("write", self.folder.name().join(JOURNAL))(std::io::Error::other(error))
        })?;
        line.push('\n');
        self.cut_torn().map_err(SequenceError::io("mend", self.folder.name().join(JOURNAL)))?;
        let written = self.disk.append(&path, line.as_bytes()).and_then(|()| self.disk.sync(&path));
        if written.is_err() {
            self.torn_bytes = line.len() as u64;
            // If this fails too, resuming mends it.
            let _ = self.cut_torn();
        } else {
            self.journal_bytes += line.len() as u64;
        }
        self.or_disturbed(written, JOURNAL)
    }

    /// Takes away what a line that failed has left: it would spoil the next one.
    fn cut_torn(&mut self) -> std::io::Result<()> {
        if self.torn_bytes > 0 {
            self.disk.cut(&self.folder.path().join(JOURNAL), &self.journal_bytes)?;
            self.torn_bytes = 0;
        }
        Ok(())
    }

    /// Writes how it ended. A sequence is complete only with all files that its journal names.
    ///
    /// # Errors
    /// [`SequenceError::Io`] if that cannot be written; [`SequenceError::Disturbed`] if another program has
    /// changed the sequence, [`SequenceError::Renamed`] if it has got another name.
    pub fn finish(mut self, exit_status: ExitStatus, facts: StopFacts) -> Result<(), SequenceError> {
        self.check()?;
        let whole = if exit_status == ExitStatus::Complete { self.check_frames() } else { Ok(()) };
        let (exit_status, reason) = match &whole {
            Ok(()) => (exit_status, facts.reason),
            Err(error) => (ExitStatus::Failed, Some(error.to_string())),
        };
        let record = StopRecord {
            format: FORMAT_VERSION,
            exit_status,
            frames: self.named.keys().filter(|(kind, _)| *kind == FrameKind::Scan).count(),
            reason,
            closure: facts.closure,
            times: facts.times,
            stopped: now(),
        };
        write_record(&mut *self.disk, &self.folder.path().join(STOP), &record)?;
        let (exit_status, frames, reason) = (exit_status.name(), record.frames, record.reason);
        info!(folder = %self.folder.name().display(), exit_status, frames, reason, "sequence ended");
        whole?;
        match self.folder.whereabouts() {
            Ok(Some(now)) if now != self.folder.name() => {
                Err(SequenceError::Renamed { folder: self.folder.name().to_owned(), now })
            }
            _ => Ok(()),
        }
    }
}

/// Refuses a folder that is there already, unless it is empty.
///
/// # Errors
/// [`SequenceError::Exists`], [`SequenceError::Unfinished`] or [`SequenceError::Link`] with its name,
/// [`SequenceError::NoName`] for a path that ends in none.
pub fn refuse_existing(folder: &Path) -> Result<(), SequenceError> {
    if folder.file_name().is_none() {
        return Err(SequenceError::NoName(folder.to_owned()));
    }
    // A link cannot change places with a folder, wherever it leads.
    let free = || match fs::symlink_metadata(folder).is_ok_and(|found| found.is_symlink()) {
        true => Err(SequenceError::Link(folder.to_owned())),
        false => Ok(()),
    };
    match fs::read_dir(folder) {
        Ok(mut entries) => match entries.next() {
            Some(_) if is_unfinished(folder) => Err(SequenceError::Unfinished(folder.to_owned())),
            Some(_) => Err(SequenceError::Exists(folder.to_owned())),
            None => free(),
        },
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => free(),
        Err(error) => Err(SequenceError::io("look into", folder)(error)),
    }
}

/// Whether a scan in this folder can be resumed.
fn is_unfinished(folder: &Path) -> bool {
    Sequence::open(folder).is_ok_and(|sequence| {
        let can_end = sequence
            .stop()
            .is_none_or(|stop| matches!(stop.exit_status, ExitStatus::Aborted | ExitStatus::Failed));
        can_end && matches!(sequence.record().origin, Origin::Captured { .. })
    })
}

pub(super) fn write_record(
    disk: &mut dyn Disk,
    path: &Path,
    record: &impl serde::Serialize,
) -> Result<(), SequenceError> {
    let text = serde_json::to_string_pretty(record)
        .map_err(|error| SequenceError::io("write", path)(std::io::Error::other(error)))?;
    write_whole(disk, path, (text + "\n").as_bytes()).map_err(SequenceError::io("write", path))
}

/// Gives a folder that is whole its final name.
pub(super) fn publish(disk: &mut dyn Disk, folder: &Path, out: &Path) -> Result<(), SequenceError> {
    // Something may have come there since it was looked at.
    refuse_existing(out)?;
    put_in_place(disk, folder, out).map_err(SequenceError::io("make the folder", out))
}

/// A hidden folder in which `out` is made.
pub(super) fn scratch_beside(out: &Path) -> Result<Scratch, SequenceError> {
    Scratch::beside(out).map_err(|(path, source)| SequenceError::Io {
        action: "make a folder in",
        path,
        source,
    })
}
