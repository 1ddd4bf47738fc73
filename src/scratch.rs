//! Folders in the making: hidden beside their place, renamed when whole, removed when the work is given up.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Scratch folders that exist now, for whoever has to end the program at once.
static EXISTING: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A hidden folder beside `target`, on the same file system, so that what is built in it can be renamed to `target`.
/// Dropped, it is removed with all that it holds.
#[derive(Debug)]
pub struct Scratch {
    folder: tempfile::TempDir,
}

impl Scratch {
    /// Makes the folder, and the folders above `target` that are missing.
    ///
    /// # Errors
    /// The folder concerned and what the operating system said.
    pub fn beside(target: &Path) -> Result<Self, (PathBuf, std::io::Error)> {
        let parent =
            target.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let make = || {
            std::fs::create_dir_all(parent)?;
            tempfile::Builder::new().prefix(".epirig-").tempdir_in(parent)
        };
        let folder = make().map_err(|error| (parent.to_owned(), error))?;
        existing().push(folder.path().to_owned());
        Ok(Self { folder })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Removes the scratch folders of all threads: for a program that was told to end now and runs no destructors.
    pub fn remove_all() {
        for folder in existing().drain(..) {
            // Nobody is left to be told.
            let _ = std::fs::remove_dir_all(folder);
        }
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        existing().retain(|folder| folder != self.folder.path());
    }
}

fn existing() -> std::sync::MutexGuard<'static, Vec<PathBuf>> {
    EXISTING.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scratch_folders_vanish_when_dropped_and_when_told() {
        let folder = tempfile::tempdir().unwrap();
        let entries = || std::fs::read_dir(folder.path()).unwrap().count();
        let scratch = Scratch::beside(&folder.path().join("target")).unwrap();
        std::fs::write(scratch.path().join("file"), "half").unwrap();
        assert_eq!(entries(), 1);
        drop(scratch);
        assert_eq!(entries(), 0);
        let scratch = Scratch::beside(&folder.path().join("target")).unwrap();
        std::fs::write(scratch.path().join("file"), "half").unwrap();
        Scratch::remove_all();
        assert_eq!(entries(), 0);
    }
}
