//! The plan of a scan.

use std::time::Duration;

use super::CaptureError;
use crate::profile::{LimitsProfile, PlanProfile};
use epirig_data::sequence::{FrameKind, NominalLens};
use epirig_devices::camera::{CameraSettings, Configuration};

/// What to capture, and what is known of the rig.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CapturePlan {
    /// Positions of the frames, in mm from home.
    pub positions_mm: Vec<f64>,
    /// Settings of the camera.
    pub camera: CameraSettings,
    /// The profile's section: settling, averaging, and the frames before the scan. Its start, step and number of frames
    /// are not used: `positions_mm` has the positions.
    pub section: PlanProfile,
    /// Limits of the scan.
    pub limits: LimitsProfile,
    /// The lens, if known.
    pub lens: Option<NominalLens>,
    /// The rig's profile as recorded, for resuming.
    pub rig: Option<serde_json::Value>,
    /// The configuration of the simulated rig, if it is one.
    pub simulator: Option<serde_json::Value>,
}

impl CapturePlan {
    /// A plan of single frames at these positions, with a camera set up for measuring.
    pub fn at(positions_mm: Vec<f64>) -> Self {
        let section = PlanProfile { settle: Duration::ZERO, ..PlanProfile::default() };
        Self { positions_mm, section, ..Self::default() }
    }

    /// Number of frames of this kind.
    pub fn count(&self, kind: FrameKind) -> usize {
        match kind {
            FrameKind::Scan => self.positions_mm.len(),
            FrameKind::Dark => self.section.dark,
            FrameKind::Flat => self.section.flat,
            FrameKind::Board => self.section.board,
        }
    }

    /// Number of calibration frames, all taken before the scan.
    pub fn calibration_frames(&self) -> usize {
        FrameKind::CALIBRATION.into_iter().map(|kind| self.count(kind)).sum()
    }

    /// The first position, if there are at least two.
    ///
    /// # Errors
    /// [`CaptureError::EmptyPlan`].
    pub(super) fn first_mm(&self) -> Result<f64, CaptureError> {
        let first = self.positions_mm.first().filter(|_| self.positions_mm.len() > 1);
        first.copied().ok_or(CaptureError::EmptyPlan(self.positions_mm.len()))
    }

    /// Bytes of a frame's samples, for a camera with this configuration.
    pub fn frame_bytes(&self, configuration: &Configuration) -> u64 {
        let sample_bytes = if self.section.average > 1 || configuration.bit_depth > 8 { 2 } else { 1 };
        configuration.rows as u64 * configuration.columns as u64 * sample_bytes
    }

    /// Refuses positions outside the travel, before the scan begins.
    ///
    /// # Errors
    /// [`CaptureError::BeyondTravel`].
    pub fn check_travel(&self, travel_mm: f64) -> Result<(), CaptureError> {
        let beyond = self.positions_mm.iter().rfind(|position_mm| !(0.0..=travel_mm).contains(*position_mm));
        beyond.map_or(Ok(()), |&position_mm| Err(CaptureError::BeyondTravel { position_mm, travel_mm }))
    }
}
