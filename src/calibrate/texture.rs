//! Positions from the object's texture.

use super::remarks::Remarks;
use super::{CalibrateError, PositionSource, PositionsRecord};
use epirig_calibration::stage_axis::{MeasuredTau, positioning_error};
use epirig_calibration::texture_motion::{Frames, TextureMotion, texture_motion};
use epirig_core::frame::full_scale;
use epirig_core::grid::Grid;
use epirig_core::progress::Progress;
use epirig_core::statistics::median;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;
use epirig_data::sequence::Sequence;

/// Places of points in frames: some hundred points in each of a hundred frames, from several anchors.
const OBSERVATIONS: usize = 200_000;
/// A step that is less than so many of its standard uncertainties is none.
const SIGNIFICANT: f64 = 3.0;
/// A step that differs from the stage's by more than this share is a jump: frames are missing, or it was bumped.
const JUMP: f64 = 0.5;

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
    let motion = texture_motion(&VolumeFrames(volume), OBSERVATIONS)?;
    progress.advance(1);
    progress.end();
    refuse_returns(&motion, sequence)?;
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
    let Some(reported_mm) = sequence.positions_mm() else { return Ok(record) };
    // mm of the stage for a tau of 1, by each step.
    let ratios: Vec<f64> = steps(&reported_mm).zip(steps(&motion.tau)).map(|(mm, tau)| mm / tau).collect();
    let usual = median(&mut ratios.clone()).unwrap_or(f64::NAN);
    let jumps: Vec<usize> =
        (0..ratios.len()).filter(|&step| (usual / ratios[step] - 1.0).abs() > JUMP).collect();
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
    let words = jumps.iter().map(|&step| {
        let (before, after) = (name(sequence, step), name(sequence, step + 1));
        format!("{:.2} steps from {before} to {after}", usual / ratios[step])
    });
    remarks.notes.push(format!(
        "the texture contradicts the given positions: it moved by {}; the measured positions are used, on the scale of the other steps",
        words.collect::<Vec<_>>().join(", ")
    ));
    let others = || {
        let both = steps(&reported_mm).zip(steps(&motion.tau)).enumerate();
        both.filter(|(step, _)| !jumps.contains(step)).map(|(_, both)| both)
    };
    let (count, mm, tau) =
        others().fold((0.0, 0.0, 0.0), |(count, mm, tau), step| (count + 1.0, mm + step.0, tau + step.1));
    let scale: f64 = mm / tau;
    // Errors of steps, as those of hands.
    let squares: f64 = others().map(|(mm, tau)| (mm - scale * tau).powi(2)).sum();
    record.baseline_mm = Some(scale);
    record.baseline_sigma_mm = Some((squares / f64::max(count - 1.0, 1.0) * count).sqrt() / tau);
    Ok(record)
}

fn steps(positions: &[f64]) -> impl Iterator<Item = f64> + '_ {
    positions.windows(2).map(|pair| pair[1] - pair[0])
}

/// A frame, with the image that it was made of.
fn name(sequence: &Sequence, frame: usize) -> String {
    let source = sequence.frames().get(frame).and_then(|record| record.source.as_deref());
    source.map_or_else(|| format!("frame {frame}"), |source| format!("frame {frame} ({source})"))
}

/// Refuses frames that do not stand beyond the one before.
fn refuse_returns(motion: &TextureMotion, sequence: &Sequence) -> Result<(), CalibrateError> {
    let usual = median(&mut steps(&motion.tau).map(f64::abs).collect::<Vec<_>>()).unwrap_or(f64::NAN);
    let returns = steps(&motion.tau).zip(&motion.step_sigma).enumerate();
    let found: Vec<String> = returns
        .filter(|(_, (step, sigma))| *step < SIGNIFICANT * **sigma)
        .map(|(index, (step, sigma))| {
            let (before, after) = (name(sequence, index), name(sequence, index + 1));
            match step < -SIGNIFICANT * sigma {
                true => format!("{after} stands {:.2} steps before {before}", -step / usual),
                false => format!("{after} stands where {before} does"),
            }
        })
        .collect();
    match found.is_empty() {
        true => Ok(()),
        false => Err(CalibrateError::Returns { found }),
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
