//! Options of the verbs that import images.

use std::path::{Path, PathBuf};

use clap::Args;

use super::super::choice::choice;
use super::super::numbers::positive_mm;
use super::super::rig::{given, given_by_set, named_profile};
use super::super::{CliError, Talk};
use super::parse::{parse_frames, parse_point, parse_positive, parse_span};
use super::prepared::Prepared;
use super::sorting::Sorting;
use super::{array, video};
use crate::profile::Profile;
use crate::rig::nominal_lens;
use epirig_data::packed::is_zarr;
use epirig_data::sequence::import::{ImportOptions, Rotation, SortOrder, Span, choose, find_images};
use epirig_data::storage::Scratch;

/// What is said of images besides where they are.
#[derive(Debug, Args)]
pub(in crate::cli) struct ImportArguments {
    /// Of a video or an array, take every N-th frame only, from the first on; --frames and --step-mm count those
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
    /// Degrees by which all images are turned clockwise, for `epirig match` without a calibration
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
    /// Focal length, in px, in place of the profile's. With it and positions, heights are in mm [default: as EXIF
    /// tells, if all images agree]
    #[arg(long, value_name = "PX", value_parser = parse_positive)]
    focal_length_px: Option<f64>,
    /// Principal point, in px: column,row [default: centre of the image]
    #[arg(long, value_name = "X,Y", hide_short_help = true, value_parser = parse_point)]
    principal_point_px: Option<(f64, f64)>,
    /// Make hard links to grey PNG files instead of copies; both must be on one file system
    #[arg(long, hide_short_help = true)]
    link: bool,
}

impl ImportArguments {
    /// Finds the images, and what is known of them. Refuses what does not fit together, and images too large for
    /// the memory.
    pub(in crate::cli) fn prepare(
        &self,
        images: &[PathBuf],
        out: &Path,
        talk: &Talk,
    ) -> Result<Prepared, CliError> {
        let profile = self.profile()?;
        let lens = profile.as_ref().and_then(|profile| nominal_lens(&profile.optics));
        if self.principal_point_px.is_some() && lens.is_none() {
            return Err(CliError::usage(
                "--principal-point-px needs the focal length: give --focal-length-px, or a profile that has it with --rig".to_owned(),
            ));
        }
        let recorded = profile.clone().map(Profile::of_lens_and_targets).transpose()?;
        let rig = recorded.map(|profile| profile.record());
        let options = ImportOptions {
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
        let extracted = self.extracted(images, out, talk)?;
        let mut listing = match &extracted {
            Some(extracted) => find_images(&[extracted.path().to_owned()], SortOrder::Name)?,
            None => find_images(images, self.sort.of_files())?,
        };
        if extracted.is_some() {
            listing.place.clone_from(&images[0]);
        }
        let chosen = choose(&listing, options.frames, &options.exclude)?;
        let prepared = Prepared {
            out: out.to_owned(),
            profile,
            options,
            sorting: self.sort,
            listing,
            chosen,
            extracted,
        };
        prepared.check_memory()?;
        Ok(prepared)
    }

    /// The frames of the video or the array, if one is given.
    fn extracted(&self, images: &[PathBuf], out: &Path, talk: &Talk) -> Result<Option<Scratch>, CliError> {
        let is_video = |path: &PathBuf| video::is_video_name(path) && path.is_file();
        let of_many = (self.every as usize, self.frames.map(|(_, last)| last.saturating_add(1)));
        match images {
            [path] if is_video(path) => Ok(Some(video::extract(path, out, of_many, talk)?)),
            [path] if is_zarr(path) => Ok(Some(array::extract(path, out, of_many, talk)?)),
            images => match images.iter().find(|path| is_video(path) || is_zarr(path)) {
                Some(path) => Err(CliError::usage(format!(
                    "{} is {}, and other images are given beside it; import it alone",
                    path.display(),
                    if is_video(path) { "a video" } else { "an array" }
                ))),
                None if self.every > 1 => Err(CliError::usage(
                    "--every is for the frames of a video or an array; of images, give those to use, or --frames and --exclude".to_owned(),
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
