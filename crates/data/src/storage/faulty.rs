//! A disk that fails on purpose, for tests.

use std::io;

use super::{Disk, DiskStep, RealDisk};

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
}

impl Disk for FaultyDisk {
    fn act(&mut self, step: DiskStep<'_>) -> io::Result<()> {
        match step {
            DiskStep::Exchange(..) if !self.exchanges => return Err(io::ErrorKind::Unsupported.into()),
            DiskStep::Link(..) if !self.links => return Err(io::ErrorKind::PermissionDenied.into()),
            _ => {}
        }
        let works = self.steps > 0;
        self.steps = self.steps.saturating_sub(1);
        if works {
            return RealDisk.act(step);
        }
        let died_before = std::mem::replace(&mut self.dead, self.fault == DiskFault::Killed);
        match step {
            DiskStep::Write(..) | DiskStep::Append(..) if died_before => {}
            DiskStep::Write(path, bytes) => RealDisk.write(path, &bytes[..bytes.len() / 2])?,
            DiskStep::Append(path, bytes) => RealDisk.append(path, &bytes[..bytes.len() / 2])?,
            _ if self.dead => {}
            // It needs no room.
            _ => return RealDisk.act(step),
        }
        Err(match self.dead {
            true => io::Error::other("the program was killed (a simulated fault)"),
            false => io::ErrorKind::StorageFull.into(),
        })
    }
}
