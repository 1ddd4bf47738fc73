//! Where results may be put: a verb replaces nothing but its own.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use super::error::ResultsError;
use super::kind::ResultsKind;
use epirig_data::storage::{is_in_the_making, is_of_the_system, is_scratch, is_writing};

/// Refuses to put results at `target` unless nothing is there, or an empty folder, or results of the same kind that may be replaced. What killed
/// programs and systems have left there counts as ours.
pub(super) fn check_target(target: &Path, kind: ResultsKind, overwrite: bool) -> Result<(), ResultsError> {
    let io = |source| ResultsError::Io { action: "look into", path: target.to_owned(), source };
    match fs::symlink_metadata(target) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        // Below a file there is no folder: making it will say so, with the path of that file.
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
        match kind.folders().iter().find(|(folder, _)| *folder == name) {
            Some((_, files)) if is_folder => {
                for (inside, is_folder) in entries(&target.join(&name))? {
                    if is_folder || !files.contains(&&*inside) {
                        return Err(foreign(format!("{name}/{inside}")));
                    }
                }
            }
            None if !is_folder && kind.files().contains(&&*name) => {}
            _ => return Err(foreign(name)),
        }
    }
    match occupied {
        true if !overwrite => Err(ResultsError::Exists { path: target.to_owned() }),
        true if !there(kind.summary()) => Err(ResultsError::NoSummary { path: target.to_owned(), kind }),
        _ => Ok(()),
    }
}

/// Names in a folder, in their order, and whether each is a folder; without those that are nobody's.
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
        // Whatever it is, a note of a system is no work of a person.
        if is_of_the_system(&name) || (is_in_the_making(&name) && kind.is_file()) {
            continue;
        }
        found.push((name.to_string_lossy().into_owned(), kind.is_dir()));
    }
    found.sort();
    Ok(found)
}
