//! A disk that fails on purpose, for tests.

use std::io;
use std::path::Path;

use super::{Disk, RealDisk};

/// How a disk fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DiskFault {
    /// The program is killed in the middle of the step: half of the data is written, and nothing follows.
    Killed,
    /// The disk is full from that step on: half of the data fits; steps that need no room still work.
    Full,
}

/// The real disk, until a given step.
///
/// ```
/// use epirig_data::storage::{Disk, DiskFault, FaultyDisk};
///
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("file");
/// let mut disk = FaultyDisk::new(DiskFault::Full, 1);
/// disk.write(&file, b"whole")?;
/// assert!(disk.append(&file, b"more").is_err());
/// assert_eq!(std::fs::read(&file)?, b"wholemo");
/// disk.remove(&file)?;
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct FaultyDisk {
    fault: DiskFault,
    /// Steps that still work.
    steps: usize,
    /// Whether the program has been killed.
    dead: bool,
    /// Whether two names can change places in one step.
    exchanges: bool,
    /// Whether a file can have two names.
    links: bool,
}

impl FaultyDisk {
    /// A disk that does `steps` steps before it fails.
    pub fn new(fault: DiskFault, steps: usize) -> Self {
        Self { fault, steps, dead: false, exchanges: true, links: true }
    }

    /// The same on a file system without exchange of names.
    pub fn without_exchange(self) -> Self {
        Self { exchanges: false, ..self }
    }

    /// The same on a file system without hard links.
    pub fn without_links(self) -> Self {
        Self { links: false, ..self }
    }

    /// Whether this step still works.
    fn works(&mut self) -> bool {
        let works = self.steps > 0;
        self.steps = self.steps.saturating_sub(1);
        works
    }

    /// A step that writes `bytes` by `write`.
    fn writing(
        &mut self,
        bytes: &[u8],
        write: impl FnOnce(&mut RealDisk, &[u8]) -> io::Result<()>,
    ) -> io::Result<()> {
        if self.works() {
            return write(&mut RealDisk, bytes);
        }
        let died_before = self.dead;
        self.dead = self.fault == DiskFault::Killed;
        if died_before {
            return Err(killed());
        }
        write(&mut RealDisk, &bytes[..bytes.len() / 2])?;
        Err(if self.dead { killed() } else { io::ErrorKind::StorageFull.into() })
    }

    /// A step that needs no room.
    fn step(&mut self, act: impl FnOnce(&mut RealDisk) -> io::Result<()>) -> io::Result<()> {
        if self.works() || self.fault == DiskFault::Full {
            return act(&mut RealDisk);
        }
        self.dead = true;
        Err(killed())
    }
}

fn killed() -> io::Error {
    io::Error::other("the program was killed (a simulated fault)")
}

impl Disk for FaultyDisk {
    fn make_folder(&mut self, path: &Path) -> io::Result<()> {
        self.step(|disk| disk.make_folder(path))
    }

    fn write(&mut self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        self.writing(bytes, |disk, bytes| disk.write(path, bytes))
    }

    fn append(&mut self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        self.writing(bytes, |disk, bytes| disk.append(path, bytes))
    }

    fn sync(&mut self, path: &Path) -> io::Result<()> {
        self.step(|disk| disk.sync(path))
    }

    fn rename(&mut self, from: &Path, to: &Path) -> io::Result<()> {
        self.step(|disk| disk.rename(from, to))
    }

    fn rename_new(&mut self, from: &Path, to: &Path) -> io::Result<()> {
        self.step(|disk| disk.rename_new(from, to))
    }

    fn exchange(&mut self, one: &Path, other: &Path) -> io::Result<()> {
        if !self.exchanges {
            return Err(io::ErrorKind::Unsupported.into());
        }
        self.step(|disk| disk.exchange(one, other))
    }

    fn link(&mut self, file: &Path, name: &Path) -> io::Result<()> {
        if !self.links {
            return Err(io::ErrorKind::PermissionDenied.into());
        }
        self.step(|disk| disk.link(file, name))
    }

    fn cut(&mut self, path: &Path, bytes: u64) -> io::Result<()> {
        self.step(|disk| disk.cut(path, bytes))
    }

    fn remove(&mut self, path: &Path) -> io::Result<()> {
        self.step(|disk| disk.remove(path))
    }

    fn remove_folder(&mut self, path: &Path) -> io::Result<()> {
        self.step(|disk| disk.remove_folder(path))
    }
}
