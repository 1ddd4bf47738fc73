//! Places for results: a verb replaces only its own results.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use super::error::ResultsError;
use super::kind::ResultsKind;
use epirig_data::storage::{is_in_the_making, is_of_the_system, is_scratch, is_writing};

/// Refuses `target`, unless it does not exist, is an empty folder, or holds results of the same kind that may
/// be replaced. Leftovers of killed programs and files of the system are ignored.
pub(super) fn check_target(target: &Path, kind: ResultsKind, overwrite: bool) -> Result<(), ResultsError> {
    let io = |source| ResultsError::Io { action: "look into", path: target.to_owned(), source };
    match fs::symlink_metadata(target) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        // A path below a file fails when the folder is created, with an error that names the file.
        Err(error) if error.kind() == ErrorKind::NotADirectory => return Ok(()),
        Err(error) => return Err(io(error)),
        Ok(metadata) if metadata.is_symlink() => {
            return Err(ResultsError::Link { path: target.to_owned() });
        }
        Ok(metadata) if !metadata.is_dir() => {
            return Err(ResultsError::NotAFolder { path: target.to_owned() });
        }
        Ok(_) => {}
    }
    let there = |name: &str| fs::symlink_metadata(target.join(name)).is_ok_and(|found| found.is_file());
    if let Some(found) = ResultsKind::ALL.into_iter().find(|other| *other != kind && there(other.summary())) {
        return Err(ResultsError::OtherResults { path: target.to_owned(), found, wanted: kind });
    }
    let foreign = |name: String| ResultsError::Foreign { path: target.to_owned(), name };
    let mut occupied = false;
    for (name, is_folder) in entries(target)? {
        occupied = true;
        if !is_folder {
            if !kind.has(&name) {
                return Err(foreign(name));
            }
            continue;
        }
        if !kind.folders().contains(&&*name) {
            return Err(foreign(name));
        }
        for (inside, is_folder) in entries(&target.join(&name))? {
            let inside = format!("{name}/{inside}");
            if is_folder || !kind.has(&inside) {
                return Err(foreign(inside));
            }
        }
    }
    match occupied {
        true if !overwrite => Err(ResultsError::Exists { path: target.to_owned() }),
        true if !there(kind.summary()) => Err(ResultsError::NoSummary { path: target.to_owned(), kind }),
        _ => Ok(()),
    }
}

/// Sorted names in a folder, each with whether it is a folder; without leftovers and files of the system.
fn entries(folder: &Path) -> Result<Vec<(String, bool)>, ResultsError> {
    let io = |source| ResultsError::Io { action: "look into", path: folder.to_owned(), source };
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(io)? {
        let entry = entry.map_err(io)?;
        let name = entry.file_name();
        if is_scratch(&name) {
            if is_writing(&entry.path()) {
                return Err(ResultsError::Busy { path: entry.path() });
            }
            continue;
        }
        let kind = entry.file_type().map_err(io)?;
        // Files that systems create are ignored.
        if is_of_the_system(&name) || (is_in_the_making(&name) && kind.is_file()) {
            continue;
        }
        found.push((name.to_string_lossy().into_owned(), kind.is_dir()));
    }
    found.sort();
    Ok(found)
}
