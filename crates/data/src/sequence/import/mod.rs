//! Import: a sequence made of images that other software took.

mod alike;
mod listing;
mod numbering;
mod options;
mod order;
mod places;
mod rotation;
mod selection;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use jiff::civil::DateTime;

use super::error::SequenceError;
use super::nominal_lens::NominalLens;
use super::pixels::{
    DecodedImage, ExifFocalLength, FocalLengths, ImageFault, LARGEST_IMAGE, decode_grey, exif_of,
    focal_length, foreign_format, header, time_of, with_bit_depth,
};
use super::positions::read_positions;
use super::reader::{MOST_FRAMES, START, describe};
use super::record::{ExitStatus, FrameKind, Origin, SequenceRecord};
use super::writer::{
    FrameFacts, SequenceWriter, StopFacts, publish, refuse_existing, scratch_beside, write_record,
};
use crate::storage::{RealDisk, read_file};
use epirig_core::frame::Frame;
use epirig_core::progress::Progress;
use epirig_core::tau::Tau;
pub use listing::{Listing, find_images, list_images};
pub use options::ImportOptions;
pub use order::SortOrder;
use order::name;
use places::refuse_inside;
pub use rotation::Rotation;
pub use selection::{Chosen, Span, choose, spans_of};

/// Looks at the frames while they are imported.
pub trait Inspector {
    /// The next frame of the sequence, the image that it is made of, and its position if that is given.
    fn look(&mut self, _image: &Chosen, _frame: &Frame, _position_mm: Option<f64>) {}

    /// The lens that has the focal length which the images tell, and the rig's record with it, if it is to be
    /// recorded. Asked after the last image, and only if no lens is stated.
    fn lens(&mut self, _told: &ExifFocalLength) -> Option<(NominalLens, serde_json::Value)> {
        None
    }

    /// What was found in all of them, one sentence each.
    fn findings(&mut self) -> Vec<String> {
        Vec::new()
    }
}

/// Finds nothing.
impl Inspector for () {}

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
    /// What looks wrong in the frames, one sentence each.
    pub findings: Vec<String>,
    /// Whether images between the first and the last were left out.
    pub has_gaps: bool,
    /// Names of two images of which the second follows the first, and was taken before it, as their EXIF tells; the
    /// first two such. `None` if times agree with the order, or are not told.
    pub out_of_time: Option<[String; 2]>,
    /// The focal length that was taken from EXIF, because none was stated.
    pub exif_focal_length: Option<ExifFocalLength>,
}

/// Makes the sequence `out` of images, which stay as they are. Calibration images must be of the size and the
/// bit depth of the frames, or they tell nothing of them.
///
/// The sequence is built beside `out` and renamed when it is whole: a failed import leaves nothing.
///
/// # Errors
/// [`SequenceError`] naming the file that cannot be used, or the folder that cannot be written.
pub fn import(
    listing: &Listing,
    out: &Path,
    options: &ImportOptions,
    inspector: &mut dyn Inspector,
    progress: &dyn Progress,
) -> Result<Imported, SequenceError> {
    let place = &listing.place;
    let mut hidden = listing.hidden.clone();
    let images = choose(listing, options.frames, &options.exclude)?;
    if images.len() < 2 {
        return Err(SequenceError::TooFewFrames { path: place.to_owned(), count: images.len() });
    }
    let used: Vec<PathBuf> = images.iter().map(|image| image.path.clone()).collect();
    let has_gaps = images.windows(2).any(|pair| pair[1].number > pair[0].number + 1);
    let holes = match options.positions.is_some() || has_gaps {
        true => Vec::new(),
        false => numbering::holes(&used),
    };
    for folder in &listing.whole {
        numbering::refuse_other_images(folder, &listing.images)?;
    }
    refuse_existing(out)?;
    // A folder of single files holds other things, too.
    listing.whole.iter().try_for_each(|folder| refuse_inside(out, folder))?;
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
            // The stage was there for an image that is left out, too.
            let first = images[0].number;
            let positions: Vec<f64> =
                images.iter().map(|image| (image.number - first) as f64 * step_mm).collect();
            Tau::from_positions(&positions)
                .map_err(|source| SequenceError::Positions { path: place.to_owned(), source })?;
            Some(positions)
        }
        (None, None) => None,
    };

    if images.len() > MOST_FRAMES {
        return Err(SequenceError::TooManyFrames {
            path: place.to_owned(),
            count: images.len(),
            most: MOST_FRAMES,
        });
    }
    let first = &images[0].path;
    let bytes = read_file(first, LARGEST_IMAGE)?;
    refuse_foreign_bytes(first, &bytes)?;
    let stored = header(&bytes).map_err(fault_of(first))?;
    let head = decode(first, &bytes, options)?;
    drop(bytes);
    let scratch = scratch_beside(out)?;
    let building = scratch.path().join("sequence");

    // Conversions are known only after the last image, so the record is written with the first frames' and
    // then again.
    let mut record = start_record(place, &head, images.len(), positions_mm.clone(), options);
    let mut import = Import {
        writer: SequenceWriter::create(&building, &record)?,
        options,
        first,
        images: &images,
        stored: describe(stored.rows, stored.columns, stored.bits),
        expected: describe(record.rows, record.columns, record.bit_depth),
        conversions: BTreeMap::new(),
        latest: None,
        out_of_time: None,
        focal_lengths: FocalLengths::default(),
    };
    let total = images.len() + calibration.iter().map(|(_, images)| images.len()).sum::<usize>();
    progress.begin("importing", total as u64);
    for (index, image) in images.iter().enumerate() {
        progress.unless_cancelled()?;
        let position_mm = positions_mm.as_ref().map(|positions| positions[index]);
        let frame = import.take(FrameKind::Scan, index, image, position_mm)?;
        inspector.look(image, &frame, position_mm);
        progress.advance(1);
    }
    for (kind, images) in &calibration {
        for (index, path) in images.iter().enumerate() {
            progress.unless_cancelled()?;
            let image = Chosen { number: index, path: path.clone() };
            import.take(*kind, index, &image, None)?;
            progress.advance(1);
        }
    }
    progress.end();
    let Import { writer, conversions: done, out_of_time, focal_lengths, .. } = import;
    writer.finish(ExitStatus::Complete, StopFacts::default())?;
    let done: Vec<String> = done.iter().map(|(words, count)| format!("{count} image(s): {words}")).collect();
    let (exif_focal_length, zoom) = match focal_lengths.agreed() {
        Some(Ok(told)) if options.lens.is_none() => {
            let known = inspector.lens(&told);
            let is_known = known.is_some();
            if let (Some((lens, with_lens)), Origin::Imported { rig, .. }) = (known, &mut record.origin) {
                record.intrinsics = Some(lens.intrinsics(record.columns, record.rows));
                *rig = Some(with_lens);
            }
            (is_known.then_some(told), None)
        }
        Some(Err(zoom)) => (None, Some(zoom)),
        _ => (None, None),
    };
    let mut found = inspector.findings();
    found.extend(zoom);
    if let Origin::Imported { conversions, findings, .. } = &mut record.origin {
        conversions.clone_from(&done);
        findings.clone_from(&found);
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
        findings: found,
        has_gaps,
        out_of_time,
        exif_focal_length,
    })
}

/// An import in progress.
struct Import<'a> {
    writer: SequenceWriter,
    options: &'a ImportOptions,
    /// The image that the others must be like ...
    first: &'a Path,
    /// All that become frames of the scan.
    images: &'a [Chosen],
    /// ... the value in its header ...
    stored: String,
    /// ... and the value expected.
    expected: String,
    /// Number of images by conversion.
    conversions: BTreeMap<String, usize>,
    /// The last frame of the scan that tells when it was taken, with its name.
    latest: Option<(DateTime, String)>,
    /// As in [`Imported`].
    out_of_time: Option<[String; 2]>,
    /// Those that the frames of the scan tell.
    focal_lengths: FocalLengths,
}

impl Import<'_> {
    /// Makes an image the frame `index` of its kind.
    fn take(
        &mut self,
        kind: FrameKind,
        index: usize,
        chosen: &Chosen,
        commanded_mm: Option<f64>,
    ) -> Result<Frame, SequenceError> {
        let path = &chosen.path;
        let bytes = read_file(path, LARGEST_IMAGE)?;
        refuse_foreign_bytes(path, &bytes)?;
        let stored = header(&bytes).map_err(fault_of(path))?;
        let stored = describe(stored.rows, stored.columns, stored.bits);
        if stored != self.stored {
            return Err(self.unlike(kind, chosen, stored, self.stored.clone()));
        }
        let exif = exif_of(&bytes);
        let taken = exif.as_ref().and_then(time_of);
        let image = decode(path, &bytes, self.options)?;
        let found = describe(image.frame.rows(), image.frame.columns(), image.frame.bit_depth());
        if found != self.expected {
            return Err(self.unlike(kind, chosen, found, self.expected.clone()));
        }
        if let Some(words) = image.conversion {
            *self.conversions.entry(words.to_owned()).or_default() += 1;
        }
        let rotate = self.options.rotate;
        if rotate != Rotation::None {
            let words = format!("turned clockwise by {rotate} degrees (--rotate)");
            *self.conversions.entry(words).or_default() += 1;
        }
        let facts = FrameFacts { commanded_mm, source: Some(name(path)), taken, ..FrameFacts::default() };
        if let (FrameKind::Scan, Some(taken)) = (kind, taken) {
            self.follow(taken, name(path));
        }
        let size = (image.frame.rows(), image.frame.columns());
        let told =
            exif.as_ref().filter(|_| kind == FrameKind::Scan).and_then(|exif| focal_length(exif, size));
        if let Some(told) = told {
            self.focal_lengths.add(told, name(path));
        }
        match (image.usable_as_is, self.options.link) {
            (true, true) => self.writer.put_link(kind, index, &image.frame, (path, &bytes), facts),
            (true, false) => self.writer.put_encoded(kind, index, &image.frame, &bytes, facts),
            (false, _) => self.writer.put(kind, index, &image.frame, facts),
        }?;
        Ok(image.frame)
    }

    /// Notes whether a frame of the scan was taken before the one in front of it.
    fn follow(&mut self, taken: DateTime, name: String) {
        if let Some((before, other)) = &self.latest
            && taken < *before
            && self.out_of_time.is_none()
        {
            self.out_of_time = Some([other.clone(), name.clone()]);
        }
        self.latest = Some((taken, name));
    }

    fn unlike(&self, kind: FrameKind, image: &Chosen, found: String, expected: String) -> SequenceError {
        let (path, first) = (image.path.clone(), self.first.to_owned());
        match kind {
            FrameKind::Scan => {
                let unlike_most = alike::unlike_most(self.images).into();
                SequenceError::Unlike {
                    path,
                    found: found.into(),
                    first,
                    expected: expected.into(),
                    unlike_most,
                }
            }
            _ => SequenceError::CalibrationUnlike { path, found, expected },
        }
    }
}

fn start_record(
    place: &Path,
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
    let origin = Origin::Imported {
        folder: place.display().to_string(),
        conversions: Vec::new(),
        findings: Vec::new(),
        calibration_folders,
        rig: options.rig.clone(),
    };
    SequenceRecord {
        positions_mm,
        intrinsics: options.lens.map(|lens| lens.intrinsics(columns, rows)),
        ..SequenceRecord::new(origin, (rows, columns), head.frame.bit_depth(), frames)
    }
}

fn decode(path: &Path, bytes: &[u8], options: &ImportOptions) -> Result<DecodedImage, SequenceError> {
    let mut image = decode_grey(bytes).map_err(fault_of(path))?;
    let wrong = |source| SequenceError::BitDepth { path: path.to_owned(), source };
    if let Some(bit_depth) = options.bit_depth {
        image.frame = with_bit_depth(image.frame, bit_depth).map_err(wrong)?;
    }
    if options.rotate != Rotation::None {
        image.frame = options.rotate.turn(image.frame).map_err(wrong)?;
        image.usable_as_is = false;
    }
    Ok(image)
}

/// Refuses a file of a format that is not read, which its name does not tell.
fn refuse_foreign_bytes(path: &Path, bytes: &[u8]) -> Result<(), SequenceError> {
    match foreign_format(path, bytes) {
        Some(format) => Err(SequenceError::ForeignFormat { path: path.to_owned(), format, count: 1 }),
        None => Ok(()),
    }
}

fn fault_of(path: &Path) -> impl FnOnce(ImageFault) -> SequenceError {
    let path = path.to_owned();
    move |fault| match fault {
        ImageFault::Damaged(reason) => SequenceError::BadImage { path, reason },
        other => SequenceError::Unusable { path, reason: other.to_string() },
    }
}
