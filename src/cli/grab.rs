//! `epirig grab`.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::files::{refuse_taken, write_new};
use super::rig::{CameraArguments, RigArgument, tell_configuration};
use super::{CliError, Talk};
use crate::rig::{camera_settings, open_camera};
use epirig_core::frame::Frame;
use epirig_core::progress::Progress;
use epirig_data::formats::MapFormat;
use epirig_data::sequence::encode_png;
use epirig_data::storage::parent;
use epirig_devices::camera::{Assessment, Camera, FrameFacts, TimingRule, average};
use epirig_devices::stage::StagePosition;

/// Take a frame, and print its brightness and sharpness
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig grab --out frame.png
  epirig grab --out mean.png --average 16      the mean of 16 frames; mean-variance.tiff beside it
  epirig grab --out frame.png --exposure-us 10000 --control gain=0
  epirig grab --out frame.png --camera sim     no hardware needed

All automatic controls of the camera are switched off first. The exposure begins after the command.
A mean is scaled to 16 bit: by 257 for a camera of 8 bit. The variance is that of a single frame,
in squared grey levels of the camera.")]
pub(super) struct Grab {
    /// The PNG to write, 8 or 16 bit; an existing file is refused
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Number of frames averaged, into one of 16 bit
    #[arg(long, value_name = "K", default_value_t = 1, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=65536))]
    average: u32,
    #[command(flatten)]
    rig: RigArgument,
    #[command(flatten)]
    camera: CameraArguments,
}

#[derive(Serialize)]
struct Grabbed {
    file: String,
    /// Variance of a single frame, in squared DN of the camera; for averages only.
    variance_file: Option<String>,
    camera: String,
    format: String,
    rows: usize,
    columns: usize,
    bit_depth: u8,
    averaged: usize,
    controls: Vec<(String, i64)>,
    exposure_start_ns: u64,
    timing: TimingRule,
    sequence: u32,
    stale: usize,
    damaged: usize,
    missed: u32,
    mean_dn: f64,
    minimum_dn: u16,
    maximum_dn: u16,
    /// Pixels at full scale in any of the averaged frames.
    saturated: usize,
    black: usize,
    focus: f64,
    bin_width_dn: u32,
    histogram: Vec<u64>,
}

impl Grab {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let variance_path = self.variance_path();
        let ending = self.out.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        if ending != "png" {
            return Err(CliError::usage(format!("{}: give a name that ends in .png", self.out.display())));
        }
        for path in std::iter::once(&self.out).chain(&variance_path) {
            refuse_taken(path)?;
        }
        let folder = parent(&self.out);
        if !folder.is_dir() {
            return Err(CliError::usage(format!(
                "{}: the folder does not exist; create it first",
                folder.display()
            )));
        }
        let profile = self.rig.profile(self.camera.changes())?;
        let mut camera = open_camera(&profile, &StagePosition::default())?.camera;
        let configuration = camera.configure(&camera_settings(&profile)?)?;
        tell_configuration(&configuration, talk);
        camera.start()?;
        let moment = camera.now();
        let (frame, facts, saturated) = match &variance_path {
            None => {
                let taken = camera.grab_after(moment)?;
                (taken.frame, vec![taken.facts], None)
            }
            Some(path) => {
                talk.begin("averaging", u64::from(self.average));
                let go_on = || {
                    talk.advance(1);
                    true
                };
                let averaged = average(&mut *camera, moment, self.average as usize, &go_on);
                talk.end();
                let averaged = averaged?;
                let map = MapFormat::Tiff
                    .encode(&averaged.variance_dn2)
                    .map_err(|error| CliError::data(format!("{}: {error}", path.display())))?;
                write_new(path, &map)?;
                (averaged.frame, averaged.facts, Some(averaged.saturated))
            }
        };
        camera.stop()?;
        write_new(&self.out, &encode_png(&frame).map_err(CliError::output)?)?;
        let output = self.output(&*camera, &configuration.format.to_string(), &frame, &facts, saturated);
        talk.result(&output, || describe(&output))
    }

    /// Path of the variance map; `None` without averaging.
    fn variance_path(&self) -> Option<PathBuf> {
        let stem = self.out.file_stem().unwrap_or_default().to_string_lossy();
        (self.average > 1).then(|| self.out.with_file_name(format!("{stem}-variance.tiff")))
    }

    fn output(
        &self,
        camera: &dyn Camera,
        format: &str,
        frame: &Frame,
        facts: &[FrameFacts],
        saturated: Option<usize>,
    ) -> Grabbed {
        let light = Assessment::of(frame);
        let last = facts.last();
        Grabbed {
            file: self.out.display().to_string(),
            variance_file: self.variance_path().map(|path| path.display().to_string()),
            camera: camera.identity().to_string(),
            format: format.to_owned(),
            rows: frame.rows(),
            columns: frame.columns(),
            bit_depth: frame.bit_depth(),
            averaged: facts.len(),
            controls: last.map(|facts| facts.controls.clone()).unwrap_or_default(),
            exposure_start_ns: last.map_or(0, |facts| facts.exposure_start.as_ns()),
            timing: last.map_or(TimingRule::Counted, |facts| facts.timing),
            sequence: last.map_or(0, |facts| facts.sequence),
            stale: facts.iter().map(|facts| facts.stale).sum(),
            damaged: facts.iter().map(|facts| facts.damaged).sum(),
            missed: facts.iter().map(|facts| facts.missed).sum(),
            mean_dn: light.mean_dn,
            minimum_dn: light.minimum_dn,
            maximum_dn: light.maximum_dn,
            saturated: saturated.unwrap_or(light.saturated),
            black: light.black,
            focus: light.focus,
            bin_width_dn: light.bin_width_dn,
            histogram: light.histogram,
        }
    }
}

fn describe(grabbed: &Grabbed) -> String {
    let pixels = (grabbed.rows * grabbed.columns).max(1) as f64;
    let share = |count: usize| count as f64 * 100.0 / pixels;
    let variance =
        grabbed.variance_file.as_ref().map_or(String::new(), |file| format!("variance        {file}\n"));
    let unlike = match (grabbed.damaged, grabbed.missed) {
        (0, 0) => String::new(),
        (damaged, missed) => {
            format!("passed over     {damaged} damaged frames, {missed} lost by the driver\n")
        }
    };
    format!(
        "frame           {} ({} x {} of {} bit, {} averaged)\n{variance}{unlike}mean            {:.1} DN ({} to {})\n\
         saturated       {} px ({:.3} %)\nblack           {} px ({:.3} %)\nfocus           {:.5} (larger is sharper; compare for one object only)\n",
        grabbed.file,
        grabbed.columns,
        grabbed.rows,
        grabbed.bit_depth,
        grabbed.averaged,
        grabbed.mean_dn,
        grabbed.minimum_dn,
        grabbed.maximum_dn,
        grabbed.saturated,
        share(grabbed.saturated),
        grabbed.black,
        share(grabbed.black),
        grabbed.focus,
    )
}
