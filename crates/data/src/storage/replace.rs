//! Replacing one folder by another, so that at any moment one of the two is there.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::disk::{hidden, sync_name};
use super::scratch::is_written_beside;
use super::{Disk, Step, is_there};

/// Puts the folder `new` at `target`. The folder that was there, if any, is at `new` afterwards, for the
/// caller to remove.
///
/// The two are exchanged in one step where the file system can do that. Elsewhere the former folder is set
/// aside under a name that [`recover`] knows, so a program that is killed between the steps loses nothing.
///
/// # Errors
/// What the operating system said. What was there stays, unless the new one [is in place](super::is_in_place).
pub fn put_in_place(disk: &mut dyn Disk, new: &Path, target: &Path) -> io::Result<()> {
    let _step = Step::begin();
    sync_folders(disk, new)?;
    if !is_occupied(target)? {
        disk.rename(new, target)?;
        return sync_name(disk, target);
    }
    match disk.exchange(new, target) {
        Ok(()) => sync_name(disk, target),
        Err(error) if is_unknown(&error) => exchange_by_two_renames(disk, new, target),
        Err(error) => Err(error),
    }
}

fn exchange_by_two_renames(disk: &mut dyn Disk, new: &Path, target: &Path) -> io::Result<()> {
    let former = former(target);
    disk.rename(target, &former)?;
    if let Err(error) = disk.rename(new, target) {
        // If this fails, too, `recover` does it.
        let _ = disk.rename(&former, target);
        return Err(error);
    }
    sync_name(disk, target)?;
    disk.rename(&former, new)
}

/// Brings a folder back that was set aside when a program was killed, and removes it if the new one stands.
/// To be called before `target` is read or written.
///
/// # Errors
/// What the operating system said.
pub fn recover(disk: &mut dyn Disk, target: &Path) -> io::Result<()> {
    let former = former(target);
    // Another program that works beside it may be between its two renames.
    if !is_there(&former)? || is_written_beside(target) {
        return Ok(());
    }
    let _step = Step::begin();
    if is_occupied(target)? {
        return disk.remove_folder(&former);
    }
    disk.rename(&former, target)?;
    sync_name(disk, target)
}

/// The name under which the former `target` is set aside.
fn former(target: &Path) -> PathBuf {
    hidden(target, ".former")
}

/// Whether anything but an empty folder is there.
fn is_occupied(path: &Path) -> io::Result<bool> {
    match fs::read_dir(path) {
        Ok(mut entries) => Ok(entries.next().is_some()),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Whether an error says that file system or kernel have no exchange of names.
fn is_unknown(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::Unsupported | ErrorKind::InvalidInput)
}

/// Flushes the names in a folder and in those below it to disk. The files were flushed when they were
/// written.
fn sync_folders(disk: &mut dyn Disk, folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            sync_folders(disk, &entry.path())?;
        }
    }
    disk.sync(folder)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::{DiskFault, FaultyDisk, RealDisk, is_in_place};

    fn folder_of(path: &Path, text: &str) {
        fs::create_dir_all(path.join("deep")).unwrap();
        fs::write(path.join("deep/file"), text).unwrap();
    }

    fn content(path: &Path) -> Option<String> {
        fs::read_to_string(path.join("deep/file")).ok()
    }

    /// Lets each step fail in turn; after it either the former or the new folder is there, whole.
    fn fail_at_every_step(fault: DiskFault, exchanges: bool) -> usize {
        for steps in 0.. {
            let place = tempfile::tempdir().unwrap();
            let (new, target) = (place.path().join("new"), place.path().join("target"));
            folder_of(&target, "former");
            folder_of(&new, "new");
            let mut disk = FaultyDisk::new(fault, steps);
            if !exchanges {
                disk = disk.without_exchange();
            }
            let done = put_in_place(&mut disk, &new, &target);
            recover(&mut RealDisk, &target).unwrap();
            let now = content(&target);
            assert!(matches!(now.as_deref(), Some("former" | "new")), "{fault:?} at {steps}: {now:?}");
            if done.as_ref().is_err_and(is_in_place) {
                assert_eq!(now.as_deref(), Some("new"), "{fault:?} at {steps}");
            }
            if now.as_deref() == Some("new") && exchanges {
                assert!(done.is_ok() || done.as_ref().is_err_and(is_in_place), "{fault:?} at {steps}");
            }
            if done.is_ok() {
                assert_eq!(now.as_deref(), Some("new"));
                assert_eq!(content(&new).as_deref(), Some("former"));
                assert_eq!(fs::read_dir(place.path()).unwrap().count(), 2);
                return steps;
            }
            let _ = fs::remove_dir_all(&new);
            folder_of(&new, "newer");
            put_in_place(&mut RealDisk, &new, &target).unwrap();
            assert_eq!(content(&target).as_deref(), Some("newer"));
        }
        unreachable!()
    }

    #[test]
    fn whatever_step_fails_one_of_both_is_there() {
        for exchanges in [true, false] {
            // Two folders and their parent synced, and one exchange or three renames.
            assert_eq!(fail_at_every_step(DiskFault::Killed, exchanges), if exchanges { 4 } else { 6 });
            fail_at_every_step(DiskFault::Full, exchanges);
        }
    }

    #[test]
    fn an_empty_or_missing_place_is_taken() {
        let place = tempfile::tempdir().unwrap();
        let (new, target) = (place.path().join("new"), place.path().join("target"));
        for empty in [false, true] {
            folder_of(&new, "new");
            if empty {
                fs::create_dir(&target).unwrap();
            }
            put_in_place(&mut RealDisk, &new, &target).unwrap();
            assert_eq!(content(&target).as_deref(), Some("new"));
            fs::remove_dir_all(&target).unwrap();
        }
    }
}
