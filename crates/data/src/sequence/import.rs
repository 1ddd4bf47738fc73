//! Import: a sequence made of images that other software took.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::error::SequenceError;
use super::nominal_lens::NominalLens;
use super::numbering;
use super::pixels::{DecodedImage, ImageFault, LARGEST_IMAGE, decode_grey, header, with_bit_depth};
use super::positions::read_positions;
use super::reader::{MOST_FRAMES, START, describe};
use super::record::{ExitStatus, FORMAT_VERSION, FrameKind, Origin, SequenceRecord};
use super::writer::{
    FrameFacts, SequenceWriter, StopFacts, new_uid, now, publish, refuse_existing, scratch_beside,
    write_record,
};
use crate::storage::{RealDisk, kind, read_file};
use epirig_core::progress::Progress;
use epirig_core::tau::Tau;

/// Facts about the images from a person.
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
    /// The lens, if known.
    pub lens: Option<NominalLens>,
    /// A folder of images without light.
    pub dark: Option<PathBuf>,
    /// A folder of images of a uniform target.
    pub flat: Option<PathBuf>,
    /// A folder of images of a chess-board in a hand.
    pub board: Option<PathBuf>,
    /// The rig's lens and targets, for [`Origin::Imported`].
    pub rig: Option<serde_json::Value>,
    /// Whether grey PNG files are linked instead of copied.
    pub link: bool,
}

impl ImportOptions {
    /// The folders of calibration images.
    fn calibration(&self) -> impl Iterator<Item = (FrameKind, &Path)> {
        FrameKind::CALIBRATION.into_iter().filter_map(|kind| {
            let folder = match kind {
                FrameKind::Scan => None,
                FrameKind::Dark => self.dark.as_deref(),
                FrameKind::Flat => self.flat.as_deref(),
                FrameKind::Board => self.board.as_deref(),
            };
            Some((kind, folder?))
        })
    }
}

/// The result of an import.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Imported {
    /// Frames written.
    pub frames: usize,
    /// Calibration frames written, by the sequence's folder for them.
    pub calibration_frames: BTreeMap<String, usize>,
    /// Rows of a frame.
    pub rows: usize,
    /// Columns of a frame.
    pub columns: usize,
    /// Bits of a sample.
    pub bit_depth: u8,
    /// Conversions of the images, one sentence each.
    pub conversions: Vec<String>,
    /// Names of hidden files that were passed over.
    pub hidden: Vec<String>,
    /// Names that numbered images lack between the first and the last; empty where positions were given one by one.
    pub holes: Vec<String>,
}

/// Images in a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listing {
    /// The images in natural order: `frame_9` before `frame_10`.
    pub images: Vec<PathBuf>,
    /// Names of hidden files that were passed over: some systems keep notes of their own beside images
    /// (`._0001.png`).
    pub hidden: Vec<String>,
}

/// Lists the images in a folder. Links to files count as files.
///
/// # Errors
/// [`SequenceError`] if the folder cannot be listed or holds no images; [`SequenceError::NotFiles`] if a name
/// of an image has no file behind it.
pub fn list_images(folder: &Path) -> Result<Listing, SequenceError> {
    let (mut images, mut hidden, mut wrong) = (Vec::new(), Vec::new(), Vec::new());
    for entry in fs::read_dir(folder).map_err(SequenceError::io("look into", folder))? {
        let path = entry.map_err(SequenceError::io("look into", folder))?.path();
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        if !matches!(extension.as_deref(), Some("png" | "tif" | "tiff" | "jpg" | "jpeg")) {
            continue;
        }
        let name = name(&path);
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
        return Err(SequenceError::NoImages { path: folder.to_owned() });
    }
    images.sort_by(|a, b| natural_order(&name(a), &name(b)).then_with(|| a.cmp(b)));
    // Cameras write a frame as raw image and as JPEG: both would count.
    let mut stems = BTreeMap::new();
    for image in &images {
        if let Some(other) = stems.insert(image.file_stem(), image) {
            let found = vec![format!("{} and {} have one name in two formats", name(other), name(image))];
            return Err(SequenceError::NotFiles { folder: folder.to_owned(), found });
        }
    }
    Ok(Listing { images, hidden })
}

/// Makes the sequence `out` of the images in `folder`, which stay as they are. Calibration images must be of
/// the size and the bit depth of the frames, or they tell nothing of them.
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
    let Listing { images: all, mut hidden } = list_images(folder)?;
    let (first, last) = options.frames.unwrap_or((0, all.len() - 1));
    if first > last || last >= all.len() {
        return Err(SequenceError::NoSuchFrames { path: folder.to_owned(), first, last, count: all.len() });
    }
    let images = &all[first..=last];
    if images.len() < 2 {
        return Err(SequenceError::TooFewFrames { path: folder.to_owned(), count: images.len() });
    }
    let holes = if options.positions.is_some() { Vec::new() } else { numbering::holes(images) };
    numbering::refuse_other_images(folder, &all)?;
    refuse_existing(out)?;
    refuse_inside(out, folder)?;
    let mut calibration = Vec::new();
    for (kind, folder) in options.calibration() {
        refuse_inside(out, folder)?;
        let listing = list_images(folder)?;
        hidden.extend(listing.hidden);
        calibration.push((kind, listing.images));
    }
    let positions_mm = match (&options.positions, options.step_mm) {
        (Some(path), _) => Some(read_positions(path, images.len())?),
        (None, Some(step_mm)) => {
            let positions: Vec<f64> = (0..images.len()).map(|index| index as f64 * step_mm).collect();
            Tau::from_positions(&positions)
                .map_err(|source| SequenceError::Positions { path: folder.to_owned(), source })?;
            Some(positions)
        }
        (None, None) => None,
    };

    if images.len() > MOST_FRAMES {
        return Err(SequenceError::TooManyFrames {
            path: folder.to_owned(),
            count: images.len(),
            most: MOST_FRAMES,
        });
    }
    let bytes = read_file(&images[0], LARGEST_IMAGE)?;
    let stored = header(&bytes).map_err(fault_of(&images[0]))?;
    let head = decode(&images[0], &bytes, options.bit_depth)?;
    drop(bytes);
    let scratch = scratch_beside(out)?;
    let building = scratch.path().join("sequence");

    // Conversions are known only after the last image, so the record is written with the first frames' and
    // then again.
    let mut record = start_record(folder, &head, images.len(), positions_mm.clone(), options);
    let mut import = Import {
        writer: SequenceWriter::create(&building, &record)?,
        options,
        first: &images[0],
        stored: describe(stored.rows, stored.columns, stored.bits),
        expected: describe(record.rows, record.columns, record.bit_depth),
        conversions: BTreeMap::new(),
    };
    let total = images.len() + calibration.iter().map(|(_, images)| images.len()).sum::<usize>();
    progress.begin("importing", total as u64);
    for (index, path) in images.iter().enumerate() {
        let position_mm = positions_mm.as_ref().map(|positions| positions[index]);
        import.take(FrameKind::Scan, index, path, position_mm)?;
        progress.advance(1);
    }
    for (kind, images) in &calibration {
        for (index, path) in images.iter().enumerate() {
            import.take(*kind, index, path, None)?;
            progress.advance(1);
        }
    }
    progress.end();
    let Import { writer, conversions: done, .. } = import;
    writer.finish(ExitStatus::Complete, StopFacts::default())?;
    let done: Vec<String> = done.iter().map(|(words, count)| format!("{count} image(s): {words}")).collect();
    if let Origin::Imported { conversions, .. } = &mut record.origin {
        conversions.clone_from(&done);
    }
    write_record(&mut RealDisk, &building.join(START), &record)?;
    publish(&mut RealDisk, &building, out)?;
    let counted = |(kind, images): &(FrameKind, Vec<PathBuf>)| (kind.folder().to_owned(), images.len());
    Ok(Imported {
        frames: images.len(),
        calibration_frames: calibration.iter().map(counted).collect(),
        rows: record.rows,
        columns: record.columns,
        bit_depth: record.bit_depth,
        conversions: done,
        hidden,
        holes,
    })
}

/// An import in progress.
struct Import<'a> {
    writer: SequenceWriter,
    options: &'a ImportOptions,
    /// The image that the others must be like ...
    first: &'a Path,
    /// ... the value in its header ...
    stored: String,
    /// ... and the value expected.
    expected: String,
    /// Number of images by conversion.
    conversions: BTreeMap<&'static str, usize>,
}

impl Import<'_> {
    /// Makes an image the frame `index` of its kind.
    fn take(
        &mut self,
        kind: FrameKind,
        index: usize,
        path: &Path,
        commanded_mm: Option<f64>,
    ) -> Result<(), SequenceError> {
        let bytes = read_file(path, LARGEST_IMAGE)?;
        let stored = header(&bytes).map_err(fault_of(path))?;
        let stored = describe(stored.rows, stored.columns, stored.bits);
        if stored != self.stored {
            return Err(self.unlike(kind, path, stored, self.stored.clone()));
        }
        let image = decode(path, &bytes, self.options.bit_depth)?;
        let found = describe(image.frame.rows(), image.frame.columns(), image.frame.bit_depth());
        if found != self.expected {
            return Err(self.unlike(kind, path, found, self.expected.clone()));
        }
        if let Some(words) = image.conversion {
            *self.conversions.entry(words).or_default() += 1;
        }
        let facts = FrameFacts { commanded_mm, source: Some(name(path)), ..FrameFacts::default() };
        match (image.usable_as_is, self.options.link) {
            (true, true) => self.writer.put_link(kind, index, &image.frame, (path, &bytes), facts),
            (true, false) => self.writer.put_encoded(kind, index, &image.frame, &bytes, facts),
            (false, _) => self.writer.put(kind, index, &image.frame, facts),
        }
    }

    fn unlike(&self, kind: FrameKind, path: &Path, found: String, expected: String) -> SequenceError {
        let path = path.to_owned();
        match kind {
            FrameKind::Scan => SequenceError::Unlike { path, found, first: self.first.to_owned(), expected },
            _ => SequenceError::CalibrationUnlike { path, found, expected },
        }
    }
}

/// Refuses a sequence that would lie among the images that it is made of.
fn refuse_inside(out: &Path, folder: &Path) -> Result<(), SequenceError> {
    let source = fs::canonicalize(folder).map_err(SequenceError::io("look into", folder))?;
    if resolved(out).is_some_and(|out| out.starts_with(&source)) {
        return Err(SequenceError::InsideSource { out: out.to_owned(), folder: folder.to_owned() });
    }
    Ok(())
}

/// Where a path leads that need not be there yet: its links followed as far as there are any.
fn resolved(path: &Path) -> Option<PathBuf> {
    let path = std::path::absolute(path).ok()?;
    let there = path.ancestors().find_map(|ancestor| Some((ancestor, fs::canonicalize(ancestor).ok()?)));
    let (ancestor, real) = there?;
    Some(real.join(path.strip_prefix(ancestor).ok()?))
}

fn start_record(
    folder: &Path,
    head: &DecodedImage,
    frames: usize,
    positions_mm: Option<Vec<f64>>,
    options: &ImportOptions,
) -> SequenceRecord {
    let (rows, columns) = (head.frame.rows(), head.frame.columns());
    let calibration_folders = options
        .calibration()
        .map(|(kind, folder)| (kind.folder().to_owned(), folder.display().to_string()))
        .collect();
    SequenceRecord {
        format: FORMAT_VERSION,
        uid: new_uid(),
        program: concat!("epirig ", env!("CARGO_PKG_VERSION")).to_owned(),
        created: now(),
        origin: Origin::Imported {
            folder: folder.display().to_string(),
            conversions: Vec::new(),
            calibration_folders,
            rig: options.rig.clone(),
        },
        rows,
        columns,
        bit_depth: head.frame.bit_depth(),
        frames,
        positions_mm,
        intrinsics: options.lens.map(|lens| lens.intrinsics(columns, rows)),
    }
}

fn decode(path: &Path, bytes: &[u8], bit_depth: Option<u8>) -> Result<DecodedImage, SequenceError> {
    let mut image = decode_grey(bytes).map_err(fault_of(path))?;
    if let Some(bit_depth) = bit_depth {
        image.frame = with_bit_depth(image.frame, bit_depth)
            .map_err(|source| SequenceError::BitDepth { path: path.to_owned(), source })?;
    }
    Ok(image)
}

fn fault_of(path: &Path) -> impl FnOnce(ImageFault) -> SequenceError {
    let path = path.to_owned();
    move |fault| match fault {
        ImageFault::Damaged(reason) => SequenceError::BadImage { path, reason },
        other => SequenceError::Unusable { path, reason: other.to_string() },
    }
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
