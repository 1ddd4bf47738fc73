//! What a scan is to do.

use std::time::Duration;

use super::CaptureError;
use epirig_data::sequence::{FrameKind, NominalLens};
use epirig_devices::camera::{CameraSettings, Configuration};

/// What a scan puts up with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CaptureLimits {
    /// Times that a frame is taken again.
    pub retakes: usize,
    /// Share of a frame's samples that may be at full scale, 0 to 1.
    pub saturated: f64,
    /// How far the reported position may be from the commanded one, in mm.
    pub position_mm: f64,
    /// How far the picture may have moved after homing, in px.
    pub shift_px: f64,
    /// How long to wait for a camera or a stage that has gone.
    pub wait: Duration,
}

impl Default for CaptureLimits {
    fn default() -> Self {
        Self {
            retakes: 3,
            saturated: 0.01,
            // A motor step of usual stages, and a fraction of the smallest usual scan step.
            position_mm: 0.02,
            shift_px: 0.1,
            wait: Duration::from_secs(300),
        }
    }
}

/// What a scan is to do and what is known of the rig.
#[derive(Debug, Clone, PartialEq)]
pub struct CapturePlan {
    /// Where to take frames, in mm from home.
    pub positions_mm: Vec<f64>,
    /// How long the stage swings after a move: exposures begin after that.
    pub settle: Duration,
    /// What the camera is to be.
    pub camera: CameraSettings,
    /// Frames averaged to one of 16 bit at each position; 1 for single frames as they are.
    pub averaged: usize,
    /// Dark frames to take before the scan.
    pub dark: usize,
    /// Frames of a uniform target to take before the scan.
    pub flat: usize,
    /// Frames of a chess-board in a hand to take before the scan, each in another pose.
    pub board: usize,
    /// What it puts up with.
    pub limits: CaptureLimits,
    /// The lens, if known.
    pub lens: Option<NominalLens>,
    /// How to connect to the rig again, for whoever resumes.
    pub rig: Option<serde_json::Value>,
    /// How the simulated rig was made, if it is one.
    pub simulator: Option<serde_json::Value>,
}

impl CapturePlan {
    /// A plan that takes a frame as it is at each position, with a camera set up for measuring.
    pub fn at(positions_mm: Vec<f64>) -> Self {
        Self {
            positions_mm,
            settle: Duration::ZERO,
            camera: CameraSettings::default(),
            averaged: 1,
            dark: 0,
            flat: 0,
            board: 0,
            limits: CaptureLimits::default(),
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

    /// Number of frames that are taken before the scan.
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

    /// Bytes of a frame's samples, of a camera that is set like this.
    pub fn frame_bytes(&self, configuration: &Configuration) -> u64 {
        let sample_bytes = if self.averaged > 1 || configuration.bit_depth > 8 { 2 } else { 1 };
        configuration.rows as u64 * configuration.columns as u64 * sample_bytes
    }

    /// Refuses a plan that leaves the travel: a scan that cannot end need not begin.
    ///
    /// # Errors
    /// [`CaptureError::BeyondTravel`].
    pub fn check_travel(&self, travel_mm: f64) -> Result<(), CaptureError> {
        let beyond = self.positions_mm.iter().rfind(|position_mm| !(0.0..=travel_mm).contains(*position_mm));
        beyond.map_or(Ok(()), |&position_mm| Err(CaptureError::BeyondTravel { position_mm, travel_mm }))
    }
}
