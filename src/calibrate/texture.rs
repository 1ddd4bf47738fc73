//! The camera's motion, and the position of every frame, from the object's texture.

use super::rectified_frames::RectifiedFrames;
use super::remarks::{Remarks, some_of};
use super::{CalibrateError, CameraMotionRecord, PositionSource, PositionsRecord};
use epirig_calibration::lens::LensEstimate;
use epirig_calibration::rectification::{FramePose, RectifiedCamera};
use epirig_calibration::stage_axis::{MeasuredTau, positioning_error};
use epirig_calibration::texture_motion::{
    CameraPose, Frames, MotionLens, MotionModel, MotionOptions, Return, Step, TextureMotion,
    TextureMotionError, in_usual_steps, texture_motion,
};
use epirig_core::progress::Progress;
use epirig_core::rows::RowSource;
use epirig_core::statistics::root_mean_square;
use epirig_core::tau::Tau;
use epirig_data::sequence::{Origin, Sequence};

/// Places of points in frames: some hundred points in each of a hundred frames, from several anchors.
const OBSERVATIONS: usize = 200_000;
/// Roll and pan that are not this many standard uncertainties off are left.
const SIGNIFICANT: f64 = 3.0;
/// A drift of rows over the path that is less than this, in px, costs less than the resampling that corrects it.
const LEAST_DRIFT_PX: f64 = 0.01;
/// Share of the places of points that is left out before that is noted: photographs of trees, with deep gaps between
/// them, have 0.04, flat objects less than 0.01.
const MANY_REJECTED: f64 = 0.1;
/// A focal length that is known worse than this, as a share, may bend the shape where frames turn: by a tenth of what a turn
/// of a tenth of a degree moves at the borders.
const VAGUE_FOCAL_LENGTH: f64 = 0.1;

/// What the texture is looked for in.
pub(super) struct Seen<'a> {
    /// The frames, as `camera` sees them.
    pub(super) frames: &'a dyn RowSource,
    pub(super) camera: RectifiedCamera,
    pub(super) lens: &'a LensEstimate,
    /// What may be adjusted.
    pub(super) may: MotionModel,
}

/// What the texture tells.
pub(super) struct FoundMotion {
    pub(super) positions: PositionsRecord,
    pub(super) motion: CameraMotionRecord,
    /// First radial term of the distortion; 0 if it was not adjusted.
    pub(super) k1: f64,
    /// The focal length as so many times that of the lens, and its standard uncertainty as a share; `None` if it was not
    /// adjusted.
    pub(super) focal_length: Option<(f64, f64)>,
}

/// The camera's motion and tau of every frame from the texture; scale and origin come from the stage (or from the
/// frame count). Positions that were `reported` are kept if the texture does not contradict them.
pub(super) fn from_texture(
    seen: Seen,
    sequence: &Sequence,
    reported: Option<&PositionsRecord>,
    remarks: &mut Remarks,
    progress: &dyn Progress,
) -> Result<FoundMotion, CalibrateError> {
    progress.begin("motion from the texture", 1);
    let Seen { frames: source, camera, lens, may } = seen;
    let frames = RectifiedFrames::of(source, progress);
    let origin = &sequence.record().origin;
    let centre_px = [camera.principal_point_x_px, camera.principal_point_y_px];
    let lens = MotionLens { focal_length_px: camera.focal_length_px, centre_px, ..MotionLens::of(lens) };
    let options = MotionOptions { observations: OBSERVATIONS, lens: Some(lens), may };
    let motion = texture_motion(&frames, &options);
    frames.unless_unread()?;
    let motion = motion.map_err(|error| match error {
        TextureMotionError::Cancelled(cancelled) => cancelled.into(),
        error => unmeasured(error, origin, frames.count(), &|frame| name(sequence, frame)),
    })?;
    progress.advance(1);
    progress.end();
    let found = positions(&motion, sequence, remarks)?;
    let positions = match reported {
        Some(reported) if !motion.model.rotations && agrees(&found) => reported.clone(),
        _ => found,
    };
    let k1 = motion.cameras.k1;
    let longer = motion.cameras.focal_length_px / camera.focal_length_px;
    let focal_length = motion.model.focal_length.then_some((longer, motion.focal_length_sigma));
    let motion = record(&motion, camera);
    remark(&motion, remarks);
    Ok(FoundMotion { positions, motion, k1, focal_length })
}

/// tau of every frame, on the stage's scale if there is one.
fn positions(
    motion: &TextureMotion,
    sequence: &Sequence,
    remarks: &mut Remarks,
) -> Result<PositionsRecord, CalibrateError> {
    let origin = &sequence.record().origin;
    let name = |frame| name(sequence, frame);
    let reported_mm = sequence.positions_mm();
    let frames: Vec<usize> = (0..motion.tau.len()).collect();
    let places = match &reported_mm {
        Some(reported_mm) => in_usual_steps(reported_mm),
        None => frames.iter().map(|&frame| frame as f64).collect(),
    };
    let found = motion.steps(&frames, &places);
    let order = order(motion);
    // Positions that somebody has given say that frames go on.
    if reported_mm.is_some() || matches!(origin, Origin::Captured { .. }) {
        refuse_returns(&found, origin, &name)?;
    } else {
        note_returns(&found, &name, remarks);
    }
    let in_order = |values: &[f64]| match order.is_empty() {
        true => values.to_vec(),
        false => order.iter().map(|&frame| values[frame]).collect(),
    };
    let tau = Tau::from_positions(&apart(in_order(&motion.tau)))?;
    let mut record = PositionsRecord {
        source: PositionSource::Texture,
        tau: tau.values().to_vec(),
        tau_sigma: in_order(&motion.tau_sigma).into_iter().map(Some).collect(),
        order,
        baseline_mm: None,
        baseline_sigma_mm: None,
        positioning_error: None,
        target_scale: None,
    };
    let Some(reported_mm) = reported_mm else { return Ok(record) };
    let (jumps, others): (Vec<Step>, Vec<Step>) = found.into_iter().partition(Step::jumps);
    if jumps.is_empty() {
        let measured = motion.tau.iter().zip(&motion.tau_sigma);
        let measured: Vec<_> = measured.map(|(&tau, &sigma)| Some(MeasuredTau { tau, sigma })).collect();
        let Some(positioning) = positioning_error(&measured, &reported_mm) else { return Ok(record) };
        // The same numbers as in the record of the errors.
        let positions: Vec<f64> = positioning.frames.iter().map(|frame| frame.measured_mm).collect();
        record.tau = Tau::from_positions(&positions)?.values().to_vec();
        record.baseline_mm = Some(positioning.baseline_mm);
        record.baseline_sigma_mm = Some(positioning.baseline_sigma_mm);
        record.positioning_error = Some(positioning);
        return Ok(record);
    }
    // Positions after a jump are all off by it, so the other steps give the scale.
    let words = some_of(&jumps, |jump| {
        let (before, after) = (name(jump.from), name(jump.to));
        format!("{:.2} steps instead of {:.2} from {before} to {after}", jump.length, jump.taken)
    });
    remarks.notes.push(format!(
        "the texture contradicts the given positions: it moved by {words}; the measured positions are used, on the scale of the other steps"
    ));
    let step = |values: &[f64], step: &Step| values[step.to] - values[step.from];
    let others = || others.iter().map(|other| (step(&reported_mm, other), step(&motion.tau, other)));
    let (count, mm, tau) =
        others().fold((0.0, 0.0, 0.0), |(count, mm, tau), step| (count + 1.0, mm + step.0, tau + step.1));
    let scale: f64 = mm / tau;
    // Errors of steps, as those of hands.
    let squares: f64 = others().map(|(mm, tau)| (mm - scale * tau).powi(2)).sum();
    record.baseline_mm = Some(scale);
    record.baseline_sigma_mm = Some((squares / f64::max(count - 1.0, 1.0) * count).sqrt() / tau);
    Ok(record)
}

/// Whether the reported positions differ from those of the texture by no more than these are known to.
fn agrees(found: &PositionsRecord) -> bool {
    let Some(error) = &found.positioning_error else { return false };
    let sigmas: Vec<f64> = error.frames.iter().filter_map(|frame| frame.sigma_mm).collect();
    error.outliers.is_empty() && error.rms_um <= 1000.0 * SIGNIFICANT * root_mean_square(&sigmas)
}

/// The frames by their positions; empty if they stand in this order.
fn order(motion: &TextureMotion) -> Vec<usize> {
    let mut order: Vec<usize> = (0..motion.tau.len()).collect();
    order.sort_by(|&a, &b| motion.tau[a].total_cmp(&motion.tau[b]));
    if order.is_sorted() { Vec::new() } else { order }
}

/// Positions that increase: frames of one place stand a billionth of the path apart, which no picture shows.
fn apart(mut tau: Vec<f64>) -> Vec<f64> {
    const LEAST: f64 = 1e-9;
    for index in 1..tau.len() {
        tau[index] = tau[index].max(tau[index - 1] + LEAST);
    }
    tau
}

/// The record of a motion that was seen by `camera`.
fn record(motion: &TextureMotion, camera: RectifiedCamera) -> CameraMotionRecord {
    let cameras = &motion.cameras;
    let m = cameras.direction;
    // R = Ry(pan) Rz(roll) turns m to the axis of columns, whichever way is nearer.
    let roll_rad = -(m.y / m.x).atan();
    let along = m.x * roll_rad.cos() - m.y * roll_rad.sin();
    let pan_rad = (m.z / along).atan();
    let moved_px = motion.position_px.last().copied().unwrap_or(0.0);
    let corner = 0.5 * camera.rows as f64 / camera.focal_length_px;
    let drift_px = moved_px.abs() * roll_rad.sin().hypot(pan_rad.sin() * corner);
    let is_significant = roll_rad.abs() > SIGNIFICANT * motion.angle_sigma_rad
        || pan_rad.abs() > SIGNIFICANT * motion.pan_own_sigma_rad;
    let model = motion.model;
    let across = cameras.across();
    let pose = |pose: &CameraPose| FramePose {
        rotation_rad: pose.rotation_rad.into(),
        offset: ((across[0] * pose.offset[0] + across[1] * pose.offset[1]) * motion.typical_rho).into(),
    };
    let has_poses = model.rotations || model.offsets;
    CameraMotionRecord {
        model,
        is_tested: motion.is_tested,
        roll_deg: roll_rad.to_degrees(),
        roll_sigma_deg: motion.angle_sigma_rad.to_degrees(),
        pan_deg: pan_rad.to_degrees(),
        pan_sigma_deg: motion.pan_sigma_rad.to_degrees(),
        pan_own_sigma_deg: motion.pan_own_sigma_rad.to_degrees(),
        focal_length_px: cameras.focal_length_px,
        focal_length_sigma_px: motion.focal_length_sigma * cameras.focal_length_px,
        moved_px,
        position_sigma_px: motion.position_sigma_px,
        disparity_sigma_px: motion.disparity_sigma_px,
        bend_sigma_px: motion.bend_sigma_px,
        drift_px,
        is_applied: has_poses || model.k1 || (is_significant && drift_px > LEAST_DRIFT_PX),
        rows_sigma_px: motion.rows_sigma_px,
        points: motion.points,
        rejected: motion.rejected,
        residual_px: motion.residual_px,
        poses: if has_poses { cameras.frames.iter().map(pose).collect() } else { Vec::new() },
    }
}

/// Says what was found, and what could not be.
fn remark(motion: &CameraMotionRecord, remarks: &mut Remarks) {
    if !motion.is_tested {
        remarks.needs.push(
            "frames have too few points to tell whether the camera turned by itself from frame to frame; more texture would tell"
                .to_owned(),
        );
    }
    if motion.rejected > MANY_REJECTED {
        remarks.notes.push(format!(
            "{:.0} % of the places of points contradict a camera that moves along a line: something in the scene moves, shines or is occluded; \
             the motion is that of the others",
            100.0 * motion.rejected
        ));
    }
    let CameraMotionRecord { focal_length_px, focal_length_sigma_px, .. } = motion;
    if motion.model.focal_length {
        remarks.notes.push(format!(
            "the turns of the camera tell the focal length: {focal_length_px:.0} px, to {:.1} %",
            100.0 * focal_length_sigma_px / focal_length_px
        ));
    } else if motion.model.rotations && focal_length_sigma_px / focal_length_px > VAGUE_FOCAL_LENGTH {
        remarks.notes.push(
            "the camera turned by itself, and the focal length is not known: turns to the side and positions cannot be told apart well, and \
             the shape may be bent by more than sigma says; state the focal length (--focal-length-px, or optics.focal_length)"
                .to_owned(),
        );
    }
    if motion.model.rotations {
        let [pitch, yaw, roll] = motion.rotation_rms_deg();
        remarks.notes.push(format!(
            "the camera turned by itself from frame to frame, by {pitch:.3} (up and down), {yaw:.3} (left and right) and {roll:.3} degrees \
             (about its view), RMS; this is corrected"
        ));
    }
}

/// Says which frames do not go on; they are taken in the order of their positions.
fn note_returns(steps: &[Step], name: &dyn Fn(usize) -> String, remarks: &mut Remarks) {
    let returns: Vec<(usize, Return)> =
        steps.iter().filter_map(|step| Some((step.to, step.returns()?))).collect();
    if returns.is_empty() {
        return;
    }
    let found = some_of(&returns, |(frame, how)| match how {
        Return::Back(steps) => {
            format!("{} stands {steps:.2} steps before the one in front of it", name(*frame))
        }
        _ => format!("{} stands where the one in front of it does", name(*frame)),
    });
    remarks.notes.push(format!("{found}; the frames are taken in the order of their positions"));
}

/// A frame, with the image that it was made of.
fn name(sequence: &Sequence, frame: usize) -> String {
    let source = sequence.frames().get(frame).and_then(|record| record.source.as_deref());
    source.map_or_else(|| format!("frame {frame}"), |source| format!("frame {frame} ({source})"))
}

/// Refuses frames that do not stand beyond the one before.
fn refuse_returns(
    steps: &[Step],
    origin: &Origin,
    name: &dyn Fn(usize) -> String,
) -> Result<(), CalibrateError> {
    let returns = steps.iter().filter_map(|step| {
        // Positions must increase, also where steps are smaller than their uncertainty.
        let known = step.returns().or((step.length <= 0.0).then_some(Return::Repeated));
        Some((step, known?))
    });
    let returns: Vec<(&Step, Return)> = returns.collect();
    if returns.is_empty() {
        return Ok(());
    }
    let returns = some_of(&returns, |(step, how)| {
        let (before, after) = (name(step.from), name(step.to));
        match how {
            Return::Back(steps) => format!("{after} stands {steps:.2} steps before {before}"),
            _ => format!("the step from {before} to {after} cannot be told from none"),
        }
    });
    let cure = cure(
        origin,
        "import the images in the order of the motion (--sort motion) or without those (--exclude), or",
    );
    Err(CalibrateError::Returns { found: returns, cure })
}

/// Why nothing was measured, with the images named.
fn unmeasured(
    error: TextureMotionError,
    origin: &Origin,
    count: usize,
    name: &dyn Fn(usize) -> String,
) -> CalibrateError {
    let frames = match error {
        // There are no others.
        TextureMotionError::Apart { frames } if frames.len() == count => {
            return CalibrateError::TextureMotion(TextureMotionError::NothingFollowed);
        }
        TextureMotionError::Apart { frames } => frames,
        other => return CalibrateError::TextureMotion(other),
    };
    let found = some_of(&frames, |&frame| name(frame));
    let cure = cure(origin, "import the images without those (--exclude), or");
    CalibrateError::Apart { found, cure }
}

/// What helps: images can be imported in another way, other frames are what they are.
fn cure(origin: &Origin, of_images: &'static str) -> &'static str {
    match origin {
        Origin::Imported { .. } => of_images,
        _ => "look at those frames and take the scan again, or",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn scanned() -> Origin {
        Origin::Captured {
            stage: "stage".to_owned(),
            stage_settings: BTreeMap::new(),
            camera: "camera".to_owned(),
            configuration: None,
            limits: None,
            rig: None,
            simulator: None,
        }
    }

    fn imported() -> Origin {
        Origin::Imported {
            folder: "photos".to_owned(),
            conversions: Vec::new(),
            findings: Vec::new(),
            calibration_folders: BTreeMap::new(),
            rig: None,
        }
    }

    fn image(frame: usize) -> String {
        format!("frame {frame} ({frame}.png)")
    }

    #[test]
    fn frames_that_do_not_go_on_are_refused_with_what_helps_where_they_come_from() {
        let step = |from, length| Step { from, to: from + 1, length, sigma: 0.01, taken: 1.0 };
        let refused = |lengths: &[f64], origin| {
            let steps: Vec<Step> =
                lengths.iter().enumerate().map(|(from, length)| step(from, *length)).collect();
            refuse_returns(&steps, &origin, &image).map_err(|error| error.to_string())
        };
        assert_eq!(refused(&[1.0, 0.25, 2.0], imported()), Ok(()));
        let said = refused(&[1.0, 0.025, -0.2, 0.0, 0.0, 0.0], imported()).unwrap_err();
        assert!(said.contains("from frame 1 (1.png) to frame 2 (2.png) cannot be told from none"), "{said}");
        assert!(said.contains("frame 3 (3.png) stands 0.20 steps before frame 2 (2.png)"), "{said}");
        assert!(said.contains(" and 2 more;") && said.contains("--exclude"), "{said}");
        let said = refused(&[1.0, 0.0], scanned()).unwrap_err();
        assert!(said.contains("take the scan again") && !said.contains("import"), "{said}");
        // A step that is as uncertain as it is long goes on, if it goes on at all.
        let unsure = |length| Step { from: 0, to: 1, length, sigma: 0.5, taken: 1.0 };
        assert!(refuse_returns(&[unsure(0.1)], &scanned(), &image).is_ok());
        assert!(refuse_returns(&[unsure(-0.1)], &scanned(), &image).is_err());
    }

    #[test]
    fn frames_that_are_not_connected_are_told_by_their_images() {
        let said = |origin| {
            let error = TextureMotionError::Apart { frames: (4..10).collect() };
            unmeasured(error, &origin, 20, &image).to_string()
        };
        let of_images = said(imported());
        let names = "frame 4 (4.png), frame 5 (5.png), frame 6 (6.png) and 3 more cannot be connected";
        assert!(of_images.contains(names) && of_images.contains("--exclude"), "{of_images}");
        assert!(!said(scanned()).contains("--exclude") && said(scanned()).contains("--positions stage"));
    }
}
