//! Scratch folders: hidden beside their target, renamed when complete, removed when the work is given up.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::step::{Step, close};

/// How names of scratch folders begin.
const PREFIX: &str = ".epirig-";

/// Scratch folders that exist now, for an interruption that ends the program at once.
static EXISTING: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A hidden folder beside `target`, on the same file system, so that it can be renamed to `target`. It is
/// removed with its content when dropped.
///
/// It is locked while in use. One that a killed program has left is not locked, and the next program beside
/// it removes it.
#[derive(Debug)]
pub struct Scratch {
    path: PathBuf,
    /// The folder, open and locked; `None` on file systems without locks.
    _lock: Option<File>,
}

impl Scratch {
    /// Makes the folder, and the folders above `target` that are missing.
    ///
    /// # Errors
    /// The folder concerned and what the operating system said.
    pub fn beside(target: &Path) -> Result<Self, (PathBuf, io::Error)> {
        let parent = parent(target);
        Self::inside(parent).map_err(|error| (parent.to_owned(), error))
    }

    /// The same in the folder `parent`, which is made if it is missing.
    ///
    /// # Errors
    /// What the operating system said.
    pub fn inside(parent: &Path) -> io::Result<Self> {
        let _step = Step::begin();
        fs::create_dir_all(parent)?;
        remove_deserted(parent);
        loop {
            let path = tempfile::Builder::new().prefix(PREFIX).tempdir_in(parent)?.keep();
            match lock(&path) {
                Locked::Mine(lock) => {
                    existing().push(path.clone());
                    return Ok(Self { path, _lock: lock });
                }
                // Another program found it unlocked, and takes it for deserted.
                Locked::Taken | Locked::Gone => {}
            }
        }
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _step = Step::begin();
        // What cannot be removed now is by the next program that works here.
        let _ = fs::remove_dir_all(&self.path);
        existing().retain(|folder| *folder != self.path);
    }
}

/// For a program that ends now, and runs no destructors: lets no further step of the disk begin, waits for those under
/// way, and removes the scratch folders of all threads. Other threads that want to write wait from now on.
///
/// `false`: after `patience` the disk had not answered, and everything was left as it is.
pub fn abandon(patience: Duration) -> bool {
    let quiet = close(patience);
    if quiet {
        for folder in existing().drain(..) {
            // The program ends: the error has no reader.
            let _ = fs::remove_dir_all(folder);
        }
    }
    quiet
}

/// Whether a file's name is that of a scratch folder.
pub fn is_scratch(name: &std::ffi::OsStr) -> bool {
    name.to_string_lossy().starts_with(PREFIX)
}

/// Whether another program builds something in this scratch folder now.
pub fn is_writing(path: &Path) -> bool {
    matches!(lock(path), Locked::Taken)
}

/// Whether another program builds something beside `target` now.
pub(super) fn is_written_beside(target: &Path) -> bool {
    let entries = fs::read_dir(parent(target)).into_iter().flatten().flatten();
    entries.filter(|entry| is_scratch(&entry.file_name())).any(|entry| is_writing(&entry.path()))
}

/// The folder that `path` lies in.
pub fn parent(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

enum Locked {
    /// By this call; without a file where the file system knows no locks.
    Mine(Option<File>),
    Taken,
    Gone,
}

fn lock(path: &Path) -> Locked {
    let Ok(folder) = File::open(path) else { return Locked::Gone };
    match folder.try_lock() {
        // It may have been removed between its making and its locking.
        Ok(()) if path.exists() => Locked::Mine(Some(folder)),
        Ok(()) => Locked::Gone,
        Err(fs::TryLockError::WouldBlock) => Locked::Taken,
        Err(fs::TryLockError::Error(_)) => Locked::Mine(None),
    }
}

/// Removes what killed programs have left in `parent`.
fn remove_deserted(parent: &Path) {
    // A folder that cannot be listed fails when it is written to.
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if is_scratch(&entry.file_name()) && is_folder {
            // Without a lock it is not known whether it is in use.
            if let Locked::Mine(Some(_lock)) = lock(&entry.path()) {
                let _ = fs::remove_dir_all(entry.path());
            }
        }
    }
}

fn existing() -> MutexGuard<'static, Vec<PathBuf>> {
    EXISTING.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scratch_folders_vanish_when_dropped_and_deserted_ones_with_the_next() {
        let folder = tempfile::tempdir().unwrap();
        let entries = || fs::read_dir(folder.path()).unwrap().count();
        let scratch = Scratch::beside(&folder.path().join("target")).unwrap();
        fs::write(scratch.path().join("file"), "half").unwrap();
        assert_eq!(entries(), 1);
        // One that is in use is left alone.
        let second = Scratch::beside(&folder.path().join("target")).unwrap();
        assert_eq!(entries(), 2);
        assert!(is_writing(second.path()));
        drop((scratch, second));
        assert_eq!(entries(), 0);
        let deserted = folder.path().join(".epirig-killed");
        fs::create_dir_all(deserted.join("results")).unwrap();
        assert!(!is_writing(&deserted));
        drop(Scratch::beside(&folder.path().join("target")).unwrap());
        assert_eq!(entries(), 0);
    }
}
