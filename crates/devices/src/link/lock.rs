//! Port locks: one process per port.

use std::fs::{File, OpenOptions, Permissions, TryLockError};
use std::io::{ErrorKind, Read, Seek, Write};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

use super::LinkError;

/// Locks a port against other processes for its lifetime.
///
/// The file follows the old convention (`LCK..ttyUSB0` with the process id), which terminal programs respect;
/// their locks are respected here. The lock itself is the kernel's, so a killed program leaves none. The
/// exclusive mode of the port alone is not enough: root can open the port anyway.
#[derive(Debug)]
pub struct PortLock {
    path: PathBuf,
    /// Locked as long as it is open.
    _file: File,
}

/// Folders for lock files; the first writable one is used.
fn folders() -> [PathBuf; 3] {
    ["/run/lock".into(), "/var/lock".into(), std::env::temp_dir()]
}

/// Attempts if the file vanishes between opening and locking.
const TRIES: u32 = 10;

fn lock_name(port: &str) -> String {
    let device = std::fs::canonicalize(port).unwrap_or_else(|_| PathBuf::from(port));
    let device = device.strip_prefix("/dev").unwrap_or(&device).to_string_lossy();
    format!("LCK..{}", device.trim_start_matches('/').replace('/', "_"))
}

/// The process id in a lock file, if that process is alive.
fn living_holder(path: &Path) -> Option<i32> {
    let mut text = String::new();
    File::open(path).ok()?.take(32).read_to_string(&mut text).ok()?;
    let pid: i32 = text.trim().parse().ok()?;
    Path::new("/proc").join(pid.to_string()).exists().then_some(pid)
}

/// The process that uses `port`, according to its lock file.
pub fn holder(port: &str) -> Option<i32> {
    let name = lock_name(port);
    folders().iter().find_map(|folder| living_holder(&folder.join(&name)))
}

/// Opens the lock file, which all users must be able to do: root may have created it.
fn open(path: &Path) -> std::io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true);
    // The kernel refuses to open another user's file in a shared folder with the flag that creates it.
    match options.open(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => {}
        opened => return opened,
    }
    match options.create_new(true).open(path) {
        Ok(file) => {
            file.set_permissions(Permissions::from_mode(0o666))?;
            Ok(file)
        }
        // Another process has created it meanwhile.
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            OpenOptions::new().read(true).write(true).open(path)
        }
        Err(error) => Err(error),
    }
}

impl PortLock {
    /// Locks the port.
    ///
    /// # Errors
    /// [`LinkError::Busy`] if another process uses it, [`LinkError::Io`] if no lock file can be created.
    pub fn take(port: &str) -> Result<Self, LinkError> {
        let name = lock_name(port);
        let mut refused = None;
        for folder in folders().iter().filter(|folder| folder.is_dir()) {
            let path = folder.join(&name);
            match Self::take_file(port, path.clone()) {
                Ok(taken) => return taken,
                Err(error) => refused = Some((path, error)),
            }
        }
        let (path, detail) = refused.map_or_else(
            || (PathBuf::from(&name), "no folder for lock files is writable".to_owned()),
            |(path, error)| (path, format!("{error}; delete the file if no program uses the port")),
        );
        Err(LinkError::Io { port: path.display().to_string(), action: "lock the port", detail })
    }

    /// The lock, or who has it; an error if this file cannot be a lock.
    fn take_file(port: &str, path: PathBuf) -> std::io::Result<Result<Self, LinkError>> {
        let busy = |pid: Option<i32>| {
            let holder = pid.map_or("another process".to_owned(), |pid| format!("process {pid}"));
            Ok(Err(LinkError::Busy { port: port.to_owned(), holder }))
        };
        for _ in 0..TRIES {
            let mut file = open(&path)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return busy(living_holder(&path)),
                Err(TryLockError::Error(error)) => return Err(error),
            }
            // Its last holder may have removed it before it was locked here.
            let same = |there: std::fs::Metadata| file.metadata().is_ok_and(|here| here.ino() == there.ino());
            if !std::fs::metadata(&path).is_ok_and(same) {
                continue;
            }
            // A program that knows only the old convention.
            if let Some(pid) = living_holder(&path) {
                return busy(Some(pid));
            }
            file.set_len(0)?;
            file.rewind()?;
            writeln!(file, "{:>10}", std::process::id())?;
            return Ok(Ok(Self { path, _file: file }));
        }
        busy(None)
    }
}

impl Drop for PortLock {
    fn drop(&mut self) {
        // Removed while locked: a process that has just opened the file notices that it is no longer at its
        // path. A remaining file belongs to a dead process.
        let _ = std::fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_taker_is_told_who_has_the_port() {
        let port = format!("/dev/epirig-test-{}", std::process::id());
        let lock = PortLock::take(&port).unwrap();
        let pid = std::process::id();
        let error = PortLock::take(&port).unwrap_err();
        assert_eq!(error, LinkError::Busy { port: port.clone(), holder: format!("process {pid}") });
        assert_eq!(holder(&port), Some(pid as i32));
        drop(lock);
        assert_eq!(holder(&port), None);
        // A file of a dead process is no lock; that of a living process is, even without a lock of the
        // kernel.
        let path = folders().into_iter().find(|folder| folder.is_dir()).unwrap().join(lock_name(&port));
        std::fs::write(&path, "2147483646\n").unwrap();
        drop(PortLock::take(&port).unwrap());
        assert!(!path.exists());
        std::fs::write(&path, "         1\n").unwrap();
        assert!(
            matches!(PortLock::take(&port), Err(LinkError::Busy { holder, .. }) if holder == "process 1")
        );
        std::fs::remove_file(&path).unwrap();
    }
}
