//! `epirig calibrate`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::choice::choice;
use super::files::{taken, write_new};
use super::linearity::read_exposures;
use super::memory_limit::MemoryArgument;
use super::need::check_calibration;
use super::rig::RigArgument;
use super::scan::match_command;
use super::scan_end::AnywayArgument;
use super::{CliError, Talk};
use crate::calibrate::{
    CALIBRATION, CalibrateError, Calibration, CalibrationPlan, CameraMotionRecord, LensKnowledge, LensSource,
    PositionSource, read_calibration_file,
};
use crate::number::{ascii, sigma};
use crate::pipeline::calibrate_sequence;
use crate::profile::Profile;
use crate::rig::calibration_plan;
use epirig_calibration::lens::{LensEstimate, opencv_yaml, ros_camera_info};
use epirig_calibration::photometry::{DarkRecord, FlatField, FlatMethod, FrameGains, HIGHEST_ORDER, Outcome};
use epirig_core::shell::quoted;
use epirig_data::sequence::{Intrinsics, Sequence};
use epirig_data::storage::{ReadError, parent, read_text};

/// Calibrate: illumination, lens, stage axis, positions of frames
///
/// Uses what the sequence has: dark and flat frames for the illumination, board frames for the lens,
/// chess-boards on the object for the stage axis and the positions, or else the texture of the object. Names
/// what is missing, rejects frames that are not good enough (exit code 6), and writes calibration.json, which
/// `epirig match` applies. Target, board and lens are described by the profile recorded in the sequence, or by
/// another profile with --rig.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig calibrate tile-0042
  epirig calibrate tile-0042 --set target.square=\"7.43 mm\" --overwrite    squares as measured
  epirig calibrate seq --lens camera.yml                 a lens that OpenCV or ROS has calibrated
  epirig calibrate seq --positions texture               the motion from the object itself, or nothing
  epirig calibrate seq --flat-field paper                the correction of the 2001 paper
  epirig calibrate seq --export-lens camera.yml          for OpenCV (.yml); .yaml is for ROS
  epirig calibrate seq --linearity exposures.csv         test of the sensor response

To get the frames: `epirig target print` makes the target. With dark, flat and board in [plan] of
the profile, `epirig capture` takes them. `epirig import --dark DIR --flat DIR --board DIR` imports
them.")]
pub(super) struct CalibrateVerb {
    /// Folder of the sequence
    seq: PathBuf,
    /// Replace an existing calibration
    #[arg(long)]
    overwrite: bool,
    /// Read the lens from a file: .yml or .yaml of OpenCV or ROS, or calibration.json of another sequence
    /// [default: from the board frames, else from [optics]]
    #[arg(long, value_name = "FILE")]
    lens: Option<PathBuf>,
    /// Export the lens for another program: .yml for OpenCV, .yaml for ROS (camera_info)
    #[arg(long, value_name = "FILE", value_parser = parse_lens_file)]
    export_lens: Option<PathBuf>,
    /// Model of the flat field: auto (chosen by cross-validation), paper (polynomial of order 3), order:N,
    /// pixels, none
    #[arg(long, value_name = "METHOD", default_value = "auto", value_parser = parse_flat_field)]
    flat_field: FlatChoice,
    /// Do not subtract the dark level
    #[arg(long)]
    no_dark: bool,
    /// Do not replace defective pixels
    #[arg(long)]
    no_defective_pixels: bool,
    /// Do not make the frames equally bright
    #[arg(long)]
    no_frame_gain: bool,
    /// Table of flat images at several exposures, to test the sensor's linearity. Columns: file and exposure
    /// (any unit)
    #[arg(long, value_name = "TABLE.csv")]
    linearity: Option<PathBuf>,
    /// Source of the position of every frame
    #[arg(long, value_parser = choice::<PositionSource>(), default_value_t = PositionSource::Automatic)]
    positions: PositionSource,
    #[command(flatten)]
    memory: MemoryArgument,
    #[command(flatten)]
    anyway: AnywayArgument,
    #[command(flatten)]
    rig: RigArgument,
}

/// Model of the flat field; `None` switches the correction off.
#[derive(Debug, Clone, Copy)]
struct FlatChoice(Option<FlatMethod>);

impl CalibrateVerb {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let sequence = self.anyway.open(&self.seq, talk)?;
        let folder = self.export_lens.as_deref().map(parent);
        if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
            return Err(CliError::usage(format!(
                "{}: the folder for --export-lens does not exist; create it first",
                folder.display()
            )));
        }
        if let Some(path) = self.export_lens.as_deref().filter(|path| path.symlink_metadata().is_ok()) {
            return Err(taken(path));
        }
        let mut plan = self.plan(&sequence)?;
        check_calibration(&sequence, &mut plan, self.memory.limit, talk)?;
        let (found, unfinished) = calibrate_sequence(&sequence, &plan, self.overwrite, talk)?;
        let calibration = &found.calibration;
        if let Some(path) = &self.export_lens {
            export(path, calibration)?;
        }
        tell(calibration, unfinished.as_ref(), talk);
        // Pictures and maps.
        let folder = Some(self.seq.join("calibration")).filter(|folder| folder.is_dir());
        talk.result(calibration, || {
            format!(
                "{}wrote {}\n{}next: {}\n",
                describe(calibration),
                quoted(&self.seq.join(CALIBRATION)),
                folder.map_or(String::new(), |folder| format!("look at {}\n", quoted(&folder))),
                match_command(&self.seq)
            )
        })
    }

    fn plan(&self, sequence: &Sequence) -> Result<CalibrationPlan, CliError> {
        let record = sequence.record();
        let profile = self.rig.over(Profile::of_sequence(sequence)?)?;
        let mut plan = calibration_plan(&profile, record.columns, record.rows);
        if let Some(path) = &self.lens {
            plan.lens = Some(read_lens(path, record.rows, record.columns)?);
        }
        plan.photometry.dark = !self.no_dark;
        plan.photometry.defective_pixels = !self.no_defective_pixels;
        plan.photometry.frame_gain = !self.no_frame_gain;
        plan.photometry.flat_field = self.flat_field.0;
        if let Some(path) = &self.linearity {
            plan.exposures = read_exposures(path, record)?;
        }
        plan.positions = self.positions;
        Ok(plan)
    }
}

fn parse_flat_field(text: &str) -> Result<FlatChoice, String> {
    let wrong = || {
        format!(
            "\"{text}\" is not a method; write auto, paper, order:0 to order:{HIGHEST_ORDER}, pixels or none"
        )
    };
    let method = match text {
        "auto" => FlatMethod::Automatic,
        "paper" => FlatMethod::Polynomial(3),
        "pixels" => FlatMethod::PerPixel,
        "none" => return Ok(FlatChoice(None)),
        other => {
            let order = other.strip_prefix("order:").and_then(|order| order.parse().ok());
            FlatMethod::Polynomial(order.filter(|order| *order <= HIGHEST_ORDER).ok_or_else(wrong)?)
        }
    };
    Ok(FlatChoice(Some(method)))
}

fn parse_lens_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let ending = path.extension().and_then(|ending| ending.to_str());
    matches!(ending, Some("yml" | "yaml"))
        .then_some(path)
        .ok_or_else(|| format!("\"{text}\" does not end in .yml (OpenCV) or .yaml (ROS camera_info)"))
}

/// More than any lens file needs, including one that lists all board views. In bytes.
const LARGEST_LENS: u64 = 16 << 20;

fn read_lens(path: &Path, rows: usize, columns: usize) -> Result<LensKnowledge, CliError> {
    let name = path.display().to_string();
    if !path.exists() {
        return Err(CliError::usage(format!(
            "{name}: no such lens file; give a YAML file of OpenCV or ROS, or a calibration.json"
        )));
    }
    let estimate = if path.extension().is_some_and(|ending| ending == "json") {
        read_calibration_file(path)?.lens.estimate
    } else {
        let text = read_text(path, LARGEST_LENS).map_err(|error| match error {
            ReadError::Io { .. } => CliError::from(error),
            _ => CliError::data(format!(
                "{error} (a lens is a YAML file of OpenCV or ROS, or a calibration.json)"
            )),
        })?;
        let file =
            opencv_yaml::read_lens(&text).map_err(|error| CliError::data(format!("{name}: {error}")))?;
        let (rows, columns) = (file.rows.unwrap_or(rows), file.columns.unwrap_or(columns));
        LensEstimate::of_a_calibration(file.lens, rows, columns)
    };
    let lens = estimate.lens;
    for focal_length_px in [lens.focal_length_x_px, lens.focal_length_y_px] {
        let intrinsics = Intrinsics {
            focal_length_px,
            principal_point_x_px: lens.principal_point_x_px,
            principal_point_y_px: lens.principal_point_y_px,
        };
        if let Some(reason) = intrinsics.impossible(estimate.rows, estimate.columns) {
            return Err(CliError::data(format!("{name}: {reason}; check the file")));
        }
    }
    Ok(LensKnowledge::File { name, estimate: Box::new(estimate) })
}

fn export(path: &Path, calibration: &Calibration) -> Result<(), CliError> {
    let estimate = &calibration.lens.estimate;
    let (rows, columns, lens) = (estimate.rows, estimate.columns, estimate.lens);
    let text = if path.extension().is_some_and(|ending| ending == "yaml") {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        ros_camera_info::write(&name, rows, columns, &lens)
    } else {
        opencv_yaml::write(rows, columns, &lens)
    };
    write_new(path, text.as_bytes())
}

/// Prints the calibration's notes and needs, and what failed when it was in place.
pub(super) fn tell(calibration: &Calibration, unfinished: Option<&CalibrateError>, talk: &Talk) {
    if let Some(error) = unfinished {
        talk.say(&format!("note: {CALIBRATION} is in place and whole, but {error}"));
    }
    for note in &calibration.notes {
        talk.say(&format!("note: {note}"));
    }
    for need in &calibration.needs {
        talk.say(&format!("needs: {need}"));
    }
}

/// The calibration as a few lines of text.
pub(super) fn describe(calibration: &Calibration) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| text.push_str(&format!("{name:<19}{value}\n"));
    let photometry = &calibration.photometry;
    let dark = |dark: &DarkRecord| format!("{:.2} DN, {} frames", dark.level_dn, dark.frames);
    line("dark level", outcome(&photometry.dark, dark));
    let flat_field = |field: &FlatField| {
        let rest = unexplained(field.residual_rms_percent);
        format!("corners {:.1} % darker{rest}, {} frames", field.vignetting_percent, field.frames)
    };
    line("flat field", outcome(&photometry.flat_field, flat_field));
    let replaced = |pixels: &Vec<_>| format!("{} replaced by their neighbours", pixels.len());
    line("defective pixels", outcome(&photometry.defective_pixels, replaced));
    if let Some(linearity) = &calibration.linearity {
        line(
            "linearity",
            format!(
                "{}: departs by {:.2} % of full scale at most ({:.2} % are allowed)",
                if linearity.is_linear() { "good" } else { "NOT LINEAR" },
                linearity.largest_departure_percent,
                linearity.limit_percent
            ),
        );
    }
    let even = |gains: &FrameGains| format!("varies by {:.3} %, made even", 100.0 * gains.flicker);
    line("frames' brightness", outcome(&calibration.frame_gains, even));
    line("lens", lens(calibration));
    if let Some(stage_axis) = &calibration.stage_axis {
        line("roll", with_sigma(stage_axis.roll_deg, stage_axis.roll_sigma_deg, "deg"));
        line("pan", with_sigma(stage_axis.pan_deg, stage_axis.pan_sigma_deg, "deg"));
        line(
            "rows",
            format!(
                "straight to {:.4} px RMS ({} in {} of {} frames, each known to {:.4} px)",
                stage_axis.rows_rms_px,
                found_of(stage_axis.corners, stage_axis.corners_of_target),
                stage_axis.frames,
                calibration.inputs.counts[0],
                stage_axis.corner_sigma_px
            ),
        );
    }
    if let Some(motion) = &calibration.camera_motion {
        line("roll", with_sigma(motion.roll_deg, motion.roll_sigma_deg, "deg"));
        line("pan", with_sigma(motion.pan_deg, motion.pan_sigma_deg, "deg"));
        line("frames turn", turns(motion));
        line("rows", rows(motion));
        line("disparities", disparities(motion));
    }
    let positions = &calibration.positions;
    line(
        "positions",
        match (&positions.positioning_error, positions.source) {
            (Some(positioning), source) => format!(
                "from the {}: the stage is off by {:.1} um RMS, {:.1} um at most",
                if source == PositionSource::Target { "target" } else { "texture" },
                positioning.rms_um,
                positioning.largest_um
            ),
            (None, PositionSource::Stage) if positions.baseline_mm.is_none() => {
                "not known; taken as evenly spaced".to_owned()
            }
            (None, PositionSource::Stage) => "the stage's".to_owned(),
            (None, _) => "measured; the stage's are not known".to_owned(),
        },
    );
    if let Some(scale) = positions.target_scale {
        line(
            "scale",
            format!(
                "by the target's squares the travel is {:.2} mm, by the stage {:.2} mm ({:.2} % {})",
                scale.baseline_mm,
                scale.reported_mm,
                100.0 * scale.contradiction().abs(),
                if scale.contradiction() < 0.0 { "less" } else { "more" }
            ),
        );
    }
    let camera = calibration.mapping.camera;
    line("rectified frames", format!("{} x {}", camera.columns, camera.rows));
    text
}

/// What frames have by themselves.
fn turns(motion: &CameraMotionRecord) -> String {
    if motion.poses.is_empty() {
        let why =
            if motion.is_tested { "no more than they can be measured" } else { "not known: too few points" };
        return why.to_owned();
    }
    let [pitch, yaw, roll] = motion.rotation_rms_deg();
    let offsets = if motion.model.offsets { "; and leave the straight line" } else { "" };
    format!("by {pitch:.3}, {yaw:.3} and {roll:.3} deg RMS (pitch, yaw, roll), corrected{offsets}")
}

/// How well disparities are known together.
fn disparities(motion: &CameraMotionRecord) -> String {
    let [all, bend] = [motion.disparity_sigma_px, motion.bend_sigma_px].map(|px| ascii(&sigma(px, "px")));
    format!("known to {all} by the motion, all of them together; a plane may be bent by {bend}")
}

fn rows(motion: &CameraMotionRecord) -> String {
    let CameraMotionRecord { drift_px, rows_sigma_px, points, residual_px, .. } = motion;
    let corrected = if motion.is_applied { "corrected" } else { "not significant" };
    format!(
        "drift by {drift_px:.2} px, {corrected}; known to {rows_sigma_px:.4} px ({points} points, residuals {residual_px:.3} px RMS)"
    )
}

fn lens(calibration: &Calibration) -> String {
    let record = &calibration.lens;
    let lens = record.estimate.lens;
    let focal_length = format!(
        "{}; k1 {:+.4}",
        with_sigma(lens.focal_length_x_px, record.estimate.sigma()[0], "px"),
        lens.distortion.k1
    );
    let source = match (record.source, &record.board_frames) {
        (LensSource::BoardFrames, Some(found)) => {
            let corners = found.views.iter().map(|view| view.points).sum();
            format!(
                "from {} of {} board frames, {}, {:.3} px RMS",
                found.views.len(),
                calibration.inputs.counts[3],
                found_of(corners, found.views.len() * record.corners_of_board),
                found.rms_px
            )
        }
        (LensSource::File, _) => format!("from {}", record.file.as_deref().unwrap_or("a file")),
        (LensSource::DataSheet, _) => "from its data sheet".to_owned(),
        (LensSource::Texture, _) => "from the texture of frames that turned".to_owned(),
        (LensSource::BoardFrames, None) | (LensSource::Unknown, _) => {
            return "unknown; rectification works without it, heights in mm need it".to_owned();
        }
    };
    format!("{focal_length} ({source})")
}

/// Corners that were found, of those that there are, if that is known.
fn found_of(corners: usize, all: usize) -> String {
    if all > 0 { format!("{corners} of {all} corners") } else { format!("{corners} corners") }
}

/// A value with the digits that its standard deviation justifies: two digits of the latter.
fn with_sigma(value: f64, sigma: f64, unit: &str) -> String {
    let digits = if sigma > 0.0 { (1.0 - sigma.log10().floor()).clamp(0.0, 7.0) as usize } else { 4 };
    if sigma >= 10.0 {
        return format!("{value:.0} {unit}, sigma {sigma:.0} {unit}");
    }
    format!("{value:.digits$} {unit}, sigma {sigma:.digits$} {unit}")
}

/// What a model leaves unexplained. Empty below what would be shown: a per-pixel map leaves nothing.
fn unexplained(rms_percent: f64) -> String {
    match rms_percent < 5e-4 {
        true => String::new(),
        false => format!(", {rms_percent:.3} % of the cells' means unexplained"),
    }
}

fn outcome<T>(outcome: &Outcome<T>, describe: impl FnOnce(&T) -> String) -> String {
    match outcome {
        Outcome::Applied(found) => describe(found),
        Outcome::SwitchedOff => "switched off".to_owned(),
        Outcome::NotApplied(_) => "not corrected".to_owned(),
    }
}
