//! How the picture moves with the stage.

use std::time::Duration;

use serde::Serialize;

use super::error::MotionError;
use epirig_calibration::registration::{ShiftError, shift_between};
use epirig_core::frame::Frame;
use epirig_devices::camera::{Camera, TakenFrame};
use epirig_devices::stage::Stage;

/// A movement of so many px tells its size to 1 % or better where there is texture at all, and stays within what can be found.
const ENOUGH_PX: f64 = 4.0;
/// From one attempt to the next the move grows or shrinks by this factor.
const FACTOR: f64 = 4.0;
/// Attempts to find a length of move that can be seen: lengths from 1/256 to 256 times the first.
const ATTEMPTS: usize = 5;
/// A shift of less than so many sigma may be none ...
const SIGNIFICANT: f64 = 5.0;
/// ... and one of less than this, in px, is none, however small sigma is: drift and vibration of a rig worth measuring with stay below 0.02 px
/// from frame to frame, the error of interpolation below 0.005 px, and a scan that moves the picture by no more has nothing to measure.
const LEAST_PX: f64 = 0.1;

/// What a mm of the stage moves the picture by.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ImageMotion {
    /// Along x, in px per mm; negative if the contents move to lower columns as the position grows.
    pub x_px_per_mm: f64,
    /// Along y, in px per mm.
    pub y_px_per_mm: f64,
    /// Standard deviation of either, in px per mm.
    pub sigma_px_per_mm: f64,
    /// Length of the move that it was measured by, in mm.
    pub move_mm: f64,
}

impl ImageMotion {
    /// Along its own direction, in px per mm; positive.
    pub fn px_per_mm(&self) -> f64 {
        self.x_px_per_mm.hypot(self.y_px_per_mm)
    }

    /// Angle between the motion and the rows, in rad, -pi/2 to pi/2; positive if the contents move down to the right.
    pub fn angle_rad(&self) -> f64 {
        (self.y_px_per_mm / self.x_px_per_mm).atan()
    }

    /// Whether the picture moves at all: by more than noise, drift and vibration explain.
    pub fn is_significant(&self) -> bool {
        self.px_per_mm() > SIGNIFICANT * self.sigma_px_per_mm && self.px_per_mm() * self.move_mm >= LEAST_PX
    }
}

/// Measures the motion of the picture by a move of about `move_mm` upwards from `from_mm`, where the stage is; shorter or longer, but ending
/// at `last_mm` at most, if that shows too much or too little. The stage stays at the end of the last move.
///
/// # Errors
/// [`MotionError`] if stage or camera fail, or no length of move gives two frames that can be compared.
pub fn measure_motion(
    stage: &mut dyn Stage,
    camera: &mut dyn Camera,
    settle: Duration,
    [from_mm, last_mm]: [f64; 2],
    move_mm: f64,
) -> Result<ImageMotion, MotionError> {
    let first = look(camera, settle)?;
    let mut move_mm = move_mm.min(last_mm - from_mm);
    let mut found: Result<ImageMotion, MotionError> = Err(MotionError::NoRoom { from_mm, last_mm });
    let mut shrunk = false;
    for _ in 0..ATTEMPTS {
        if move_mm <= 0.0 || move_mm.is_nan() {
            break;
        }
        // Each length is approached as the one before, upwards.
        stage.move_to(from_mm)?;
        stage.move_to(from_mm + move_mm)?;
        match shift_between(&first, &look(camera, settle)?) {
            Ok(shift) => {
                found = Ok(ImageMotion {
                    x_px_per_mm: shift.x_px / move_mm,
                    y_px_per_mm: shift.y_px / move_mm,
                    // The first frame's place and noise are in the shift as the second's.
                    sigma_px_per_mm: shift.sigma_px / move_mm,
                    move_mm,
                });
                let longer_mm = (FACTOR * move_mm).min(last_mm - from_mm);
                let enough = shift.x_px.hypot(shift.y_px) >= ENOUGH_PX;
                if enough || shrunk || longer_mm <= move_mm {
                    break;
                }
                move_mm = longer_mm;
            }
            Err(error @ ShiftError::Unlike { .. }) if found.is_err() => {
                shrunk = true;
                found = Err(error.into());
                move_mm /= FACTOR;
            }
            Err(error) if found.is_err() => return Err(error.into()),
            // A longer move has left the picture behind; what the shorter one said holds.
            Err(_) => break,
        }
    }
    found
}

/// A frame of what is there once the stage has come to rest.
pub(super) fn look(camera: &mut dyn Camera, settle: Duration) -> Result<Frame, MotionError> {
    let at_rest = camera.now().after(settle);
    let TakenFrame { frame, .. } = camera.grab_after(at_rest)?;
    Ok(frame)
}
