//! The order of images.

use std::cmp::Ordering;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::super::error::SequenceError;
use super::super::pixels::{LARGEST_IMAGE, time_taken};
use crate::storage::read_file;

epirig_core::choices! {
    /// What the images are sorted by.
    #[derive(Default)]
    pub enum SortOrder {
        /// By file names, as people count: frame_9 before frame_10.
        #[default]
        Name = "name",
        /// By the times at which they were taken by EXIF; unless all tell it, when the files were last changed.
        Time = "time",
        /// As given; those of one folder or pattern by file names.
        Given = "given",
    }
}

/// The last part of a path.
pub(super) fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Sorts images that are in natural order within each argument. By times, gives the number of those that do not
/// tell when they were taken; 0 otherwise.
pub(super) fn sort(images: &mut Vec<PathBuf>, order: SortOrder) -> Result<usize, SequenceError> {
    match order {
        SortOrder::Given => {}
        SortOrder::Name => images.sort_by(|a, b| by_name(a, b)),
        SortOrder::Time => {
            let taken = times(images, |image| {
                // What cannot be read is told by the import.
                Ok(read_file(image, LARGEST_IMAGE).ok().and_then(|bytes| time_taken(&bytes)))
            })?;
            let untimed = taken.iter().filter(|time| time.is_none()).count();
            match untimed {
                0 => by_time(images, taken),
                _ => by_time(images, times(images, time_of)?),
            }
            return Ok(untimed);
        }
    }
    Ok(0)
}

fn times<T>(
    images: &[PathBuf],
    time: impl Fn(&Path) -> Result<T, SequenceError>,
) -> Result<Vec<T>, SequenceError> {
    images.iter().map(|image| time(image)).collect()
}

/// Puts images in the order of their times; those of one time in the order of their names.
fn by_time<T: Ord>(images: &mut Vec<PathBuf>, times: Vec<T>) {
    let mut timed: Vec<(T, PathBuf)> = times.into_iter().zip(images.drain(..)).collect();
    timed.sort_by(|(at, a), (other, b)| at.cmp(other).then_with(|| by_name(a, b)));
    images.extend(timed.into_iter().map(|(_, image)| image));
}

fn time_of(image: &Path) -> Result<SystemTime, SequenceError> {
    let time = fs::metadata(image).and_then(|metadata| metadata.modified());
    time.map_err(SequenceError::io("find the time of", image))
}

/// Natural order of the names; images of one name by their whole paths.
pub(super) fn by_name(a: &Path, b: &Path) -> Ordering {
    natural_order(&name(a), &name(b)).then_with(|| natural_order(&a.to_string_lossy(), &b.to_string_lossy()))
}

/// Compares runs of digits by value and everything else by character.
pub(super) fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a.chars().peekable(), b.chars().peekable());
    loop {
        match (a.peek(), b.peek()) {
            (Some(x), Some(y)) if x.is_ascii_digit() && y.is_ascii_digit() => {
                let (x, y) = (take_digits(&mut a), take_digits(&mut b));
                let (short, long) = (x.trim_start_matches('0'), y.trim_start_matches('0'));
                let order =
                    short.len().cmp(&long.len()).then_with(|| short.cmp(long)).then_with(|| x.cmp(&y));
                if order != Ordering::Equal {
                    return order;
                }
            }
            (x, y) if x == y => {
                if a.next().is_none() {
                    return Ordering::Equal;
                }
                b.next();
            }
            (x, y) => return x.cmp(&y),
        }
    }
}

fn take_digits(text: &mut std::iter::Peekable<std::str::Chars<'_>>) -> String {
    let mut digits = String::new();
    while let Some(digit) = text.next_if(char::is_ascii_digit) {
        digits.push(digit);
    }
    digits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_sort_as_people_count() {
        let mut names = vec!["f10.png", "f9.png", "f1.png", "f09.png", "e100.png", "f1b.png", "f.png"];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(names, ["e100.png", "f.png", "f1.png", "f1b.png", "f09.png", "f9.png", "f10.png"]);
    }
}
