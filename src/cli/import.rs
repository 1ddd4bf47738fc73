//! `epirig import`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, Talk};
use crate::sequence::import::{ImportOptions, import};

/// Make a sequence of images that other software took
///
/// The images stay as they are. Colour is converted to grey, and that is said and recorded. Files are taken in natural
/// order: frame_9 before frame_10.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:
  epirig import photos/ --out seq
  epirig import photos/ --out seq --frames 40..80
  epirig import photos/ --out seq --step-mm 1.5 --focal-length-px 2844
  epirig import photos/ --out seq --positions positions.csv"
)]
pub(super) struct Import {
    /// Folder of PNG, TIFF or JPEG images, 8 or 16 bit
    dir: PathBuf,
    /// Folder of the new sequence
    #[arg(long, value_name = "SEQ")]
    out: PathBuf,
    /// First and last image to use, counted from 0 in natural order, both included
    #[arg(long, value_name = "A..B", value_parser = parse_frames)]
    frames: Option<(usize, usize)>,
    /// Table of positions in mm, one for each image used: a number a line, or a column position_mm
    #[arg(long, value_name = "FILE.csv", conflicts_with = "step_mm")]
    positions: Option<PathBuf>,
    /// Distance between neighbouring frames, in mm
    #[arg(long, value_name = "MM", value_parser = parse_positive)]
    step_mm: Option<f64>,
    /// Bits that the camera gave, where fewer than the files hold
    #[arg(long, value_name = "BITS", value_parser = clap::value_parser!(u8).range(1..=16))]
    bit_depth: Option<u8>,
    /// Focal length, in px; with it and positions, heights are given in mm
    #[arg(long, value_name = "PX", value_parser = parse_positive)]
    focal_length_px: Option<f64>,
    /// Principal point, in px: column,row [default: the image's middle]
    #[arg(long, value_name = "X,Y", value_parser = parse_point, requires = "focal_length_px")]
    principal_point_px: Option<(f64, f64)>,
    /// Link grey PNG files instead of copying them
    #[arg(long)]
    link: bool,
}

impl Import {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let options = ImportOptions {
            frames: self.frames,
            positions: self.positions,
            step_mm: self.step_mm,
            bit_depth: self.bit_depth,
            focal_length_px: self.focal_length_px,
            principal_point_px: self.principal_point_px,
            link: self.link,
        };
        let imported = import(&self.dir, &self.out, &options, talk)?;
        for conversion in &imported.conversions {
            talk.say(&format!("note: {conversion}"));
        }
        if options.focal_length_px.is_some() && options.positions.is_none() && options.step_mm.is_none() {
            talk.say("note: heights in mm need positions too; give --step-mm or --positions");
        }
        talk.result(&imported, || {
            format!(
                "{}: {} frames of {} x {}, {} bit\nnext: epirig match {} --reference middle\n",
                self.out.display(),
                imported.frames,
                imported.columns,
                imported.rows,
                imported.bit_depth,
                self.out.display()
            )
        })
    }
}

fn parse_frames(text: &str) -> Result<(usize, usize), String> {
    let wrong = || format!("\"{text}\" is no selection; write the first and the last image, such as 40..80");
    let (first, last) = text.split_once("..").ok_or_else(wrong)?;
    Ok((first.trim().parse().map_err(|_| wrong())?, last.trim().parse().map_err(|_| wrong())?))
}

/// A finite number above zero.
pub(super) fn parse_positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err(format!("\"{text}\" is no positive number")),
    }
}

fn parse_point(text: &str) -> Result<(f64, f64), String> {
    let wrong = || format!("\"{text}\" is no point; write column,row such as 511.5,511.5");
    let (x, y) = text.split_once(',').ok_or_else(wrong)?;
    let number =
        |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(wrong);
    Ok((number(x)?, number(y)?))
}
