//! The steps that the program does to a disk, one function each, so that each can be made to fail in a test.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::Step;
use super::scratch::parent;

/// A disk, as the steps of which all writing consists.
///
/// A step is as small as the operating system makes it. So ending the program between two of them, or letting
/// one fail, tries every state that can occur. An interruption waits for the step under way, see [`Step`].
pub trait Disk: Send {
    /// Makes a folder.
    ///
    /// # Errors
    /// What the operating system says, as in all methods.
    fn make_folder(&mut self, path: &Path) -> io::Result<()>;

    /// Makes a file of these bytes, in place of one that is there.
    ///
    /// # Errors
    /// See [`make_folder`](Self::make_folder).
    fn write(&mut self, path: &Path, bytes: &[u8]) -> io::Result<()>;

    /// Adds bytes to the end of a file that is there.
    ///
    /// # Errors
    /// See [`make_folder`](Self::make_folder).
    fn append(&mut self, path: &Path, bytes: &[u8]) -> io::Result<()>;

    /// Returns when a file, or the names in a folder, would survive a loss of power.
    ///
    /// # Errors
    /// See [`make_folder`](Self::make_folder).
    fn sync(&mut self, path: &Path) -> io::Result<()>;

    /// Gives a file or folder another name, in place of a file or an empty folder that has it.
    ///
    /// # Errors
    /// See [`make_folder`](Self::make_folder).
    fn rename(&mut self, from: &Path, to: &Path) -> io::Result<()>;

    /// Exchanges two names, whatever they name, in one step.
    ///
    /// # Errors
    /// See [`make_folder`](Self::make_folder); of kind `Unsupported` or `InvalidInput` where the file system
    /// knows no such step.
    fn exchange(&mut self, one: &Path, other: &Path) -> io::Result<()>;

    /// Gives a file a second name; of a link, the file that it leads to.
    ///
    /// # Errors
    /// See [`make_folder`](Self::make_folder).
    fn link(&mut self, file: &Path, name: &Path) -> io::Result<()>;

    /// Cuts a file to its first `bytes` bytes.
    ///
    /// # Errors
    /// See [`make_folder`](Self::make_folder).
    fn cut(&mut self, path: &Path, bytes: u64) -> io::Result<()>;

    /// Removes a file.
    ///
    /// # Errors
    /// See [`make_folder`](Self::make_folder).
    fn remove(&mut self, path: &Path) -> io::Result<()>;

    /// Removes a folder with all that it holds.
    ///
    /// # Errors
    /// See [`make_folder`](Self::make_folder).
    fn remove_folder(&mut self, path: &Path) -> io::Result<()>;
}

/// The disk as it is.
#[derive(Debug, Clone, Copy, Default)]
pub struct RealDisk;

impl Disk for RealDisk {
    fn make_folder(&mut self, path: &Path) -> io::Result<()> {
        let _step = Step::begin();
        fs::create_dir(path)
    }

    fn write(&mut self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        let _step = Step::begin();
        // A link that lies there may lead anywhere: it is replaced, not followed.
        match fs::remove_file(path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        OpenOptions::new().write(true).create_new(true).open(path)?.write_all(bytes)
    }

    fn append(&mut self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        let _step = Step::begin();
        not_following(OpenOptions::new().append(true)).open(path)?.write_all(bytes)
    }

    fn sync(&mut self, path: &Path) -> io::Result<()> {
        let _step = Step::begin();
        File::open(path)?.sync_all()
    }

    fn rename(&mut self, from: &Path, to: &Path) -> io::Result<()> {
        let _step = Step::begin();
        fs::rename(from, to)
    }

    fn exchange(&mut self, one: &Path, other: &Path) -> io::Result<()> {
        let _step = Step::begin();
        exchange(one, other)
    }

    fn link(&mut self, file: &Path, name: &Path) -> io::Result<()> {
        let _step = Step::begin();
        fs::hard_link(fs::canonicalize(file)?, name)
    }

    fn cut(&mut self, path: &Path, bytes: u64) -> io::Result<()> {
        let _step = Step::begin();
        not_following(OpenOptions::new().write(true)).open(path)?.set_len(bytes)
    }

    fn remove(&mut self, path: &Path) -> io::Result<()> {
        let _step = Step::begin();
        fs::remove_file(path)
    }

    fn remove_folder(&mut self, path: &Path) -> io::Result<()> {
        let _step = Step::begin();
        fs::remove_dir_all(path)
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

#[cfg(target_os = "linux")]
fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE)?)
}

#[cfg(not(target_os = "linux"))]
fn exchange(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Writes a file so that its final name exists only when it is complete: temporary file, fsync, rename, fsync
/// of the folder. No interruption comes between.
///
/// # Errors
/// What the operating system says. What had the name before keeps it.
pub fn write_whole(disk: &mut dyn Disk, path: &Path, bytes: &[u8]) -> io::Result<()> {
    let _step = Step::begin();
    let temporary = temporary(path);
    let written = disk
        .write(&temporary, bytes)
        .and_then(|()| disk.sync(&temporary))
        .and_then(|()| disk.rename(&temporary, path));
    if let Err(error) = written {
        // The failure is returned; a part that stays behind is overwritten by the next attempt.
        let _ = disk.remove(&temporary);
        return Err(error);
    }
    disk.sync(parent(path))
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

fn temporary(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(IN_THE_MAKING);
    path.with_file_name(name)
}
