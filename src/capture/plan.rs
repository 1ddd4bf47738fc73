//! The plan of a scan.

use std::time::Duration;

use super::CaptureError;
use crate::profile::LimitsProfile;
use epirig_data::sequence::{FrameKind, NominalLens};
use epirig_devices::camera::{CameraSettings, Configuration};

/// What to capture, and what is known of the rig.
#[derive(Debug, Clone, PartialEq)]
pub struct CapturePlan {
    /// Positions of the frames, in mm from home.
    pub positions_mm: Vec<f64>,
    /// Time for which the stage vibrates after a move; exposures begin later.
    pub settle: Duration,
    /// Settings of the camera.
    pub camera: CameraSettings,
    /// Number of frames averaged at each position, into one of 16 bit; 1 keeps single frames unchanged.
    pub averaged: usize,
    /// Number of dark frames before the scan.
    pub dark: usize,
    /// Number of frames of a uniform target before the scan.
    pub flat: usize,
    /// Number of frames of the hand-held chess-board before the scan, each in a different pose.
    pub board: usize,
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
        Self {
            positions_mm,
            settle: Duration::ZERO,
            camera: CameraSettings::default(),
            averaged: 1,
            dark: 0,
            flat: 0,
            board: 0,
            limits: LimitsProfile::default(),
            lens: None,
            rig: None,
            simulator: None,
        }
    }

    /// Number of frames of this kind.
    pub fn count(&self, kind: FrameKind) -> usize {
        match kind {
            FrameKind::Scan => self.positions_mm.len(),
            FrameKind::Dark => self.dark,
            FrameKind::Flat => self.flat,
            FrameKind::Board => self.board,
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
        let sample_bytes = if self.averaged > 1 || configuration.bit_depth > 8 { 2 } else { 1 };
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
