//! Positions from the object's texture.

use super::remarks::{Remarks, some_of};
use super::{CalibrateError, PositionSource, PositionsRecord};
use epirig_calibration::stage_axis::{MeasuredTau, positioning_error};
use epirig_calibration::texture_motion::{
    Frames, Return, Step, TextureMotion, TextureMotionError, in_usual_steps, texture_motion,
};
use epirig_core::frame::full_scale;
use epirig_core::grid::Grid;
use epirig_core::progress::Progress;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;
use epirig_data::sequence::{Origin, Sequence};

/// Places of points in frames: some hundred points in each of a hundred frames, from several anchors.
const OBSERVATIONS: usize = 200_000;
/// A volume as frames of 8 bit.
struct VolumeFrames<'a>(&'a Volume);

impl Frames for VolumeFrames<'_> {
    fn count(&self) -> usize {
        self.0.frames()
    }

    fn size(&self) -> (usize, usize) {
        (self.0.rows(), self.0.columns())
    }

    fn picture(&self, index: usize, factor: usize) -> Grid<f32> {
        let volume = self.0;
        let (rows, columns) = (volume.rows() / factor, volume.columns() / factor);
        let share = 255.0 / (f32::from(full_scale(volume.bit_depth())) * (factor * factor) as f32);
        let mut picture = Grid::filled(rows, columns, 0.0_f32);
        let mut line = vec![0.0; volume.columns()];
        for row in 0..rows * factor {
            volume.copy_row(row, index, &mut line);
            for (sum, values) in picture.row_mut(row / factor).iter_mut().zip(line.chunks_exact(factor)) {
                *sum += share * values.iter().sum::<f32>();
            }
        }
        picture
    }
}

/// tau of every frame from the texture; scale and origin come from the stage (or from the frame count).
pub(super) fn from_texture(
    volume: &Volume,
    sequence: &Sequence,
    remarks: &mut Remarks,
    progress: &dyn Progress,
) -> Result<PositionsRecord, CalibrateError> {
    progress.begin("positions from the texture", 1);
    let origin = &sequence.record().origin;
    let name = |frame| name(sequence, frame);
    let motion = texture_motion(&VolumeFrames(volume), OBSERVATIONS)
        .map_err(|error| unmeasured(error, origin, &name))?;
    progress.advance(1);
    progress.end();
    let reported_mm = sequence.positions_mm();
    let frames: Vec<usize> = (0..motion.tau.len()).collect();
    let places = match &reported_mm {
        Some(reported_mm) => in_usual_steps(reported_mm),
        None => frames.iter().map(|&frame| frame as f64).collect(),
    };
    let found = motion.steps(&frames, &places);
    refuse_returns(&found, origin, &name)?;
    note_turn(&motion, remarks);
    let tau = Tau::from_positions(&motion.tau)?;
    let mut record = PositionsRecord {
        source: PositionSource::Texture,
        tau: tau.values().to_vec(),
        tau_sigma: motion.tau_sigma.iter().copied().map(Some).collect(),
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
fn unmeasured(error: TextureMotionError, origin: &Origin, name: &dyn Fn(usize) -> String) -> CalibrateError {
    let TextureMotionError::Apart { frames } = error else { return CalibrateError::TextureMotion(error) };
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

/// Tells of a motion that is not along the rows by so much that it costs accuracy.
fn note_turn(motion: &TextureMotion, remarks: &mut Remarks) {
    if motion.turn_costs() {
        remarks.needs.push(format!(
            "the motion is at {:.2} degrees to the rows, so points move by {:.1} px across them, and a match needs motion along the rows: \
             turn the images by {:.2} degrees {} in an image program, and import them again",
            motion.angle_rad.to_degrees().abs(),
            motion.drift_px().abs(),
            motion.angle_rad.to_degrees().abs(),
            motion.cure(),
        ));
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
            unmeasured(error, &origin, &image).to_string()
        };
        let of_images = said(imported());
        let names = "frame 4 (4.png), frame 5 (5.png), frame 6 (6.png) and 3 more cannot be connected";
        assert!(of_images.contains(names) && of_images.contains("--exclude"), "{of_images}");
        assert!(!said(scanned()).contains("--exclude") && said(scanned()).contains("--positions stage"));
    }
}
