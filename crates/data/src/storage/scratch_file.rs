//! A file without a name: gone when it is closed, whatever happens to the program.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::step::Step;

/// A file for numbers that are needed again soon and do not fit into memory.
#[derive(Debug)]
pub struct ScratchFile {
    file: Mutex<File>,
}

impl ScratchFile {
    /// Makes the file on the disk of `folder`, or in the folder for temporary files if nothing may be written
    /// there.
    ///
    /// # Errors
    /// What the operating system said.
    pub fn on_the_disk_of(folder: &Path) -> io::Result<Self> {
        let _step = Step::begin();
        let file = tempfile::tempfile_in(folder).or_else(|_| tempfile::tempfile())?;
        Ok(Self { file: Mutex::new(file) })
    }

    /// Writes `bytes` from byte `place` on.
    ///
    /// # Errors
    /// What the operating system said, such as that the disk is full.
    pub fn write_at(&self, bytes: &[u8], place: u64) -> io::Result<()> {
        let mut file = self.at(place)?;
        file.write_all(bytes)
    }

    /// Fills `bytes` with what stands from byte `place` on.
    ///
    /// # Errors
    /// What the operating system said; an error, too, if the file is shorter.
    pub fn read_at(&self, bytes: &mut [u8], place: u64) -> io::Result<()> {
        let mut file = self.at(place)?;
        file.read_exact(bytes)
    }

    fn at(&self, place: u64) -> io::Result<MutexGuard<'_, File>> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(place))?;
        Ok(file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_is_read_and_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let file = ScratchFile::on_the_disk_of(folder.path()).unwrap();
        file.write_at(b"late", 1000).unwrap();
        file.write_at(b"early", 0).unwrap();
        let mut bytes = [0; 4];
        file.read_at(&mut bytes, 1000).unwrap();
        assert_eq!(&bytes, b"late");
        assert!(file.read_at(&mut bytes, 1001).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
