//! Photographs along a straight line with their truth, as the tests draw them, written into a
//! folder.
//!
//! ```sh
//! cargo run --release -p epirig-photographs --example photographs -- --out set --roll 2 --wobble 0.02 --missing 7,8
//! ```

#![allow(clippy::unwrap_used, reason = "an example stops at the first thing that does not work")]

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use epirig_photographs::{Orientation, Photographs, Relief, Texture};

/// Photographs of a relief from a camera on a slider, for trials of what measures them. They come to
/// OUT/photographs, and their truth to OUT: truth.json, and parallax.npy, which has f (s_last -
/// s_first) / Z in the frame in the middle, in px.
#[derive(Parser)]
struct Arguments {
    /// The folder, which is made.
    #[arg(long)]
    out: PathBuf,
    #[arg(long, default_value_t = 1000)]
    rows: usize,
    #[arg(long, default_value_t = 1500)]
    columns: usize,
    #[arg(long, default_value_t = 30)]
    frames: usize,
    /// Focal length in px; without it, twice the columns.
    #[arg(long)]
    focal_length: Option<f64>,
    /// Movement over all frames, in px; without it, 0.174 times the columns.
    #[arg(long)]
    baseline: Option<f64>,
    #[arg(long, value_enum, default_value = "hills")]
    relief: ReliefName,
    /// Parallax of the relief over the baseline, in px; without it, 0.05 times the baseline.
    #[arg(long)]
    relief_px: Option<f64>,
    #[arg(long, value_enum, default_value = "noise")]
    texture: TextureName,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Angle of the motion in the image plane, in degrees: 90 is down, 180 to the left.
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    roll: f64,
    /// Angle of the motion out of the image plane, in degrees.
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    pan: f64,
    /// RMS of the rotation of the frames about each axis, in degrees.
    #[arg(long, default_value_t = 0.0)]
    wobble: f64,
    /// RMS of the displacement across the path, in px.
    #[arg(long, default_value_t = 0.0)]
    offset: f64,
    /// Steps differ by up to this share.
    #[arg(long, default_value_t = 0.0)]
    uneven: f64,
    /// Numbers of photographs that are left out; the first is 1.
    #[arg(long, value_delimiter = ',')]
    missing: Vec<usize>,
    /// Number of a photograph that is taken where the one before it was.
    #[arg(long)]
    repeated: Option<usize>,
    /// Number of a photograph before which the camera goes back by 0.7 steps.
    #[arg(long)]
    step_back: Option<usize>,
    /// Light differs by up to this share.
    #[arg(long, default_value_t = 0.0)]
    light: f64,
    /// Noise, in grey values.
    #[arg(long, default_value_t = 2.0)]
    noise: f64,
    /// Movement during an exposure, in px.
    #[arg(long, default_value_t = 0.0)]
    blur: f64,
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    k1: f64,
    /// Quality of the JPEG images; 0 for PNG.
    #[arg(long, default_value_t = 92)]
    jpeg: u8,
    /// How the JPEG images are stored.
    #[arg(long, value_enum, default_value = "upright")]
    orientation: OrientationName,
    /// The JPEG images tell the focal length.
    #[arg(long)]
    exif_focal_length: bool,
    /// Number the files without gaps, whatever is missing.
    #[arg(long)]
    renumbered: bool,
    /// Write the frames of an ideal camera along the motion, too: to OUT/straightened, with their
    /// true disparity.
    #[arg(long)]
    straightened: bool,
    /// Write the photographs rectified with the true motion, too: to OUT/rectified, with positions
    /// and their true disparity.
    #[arg(long)]
    rectified: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum ReliefName {
    Flat,
    Hills,
    Mounds,
    Grooves,
    Slope,
}

#[derive(Clone, Copy, ValueEnum)]
enum TextureName {
    Noise,
    Patches,
    Repeating,
    Weak,
    Stripes,
    Blobs,
}

#[derive(Clone, Copy, ValueEnum)]
enum OrientationName {
    Upright,
    HalfTurn,
    Clockwise,
    Counterclockwise,
}

impl Arguments {
    fn photographs(&self) -> Photographs {
        let standard = Photographs::sized(self.rows, self.columns, self.frames);
        let baseline_px = self.baseline.unwrap_or(standard.baseline_px);
        Photographs {
            focal_length_px: self.focal_length.unwrap_or(standard.focal_length_px),
            baseline_px,
            relief: match self.relief {
                ReliefName::Flat => Relief::Flat,
                ReliefName::Hills => Relief::Hills,
                ReliefName::Mounds => Relief::Mounds,
                ReliefName::Grooves => Relief::Grooves,
                ReliefName::Slope => Relief::Slope,
            },
            relief_px: self.relief_px.unwrap_or(0.05 * baseline_px),
            texture: match self.texture {
                TextureName::Noise => Texture::Noise,
                TextureName::Patches => Texture::Patches,
                TextureName::Repeating => Texture::Repeating,
                TextureName::Weak => Texture::Weak,
                TextureName::Stripes => Texture::Stripes,
                TextureName::Blobs => Texture::Blobs,
            },
            seed: self.seed,
            roll_deg: self.roll,
            pan_deg: self.pan,
            wobble_deg: self.wobble,
            offset_px: self.offset,
            uneven_steps: self.uneven,
            missing: self.missing.clone(),
            repeated: self.repeated,
            step_back: self.step_back,
            light: self.light,
            noise: self.noise,
            motion_blur_px: self.blur,
            k1: self.k1,
            jpeg_quality: (self.jpeg > 0).then_some(self.jpeg),
            orientation: match self.orientation {
                OrientationName::Upright => Orientation::Upright,
                OrientationName::HalfTurn => Orientation::HalfTurn,
                OrientationName::Clockwise => Orientation::Clockwise,
                OrientationName::Counterclockwise => Orientation::Counterclockwise,
            },
            exif_focal_length: self.exif_focal_length,
            renumbered: self.renumbered,
            ..standard
        }
    }
}

fn main() {
    let arguments = Arguments::parse();
    let series = arguments.photographs().take();
    series.write_photographs(&arguments.out.join("photographs"));
    series.write_truth(&arguments.out);
    if arguments.straightened {
        series.write_straightened(&arguments.out.join("straightened"));
    }
    if arguments.rectified {
        series.write_rectified(&arguments.out.join("rectified"));
    }
    println!("{} photographs: {}", series.count(), arguments.out.display());
}
