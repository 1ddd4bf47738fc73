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
            Some(path) if self.is_at(&path).unwrap_or(false) => path,
            _ => self.name.clone(),
        }
    }

    /// Whether its name still leads to it.
    ///
    /// # Errors
    /// What the operating system says, if it does not tell.
    pub fn is_in_place(&self) -> io::Result<bool> {
        self.is_at(&self.name)
    }

    /// Its present name; `None` if it was removed, or is not where it was and the system does not tell where.
    ///
    /// # Errors
    /// What the operating system says, as of a disk that is away for a moment: the folder may be in its place.
    pub fn whereabouts(&self) -> io::Result<Option<PathBuf>> {
        if self.is_in_place()? {
            return Ok(Some(self.name.clone()));
        }
        match self.by_handle().and_then(|link| fs::read_link(link).ok()) {
            Some(told) if self.is_at(&told)? => Ok(Some(told)),
            _ => Ok(None),
        }
    }

    /// Its present name; the one that it had, if nobody knows.
    pub fn whereabouts_or_name(&self) -> PathBuf {
        self.whereabouts().ok().flatten().unwrap_or_else(|| self.name.clone())
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

    fn is_at(&self, path: &Path) -> io::Result<bool> {
        let own = self.handle.metadata()?;
        Ok(if_there(fs::metadata(path))?.is_some_and(|found| is_same(&own, &found)))
    }
}

/// What was found; `None` if nothing has the name. Any other error tells nothing of what is there.
///
/// # Errors
/// That other error.
pub fn if_there(looked: io::Result<Metadata>) -> io::Result<Option<Metadata>> {
    use io::ErrorKind::{NotADirectory, NotFound};
    match looked {
        Ok(found) => Ok(Some(found)),
        Err(error) if matches!(error.kind(), NotFound | NotADirectory) => Ok(None),
        Err(error) => Err(error),
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
        assert_eq!(held.whereabouts().unwrap(), Some(first.clone()));
        fs::rename(&first, &second).unwrap();
        fs::create_dir(&first).unwrap();
        fs::write(held.path().join("file"), "own").unwrap();
        assert_eq!(fs::read_to_string(second.join("file")).unwrap(), "own");
        assert_eq!(fs::read_dir(&first).unwrap().count(), 0);
        assert_eq!(held.whereabouts().unwrap(), Some(second.canonicalize().unwrap()));
        fs::remove_dir_all(&second).unwrap();
        assert_eq!(held.whereabouts().unwrap(), None);
        assert!(fs::write(held.path().join("file"), "own").is_err());
    }

    #[test]
    #[cfg(unix)]
    fn a_name_that_cannot_be_examined_is_not_told_to_be_gone() {
        let place = tempfile::tempdir().unwrap();
        let name = place.path().join("folder");
        fs::create_dir(&name).unwrap();
        let held = HeldFolder::open(&name).unwrap();
        fs::rename(&name, place.path().join("away")).unwrap();
        assert!(!held.is_in_place().unwrap());
        // A link to itself: one of few names that fail for everybody, as any name does on a disk that is away.
        std::os::unix::fs::symlink(&name, &name).unwrap();
        assert!(held.is_in_place().is_err() && held.whereabouts().is_err());
    }
}
