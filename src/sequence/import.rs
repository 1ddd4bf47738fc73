//! Images that other software took, made a sequence.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::disk::RealDisk;
use super::error::SequenceError;
use super::pixels::{DecodedImage, decode_grey, with_bit_depth};
use super::positions::read_positions;
use super::reader::{START, describe};
use super::record::{ExitStatus, FORMAT_VERSION, Intrinsics, Origin, SequenceRecord};
use super::writer::{
    FrameFacts, SequenceWriter, StopFacts, new_uid, now, publish, refuse_existing, scratch_beside,
    write_record,
};
use crate::progress::Progress;

/// What a person says of the images.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ImportOptions {
    /// First and last index of the images to use, in natural order from 0, both included; `None` for all.
    pub frames: Option<(usize, usize)>,
    /// A table of positions in mm, one for each frame that is used.
    pub positions: Option<PathBuf>,
    /// Distance between frames in mm, if they are equidistant and it is known.
    pub step_mm: Option<f64>,
    /// Bits that the camera gave, where fewer than the files hold (for example 12 in 16-bit files).
    pub bit_depth: Option<u8>,
    /// Focal length in px, and the principal point (the image's middle if not given).
    pub focal_length_px: Option<f64>,
    /// Principal point in px, column and row.
    pub principal_point_px: Option<(f64, f64)>,
    /// Whether grey PNG files are linked instead of copied.
    pub link: bool,
}

/// What an import did.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Imported {
    /// Frames written.
    pub frames: usize,
    /// Rows of a frame.
    pub rows: usize,
    /// Columns of a frame.
    pub columns: usize,
    /// Bits of a sample.
    pub bit_depth: u8,
    /// What was done to the images, one sentence each.
    pub conversions: Vec<String>,
}

/// Images in a folder, in natural order: `frame_9` before `frame_10`.
///
/// # Errors
/// [`SequenceError`] if the folder cannot be listed or holds no images.
pub fn list_images(folder: &Path) -> Result<Vec<PathBuf>, SequenceError> {
    let mut images = Vec::new();
    for entry in fs::read_dir(folder).map_err(SequenceError::io("look into", folder))? {
        let path = entry.map_err(SequenceError::io("look into", folder))?.path();
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        if matches!(extension.as_deref(), Some("png" | "tif" | "tiff" | "jpg" | "jpeg")) && path.is_file() {
            images.push(path);
        }
    }
    if images.is_empty() {
        return Err(SequenceError::NoImages { path: folder.to_owned() });
    }
    images.sort_by(|a, b| natural_order(&name(a), &name(b)));
    Ok(images)
}

/// Makes the sequence `out` of the images in `folder`, which stay as they are.
///
/// The sequence is built beside `out` and renamed when it is whole: a failed import leaves nothing.
///
/// # Errors
/// [`SequenceError`] naming the file that cannot be used, or the folder that cannot be written.
pub fn import(
    folder: &Path,
    out: &Path,
    options: &ImportOptions,
    progress: &dyn Progress,
) -> Result<Imported, SequenceError> {
    let all = list_images(folder)?;
    let (first, last) = options.frames.unwrap_or((0, all.len() - 1));
    if first > last || last >= all.len() {
        return Err(SequenceError::NoSuchFrames { path: folder.to_owned(), first, last, count: all.len() });
    }
    let images = &all[first..=last];
    if images.len() < 2 {
        return Err(SequenceError::TooFewFrames { path: folder.to_owned(), count: images.len() });
    }
    refuse_existing(out)?;
    let source = fs::canonicalize(folder).map_err(SequenceError::io("look into", folder))?;
    if std::path::absolute(out).is_ok_and(|out| out.starts_with(&source)) {
        return Err(SequenceError::InsideSource { out: out.to_owned(), folder: folder.to_owned() });
    }
    let positions_mm = match (&options.positions, options.step_mm) {
        (Some(path), _) => Some(read_positions(path, images.len())?),
        (None, Some(step_mm)) => Some((0..images.len()).map(|index| index as f64 * step_mm).collect()),
        (None, None) => None,
    };

    let (_, head) = read_image(&images[0], options.bit_depth)?;
    let mut conversions: BTreeMap<&'static str, usize> = BTreeMap::new();
    let scratch = scratch_beside(out)?;
    let building = scratch.path().join("sequence");

    // Conversions are known only after the last image, so the record is written with the first frames' and then again.
    let record = start_record(folder, &head, images.len(), positions_mm.clone(), options);
    let mut writer = SequenceWriter::create(&building, &record)?;
    progress.begin("importing", images.len() as u64);
    for (index, path) in images.iter().enumerate() {
        let (bytes, image) = read_image(path, options.bit_depth)?;
        let expected = describe(record.rows, record.columns, record.bit_depth);
        let found = describe(image.frame.rows(), image.frame.columns(), image.frame.bit_depth());
        if found != expected {
            let first = images[0].clone();
            return Err(SequenceError::Unlike { path: path.clone(), found, first, expected });
        }
        if let Some(words) = image.conversion {
            *conversions.entry(words).or_default() += 1;
        }
        let facts = FrameFacts {
            commanded_mm: positions_mm.as_ref().map(|positions| positions[index]),
            source: Some(name(path)),
            ..FrameFacts::default()
        };
        match (image.usable_as_is, options.link) {
            (true, true) => writer.add_link(&image.frame, path, &bytes, facts)?,
            (true, false) => writer.add_encoded(&image.frame, &bytes, facts)?,
            (false, _) => writer.add(&image.frame, facts)?,
        }
        progress.advance(1);
    }
    progress.end();
    writer.finish(ExitStatus::Complete, StopFacts::default())?;
    let conversions: Vec<String> =
        conversions.iter().map(|(words, count)| format!("{count} image(s): {words}")).collect();
    let mut record = record;
    record.origin =
        Origin::Imported { folder: folder.display().to_string(), conversions: conversions.clone() };
    write_record(&mut RealDisk, &building.join(START), &record)?;
    publish(&mut RealDisk, &building, out)?;
    Ok(Imported {
        frames: images.len(),
        rows: record.rows,
        columns: record.columns,
        bit_depth: record.bit_depth,
        conversions,
    })
}

fn start_record(
    folder: &Path,
    head: &DecodedImage,
    frames: usize,
    positions_mm: Option<Vec<f64>>,
    options: &ImportOptions,
) -> SequenceRecord {
    let (rows, columns) = (head.frame.rows(), head.frame.columns());
    let intrinsics = options.focal_length_px.map(|focal_length_px| {
        let centred = Intrinsics::centred(focal_length_px, columns, rows);
        options.principal_point_px.map_or(centred, |(principal_point_x_px, principal_point_y_px)| {
            Intrinsics { focal_length_px, principal_point_x_px, principal_point_y_px }
        })
    });
    SequenceRecord {
        format: FORMAT_VERSION,
        uid: new_uid(),
        program: concat!("epirig ", env!("CARGO_PKG_VERSION")).to_owned(),
        created: now(),
        origin: Origin::Imported { folder: folder.display().to_string(), conversions: Vec::new() },
        rows,
        columns,
        bit_depth: head.frame.bit_depth(),
        frames,
        positions_mm,
        intrinsics,
    }
}

fn read_image(path: &Path, bit_depth: Option<u8>) -> Result<(Vec<u8>, DecodedImage), SequenceError> {
    let bytes = fs::read(path).map_err(SequenceError::io("read", path))?;
    let mut image =
        decode_grey(&bytes).map_err(|reason| SequenceError::BadImage { path: path.to_owned(), reason })?;
    if let Some(bit_depth) = bit_depth {
        image.frame = with_bit_depth(image.frame, bit_depth)
            .map_err(|source| SequenceError::BitDepth { path: path.to_owned(), source })?;
    }
    Ok((bytes, image))
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Compares runs of digits by value and everything else by character.
fn natural_order(a: &str, b: &str) -> Ordering {
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
