//! The images that a person names: folders, files, and patterns such as `photos/*.jpg`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use super::super::error::SequenceError;
use super::super::pixels::{TELLING_BYTES, foreign_format, foreign_name, is_image_name};
use super::numbering::refuse_foreign;
use super::order::{SortOrder, by_name, name, natural_order, sort};
use crate::storage::kind;

/// Images in their order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listing {
    /// The images. Those of a folder are in natural order: `frame_9` before `frame_10`.
    pub images: Vec<PathBuf>,
    /// Names of hidden files that were passed over: some systems keep notes of their own beside images
    /// (`._0001.png`).
    pub hidden: Vec<String>,
    /// Where they come from, for people: a folder, or the first argument.
    pub place: PathBuf,
    /// If they were to be sorted by time, how many of them do not tell when they were taken: with any, the times
    /// of all files were used.
    pub untimed: usize,
    /// The folders of which all images are taken.
    pub(super) whole: Vec<PathBuf>,
}

/// Lists the images in a folder. Links to files count as files.
///
/// # Errors
/// [`SequenceError`] if the folder cannot be listed or holds no images; [`SequenceError::NotFiles`] if a name
/// of an image has no file behind it.
pub fn list_images(folder: &Path) -> Result<Listing, SequenceError> {
    let (mut images, mut hidden, mut wrong) = (Vec::new(), Vec::new(), Vec::new());
    let mut foreign = Vec::new();
    for entry in fs::read_dir(folder).map_err(SequenceError::io("look into", folder))? {
        let path = entry.map_err(SequenceError::io("look into", folder))?.path();
        let name = name(&path);
        if !is_image_name(&path) {
            foreign.extend((foreign_name(&path).is_some() && !name.starts_with('.')).then_some(path));
            continue;
        }
        match fs::metadata(&path) {
            _ if name.starts_with('.') => hidden.push(name),
            Ok(metadata) if metadata.is_file() => images.push(path),
            Ok(metadata) => wrong.push(format!("{name} is {}", kind(metadata.file_type()))),
            Err(error) => wrong.push(format!("{name} leads to no file that can be read ({error})")),
        }
    }
    hidden.sort();
    if !wrong.is_empty() {
        wrong.sort_by(|a, b| natural_order(a, b));
        return Err(SequenceError::NotFiles { folder: folder.to_owned(), found: wrong });
    }
    if images.is_empty() {
        refuse_foreign(foreign)?;
        return Err(SequenceError::NoImages(folder.to_owned()));
    }
    images.sort_by(|a, b| by_name(a, b));
    // Cameras write a frame as raw image and as JPEG: both would count.
    let mut stems = BTreeMap::new();
    for image in &images {
        if let Some(other) = stems.insert(image.file_stem(), image) {
            let found = vec![format!("{} and {} have one name in two formats", name(other), name(image))];
            return Err(SequenceError::NotFiles { folder: folder.to_owned(), found });
        }
    }
    Ok(Listing { images, hidden, place: folder.to_owned(), untimed: 0, whole: vec![folder.to_owned()] })
}

/// Lists the images that arguments name: folders, files, and patterns with `*`, `?` and `[...]`. An image that
/// is named twice counts once.
///
/// # Errors
/// As [`list_images`]; [`SequenceError::NoMatch`] for a pattern that no file fits.
pub fn find_images(arguments: &[PathBuf], order: SortOrder) -> Result<Listing, SequenceError> {
    let place = arguments.first().cloned().unwrap_or_else(|| PathBuf::from("."));
    let mut found = Listing { images: Vec::new(), hidden: Vec::new(), place, untimed: 0, whole: Vec::new() };
    let mut seen = BTreeSet::new();
    for argument in arguments {
        let images = match fs::metadata(argument) {
            Ok(metadata) if metadata.is_dir() => {
                let Listing { images, hidden, whole, .. } = list_images(argument)?;
                found.hidden.extend(hidden);
                found.whole.extend(whole);
                images
            }
            Ok(_) => {
                refuse_foreign_file(argument)?;
                vec![argument.clone()]
            }
            Err(error) => match pattern_of(argument) {
                Some(pattern) => matches(argument, pattern)?,
                None => return Err(SequenceError::io("look into", argument)(error)),
            },
        };
        for image in images {
            let real = fs::canonicalize(&image).map_err(SequenceError::io("look into", &image))?;
            if seen.insert(real) {
                found.images.push(image);
            }
        }
    }
    found.untimed = sort(&mut found.images, order)?;
    Ok(found)
}

/// Refuses a file of a format that is not read, whatever its name is.
fn refuse_foreign_file(path: &Path) -> Result<(), SequenceError> {
    let mut begin = Vec::new();
    let file = fs::File::open(path).map_err(SequenceError::io("read", path))?;
    file.take(TELLING_BYTES).read_to_end(&mut begin).map_err(SequenceError::io("read", path))?;
    match foreign_format(path, &begin) {
        Some(format) => Err(SequenceError::ForeignFormat { path: path.to_owned(), format, count: 1 }),
        None => Ok(()),
    }
}

/// The argument as a pattern, if it has what only patterns have.
fn pattern_of(argument: &Path) -> Option<&str> {
    argument.to_str().filter(|text| text.contains(['*', '?', '[']))
}

/// The files that fit a pattern, in natural order. `*` alone does not fit hidden files, as in shells.
fn matches(argument: &Path, pattern: &str) -> Result<Vec<PathBuf>, SequenceError> {
    let options = glob::MatchOptions {
        require_literal_leading_dot: true,
        require_literal_separator: true,
        ..glob::MatchOptions::new()
    };
    let no_match = |reason: String| SequenceError::NoMatch { pattern: argument.to_owned(), reason };
    let found = glob::glob_with(pattern, options).map_err(|error| no_match(error.to_string()))?;
    let mut images = Vec::new();
    for path in found {
        let path = path.map_err(|error| {
            let path = error.path().to_owned();
            SequenceError::io("look into", path)(error.into())
        })?;
        if path.is_file() {
            images.push(path);
        }
    }
    if images.is_empty() {
        return Err(no_match("no file fits it".to_owned()));
    }
    images.iter().try_for_each(|image| refuse_foreign_file(image))?;
    images.sort_by(|a, b| by_name(a, b));
    Ok(images)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_files_and_patterns_are_joined() {
        let place = tempfile::tempdir().unwrap();
        let path = |name: &str| place.path().join(name);
        fs::create_dir(path("more")).unwrap();
        for name in ["a10.png", "a2.png", "b[1].png", ".a3.png", "notes.txt", "more/a4.bmp", "more/._a4.bmp"]
        {
            fs::write(path(name), "").unwrap();
        }
        let found = |names: &[&str], order| {
            let arguments: Vec<PathBuf> = names.iter().map(|name| path(name)).collect();
            let listing = find_images(&arguments, order).unwrap();
            listing.images.iter().map(|image| name(image)).collect::<Vec<_>>()
        };
        assert_eq!(found(&["a*.png", "more"], SortOrder::Name), ["a2.png", "a4.bmp", "a10.png"]);
        assert_eq!(found(&["more", "a*.png"], SortOrder::Given), ["a4.bmp", "a2.png", "a10.png"]);
        // Named twice, and a name that looks like a pattern.
        assert_eq!(found(&["a2.png", "a?.png", "b[1].png"], SortOrder::Name), ["a2.png", "b[1].png"]);
        let error = |name: &str| find_images(&[path(name)], SortOrder::Name).unwrap_err();
        assert!(matches!(error("c*.png"), SequenceError::NoMatch { .. }));
        assert!(matches!(error("a***.png"), SequenceError::NoMatch { .. }));
        assert!(matches!(error("nowhere.png"), SequenceError::Io { .. }));
    }

    #[test]
    fn formats_that_are_not_read_are_named_wherever_they_are_given() {
        let place = tempfile::tempdir().unwrap();
        let path = |name: &str| place.path().join(name);
        fs::create_dir(path("raw")).unwrap();
        fs::create_dir(path("empty")).unwrap();
        for name in ["raw/IMG_10.CR2", "raw/IMG_9.CR2", "raw/notes.txt", "empty/notes.txt"] {
            fs::write(path(name), "").unwrap();
        }
        fs::write(path("a1.jpg"), b"\0\0\0\x18ftypheic").unwrap();
        fs::write(path("p.zip"), b"PK\x03\x04").unwrap();
        let words = |arguments: &[&str]| {
            let arguments: Vec<PathBuf> = arguments.iter().map(|name| path(name)).collect();
            match find_images(&arguments, SortOrder::Name).unwrap_err() {
                error @ SequenceError::ForeignFormat { .. } => error.to_string(),
                error => panic!("{error}"),
            }
        };
        let folder = words(&["raw"]);
        assert!(
            folder.contains("IMG_9.CR2 is a camera's raw image") && folder.contains("1 other"),
            "{folder}"
        );
        assert!(folder.contains("dcraw"), "{folder}");
        for arguments in [&["raw/IMG_9.CR2"][..], &["raw/IMG_9.CR2", "raw/IMG_10.CR2"], &["raw/*.CR2"]] {
            assert!(words(arguments).contains(".CR2 is a camera's raw image"), "{arguments:?}");
        }
        assert!(words(&["p.zip"]).contains("unzip"));
        assert!(words(&["a*.jpg"]).contains("heif-convert"));
        assert!(matches!(list_images(&path("empty")), Err(SequenceError::NoImages { .. })));
    }

    #[test]
    fn time_sorts_what_names_do_not() {
        let place = tempfile::tempdir().unwrap();
        for (name, seconds) in [("a.png", 30), ("b.png", 10), ("c.png", 20), ("d.png", 20)] {
            let file = fs::File::create(place.path().join(name)).unwrap();
            file.set_modified(std::time::UNIX_EPOCH + std::time::Duration::from_secs(seconds)).unwrap();
        }
        let listing = find_images(&[place.path().to_owned()], SortOrder::Time).unwrap();
        let names: Vec<String> = listing.images.iter().map(|image| name(image)).collect();
        assert_eq!(names, ["b.png", "c.png", "d.png", "a.png"]);
    }
}
