//! What a sequence does to a disk, step by step, so that each step can be made to fail.

mod faulty;

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

pub use faulty::{DiskFault, FaultyDisk};

/// The steps of which everything that a sequence writes consists.
///
/// A step is as small as the operating system makes it: whoever ends the program between two of them, or lets one of them
/// fail, meets all that can be met.
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

    /// Adds bytes to the end of a file, which is made if it is not there.
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
}

/// The disk as it is.
#[derive(Debug, Clone, Copy, Default)]
pub struct RealDisk;

impl Disk for RealDisk {
    fn make_folder(&mut self, path: &Path) -> io::Result<()> {
        fs::create_dir(path)
    }

    fn write(&mut self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        fs::write(path, bytes)
    }

    fn append(&mut self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        OpenOptions::new().create(true).append(true).open(path)?.write_all(bytes)
    }

    fn sync(&mut self, path: &Path) -> io::Result<()> {
        File::open(path)?.sync_all()
    }

    fn rename(&mut self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    fn cut(&mut self, path: &Path, bytes: u64) -> io::Result<()> {
        OpenOptions::new().write(true).open(path)?.set_len(bytes)
    }

    fn remove(&mut self, path: &Path) -> io::Result<()> {
        fs::remove_file(path)
    }
}

/// A file under its final name only when it is whole: temporary file, fsync, rename, fsync of the folder.
pub(super) fn write_whole(disk: &mut dyn Disk, path: &Path, bytes: &[u8]) -> io::Result<()> {
    let temporary = temporary(path);
    disk.write(&temporary, bytes)?;
    disk.sync(&temporary)?;
    disk.rename(&temporary, path)?;
    disk.sync(path.parent().unwrap_or(Path::new(".")))
}

/// How names of files in the making end.
pub(super) const IN_THE_MAKING: &str = ".part";

fn temporary(path: &Path) -> std::path::PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(IN_THE_MAKING);
    path.with_file_name(name)
}
