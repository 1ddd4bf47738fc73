//! Places for results: a verb replaces only its own results.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use super::error::ResultsError;
use super::kind::ResultsKind;
use super::maps::ResultMap;
use super::names::NAMES;
use epirig_core::choice::Choice as _;
use epirig_data::storage::{is_in_the_making, is_of_the_system, is_scratch, is_writing};

/// Refuses `target`, unless it does not exist, is an empty folder, or holds results of the same kind that may
/// be replaced. Leftovers of killed programs and files of the system are ignored.
pub(super) fn check_target(target: &Path, kind: ResultsKind, overwrite: bool) -> Result<(), ResultsError> {
    match fs::symlink_metadata(target) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        // A path below a file fails when the folder is created, with an error that names the file.
        Err(error) if error.kind() == ErrorKind::NotADirectory => return Ok(()),
        Err(error) => return Err(ResultsError::io("look into", target)(error)),
        Ok(metadata) if metadata.is_symlink() => return Err(ResultsError::Link(target.to_owned())),
        Ok(metadata) if !metadata.is_dir() => return Err(ResultsError::NotAFolder(target.to_owned())),
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
            if !has(kind, &name) {
                return Err(foreign(name));
            }
            continue;
        }
        if !kind.folders().contains(&&*name) {
            return Err(foreign(name));
        }
        for (inside, is_folder) in entries(&target.join(&name))? {
            let inside = format!("{name}/{inside}");
            if is_folder || !has(kind, &inside) {
                return Err(foreign(inside));
            }
        }
    }
    match occupied {
        true if !overwrite => Err(ResultsError::Exists(target.to_owned())),
        true if !there(kind.summary()) => Err(ResultsError::NoSummary { path: target.to_owned(), kind }),
        _ => Ok(()),
    }
}

/// Whether results of this kind may have a file of this name, which may be in one of their folders.
fn has(kind: ResultsKind, name: &str) -> bool {
    if let Some(name) = name.strip_prefix("surface/") {
        return kind == ResultsKind::Match && has(ResultsKind::Surface, name);
    }
    let is_map = |map: &ResultMap| map.row().kind == kind && map.row().file == name;
    let chart = name.strip_suffix(".png").or_else(|| name.strip_suffix(".csv"));
    let is_named = |other: &str| if other.contains('.') { other == name } else { Some(other) == chart };
    let is_other = |&(of, other): &(ResultsKind, &str)| of == kind && is_named(other);
    name == kind.summary() || ResultMap::ALL.iter().any(is_map) || NAMES.iter().any(is_other)
}

/// Sorted names in a folder, each with whether it is a folder; without leftovers and files of the system.
fn entries(folder: &Path) -> Result<Vec<(String, bool)>, ResultsError> {
    let io = |source| ResultsError::io("look into", folder)(source);
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(io)? {
        let entry = entry.map_err(io)?;
        let name = entry.file_name();
        if is_scratch(&name) {
            if is_writing(&entry.path()) {
                return Err(ResultsError::Busy(entry.path()));
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

#[cfg(test)]
mod tests {
    use super::ResultsKind::{Compare, Match, Surface};
    use super::has;

    #[test]
    fn each_kind_has_its_files_alone() {
        for (kind, name) in [
            (Match, "match.json"),
            (Match, "mask.png"),
            (Match, "height-along-row.csv"),
            (Match, "figures/6-disparity-along-row.png"),
            (Match, "surface/profile.csv"),
            (Surface, "filtered_mm.tiff"),
            (Surface, "height.png"),
            (Compare, "difference_sigma_mm.tiff"),
        ] {
            assert!(has(kind, name), "{name}");
        }
        for (kind, name) in [
            (Match, "disparity.png.csv"),
            (Match, "height-along-row"),
            (Match, "6-disparity-along-row.png"),
            (Match, "surface/mask.png"),
            (Surface, "surface/profile.csv"),
            (Surface, "match.json"),
            (Compare, "difference.csv"),
        ] {
            assert!(!has(kind, name), "{name}");
        }
    }
}
