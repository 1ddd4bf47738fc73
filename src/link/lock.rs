//! One process a port.

use std::fs::{File, OpenOptions, Permissions};
use std::io::{ErrorKind, Read, Seek, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use super::LinkError;

/// Keeps other processes off a port for as long as it lives.
///
/// The file is that of the old convention (`LCK..ttyUSB0` with the process's number), which terminal programs respect;
/// the lock itself is the kernel's, so a program that was killed leaves none behind. The exclusive mode of the port alone
/// would not do: it does not hold for root.
#[derive(Debug)]
pub struct PortLock {
    file: File,
}

/// Where lock files are kept: the first that exists.
const FOLDERS: [&str; 2] = ["/run/lock", "/var/lock"];

fn lock_path(port: &str) -> PathBuf {
    let device = std::fs::canonicalize(port).unwrap_or_else(|_| PathBuf::from(port));
    let device = device.strip_prefix("/dev").unwrap_or(&device).to_string_lossy();
    let name = format!("LCK..{}", device.trim_start_matches('/').replace('/', "_"));
    let folder = FOLDERS.iter().map(Path::new).find(|folder| folder.is_dir());
    folder.map_or_else(std::env::temp_dir, Path::to_path_buf).join(name)
}

/// The process that has `port`, if it says so in its lock file.
pub fn holder(port: &str) -> Option<i32> {
    let mut text = String::new();
    let file = File::open(lock_path(port)).ok()?;
    match file.try_lock_shared() {
        Err(std::fs::TryLockError::WouldBlock) => {}
        _ => return None,
    }
    (&file).take(32).read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

/// Opens the lock file, which any user must be able to do: whoever was first may have been root.
fn open(path: &Path) -> std::io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true);
    // The kernel refuses to open another user's file in a shared folder with the right to create it.
    match options.open(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => {}
        opened => return opened,
    }
    match options.create_new(true).open(path) {
        Ok(file) => {
            file.set_permissions(Permissions::from_mode(0o666))?;
            Ok(file)
        }
        // Another process was quicker.
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            OpenOptions::new().read(true).write(true).open(path)
        }
        Err(error) => Err(error),
    }
}

impl PortLock {
    /// Takes the port.
    ///
    /// # Errors
    /// [`LinkError::Busy`] if another process has it, [`LinkError::Io`] if there is no place for the lock file.
    pub fn take(port: &str) -> Result<Self, LinkError> {
        let path = lock_path(port);
        let failed = |error: std::io::Error| LinkError::Io {
            port: path.display().to_string(),
            action: "lock the port",
            detail: error.to_string(),
        };
        let mut file = open(&path).map_err(failed)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(std::fs::TryLockError::WouldBlock) => {
                let holder =
                    holder(port).map_or("another process".to_owned(), |pid| format!("process {pid}"));
                return Err(LinkError::Busy { port: port.to_owned(), holder });
            }
            Err(std::fs::TryLockError::Error(error)) => return Err(failed(error)),
        }
        let record = |file: &mut File| {
            file.set_len(0)?;
            file.rewind()?;
            writeln!(file, "{:>10}", std::process::id())
        };
        record(&mut file).map_err(failed)?;
        Ok(Self { file })
    }
}

impl Drop for PortLock {
    fn drop(&mut self) {
        // The file stays, empty: whoever opened it before it vanished would lock a file that nobody else can see.
        let _ = self.file.set_len(0);
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
        drop(PortLock::take(&port).unwrap());
        std::fs::remove_file(lock_path(&port)).unwrap();
    }
}
