//! The steps that the program does to a disk, one value each, so that each can be made to fail in a test.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::scratch::parent;
use super::{Scratch, Step};

/// Declares the steps once: as values, and as methods by which they are done.
macro_rules! steps {
    ($($(#[doc = $what:literal])+ $method:ident $step:ident($($argument:ident: $type:ty),+);)+) => {
        /// A step of a disk: as small as the operating system makes it.
        #[derive(Debug, Clone, Copy)]
        pub enum DiskStep<'a> {
            $($(#[doc = $what])+ $step($(&'a $type),+),)+
        }

        /// A disk, as the steps of which all writing consists.
        ///
        /// So ending the program between two of them, or letting one fail, tries every state that can occur. An
        /// interruption waits for the step under way, see [`Step`].
        ///
        /// # Errors
        /// All methods: what the operating system says.
        pub trait Disk: Send {
            /// Does a step.
            fn act(&mut self, step: DiskStep<'_>) -> io::Result<()>;

            $($(#[doc = $what])+ fn $method(&mut self, $($argument: &$type),+) -> io::Result<()> {
                self.act(DiskStep::$step($($argument),+))
            })+
        }
    };
}

steps! {
    /// Makes a folder.
    make_folder MakeFolder(path: Path);
    /// Makes a file of these bytes, in place of one that is there.
    write Write(path: Path, bytes: [u8]);
    /// Adds bytes to the end of a file that is there.
    append Append(path: Path, bytes: [u8]);
    /// Returns when a file, or the names in a folder, would survive a loss of power.
    sync Sync(path: Path);
    /// Gives a file or folder another name, in place of a file or an empty folder that has it.
    rename Rename(from: Path, to: Path);
    /// Gives a file another name; an error of kind `AlreadyExists` if the name is taken. Where the system has no
    /// such step, the name is looked at before, and what gets it in between is replaced.
    rename_new RenameNew(from: Path, to: Path);
    /// Exchanges two names, whatever they name, in one step; an error of kind `Unsupported` or `InvalidInput`
    /// where the file system knows no such step.
    exchange Exchange(one: Path, other: Path);
    /// Gives a file a second name; of a link, the file that it leads to.
    link Link(file: Path, name: Path);
    /// Cuts a file to so many bytes from its start.
    cut Cut(path: Path, bytes: u64);
    /// Removes a file.
    remove Remove(path: Path);
    /// Removes a folder with all that it holds.
    remove_folder RemoveFolder(path: Path);
}

/// The disk as it is.
#[derive(Debug, Clone, Copy, Default)]
pub struct RealDisk;

impl Disk for RealDisk {
    fn act(&mut self, step: DiskStep<'_>) -> io::Result<()> {
        use io::ErrorKind::{AlreadyExists, InvalidInput, NotFound, Unsupported};
        let _step = Step::begin();
        match step {
            DiskStep::MakeFolder(path) => fs::create_dir(path),
            DiskStep::Write(path, bytes) => {
                // A link that lies there may lead anywhere: it is replaced, not followed.
                match fs::remove_file(path) {
                    Err(error) if error.kind() != NotFound => return Err(error),
                    _ => {}
                }
                OpenOptions::new().write(true).create_new(true).open(path)?.write_all(bytes)
            }
            DiskStep::Append(path, bytes) => {
                not_following(OpenOptions::new().append(true)).open(path)?.write_all(bytes)
            }
            DiskStep::Sync(path) => File::open(path)?.sync_all(),
            DiskStep::Rename(from, to) => fs::rename(from, to),
            DiskStep::RenameNew(from, to) => match rename_in_one(from, to, false) {
                Err(error) if matches!(error.kind(), Unsupported | InvalidInput) => match is_there(to)? {
                    true => Err(AlreadyExists.into()),
                    false => fs::rename(from, to),
                },
                renamed => renamed,
            },
            DiskStep::Exchange(one, other) => rename_in_one(one, other, true),
            DiskStep::Link(file, name) => fs::hard_link(fs::canonicalize(file)?, name),
            DiskStep::Cut(path, &bytes) => {
                not_following(OpenOptions::new().write(true)).open(path)?.set_len(bytes)
            }
            DiskStep::Remove(path) => fs::remove_file(path),
            DiskStep::RemoveFolder(path) => fs::remove_dir_all(path),
        }
    }
}

/// Opens no link.
fn not_following(options: &mut OpenOptions) -> &mut OpenOptions {
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(options, rustix::fs::OFlags::NOFOLLOW.bits() as i32);
    options
}

/// Whether there is a folder, not a link to one, which may lead anywhere; `false` if there is nothing.
///
/// # Errors
/// What the operating system says; of kind `NotADirectory` if something else is there.
pub fn is_own_folder(path: &Path) -> io::Result<bool> {
    match fs::symlink_metadata(path) {
        Ok(metadata) if metadata.is_dir() => Ok(true),
        Ok(_) => Err(io::ErrorKind::NotADirectory.into()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Whether anything has this name. A name that cannot be examined is an error, not "no".
///
/// # Errors
/// What the operating system says.
pub fn is_there(path: &Path) -> io::Result<bool> {
    match fs::symlink_metadata(path) {
        Ok(_) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Renames to a free name or, to `exchange` them, to one that is taken; in one step.
#[cfg(target_os = "linux")]
fn rename_in_one(from: &Path, to: &Path, exchange: bool) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    let flags = if exchange { RenameFlags::EXCHANGE } else { RenameFlags::NOREPLACE };
    Ok(renameat_with(CWD, from, CWD, to, flags)?)
}

#[cfg(not(target_os = "linux"))]
fn rename_in_one(_: &Path, _: &Path, _: bool) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Why a new name may not survive a loss of power, although what it names is whole.
#[derive(Debug, Error)]
#[error("it is whole, but its folder could not be flushed to disk, so a loss of power may undo it ({0})")]
struct NotFlushed(#[source] io::Error);

/// Whether an error says that what was written has its name and is whole, and only the folder was not flushed.
pub fn is_in_place(error: &io::Error) -> bool {
    error.get_ref().is_some_and(|inner| inner.is::<NotFlushed>())
}

/// Advice for an error of the operating system while something is written.
pub fn advice(error: &io::Error) -> &'static str {
    use io::ErrorKind;
    match error.kind() {
        _ if is_in_place(error) => "check the disk",
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            "make room or choose another disk, then run the command again"
        }
        ErrorKind::FileTooLarge => "raise the limit of file sizes (ulimit -f), then run the command again",
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            "choose a folder you may write to, or ask for access"
        }
        ErrorKind::NotFound => "check the path",
        ErrorKind::NotADirectory => "give a folder",
        _ => "check the disk and the path, then run the command again",
    }
}

/// Flushes the folder of `path`, which has just got its name.
pub(super) fn sync_name(disk: &mut dyn Disk, path: &Path) -> io::Result<()> {
    disk.sync(parent(path)).map_err(|error| io::Error::new(error.kind(), NotFlushed(error)))
}

/// Writes a file so that its final name exists only when it is complete: temporary file, fsync, rename, fsync
/// of the folder. No interruption comes between.
///
/// # Errors
/// What the operating system says. What had the name before keeps it, unless the new file [is in
/// place](is_in_place).
pub fn write_whole(disk: &mut dyn Disk, path: &Path, bytes: &[u8]) -> io::Result<()> {
    let _step = Step::begin();
    let temporary = hidden(path, IN_THE_MAKING);
    let written = disk
        .write(&temporary, bytes)
        .and_then(|()| disk.sync(&temporary))
        .and_then(|()| disk.rename(&temporary, path));
    if let Err(error) = written {
        // The failure is returned; a part that stays behind is overwritten by the next attempt.
        let _ = disk.remove(&temporary);
        return Err(error);
    }
    sync_name(disk, path)
}

/// Writes a whole file, or nothing, if the name is free. Of two programs that write at once, one is refused, unless
/// the file system knows neither hard links nor a [renaming to free names](Disk::rename_new).
///
/// # Errors
/// What the operating system says; of kind `AlreadyExists` if the name is taken. There is no file, unless it [is in
/// place](is_in_place).
pub fn write_new(disk: &mut dyn Disk, path: &Path, bytes: &[u8]) -> io::Result<()> {
    // The file is made in a folder of its own, so that no other program uses its name.
    let scratch = Scratch::inside(parent(path))?;
    let made = scratch.path().join(path.file_name().unwrap_or(OsStr::new("file")));
    let _step = Step::begin();
    disk.write(&made, bytes)?;
    disk.sync(&made)?;
    match disk.link(&made, path) {
        // Some file systems have no hard links.
        Err(error)
            if matches!(error.kind(), io::ErrorKind::Unsupported | io::ErrorKind::PermissionDenied) =>
        {
            disk.rename_new(&made, path)?;
        }
        linked => linked?,
    }
    sync_name(disk, path)
}

/// How names of files in the making end.
const IN_THE_MAKING: &str = ".part";

/// Whether a file's name is that of one in the making: left by a killed program, if none is running.
pub fn is_in_the_making(name: &OsStr) -> bool {
    let name = name.to_string_lossy();
    name.starts_with('.') && name.ends_with(IN_THE_MAKING)
}

/// Whether a file's name is that of a note that an operating system leaves in folders that are looked at.
pub fn is_of_the_system(name: &OsStr) -> bool {
    let name = name.to_string_lossy();
    [".DS_Store", ".directory", "Thumbs.db", "desktop.ini"].contains(&&*name) || name.starts_with("._")
}

/// A hidden name beside `path`, with this ending.
pub(super) fn hidden(path: &Path, ending: &str) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(ending);
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::{DiskFault, FaultyDisk};

    type Write = fn(&mut dyn Disk, &Path, &[u8]) -> io::Result<()>;

    /// Lets each step fail in turn: either there is no file, or it is whole and the error says so.
    #[test]
    fn a_file_that_could_not_be_written_is_not_there_or_is_said_to_be() {
        let disk = |steps| FaultyDisk::new(DiskFault::Killed, steps);
        for (write, has_links) in [(write_whole as Write, true), (write_new, true), (write_new, false)] {
            // Written, flushed, named, and its folder flushed.
            for steps in 0..4 {
                let folder = tempfile::tempdir().unwrap();
                let path = folder.path().join("file");
                let mut disk = if has_links { disk(steps) } else { disk(steps).without_links() };
                let error = write(&mut disk, &path, b"whole").unwrap_err();
                assert_eq!(is_in_place(&error), steps == 3, "{steps}: {error}");
                assert_eq!(error.to_string().contains("it is whole"), steps == 3, "{steps}: {error}");
                match fs::read(&path) {
                    Ok(bytes) => assert!(steps == 3 && bytes == b"whole"),
                    Err(error) => assert!(steps < 3 && error.kind() == io::ErrorKind::NotFound),
                }
            }
        }
    }

    #[test]
    fn a_taken_name_is_refused() {
        let without_links = FaultyDisk::new(DiskFault::Killed, usize::MAX).without_links();
        for disk in [&mut RealDisk as &mut dyn Disk, &mut { without_links }] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("file");
            write_new(disk, &path, b"first").unwrap();
            let error = write_new(disk, &path, b"second").unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::AlreadyExists);
            assert_eq!(fs::read(&path).unwrap(), b"first");
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        }
    }
}
