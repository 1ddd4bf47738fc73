//! The steps of a calibration, in order.

use super::frames::read_all;
use super::held::HeldFrames;
use super::lens::find_lens;
use super::positions::{from_stage, from_target};
use super::remarks::Remarks;
use super::stage_axis::{FoundAxis, find_axis};
use super::texture::{FoundMotion, Seen, from_texture};
use super::{
    CalibrateError, Calibration, CalibrationPlan, FORMAT_VERSION, InputHashes, LensRecord, LensSource,
    MapHashes, MatchedFrames, PositionSource, PositionsRecord, StageAxisRecord,
};
use epirig_calibration::lens::Distortion;
use epirig_calibration::photometry::{
    FrameGains, GainError, Linearity, Maps, Outcome, Photometry, dominant_disparity, frame_gains, linearity,
};
use epirig_calibration::rectification::{Mapping, Rectifier};
use epirig_calibration::texture_motion::MotionModel;
use epirig_core::fault::{Blame, Fault as _};
use epirig_core::frame::{Frame, full_scale};
use epirig_core::progress::Progress;
use epirig_core::tau::Tau;
use epirig_data::sequence::{FrameKind, Sequence};
use tracing::{info, info_span, warn};

/// A calibration, and the data for pictures of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibrated {
    /// The record.
    pub calibration: Calibration,
    /// Its maps.
    pub maps: Maps,
    /// The tracks of the target, if there is a target.
    pub stage_axis: Option<epirig_calibration::stage_axis::StageAxis>,
}

/// Calibrates a sequence with all frames and descriptions that exist.
///
/// # Errors
/// [`CalibrateError`]: the frames are rejected with a reason ([`Blame::Rejection`](epirig_core::fault::Blame)), or files
/// cannot be read.
pub fn calibrate(
    sequence: &Sequence,
    plan: &CalibrationPlan,
    progress: &dyn Progress,
) -> Result<Calibrated, CalibrateError> {
    sequence.check_records()?;
    let inputs = InputHashes::of(sequence);
    let nothing = inputs.counts[1..].iter().all(|count| *count == 0);
    // Where no target tells the motion, the texture may.
    let texture = match plan.positions {
        PositionSource::Texture => Texture::Wanted,
        PositionSource::Automatic if plan.target.is_none() => Texture::Tried,
        _ => Texture::Unused,
    };
    if nothing && plan.target.is_none() && plan.lens.is_none() && texture == Texture::Unused {
        return Err(CalibrateError::Nothing { path: sequence.folder().to_owned() });
    }
    let record = sequence.record();
    let size = (record.rows, record.columns);
    let mut remarks = Remarks::default();
    remarks.notes.extend(sequence.end_in_words());

    let span = info_span!("photometry").entered();
    let dark =
        read_all(sequence, &sequence.calibration_frames(FrameKind::Dark), "reading dark frames", progress)?;
    let flat =
        read_all(sequence, &sequence.calibration_frames(FrameKind::Flat), "reading flat frames", progress)?;
    refuse_exchanged(&dark, &flat)?;
    let (photometry, maps) = Photometry::find(&dark, &flat, size, plan.photometry)?;
    info!(
        dark_frames = dark.len(),
        flat_frames = flat.len(),
        dark_level = photometry.dark.applied().is_some(),
        flat_field = photometry.flat_field.applied().is_some(),
        "light calibrated"
    );
    drop((dark, flat));
    remarks.of_photometry(&photometry);
    let correction = photometry.correction(&maps)?;
    let linearity = judge_linearity(plan, record.bit_depth, &mut remarks);

    drop(span);
    let mut lens = info_span!("lens").in_scope(|| find_lens(sequence, plan, &mut remarks, progress))?;
    info!(source = ?lens.source, focal_length_px = lens.estimate.lens.focal_length_x_px, "lens known");
    let span = info_span!("stage_axis").entered();
    let axis = |target| find_axis(sequence, target, &lens.estimate, &mut remarks, progress);
    let found = plan.target.as_ref().map(axis).transpose()?;
    drop(span);
    let direction = found.as_ref().map(|found| found.stage_axis.direction).unwrap_or_default();
    if let Some(found) = &found {
        lens.estimate = found.stage_axis.lens.clone();
    }
    let (rows, columns) = size;
    info!(
        roll_rad = direction.roll_rad,
        pan_rad = direction.pan_rad,
        target = found.is_some(),
        "stage axis known"
    );
    let mut mapping =
        Mapping::fitting(lens.estimate.lens, direction.roll_rad, direction.pan_rad, rows, columns)?;
    let stage_axis = found.as_ref().map(|found| found.record(mapping.camera));

    let _span = info_span!("positions").entered();
    let mut positions = positions(sequence, plan, found.as_ref(), &mut remarks)?;
    let gains_are_wanted = plan.photometry.frame_gain && photometry.flat_field.applied().is_some();
    let mut gains = match (plan.photometry.frame_gain, gains_are_wanted) {
        (false, _) => Outcome::SwitchedOff,
        (true, true) => Outcome::NotApplied(String::new()),
        (true, false) => Outcome::NotApplied(
            "without flat frames, brightness cannot be compared between places in the image".to_owned(),
        ),
    };
    let mut camera_motion = None;
    if gains_are_wanted || texture != Texture::Unused {
        let tau = Tau::from_positions(&positions.tau)?;
        let mut frames = info_span!("rectification").in_scope(|| {
            let frames = MatchedFrames::rectified(sequence, Rectifier::new(mapping, correction)?, tau);
            HeldFrames::of(&frames, sequence, plan.frames_on_disk, progress)
        })?;
        if gains_are_wanted {
            gains = find_gains(&mut frames, stage_axis.as_ref().map(|axis| axis.disparity_px), progress)?;
        }
        if texture != Texture::Unused {
            let seen = Seen {
                frames: frames.source(),
                camera: mapping.camera,
                lens: &lens.estimate,
                may: may_be_adjusted(&lens, &stage_axis),
            };
            let reported = (texture == Texture::Tried).then_some(&positions);
            match from_texture(seen, sequence, reported, &mut remarks, progress) {
                Ok(found) => {
                    if found.motion.is_applied && stage_axis.is_none() {
                        mapping = rectified_by(&found, &mut lens, size)?;
                    }
                    positions = found.positions;
                    camera_motion = stage_axis.is_none().then_some(found.motion);
                }
                // What was taken besides is of use without it.
                Err(error) if texture == Texture::Tried && !nothing && error.blame() == Blame::Rejection => {
                    let why = error.message();
                    remarks.needs.push(format!("the motion is taken to be along the rows: {why}"));
                }
                Err(error) => return Err(error),
            }
        }
    }
    if let Outcome::NotApplied(reason) = &gains {
        remarks.notes.push(format!("the frames' brightness is not corrected: {reason}"));
    }
    if lens.source == LensSource::Unknown {
        remarks.needs.push(
            "heights in mm need the focal length; take board frames ([plan] board, [board]), or write focal_length into [optics]".to_owned(),
        );
    }
    info!(source = ?positions.source, baseline_mm = positions.baseline_mm, "positions known");
    remarks.notes.iter().for_each(|note| info!(note, "remark"));
    remarks.needs.iter().for_each(|need| warn!(need, "the calibration lacks something"));
    let calibration = Calibration {
        format: FORMAT_VERSION,
        blake3: String::new(),
        program: concat!("epirig ", env!("CARGO_PKG_VERSION")).to_owned(),
        sequence_uid: record.uid.clone(),
        scan_ended: sequence.ended().to_owned(),
        inputs,
        photometry,
        maps: MapHashes::default(),
        linearity,
        frame_gains: gains,
        lens,
        stage_axis,
        camera_motion,
        positions,
        mapping,
        notes: remarks.notes,
        needs: remarks.needs,
    };
    Ok(Calibrated { calibration, maps, stage_axis: found.map(|found| found.stage_axis) })
}

/// What the texture may tell besides positions. A target has told the direction already, and rotations of frames would be
/// about its axis.
fn may_be_adjusted(lens: &LensRecord, stage_axis: &Option<StageAxisRecord>) -> MotionModel {
    let is_free = stage_axis.is_none();
    let focal_length = is_free && matches!(lens.source, LensSource::DataSheet | LensSource::Unknown);
    let k1 = focal_length && lens.estimate.lens.distortion == Distortion::default();
    MotionModel { pan: is_free, focal_length, rotations: is_free, offsets: is_free, k1 }
}

/// The mapping that straightens the rows of a motion, with the lens that it was seen through.
fn rectified_by(
    found: &FoundMotion,
    lens: &mut LensRecord,
    (rows, columns): (usize, usize),
) -> Result<Mapping, CalibrateError> {
    let FoundMotion { motion, k1, focal_length, .. } = found;
    if let Some((times, sigma)) = *focal_length {
        lens.estimate = lens.estimate.lengthened(times, sigma);
        lens.source = LensSource::Texture;
    }
    lens.estimate.lens.distortion.k1 += k1;
    let [roll_rad, pan_rad] = [motion.roll_deg, motion.pan_deg].map(f64::to_radians);
    Ok(Mapping::covering(lens.estimate.lens, roll_rad, pan_rad, rows, columns, &motion.poses)?)
}

/// What the texture is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Texture {
    /// Nothing: a target tells the motion, or the stage is to be trusted.
    Unused,
    /// The motion, as far as it tells it.
    Tried,
    /// The motion, or there is no calibration.
    Wanted,
}

/// Refuses dark frames that are brighter than flat frames. Tested first, because later messages would
/// mislead.
fn refuse_exchanged(dark: &[Frame], flat: &[Frame]) -> Result<(), CalibrateError> {
    let mean = |frames: &[Frame]| {
        frames.iter().map(|frame| frame.samples().mean()).sum::<f64>() / frames.len() as f64
    };
    let (dark_dn, flat_dn) = (mean(dark), mean(flat));
    // NaN, for no frames, is not larger.
    match dark_dn > flat_dn {
        true => Err(CalibrateError::Exchanged { dark_dn, flat_dn }),
        false => Ok(()),
    }
}

/// Linearity of the sensor's response, from frames at several exposures. A failure here is only noted, and
/// does not reject the calibration.
fn judge_linearity(plan: &CalibrationPlan, bit_depth: u8, remarks: &mut Remarks) -> Option<Linearity> {
    if plan.exposures.is_empty() {
        return None;
    }
    match linearity(&plan.exposures, full_scale(bit_depth), Linearity::USUAL_LIMIT_PERCENT) {
        Ok(found) => {
            if !found.is_linear() {
                remarks.needs.push(format!(
                    "the sensor's response is not linear: it deviates by {:.2} % of full scale at {:.0} DN ({:.2} % are allowed); switch \
                     the camera's gamma and contrast off, or stay below the level where it deviates",
                    found.largest_departure_percent, found.at_dn, found.limit_percent
                ));
            }
            Some(found)
        }
        Err(error) => {
            remarks.notes.push(format!("the linearity was not tested: {error}"));
            None
        }
    }
}

fn positions(
    sequence: &Sequence,
    plan: &CalibrationPlan,
    found: Option<&FoundAxis>,
    remarks: &mut Remarks,
) -> Result<PositionsRecord, CalibrateError> {
    match (plan.positions, found) {
        (PositionSource::Target | PositionSource::Automatic, Some(found)) => {
            from_target(sequence, found, remarks)
        }
        (PositionSource::Target, None) => Err(CalibrateError::NoTarget),
        _ => from_stage(sequence),
    }
}

/// Measures the brightness of every frame, and equalises it.
fn find_gains(
    frames: &mut HeldFrames,
    disparity_px: Option<f64>,
    progress: &dyn Progress,
) -> Result<Outcome<FrameGains>, CalibrateError> {
    let source = frames.source();
    let disparity_px = disparity_px.map_or_else(|| dominant_disparity(source, progress), Ok);
    Ok(match disparity_px.and_then(|disparity_px| frame_gains(source, disparity_px, progress)) {
        Ok(gains) if gains.significant => {
            frames.set_gains(&gains.gain);
            Outcome::Applied(gains)
        }
        Ok(gains) => Outcome::NotApplied(format!(
            "it varies by {:.3} %, which is not significant",
            100.0 * gains.flicker
        )),
        Err(GainError::Rows(error)) => return Err(error.into()),
        Err(error) => Outcome::NotApplied(error.to_string()),
    })
}
