//! Whether the picture moves when the stage says that it does.

use crate::camera::Difference;
use crate::frame::{Frame, full_scale};
use crate::shift::shift_between;

/// A picture has moved if it differs by so many times its noise, ...
const MOVED: f64 = 2.0;
/// ... and stands still if it differs by no more than so many: typical differences of two pairs of frames scatter by a few per
/// cent only, being of thousands of samples.
const STILL: f64 = 1.2;
/// Differences below this are rounding, in DN of the camera.
const ROUNDING_DN: f64 = 0.1;

/// A picture that has moved by less than this between two stops stands still, in px: over a hundred stops it would move by two, and
/// measure nothing.
const LEAST_STEP_PX: f64 = 0.02;
/// A shift that is known worse than this tells nothing, in px.
const WORST_SIGMA_PX: f64 = 0.05;

/// Compares each frame with the one of the stop before. An object without texture looks the same everywhere; so a picture that
/// stands still tells something only where others have moved, or where texture shows that it stands.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct MotionWatch {
    has_moved: bool,
}

impl MotionWatch {
    /// Whether `frame` may be a stop further than `before`; `noise_dn` is the typical difference of two single frames of one
    /// view, of a camera of `bit_depth`.
    pub(super) fn moved(
        &mut self,
        before: &Frame,
        frame: &Frame,
        noise_dn: Option<f64>,
        bit_depth: u8,
    ) -> bool {
        let (Some(noise_dn), Some(difference)) = (noise_dn, Difference::between(before, frame)) else {
            return true;
        };
        // Averages are scaled to 16 bit.
        let scale = f64::from(full_scale(frame.bit_depth())) / f64::from(full_scale(bit_depth));
        let differs_dn = difference.typical_dn / scale;
        if differs_dn > MOVED * noise_dn + ROUNDING_DN {
            self.has_moved = true;
        }
        if differs_dn > STILL * noise_dn + ROUNDING_DN {
            return true;
        }
        !self.has_moved && !stands_still(before, frame)
    }
}

/// Whether texture shows that nothing has moved.
fn stands_still(before: &Frame, frame: &Frame) -> bool {
    shift_between(before, frame).is_ok_and(|shift| {
        shift.sigma_px <= WORST_SIGMA_PX
            && shift.x_px.hypot(shift.y_px) <= LEAST_STEP_PX + 3.0 * shift.sigma_px
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::{Twin, TwinConfig};

    #[test]
    fn a_stall_is_told_from_an_object_without_texture() {
        for noise_dn in [0.0, 1.5] {
            let mut config = TwinConfig::textured_plane(96, 64, 3);
            config.sensor.read_noise_dn = noise_dn;
            let twin = Twin::new(config).unwrap();
            let shot = |position_mm, exposure| twin.expose(position_mm, exposure);
            let typical = Difference::between(&shot(10.0, 0), &shot(10.0, 1)).unwrap().typical_dn;
            let mut watch = MotionWatch::default();
            // Nothing has moved yet, but there is texture by which it would be seen.
            assert!(!watch.moved(&shot(10.0, 2), &shot(10.0, 3), Some(typical), 8));
            let grey = |exposure| twin.digitise(&twin.uniform_irradiance(0.5), exposure);
            assert!(watch.moved(&grey(2), &grey(3), Some(typical), 8), "nothing can be seen to move here");
            assert!(watch.moved(&shot(10.0, 4), &shot(11.5, 5), Some(typical), 8));
            assert!(!watch.moved(&shot(11.5, 6), &shot(11.5, 7), Some(typical), 8), "noise {noise_dn}");
            assert!(watch.moved(&shot(11.5, 8), &shot(13.0, 9), Some(typical), 8));
        }
    }
}
