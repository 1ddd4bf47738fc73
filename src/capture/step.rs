//! One stop of the scan: move, settle, take a frame, and certify it.

use tracing::{debug, info};

use super::motion_watch::stands_still;
use super::scan::Scan;
use super::{CaptureError, records};
use epirig_core::frame::Frame;
use epirig_data::sequence::{CertificateRecord, FrameFacts};
use epirig_devices::camera::{self, CameraError, TakenFrame, average};
use epirig_devices::stage::StageError;

/// Means of frames of neighbouring stops differ by less than this factor, because they show nearly the same
/// part of the object. Else there would be nothing to match.
const LIGHT_RATIO: f64 = 2.0;

impl Scan<'_, '_> {
    /// Moves to position `index`, takes a frame there, and checks it.
    pub(super) fn step(&mut self, index: usize, attempt: usize) -> Result<(Frame, FrameFacts), CaptureError> {
        let commanded_mm = self.plan.positions_mm[index];
        let begun = self.camera().now();
        self.go_to(commanded_mm)?;
        let before_mm = self.check_position(commanded_mm)?;
        let arrived = self.camera().now();
        self.times.moving_s += arrived.since(begun).as_secs_f64();
        let at_rest = arrived.after(self.plan.section.settle);
        debug!(
            position_mm = before_mm,
            seconds = arrived.since(begun).as_secs_f64(),
            settle_s = self.plan.section.settle.as_secs_f64(),
            "arrived"
        );
        self.camera().at_stop(index);
        let (frame, exposures) = self.look(at_rest)?;
        // Read again after the exposure: a stage that has drifted or restarted meanwhile spoils the frame.
        let after_mm = self.check_position(commanded_mm)?;
        self.times.settling_s += self.plan.section.settle.as_secs_f64();
        self.times.exposing_s += self.camera().now().since(at_rest).as_secs_f64();
        let limits = &self.plan.limits;
        let share = frame.samples().count_at_least(frame.full_scale()) as f64 / frame.samples().len() as f64;
        if share > limits.saturated {
            return Err(CaptureError::Saturated { index, share, limit: limits.saturated });
        }
        let last = exposures.last();
        if let Some(good) = self.latest.as_ref().filter(|good| good.index + 1 == index) {
            let (before_dn, mean_dn) = (good.frame.samples().mean(), frame.samples().mean());
            let most_dn = LIGHT_RATIO * before_dn.min(mean_dn).max(1.0);
            if before_dn.max(mean_dn) > most_dn {
                return Err(CaptureError::LightChanged { index, mean_dn, before_dn });
            }
            let noise_dn = last.and_then(|facts| facts.difference_dn);
            let bit_depth = self.configuration.bit_depth;
            let still =
                |noise_dn| stands_still(&good.frame, &frame, noise_dn, bit_depth, self.plan.section.average);
            if noise_dn.is_some_and(still) {
                let step_mm = commanded_mm - self.plan.positions_mm[good.index];
                return Err(CaptureError::NoMotion { index, step_mm });
            }
        }
        info!(
            commanded_mm,
            position_mm = after_mm,
            sequence = last.map(|exposure| exposure.sequence),
            saturated_share = share,
            "frame certified"
        );
        let certificate = CertificateRecord {
            attempt,
            readings_mm: [before_mm, after_mm],
            position_tolerance_mm: limits.position_mm,
            settle_ms: self.plan.section.settle.as_secs_f64() * 1e3,
            controls_as_set: last.map_or(0, |facts| facts.controls.len()),
            saturated_share: share,
            saturated_limit: limits.saturated,
        };
        let facts = FrameFacts {
            commanded_mm: Some(commanded_mm),
            reported_mm: Some(after_mm),
            camera_sequence: last.map(|exposure| exposure.sequence),
            exposure: records::exposure_record(&exposures),
            certificate: Some(certificate),
            ..FrameFacts::default()
        };
        Ok((frame, facts))
    }

    /// The reported position; an error if it is not the commanded one.
    fn check_position(&mut self, commanded_mm: f64) -> Result<f64, CaptureError> {
        let tolerance_mm = self.plan.limits.position_mm;
        let reported_mm = self.stage_now()?.position_mm()?;
        let agrees = (reported_mm - commanded_mm).abs() <= tolerance_mm;
        if !agrees {
            return Err(StageError::Disagrees { commanded_mm, reported_mm, tolerance_mm }.into());
        }
        Ok(reported_mm)
    }

    /// A frame, or the average of several, exposed after `at_rest`.
    pub(super) fn look(
        &mut self,
        at_rest: camera::Moment,
    ) -> Result<(Frame, Vec<camera::FrameFacts>), CaptureError> {
        if self.plan.section.average > 1 {
            let stop = self.stop.clone();
            let averaged =
                average(self.rig.camera, at_rest, self.plan.section.average, &|| stop.pressed().is_none());
            let averaged = averaged.map_err(|error| self.as_stop(error))?;
            return Ok((averaged.frame, averaged.facts));
        }
        let taken = self.rig.camera.grab_after(at_rest).map_err(|error| self.as_stop(error))?;
        let TakenFrame { frame, facts } = taken;
        Ok((frame, vec![facts]))
    }

    /// Stopping the stage during an average also stops the scan.
    fn as_stop(&mut self, error: CameraError) -> CaptureError {
        match error {
            CameraError::Interrupted { .. } => {
                let position_mm = self.stage.as_mut().and_then(|stage| stage.position_mm().ok());
                StageError::Stopped { position_mm }.into()
            }
            other => other.into(),
        }
    }
}
