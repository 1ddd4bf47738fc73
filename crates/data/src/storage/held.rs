//! A folder that is held open: it is known again whatever happens to its name.

use std::fs::{self, File, Metadata};
use std::io;
use std::path::{Path, PathBuf};

/// A folder that a program writes into for long.
///
/// Where the system allows it (Linux with `/proc`), it is reached through its handle. So what is written goes
/// into this folder, also after it was renamed, and never into another one that got its name.
#[derive(Debug)]
pub struct HeldFolder {
    handle: File,
    /// The name that it was opened by, or was given later.
    name: PathBuf,
}

impl HeldFolder {
    /// Opens the folder `name`.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn open(name: &Path) -> io::Result<Self> {
        Ok(Self { handle: File::open(name)?, name: name.to_owned() })
    }

    /// The same after this program has renamed it.
    pub fn renamed(self, name: &Path) -> Self {
        Self { name: name.to_owned(), ..self }
    }

    /// Its name, for messages.
    pub fn name(&self) -> &Path {
        &self.name
    }

    /// The path to it for the operating system.
    pub fn path(&self) -> PathBuf {
        match self.by_handle() {
            Some(path) if self.is_at(&path) => path,
            _ => self.name.clone(),
        }
    }

    /// Whether its name still leads to it.
    pub fn is_in_place(&self) -> bool {
        self.is_at(&self.name)
    }

    /// Its present name; `None` if it was removed, or is not where it was and the system does not tell where.
    pub fn whereabouts(&self) -> Option<PathBuf> {
        if self.is_in_place() {
            return Some(self.name.clone());
        }
        let told = fs::read_link(self.by_handle()?).ok()?;
        self.is_at(&told).then_some(told)
    }

    /// The link of the system that leads to the handle.
    fn by_handle(&self) -> Option<PathBuf> {
        #[cfg(target_os = "linux")]
        {
            let number = std::os::fd::AsRawFd::as_raw_fd(&self.handle);
            Some(PathBuf::from(format!("/proc/self/fd/{number}")))
        }
        #[cfg(not(target_os = "linux"))]
        None
    }

    fn is_at(&self, path: &Path) -> bool {
        fs::metadata(path).is_ok_and(|found| self.handle.metadata().is_ok_and(|own| is_same(&own, &found)))
    }
}

/// Whether both are of one file or folder; `true` where the system does not tell.
pub fn is_same(one: &Metadata, other: &Metadata) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        (one.dev(), one.ino()) == (other.dev(), other.ino())
    }
    #[cfg(not(unix))]
    {
        one.file_type() == other.file_type()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn it_is_written_under_any_name_and_nothing_else_is() {
        let place = tempfile::tempdir().unwrap();
        let [first, second] = ["first", "second"].map(|name| place.path().join(name));
        fs::create_dir(&first).unwrap();
        let held = HeldFolder::open(&first).unwrap();
        assert_eq!(held.whereabouts(), Some(first.clone()));
        fs::rename(&first, &second).unwrap();
        fs::create_dir(&first).unwrap();
        fs::write(held.path().join("file"), "own").unwrap();
        assert_eq!(fs::read_to_string(second.join("file")).unwrap(), "own");
        assert_eq!(fs::read_dir(&first).unwrap().count(), 0);
        assert_eq!(held.whereabouts(), Some(second.canonicalize().unwrap()));
        fs::remove_dir_all(&second).unwrap();
        assert_eq!(held.whereabouts(), None);
        assert!(fs::write(held.path().join("file"), "own").is_err());
    }
}
