//! Motion of the picture with the stage.

use std::time::Duration;

use serde::Serialize;

use super::error::MotionError;
use epirig_calibration::registration::{ShiftError, shift_between};
use epirig_core::frame::Frame;
use epirig_devices::camera::Camera;
use epirig_devices::stage::Stage;

/// A movement of this size, in px, is measured to 1 % or better if there is texture, and stays within the
/// search range.
const ENOUGH_PX: f64 = 4.0;
/// Factor between the lengths of successive moves.
const FACTOR: f64 = 4.0;
/// Most attempts to find a suitable length of the move: 1/256 to 256 times the first.
const ATTEMPTS: usize = 5;
/// A shift is significant above this multiple of sigma ...
const SIGNIFICANT: f64 = 5.0;
/// ... and above this size, in px. Drift and vibration of a usable rig stay below 0.02 px from frame to
/// frame, and the error of interpolation below 0.005 px. A scan with less motion has nothing to measure.
const LEAST_PX: f64 = 0.1;

/// Motion of the picture per mm of the stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ImageMotion {
    /// Along x, in px per mm; negative if the contents move to lower columns with increasing position.
    pub x_px_per_mm: f64,
    /// Along y, in px per mm.
    pub y_px_per_mm: f64,
    /// Standard uncertainty of either, in px per mm.
    pub sigma_px_per_mm: f64,
    /// Length of the move of the measurement, in mm.
    pub move_mm: f64,
}

impl ImageMotion {
    /// Magnitude of the motion, in px per mm; positive.
    pub fn px_per_mm(&self) -> f64 {
        self.x_px_per_mm.hypot(self.y_px_per_mm)
    }

    /// Angle between the motion and the rows, in rad, -pi/2 to pi/2; positive if the contents move down to
    /// the right.
    pub fn angle_rad(&self) -> f64 {
        (self.y_px_per_mm / self.x_px_per_mm).atan()
    }

    /// Whether the motion is significant: more than noise, drift and vibration explain.
    pub fn is_significant(&self) -> bool {
        self.px_per_mm() > SIGNIFICANT * self.sigma_px_per_mm && self.px_per_mm() * self.move_mm >= LEAST_PX
    }
}

/// Measures the motion of the picture by a move of about `move_mm` upwards from `from_mm`, the present
/// position. The move is lengthened or shortened if it shows too little or too much motion, but ends at
/// `last_mm` at most. The stage stays at the end of the last move.
///
/// # Errors
/// [`MotionError`] if stage or camera fail, or no length of the move gives two comparable frames.
pub(super) fn measure_motion(
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
        // All moves are upwards, with the same approach.
        stage.move_to(from_mm)?;
        stage.move_to(from_mm + move_mm)?;
        match shift_between(&first, &look(camera, settle)?) {
            Ok(shift) => {
                found = Ok(ImageMotion {
                    x_px_per_mm: shift.x_px / move_mm,
                    y_px_per_mm: shift.y_px / move_mm,
                    // The shift contains the error of both frames.
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
            // The longer move left the picture; the result of the shorter one is used.
            Err(_) => break,
        }
    }
    found
}

/// A frame taken after the stage has come to rest.
pub(super) fn look(camera: &mut dyn Camera, settle: Duration) -> Result<Frame, MotionError> {
    let at_rest = camera.now().after(settle);
    Ok(camera.grab_after(at_rest)?.frame)
}
