//! Images with numbers in their names: a number that is missing is a frame that is missing, and all later ones are a step off.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use super::super::error::SequenceError;
use super::super::pixels::foreign_name;
use super::order::by_name;

/// Most holes that are named.
const MOST: usize = 100;

/// Names, without ending, that `images` lack between the first and the last, if their names differ by a number alone.
pub(super) fn holes(images: &[PathBuf]) -> Vec<String> {
    let stems: Option<Vec<Stem>> = images.iter().map(|image| Stem::of(image)).collect();
    let Some(stems) = stems.filter(|stems| stems.windows(2).all(|pair| pair[0].is_before(&pair[1]))) else {
        return Vec::new();
    };
    // Some cameras count by tens.
    let steps = stems.windows(2).map(|pair| pair[1].number - pair[0].number);
    let Some(step) = steps.min() else { return Vec::new() };
    let between = |pair: &[Stem]| {
        let numbers = (1..).map_while(|count: u64| pair[0].number.checked_add(step.checked_mul(count)?));
        let end = pair[1].number;
        let names = numbers.take_while(move |number| *number < end).map(|number| pair[0].with(number));
        names.take(MOST).collect::<Vec<_>>()
    };
    stems.windows(2).flat_map(between).take(MOST).collect()
}

/// Refuses images of other formats that are numbered as `images` are, all of those in `folder`: they are frames, and would be left out without a word.
pub(super) fn refuse_other_images(folder: &Path, images: &[PathBuf]) -> Result<(), SequenceError> {
    let Some(first) = images.first().and_then(|image| Stem::of(image)) else { return Ok(()) };
    let read: BTreeSet<_> = images.iter().map(|image| image.file_stem()).collect();
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(SequenceError::io("look into", folder))? {
        let path = entry.map_err(SequenceError::io("look into", folder))?.path();
        let is_frame = foreign_name(&path).is_some()
            && Stem::of(&path).is_some_and(|stem| stem.is_like(&first))
            // Cameras write a raw image beside one that is read.
            && !read.contains(&path.file_stem());
        if is_frame {
            found.push(path);
        }
    }
    refuse_foreign(found)
}

/// Refuses files whose names tell a format that is not read.
pub(super) fn refuse_foreign(mut paths: Vec<PathBuf>) -> Result<(), SequenceError> {
    paths.sort_by(|a, b| by_name(a, b));
    let first = paths.iter().find_map(|path| Some((path, foreign_name(path)?)));
    match first {
        Some((path, format)) => {
            let alike = |other: &&PathBuf| foreign_name(other).is_some_and(|other| other.name == format.name);
            let count = paths.iter().filter(alike).count();
            Err(SequenceError::ForeignFormat { path: path.clone(), format, count })
        }
        None => Ok(()),
    }
}

/// A name around its last number.
#[derive(Debug)]
struct Stem {
    before: String,
    number: u64,
    digits: usize,
    after: String,
}

impl Stem {
    fn of(image: &Path) -> Option<Self> {
        let stem = image.file_stem()?.to_str()?;
        let end = stem.rfind(|letter: char| letter.is_ascii_digit())? + 1;
        let start = stem[..end].rfind(|letter: char| !letter.is_ascii_digit());
        let start = start.map_or(0, |place| place + stem[place..].chars().next().map_or(1, char::len_utf8));
        let digits = &stem[start..end];
        let (before, after) = (stem[..start].to_owned(), stem[end..].to_owned());
        Some(Self { before, number: digits.parse().ok()?, digits: digits.len(), after })
    }

    fn is_like(&self, other: &Self) -> bool {
        self.before == other.before && self.after == other.after
    }

    fn is_before(&self, next: &Self) -> bool {
        self.is_like(next) && self.number < next.number
    }

    fn with(&self, number: u64) -> String {
        format!("{}{number:0width$}{}", self.before, self.after, width = self.digits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn others_of_the_same_format_alone_are_counted() {
        let told = |names: &[&str]| refuse_foreign(names.iter().map(PathBuf::from).collect()).unwrap_err();
        let told = |names: &[&str]| told(names).to_string();
        let one = told(&["a.CR2", "b.HEIC", "c.zip", "d.txt"]);
        assert!(one.contains("a.CR2 is ") && !one.contains("(and so"), "{one}");
        let two = told(&["a.CR2", "b.HEIC", "c.NEF"]);
        assert!(two.contains("a.CR2 is ") && two.contains("(and so is 1 other)"), "{two}");
    }

    #[test]
    fn what_is_missing_between_numbers_is_named() {
        let holes = |names: &[&str]| holes(&names.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(holes(&["a/0001.png", "a/0002.png", "a/0004.jpg"]), ["0003"]);
        assert_eq!(holes(&["f9_l.png", "f10_l.png", "f13_l.png"]), ["f11_l", "f12_l"]);
        assert_eq!(holes(&["010.png", "020.png", "040.png"]), ["030"]);
        assert!(holes(&["0.png", "10.png", "20.png"]).is_empty());
        assert!(holes(&["left1.png", "right3.png", "right4.png"]).is_empty());
        assert!(holes(&["one.png", "two.png"]).is_empty());
        assert_eq!(holes(&["0.png", "1.png", "18446744073709551615.png"]).len(), MOST);
    }
}
