//! Frames as they are matched, a few at a time: rectified, or as captured.

use rayon::prelude::*;

use super::apply::{fault_of_the_record, rectifier};
use super::frames::frames_in_order;
use super::{CalibrateError, Calibration};
use epirig_calibration::photometry::Maps;
use epirig_calibration::rectification::Rectifier;
use epirig_core::frame::Frame;
use epirig_core::progress::Progress;
use epirig_core::tau::Tau;
use epirig_core::volume::{Volume, VolumeShape};
use epirig_data::packed::PackWriter;
use epirig_data::sequence::{FrameRecord, Sequence};

/// The volume of a sequence without its samples: with a calibration of rectified frames at their measured positions,
/// else of frames as captured.
///
/// # Errors
/// [`CalibrateError`] if the positions are none.
pub fn matched_shape(
    sequence: &Sequence,
    calibration: Option<&Calibration>,
) -> Result<VolumeShape, CalibrateError> {
    let record = sequence.record();
    let original_bits = record.origin.original_bit_depth();
    let (rows, columns) = calibration.map_or((record.rows, record.columns), |calibration| {
        (calibration.mapping.camera.rows, calibration.mapping.camera.columns)
    });
    let tau = match calibration {
        Some(calibration) => Tau::from_positions(&calibration.positions.tau)
            .map_err(|error| fault_of_the_record(sequence, error.into()))?,
        None => sequence.tau()?,
    };
    let gains = calibration.and_then(Calibration::gains);
    Ok(VolumeShape {
        rows,
        columns,
        bit_depth: original_bits.unwrap_or(record.bit_depth),
        fine: calibration.is_some() || original_bits.is_some(),
        frame_gains: gains.map_or_else(
            || vec![1.0; tau.frames()],
            |gains| gains.iter().map(|gain| (1.0 / gain) as f32).collect(),
        ),
        tau,
    })
}

/// The frames of a sequence in the order in which they are matched.
pub struct MatchedFrames<'a> {
    sequence: &'a Sequence,
    records: Vec<&'a FrameRecord>,
    /// `None` for frames as captured.
    rectifier: Option<Rectifier>,
    shape: VolumeShape,
}

impl<'a> MatchedFrames<'a> {
    /// Frames that are read and rectified together: the eight lanes of the rectifier.
    pub const TOGETHER: usize = 8;

    /// The frames of `sequence`, rectified by the calibration if there is one.
    ///
    /// # Errors
    /// [`CalibrateError`] if the records are not to be believed, or the calibration does not match the frames.
    pub fn of(
        sequence: &'a Sequence,
        calibration: Option<(&Calibration, &Maps)>,
    ) -> Result<Self, CalibrateError> {
        sequence.check_records()?;
        let rectifier =
            calibration.map(|(calibration, maps)| rectifier(sequence, calibration, maps)).transpose()?;
        let calibration = calibration.map(|(calibration, _)| calibration);
        let shape = matched_shape(sequence, calibration)?;
        Ok(Self { sequence, records: frames_in_order(sequence, calibration), rectifier, shape })
    }

    /// The frames of `sequence` as they were taken, at `tau`, rectified while the calibration is still being found.
    pub(super) fn rectified(sequence: &'a Sequence, rectifier: Rectifier, tau: Tau) -> Self {
        let shape = rectifier.shape(sequence.record().bit_depth, tau);
        Self { sequence, records: frames_in_order(sequence, None), rectifier: Some(rectifier), shape }
    }

    /// The volume of all of them, without its samples.
    pub fn shape(&self) -> &VolumeShape {
        &self.shape
    }

    /// Their records.
    pub fn records(&self) -> &[&'a FrameRecord] {
        &self.records
    }

    /// A volume of [`TOGETHER`](Self::TOGETHER) frames from `first` on, with their gains. Places beyond the last
    /// frame hold zeros.
    ///
    /// # Errors
    /// [`CalibrateError`] naming the frame that cannot be used.
    pub fn group(&self, first: usize) -> Result<Volume, CalibrateError> {
        let tau = Tau::equidistant(Self::TOGETHER).map_err(|error| self.fault(error.into()))?;
        let mut few = self.shape.of_frames(tau);
        self.insert(&mut few, (0, first))?;
        let gains = self.shape.frame_gains.iter().skip(first).take(Self::TOGETHER);
        gains.enumerate().for_each(|(place, gain)| few.set_frame_gain(place, *gain));
        Ok(few)
    }

    /// Puts the frames from `first` on, as many as go together, into a volume from `place` on.
    ///
    /// # Errors
    /// As [`Self::group`].
    fn insert(&self, volume: &mut Volume, (place, first): (usize, usize)) -> Result<(), CalibrateError> {
        let records = self.records.iter().skip(first).take(Self::TOGETHER);
        let records: Vec<&FrameRecord> = records.copied().collect();
        let frames: Result<Vec<Frame>, _> =
            records.par_iter().map(|record| self.sequence.read(record)).collect();
        let frames = frames?;
        if let Some(rectifier) = &self.rectifier {
            return rectifier
                .insert_as(volume, (place, first), &frames)
                .map_err(|error| self.fault(error.into()));
        }
        for (index, frame) in frames.iter().enumerate() {
            let put = match self.shape.fine {
                true => volume.insert_counts(place + index, frame),
                false => volume.insert(place + index, frame),
            };
            put.map_err(epirig_data::sequence::SequenceError::from)?;
        }
        Ok(())
    }

    /// All of them as a volume, with their gains.
    pub(super) fn loaded(&self, progress: &dyn Progress) -> Result<Volume, CalibrateError> {
        let count = self.records.len();
        let mut volume = self.shape.of_rows(self.shape.rows);
        progress.begin("rectifying frames", count as u64);
        for first in (0..count).step_by(Self::TOGETHER) {
            progress.unless_cancelled()?;
            self.insert(&mut volume, (first, first))?;
            progress.advance(Self::TOGETHER.min(count - first) as u64);
        }
        progress.end();
        Ok(volume)
    }

    /// Packs them with `writer`, a few at a time; `progress` is told this name of the work. Returns the number of those
    /// that were packed before.
    ///
    /// # Errors
    /// [`CalibrateError`] naming the frame that cannot be used, or the file that cannot be written. What is packed by
    /// then stays.
    pub fn packed(
        &self,
        mut writer: PackWriter,
        work: &str,
        progress: &dyn Progress,
    ) -> Result<usize, CalibrateError> {
        let (count, mut before) = (self.records.len(), 0);
        progress.begin(work, count as u64);
        for first in (0..count).step_by(Self::TOGETHER) {
            let mut missing = Vec::new();
            for t in first..count.min(first + Self::TOGETHER) {
                match writer.has(t)? {
                    true => before += 1,
                    false => missing.push(t),
                }
            }
            progress.unless_cancelled()?;
            if !missing.is_empty() {
                let few = self.group(first)?;
                missing.into_iter().try_for_each(|t| writer.put(t, few.samples_of_frame(t - first)))?;
            }
            progress.advance(Self::TOGETHER.min(count - first) as u64);
        }
        writer.finish()?;
        progress.end();
        Ok(before)
    }

    fn fault(&self, error: CalibrateError) -> CalibrateError {
        fault_of_the_record(self.sequence, error)
    }
}

/// Reads all frames of `sequence` into a volume: corrected, rectified with one resampling, and with measured
/// tau. A few frames at a time are in memory besides the volume.
///
/// # Errors
/// [`CalibrateError`] naming the frame that cannot be used, or the part of the calibration that does not
/// match.
pub fn load_calibrated(
    sequence: &Sequence,
    calibration: &Calibration,
    maps: &Maps,
    progress: &dyn Progress,
) -> Result<Volume, CalibrateError> {
    let _span = tracing::info_span!("rectification").entered();
    MatchedFrames::of(sequence, Some((calibration, maps)))?.loaded(progress)
}
