//! Resuming a sequence that was interrupted at any moment.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use super::error::SequenceError;
use super::lock::lock;
use super::reader::{JOURNAL, LARGEST_JOURNAL, STOP, Sequence, event};
use super::record::{Event, FrameKind};
use super::writer::SequenceWriter;
use crate::storage::{Disk, HeldFolder, is_in_the_making, read_file};
use epirig_core::choice::names;

impl SequenceWriter {
    /// Goes on with the sequence in `folder`: a journal line that was cut short is taken away, as are files
    /// in the making and the record of an earlier end.
    ///
    /// # Errors
    /// [`SequenceError`] if it is no sequence, another program writes it, or it cannot be read or written.
    pub fn resume_on(mut disk: Box<dyn Disk>, folder: &Path) -> Result<Self, SequenceError> {
        let held = HeldFolder::open(folder).map_err(SequenceError::io("open the folder", folder))?;
        let journal = lock(folder)?;
        let sequence = Sequence::open(folder)?;
        let journal_bytes = mend_journal(&mut *disk, &folder.join(JOURNAL))?;
        for place in std::iter::once("").chain(names::<FrameKind>()) {
            let place = folder.join(place);
            remove_unfinished(&mut *disk, &place).map_err(SequenceError::io("tidy up", &place))?;
        }
        let stop = folder.join(STOP);
        if stop.exists() {
            let removed = disk.remove(&stop).and_then(|()| disk.sync(folder));
            removed.map_err(SequenceError::io("remove", &stop))?;
        }
        let frames = sequence.events().iter().filter_map(Event::frame);
        let named = frames.map(|(kind, frame)| ((kind, frame.index), frame.bytes)).collect();
        let (folder, places) = (Arc::new(held), BTreeMap::new());
        let writer = Self { folder, places, disk, journal, journal_bytes, torn_bytes: 0, named };
        writer.check()?;
        tracing::info!(folder = %writer.folder.name().display(), frames = writer.named.len(), "sequence opened again");
        Ok(writer)
    }
}

/// Takes away a last line that was cut short, and ends one that lacks only its end. Returns the journal's
/// length.
fn mend_journal(disk: &mut dyn Disk, path: &Path) -> Result<u64, SequenceError> {
    let bytes = read_file(path, LARGEST_JOURNAL)?;
    let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
    let mut mend = || {
        if whole == bytes.len() {
            return Ok(whole as u64);
        }
        if event(&bytes[whole..]).is_ok() {
            disk.append(path, b"\n")?;
            disk.sync(path)?;
            return Ok(bytes.len() as u64 + 1);
        }
        disk.cut(path, &(whole as u64))?;
        disk.sync(path)?;
        Ok(whole as u64)
    };
    mend().map_err(SequenceError::io("mend", path))
}

fn remove_unfinished(disk: &mut dyn Disk, folder: &Path) -> std::io::Result<()> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        entries => entries?,
    };
    for entry in entries {
        let entry = entry?;
        if is_in_the_making(&entry.file_name()) {
            disk.remove(&entry.path())?;
        }
    }
    Ok(())
}
