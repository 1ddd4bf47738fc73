//! Files of lines that grow at their end: logs.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
#[cfg(unix)]
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

#[cfg(unix)]
use rustix::fs::OFlags;

#[cfg(unix)]
use super::read::WITHOUT_WAITING;
use super::read::kind;

/// Lines are shorter than this.
const LONGEST_LINE: u64 = 1 << 16;

/// Opens a file of lines to add to it, or makes it. What was cut short of its last line, when a program was killed or a disk full, is
/// taken away. A link in its place is not followed.
///
/// # Errors
/// What the operating system says, or that it is no regular file.
pub fn open_lines(path: &Path) -> io::Result<File> {
    let mut options = File::options();
    options.read(true).append(true).create(true);
    #[cfg(unix)]
    OpenOptionsExt::custom_flags(&mut options, (WITHOUT_WAITING | OFlags::NOFOLLOW).bits() as i32);
    let mut file = options.open(path)?;
    let metadata = file.metadata()?;
    if !metadata.is_file() {
        return Err(io::Error::other(format!("it is {}, not a file", kind(metadata.file_type()))));
    }
    let from = metadata.len().saturating_sub(LONGEST_LINE);
    let mut end = Vec::new();
    file.seek(SeekFrom::Start(from))?;
    file.read_to_end(&mut end)?;
    let whole = end.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
    if whole < end.len() {
        file.set_len(from + whole as u64)?;
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn whole_lines_stay_and_what_was_cut_short_goes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        for (before, after) in
            [("", "new\n"), ("one\n", "one\nnew\n"), ("one\ntw", "one\nnew\n"), ("on", "new\n")]
        {
            std::fs::write(&path, before).unwrap();
            open_lines(&path).unwrap().write_all(b"new\n").unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), after);
        }
        let long = format!("{}\n{}", "a".repeat(100_000), "b".repeat(60_000));
        std::fs::write(&path, long).unwrap();
        assert_eq!(open_lines(&path).unwrap().metadata().unwrap().len(), 100_001);
    }

    #[test]
    #[cfg(unix)]
    fn links_and_pipes_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let outside = folder.path().join("outside");
        std::fs::write(&outside, "mine").unwrap();
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&outside, &link).unwrap();
        assert!(open_lines(&link).is_err());
        assert_eq!(std::fs::read_to_string(&outside).unwrap(), "mine");
        let pipe = folder.path().join("pipe");
        rustix::fs::mknodat(rustix::fs::CWD, &pipe, rustix::fs::FileType::Fifo, 0o600.into(), 0).unwrap();
        assert!(open_lines(&pipe).unwrap_err().to_string().contains("a pipe"));
    }
}
