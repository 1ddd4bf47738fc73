//! Tests whether the picture moves when the stage reports a move.

use epirig_calibration::registration::shift_between;
use epirig_core::frame::{Frame, full_scale};
use epirig_devices::camera::Difference;

/// A picture has moved if it differs by more than this multiple of its noise. Typical differences of two
/// pairs of frames scatter by a few per cent only, because they average thousands of samples.
const STILL: f64 = 1.2;
/// Differences below this are rounding, in DN of the camera.
const ROUNDING_DN: f64 = 0.1;
/// A picture that moves by less than this between two stops stands still, in px. Over a hundred stops it
/// would move by only 2 px, too little to measure anything.
const LEAST_STEP_PX: f64 = 0.02;
/// Shifts with a larger sigma than this are not used, in px.
const WORST_SIGMA_PX: f64 = 0.05;

/// Whether `frame` shows the same as `before` of the previous stop, and has enough texture to show a motion.
/// An object without texture looks the same everywhere, so it gives `false`.
///
/// `noise_dn` is the typical difference of two single frames of one view, for a camera of `bit_depth`; a
/// frame is an average of `averaged`.
pub(super) fn stands_still(
    before: &Frame,
    frame: &Frame,
    noise_dn: f64,
    bit_depth: u8,
    averaged: usize,
) -> bool {
    let Some(difference) = Difference::between(before, frame) else { return false };
    // Averages are scaled to 16 bit, and have less noise.
    let scale = f64::from(full_scale(frame.bit_depth())) / f64::from(full_scale(bit_depth));
    let noise_dn = scale * noise_dn / (averaged.max(1) as f64).sqrt();
    // The block comparison is fast, and sufficient where the picture moves.
    if difference.typical_dn > STILL * noise_dn + scale * ROUNDING_DN {
        return false;
    }
    shift_between(before, frame).is_ok_and(|shift| {
        shift.sigma_px <= WORST_SIGMA_PX
            && shift.x_px.hypot(shift.y_px) <= LEAST_STEP_PX + 3.0 * shift.sigma_px
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_simulator::{Simulator, SimulatorConfig};

    #[test]
    fn a_stall_is_told_from_a_move_and_from_an_object_without_texture() {
        for noise_dn in [0.0, 1.5] {
            let mut config = SimulatorConfig::textured_plane(96, 64, 3);
            config.sensor.read_noise_dn = noise_dn;
            let simulator = Simulator::new(config).unwrap();
            let shot = |position_mm, exposure| simulator.expose(position_mm, exposure);
            let typical = Difference::between(&shot(10.0, 0), &shot(10.0, 1)).unwrap().typical_dn;
            let still = |one: &Frame, other: &Frame| stands_still(one, other, typical, 8, 1);
            assert!(still(&shot(10.0, 2), &shot(10.0, 3)), "noise {noise_dn}");
            assert!(!still(&shot(10.0, 4), &shot(11.5, 5)));
            // 0.2 mm are 0.08 px.
            assert!(!still(&shot(10.0, 6), &shot(10.2, 7)), "noise {noise_dn}");
            let grey = |exposure| simulator.digitise(&simulator.uniform_irradiance(0.5), exposure);
            assert!(!still(&grey(2), &grey(3)), "nothing could be seen to move here");
        }
    }
}
