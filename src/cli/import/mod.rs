//! `epirig import`.

mod inspection;
mod parse;
mod sorting;
mod video;

use std::path::{Path, PathBuf};

use clap::Args;

use super::choice::choice;
use super::need::{close_others, refuse_more_than_there_is};
use super::numbers::positive_mm;
use super::rig::{given, given_by_set, named_profile};
use super::{CliError, Talk};
use crate::pipeline::import_need;
use crate::profile::Profile;
use crate::rig::nominal_lens;
use epirig_calibration::motion::MotionCheck;
use epirig_core::shell::quoted;
use epirig_data::sequence::import::{
    ImportOptions, Imported, Listing, Rotation, SortOrder, Span, choose, find_images, import,
};
use epirig_data::sequence::{FrameKind, LARGEST_IMAGE, header};
use epirig_data::storage::{Scratch, read_file};
use inspection::Inspection;
pub(super) use parse::parse_positive;
use parse::{parse_frames, parse_point, parse_span};
use sorting::{Sorting, sort_by_motion};

/// Import images or a video of other software as a sequence
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
    /// Folder, images, a pattern in quotes, or a video. Images are PNG, TIFF, JPEG, BMP, PGM or PPM, grey or
    /// colour, 8 or 16 bit
    #[arg(required = true, value_name = "IMAGES")]
    images: Vec<PathBuf>,
    /// Folder of the new sequence
    #[arg(long, value_name = "SEQ")]
    out: PathBuf,
    /// Of a video, take every N-th frame only, from the first on; --frames and --step-mm count those
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// What the images are sorted by
    #[arg(long, value_parser = choice::<Sorting>(), default_value_t = Sorting::Name)]
    sort: Sorting,
    /// First and last image to use, counted from 0 in the order of --sort, both included
    #[arg(long, value_name = "A..B", value_parser = parse_frames)]
    frames: Option<Span>,
    /// Images to leave out: numbers as for --frames, or ranges of them. Their places stay empty with --step-mm
    #[arg(long, value_name = "N,A..B", value_delimiter = ',', value_parser = parse_span)]
    exclude: Vec<Span>,
    /// Degrees by which all images are turned clockwise: the motion must be along the rows
    #[arg(long, value_name = "DEGREES", value_parser = choice::<Rotation>(), default_value_t = Rotation::None)]
    rotate: Rotation,
    /// Table of positions in mm, one for each image used: one number per line, or a column position_mm
    #[arg(long, value_name = "FILE.csv", conflicts_with = "step_mm")]
    positions: Option<PathBuf>,
    /// Distance between neighbouring frames, in mm
    #[arg(long, value_name = "MM", value_parser = positive_mm)]
    step_mm: Option<f64>,
    /// Bit depth of the camera, if it is less than that of the files
    #[arg(long, value_name = "BITS", hide_short_help = true, value_parser = clap::value_parser!(u8).range(1..=16))]
    bit_depth: Option<u8>,
    /// Folder of dark images, taken without light
    #[arg(long, value_name = "DIR", hide_short_help = true)]
    dark: Option<PathBuf>,
    /// Folder of images of a uniform target, for the flat field
    #[arg(long, value_name = "DIR", hide_short_help = true)]
    flat: Option<PathBuf>,
    /// Folder of images of a hand-held chess-board in different poses, to calibrate the lens
    #[arg(long, value_name = "DIR", hide_short_help = true)]
    board: Option<PathBuf>,
    /// Profile of the rig that took the images, of which [optics], [target] and [board] are recorded: a file,
    /// sim or real
    #[arg(long, value_name = "FILE|sim|real")]
    rig: Option<PathBuf>,
    /// Change a key of the profile; may be repeated: --set target.square="7.5 mm"
    #[arg(long, value_name = "KEY=VALUE", hide_short_help = true)]
    set: Vec<String>,
    /// Focal length, in px, in place of the profile's. With it and positions, heights are in mm
    #[arg(long, value_name = "PX", value_parser = parse_positive)]
    focal_length_px: Option<f64>,
    /// Principal point, in px: column,row [default: centre of the image]
    #[arg(long, value_name = "X,Y", hide_short_help = true, value_parser = parse_point)]
    principal_point_px: Option<(f64, f64)>,
    /// Make hard links to grey PNG files instead of copies; both must be on one file system
    #[arg(long, hide_short_help = true)]
    link: bool,
}

impl Import {
    /// Memory for the import. All images have the size of the first, or are refused by their headers.
    fn check_memory(&self, listing: &Listing, frames: usize) -> Result<(), CliError> {
        let first = self.frames.map_or(0, |(first, _)| first);
        let Some(image) = listing.images.get(first) else { return Ok(()) };
        let bytes = read_file(image, LARGEST_IMAGE)?;
        // An unreadable image is reported by the import itself.
        let Ok(head) = header(&bytes) else { return Ok(()) };
        let need = import_need(head.rows, head.columns, 2 * bytes.len() as u64) + MotionCheck::need(frames);
        refuse_more_than_there_is("importing", need, close_others)
    }

    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let profile = self.profile()?;
        let lens = profile.as_ref().and_then(|profile| nominal_lens(&profile.optics));
        if self.principal_point_px.is_some() && lens.is_none() {
            return Err(CliError::usage(
                "--principal-point-px needs the focal length: give --focal-length-px, or a profile that has it with --rig".to_owned(),
            ));
        }
        let recorded = profile.clone().map(Profile::of_lens_and_targets).transpose()?;
        let rig = recorded.map(|profile| profile.record());
        let mut options = ImportOptions {
            frames: self.frames,
            exclude: self.exclude.clone(),
            rotate: self.rotate,
            positions: self.positions.clone(),
            step_mm: self.step_mm,
            bit_depth: self.bit_depth,
            lens,
            dark: self.dark.clone(),
            flat: self.flat.clone(),
            board: self.board.clone(),
            rig,
            link: self.link,
        };
        // Frames of a video are there as long as this is.
        let video = self.video(talk)?;
        let mut listing = match &video {
            Some(video) => find_images(&[video.path().to_owned()], SortOrder::Name)?,
            None => find_images(&self.images, self.sort.of_files())?,
        };
        if video.is_some() {
            listing.place.clone_from(&self.images[0]);
        }
        let chosen = choose(&listing, options.frames, &options.exclude)?;
        self.check_memory(&listing, chosen.len())?;
        if self.sort == Sorting::Motion {
            // What is chosen is chosen by name.
            listing.images = chosen.iter().map(|image| image.path.clone()).collect();
            (options.frames, options.exclude) = (None, Vec::new());
            sort_by_motion(&mut listing)?;
        }
        let measure = format!("epirig calibrate {} --positions texture", quoted(&self.out));
        let mut inspection = Inspection::new(chosen.len(), self.sort == Sorting::Motion, measure);
        let imported = import(&listing, &self.out, &options, &mut inspection, talk)?;
        drop(video);
        for note in imported.conversions.iter().chain(&imported.findings) {
            talk.say(&format!("note: {note}"));
        }
        if listing.untimed > 0 && listing.untimed < listing.images.len() {
            talk.say(&format!(
                "note: {} of {} images do not tell when they were taken, so they are sorted by the times of their files",
                listing.untimed,
                listing.images.len()
            ));
        }
        // Motion may be found from its end.
        if let Some([first, second]) = imported.out_of_time.as_ref().filter(|_| self.sort != Sorting::Motion)
        {
            let advice = match self.sort {
                Sorting::Time => "the times of the files say otherwise",
                _ => "--sort time takes them in the order of their times",
            };
            talk.say(&format!(
                "note: the images are not in the order in which they were taken: {second} follows {first}, and was taken before it; {advice}"
            ));
        }
        if let Some(first) = imported.hidden.first() {
            let count = imported.hidden.len();
            talk.say(&format!("note: {count} hidden file(s) ignored, such as {first}"));
        }
        let has_positions = options.step_mm.is_some() || options.positions.is_some();
        if imported.has_gaps && !has_positions {
            talk.say(
                "note: the images beside one that was left out now count as one step apart; if they are two, give --step-mm or --positions, \
                 or measure the positions with `epirig calibrate --positions texture`",
            );
        }
        if let Some(first) = imported.holes.first() {
            let count = imported.holes.len();
            talk.say(&format!(
                "note: {count} name(s) are missing in the numbering, such as {first}: if a frame is missing there, every later one is off by a step; \
                 give --positions then, or measure them with `epirig calibrate --positions texture`"
            ));
        }
        let planned_mm = profile.as_ref().and_then(|profile| profile.plan.step_mm);
        if let Some(step_mm) = planned_mm.filter(|_| !has_positions) {
            talk.say(&format!(
                "note: plan.step of the profile is not used for the images; if they were taken with it, give --step-mm {step_mm}"
            ));
        }
        if self.board.is_some()
            && profile.as_ref().is_none_or(|profile| profile.board.chess_board().is_none())
        {
            talk.say(
                "note: the chess-board of --board is not described; describe it in [board] of a profile (--rig), or import again with --set \
                 board.square=..., board.columns and board.rows",
            );
        }
        if lens.is_some() && !has_positions {
            talk.say("note: heights in mm need positions too; give --step-mm or --positions");
        }
        talk.result(&imported, || {
            format!(
                "{}: {} frames of {} x {}, {} bit{}\nnext: epirig {}\n",
                quoted(&self.out),
                imported.frames,
                imported.columns,
                imported.rows,
                imported.bit_depth,
                calibration_frames(&imported),
                next(&self.out, profile.as_ref(), &imported, inspection.is_uneven)
            )
        })
    }

    /// The frames of the video, if one is given.
    fn video(&self, talk: &Talk) -> Result<Option<Scratch>, CliError> {
        match &self.images[..] {
            [path] if video::is_video_name(path) && path.is_file() => {
                let most = self.frames.map(|(_, last)| last.saturating_add(1));
                Ok(Some(video::extract(path, &self.out, (self.every as usize, most), talk)?))
            }
            images => match images.iter().find(|path| video::is_video_name(path) && path.is_file()) {
                Some(path) => Err(CliError::usage(format!(
                    "{} is a video, and other images are given beside it; import it alone",
                    path.display()
                ))),
                None if self.every > 1 => Err(CliError::usage(
                    "--every is for the frames of a video; of images, give those to use, or --frames and --exclude".to_owned(),
                )),
                None => Ok(None),
            },
        }
    }

    /// The profile that options name, if any. The default profile of this folder belongs to another rig and
    /// is not used.
    fn profile(&self) -> Result<Option<Profile>, CliError> {
        let mut changes = given_by_set(&self.set)?;
        changes.extend(given("optics.focal_length_px", "--focal-length-px", self.focal_length_px));
        let (x_px, y_px) = self.principal_point_px.unzip();
        changes.extend(given("optics.principal_point_x_px", "--principal-point-px", x_px));
        changes.extend(given("optics.principal_point_y_px", "--principal-point-px", y_px));
        let (text, source) = match &self.rig {
            Some(path) => named_profile(path)?,
            None if changes.is_empty() => return Ok(None),
            None => (String::new(), String::new()),
        };
        Ok(Some(Profile::read(&text, &source, &changes)?))
    }
}

/// The next command: calibration if there is anything to calibrate with or to measure, else the match.
fn next(out: &Path, profile: Option<&Profile>, imported: &Imported, is_uneven: bool) -> String {
    let has_target = profile.is_some_and(|profile| profile.target.print().is_some());
    let calibrates = has_target || is_uneven || !imported.calibration_frames.is_empty();
    // A target tells the positions.
    let positions = if is_uneven && !has_target { " --positions texture" } else { "" };
    format!("{} {}{positions}", if calibrates { "calibrate" } else { "match" }, quoted(out))
}

/// The numbers of calibration frames, as text.
fn calibration_frames(imported: &Imported) -> String {
    let kinds = FrameKind::CALIBRATION.iter().map(|kind| kind.folder());
    let counts = kinds.filter_map(|kind| Some((kind, imported.calibration_frames.get(kind)?)));
    counts.map(|(kind, count)| format!(", {count} {kind}")).collect()
}
