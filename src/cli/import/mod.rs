//! `epirig import`.

mod arguments;
mod array;
mod inspection;
mod parse;
mod prepared;
mod sorting;
mod video;

use std::path::{Path, PathBuf};

use clap::Args;

use super::{CliError, Talk};
pub(super) use arguments::ImportArguments;
use epirig_core::shell::quoted;
use epirig_data::sequence::FrameKind;
use epirig_data::sequence::import::Imported;
pub(super) use prepared::Afterwards;

/// Import images, a video or a Zarr array as a sequence
///
/// The images are not changed. Colour is converted to grey, which is reported and recorded. Images are sorted
/// by name, in natural order: frame_9 before frame_10.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:
  epirig import photos/ --out seq
  epirig import 'photos/*.jpg' --out seq
  epirig import scan.mp4 --out seq --every 10                 needs the program ffmpeg
  epirig import scan.zarr --out seq                           frames x rows x columns
  epirig import photos/ --out seq --frames 40..80 --exclude 47,52..53
  epirig import photos/ --out seq --sort time --rotate 90     names in disorder, motion upwards
  epirig import photos/ --out seq --step-mm 1.5 --focal-length-px 2844
  epirig import photos/ --out seq --positions positions.csv
  epirig import photos/ --out seq --rig rig.toml --flat white/ --dark cap/ --board boards/

Calibration images must have the size and the bit depth of the frames, and come from the same camera
with the same settings. Only [optics], [target] and [board] of a rig profile are used: the lens, the
target on the object, and the hand-held chess-board. Positions come from --step-mm or --positions."
)]
pub(super) struct Import {
    /// Folder, images, a pattern in quotes, a video, or a Zarr array. Images are PNG, TIFF, JPEG, BMP, PGM or PPM, grey or
    /// colour, 8 or 16 bit
    #[arg(required = true, value_name = "IMAGES")]
    images: Vec<PathBuf>,
    /// Folder of the new sequence
    #[arg(long, value_name = "SEQ")]
    out: PathBuf,
    #[command(flatten)]
    arguments: ImportArguments,
}

impl Import {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let prepared = self.arguments.prepare(&self.images, &self.out, talk)?;
        let (imported, next) = prepared.import(Afterwards::Told, talk)?;
        talk.result(&imported, || format!("{}next: {next}\n", describe(&self.out, &imported)))
    }
}

/// The sequence in a line.
pub(super) fn describe(out: &Path, imported: &Imported) -> String {
    format!(
        "{}: {} frames of {} x {}, {} bit{}\n",
        quoted(out),
        imported.frames,
        imported.columns,
        imported.rows,
        imported.bit_depth,
        calibration_frames(imported)
    )
}

/// The numbers of calibration frames, as text.
fn calibration_frames(imported: &Imported) -> String {
    let kinds = FrameKind::CALIBRATION.iter().map(|kind| kind.folder());
    let counts = kinds.filter_map(|kind| Some((kind, imported.calibration_frames.get(kind)?)));
    counts.map(|(kind, count)| format!(", {count} {kind}")).collect()
}
