//! Files that a record names: they are read only if they lie in the record's folder.

use std::path::Path;

#[cfg(target_os = "linux")]
use super::read::{WITHOUT_WAITING, read_open};
use super::{ReadError, read_file};

/// Reads the file `name` in `folder`, of at most `limit` bytes. Absolute names, `..` and links that lead out
/// of the folder are refused, as is anything but a regular file.
///
/// # Errors
/// [`ReadError`].
pub fn read_inside(folder: &Path, name: &str, limit: u64) -> Result<Vec<u8>, ReadError> {
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{Mode, OFlags, ResolveFlags, open, openat2};
        use rustix::io::Errno;

        let path = folder.join(name);
        let io = |error: Errno| ReadError::io(&path)(error.into());
        let root =
            open(folder, OFlags::PATH | OFlags::DIRECTORY | OFlags::CLOEXEC, Mode::empty()).map_err(io)?;
        let within = ResolveFlags::BENEATH | ResolveFlags::NO_MAGICLINKS;
        match openat2(&root, name, OFlags::RDONLY | WITHOUT_WAITING, Mode::empty(), within) {
            Ok(file) => return read_open(file.into(), &path, limit),
            Err(Errno::XDEV) => return Err(outside(folder, name)),
            // Kernels before 5.6, and some sandboxes.
            Err(Errno::NOSYS | Errno::PERM) => {}
            Err(error) => return Err(io(error)),
        }
    }
    check(folder, name)?;
    read_file(&folder.join(name), limit)
}

fn outside(folder: &Path, name: &str) -> ReadError {
    ReadError::Outside { folder: folder.to_owned(), name: name.to_owned() }
}

/// The same check without the kernel's help; it holds as long as links are not changed meanwhile.
fn check(folder: &Path, name: &str) -> Result<(), ReadError> {
    use std::path::Component;

    let plain = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
    if !plain {
        return Err(outside(folder, name));
    }
    let path = folder.join(name);
    let full = |path: &Path| std::fs::canonicalize(path).map_err(ReadError::io(path));
    if full(&path)?.starts_with(full(folder)?) { Ok(()) } else { Err(outside(folder, name)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(unix)]
    fn nothing_outside_is_read() {
        use std::os::unix::fs::symlink;

        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("seq");
        std::fs::create_dir_all(folder.join("frames")).unwrap();
        std::fs::write(place.path().join("secret"), "secret").unwrap();
        std::fs::write(folder.join("frames/0.png"), "frame").unwrap();
        symlink("0.png", folder.join("frames/inside.png")).unwrap();
        symlink("../../secret", folder.join("frames/outside.png")).unwrap();
        symlink(place.path().join("secret"), folder.join("frames/absolute.png")).unwrap();
        symlink("loop.png", folder.join("frames/loop.png")).unwrap();
        let absolute = place.path().join("secret").display().to_string();
        for name in ["frames/0.png", "frames/inside.png"] {
            assert_eq!(read_inside(&folder, name, 9).unwrap(), b"frame");
            check(&folder, name).unwrap();
        }
        for name in
            ["../secret", "frames/../../secret", &absolute, "frames/outside.png", "frames/absolute.png"]
        {
            assert!(matches!(read_inside(&folder, name, 9), Err(ReadError::Outside { .. })), "{name}");
            assert!(matches!(check(&folder, name), Err(ReadError::Outside { .. })), "{name}");
        }
        assert!(read_inside(&folder, "frames/loop.png", 9).is_err());
        assert!(read_inside(&folder, "frames/1.png", 9).unwrap_err().is_missing());
        assert!(matches!(read_inside(&folder, "frames", 9), Err(ReadError::NotAFile { .. })));
    }
}
