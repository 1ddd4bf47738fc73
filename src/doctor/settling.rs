//! Mechanical settling: motion of the picture after the stage reports rest.

use std::time::Duration;

use serde::Serialize;

use super::error::MotionError;
use super::view::middle;
use epirig_calibration::registration::{Shift, shift_between};
use epirig_core::frame::Frame;
use epirig_devices::camera::{Camera, Moment};
use epirig_devices::stage::Stage;

/// Time of observation. Stages that vibrate longer are not usable.
const WATCHED: Duration = Duration::from_millis(1500);
/// Most frames kept: those of 1.5 s at 60 Hz.
const MOST_FRAMES: usize = 90;
/// The picture is at rest within this distance of its last place, in px. An end frame of N with an error e
/// changes the slope by 6 e / N; with 25 frames this error costs 0.005 px of disparity ...
const REST_PX: f64 = 0.02;
/// ... or within this multiple of the sigma of the shift.
const SIGMAS: f64 = 3.0;
/// Last share of the observation. A picture that is off in this part does not come to rest: a steady
/// vibration passes its last place in every period.
const LAST_PART: f64 = 0.25;
/// Most columns and rows kept of a frame: 90 frames then take 47 MB for any camera, and give a shift to a few
/// 0.001 px.
const KEPT_PX: usize = 512;

/// Mechanical settling of the stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Settling {
    /// Time from the reported end of the move to the start of the first exposure from which on the picture is
    /// at rest. Frames that change during the comparison with their neighbour are not delivered, so it is too
    /// short by at most one frame interval.
    pub settle: Duration,
    /// Time from the end of the move to the start of the last exposure in which the picture was not at rest;
    /// `None` if it was at rest in all. The camera gave no earlier frame then.
    pub moving: Option<Duration>,
    /// Time between frames, which is the resolution of `settle`.
    pub resolution: Duration,
    /// Tolerance of rest, in px.
    pub tolerance_px: f64,
    /// Largest distance of a comparable frame from the last one, in px.
    pub farthest_px: f64,
    /// Number of frames observed.
    pub frames: usize,
    /// Time from the end of the move to the start of the last exposure.
    pub watched: Duration,
    /// Whether the picture came to rest. It did not if it was off in the last quarter of the observation;
    /// `settle` has no meaning then.
    pub at_rest: bool,
}

/// Moves to `position_mm`, and observes the middle of the picture (512 x 512 px at most) for 1.5 s.
///
/// # Errors
/// [`MotionError`] if stage or camera fail, or the last two frames cannot be compared.
pub(super) fn measure_settling(
    stage: &mut dyn Stage,
    camera: &mut dyn Camera,
    position_mm: f64,
) -> Result<Settling, MotionError> {
    stage.move_to(position_mm)?;
    let moved = camera.now();
    let mut seen: Vec<(Moment, Frame)> = Vec::new();
    // At least two, for a camera with long exposures.
    while seen.len() < 2 || (seen.len() < MOST_FRAMES && seen[seen.len() - 1].0.since(moved) < WATCHED) {
        let taken = camera.grab_after(moved)?;
        seen.push((taken.facts.exposure_start, middle(taken.frame, KEPT_PX)));
    }
    let (starts, frames): (Vec<Moment>, Vec<Frame>) = seen.into_iter().unzip();
    let last = frames.len() - 1;
    // A frame that cannot be compared was taken far from rest; but the last two must be comparable.
    let mut shifts: Vec<Option<Shift>> =
        frames[..last - 1].iter().map(|frame| shift_between(&frames[last], frame).ok()).collect();
    shifts.push(Some(shift_between(&frames[last], &frames[last - 1])?));
    let intervals: Vec<Duration> = starts.windows(2).map(|pair| pair[1].since(pair[0])).collect();
    Ok(judge(&shifts, &starts, moved, intervals.into_iter().min().unwrap_or_default()))
}

/// The time from which on the shifts stay small. `starts` has one more entry, for the frame of reference.
fn judge(shifts: &[Option<Shift>], starts: &[Moment], moved: Moment, resolution: Duration) -> Settling {
    let known = || shifts.iter().flatten();
    let sigma_px = known().map(|shift| shift.sigma_px).fold(0.0, f64::max);
    let tolerance_px = REST_PX.max(SIGMAS * sigma_px);
    let off = |shift: &Shift| shift.x_px.hypot(shift.y_px);
    let restless = shifts.iter().rposition(|shift| !shift.is_some_and(|shift| off(&shift) <= tolerance_px));
    let first = restless.map_or(0, |index| index + 1);
    let watched = starts.last().map_or(Duration::ZERO, |start| start.since(moved));
    let is_late = |start: &Moment| start.since(moved) > watched.mul_f64(1.0 - LAST_PART);
    Settling {
        settle: starts.get(first).map_or(Duration::ZERO, |start| start.since(moved)),
        moving: restless.and_then(|index| starts.get(index)).map(|start| start.since(moved)),
        resolution,
        tolerance_px,
        farthest_px: known().map(off).fold(0.0, f64::max),
        frames: starts.len(),
        watched,
        at_rest: !restless.and_then(|index| starts.get(index)).is_some_and(is_late),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_swing_that_dies_out_settles_when_it_stays_small() {
        // 25 Hz; a swing of 1 px and 5 Hz that decays with 200 ms is below 0.02 px for good after 200 ms * ln
        // 50 = 782 ms at most.
        let starts: Vec<Moment> = (0..38).map(|index| Moment::from_ns(40_000_000 * index)).collect();
        let swing = |t: f64| (-t / 0.2).exp() * (std::f64::consts::TAU * 5.0 * t).cos();
        let shift = |x_px: f64| Shift { x_px, y_px: 0.0, sigma_px: 0.001, light: 1.0, residual_dn: 0.3 };
        let mut shifts: Vec<Option<Shift>> =
            (0..37).map(|index| Some(shift(swing(0.04 * f64::from(index))))).collect();
        // The latest frame that is off by more than that, found by hand: 720 ms (cos 0.8 of a turn ... e^-3.6
        // = 0.027, cos = -0.81: 0.022).
        let found = judge(&shifts, &starts, Moment::default(), Duration::from_millis(40));
        assert_eq!(found.settle, Duration::from_millis(760));
        assert_eq!((found.farthest_px, found.tolerance_px), (1.0, 0.02));
        assert!(found.at_rest && found.watched == Duration::from_millis(37 * 40), "{found:?}");
        assert_eq!(found.moving, Some(Duration::from_millis(720)));
        shifts[30] = None;
        let found = judge(&shifts, &starts, Moment::default(), Duration::from_millis(40));
        assert_eq!(found.settle, Duration::from_millis(31 * 40), "what cannot be compared is not at rest");
    }

    #[test]
    fn a_steady_swing_does_not_come_to_rest() {
        // 25 Hz; 0.2 px and 3 Hz, which is 0.12 of a turn from frame to frame: it is within 0.02 px of its
        // last place for two frames at most.
        let starts: Vec<Moment> = (0..38).map(|index| Moment::from_ns(40_000_000 * index)).collect();
        let place = |index: u32| 0.2 * (std::f64::consts::TAU * 3.0 * 0.04 * f64::from(index)).sin();
        let shift =
            |x_px: f64| Some(Shift { x_px, y_px: 0.0, sigma_px: 0.001, light: 1.0, residual_dn: 0.3 });
        let shifts: Vec<Option<Shift>> = (0..37).map(|index| shift(place(index) - place(37))).collect();
        let found = judge(&shifts, &starts, Moment::default(), Duration::from_millis(40));
        assert!(!found.at_rest, "{found:?}");
        // Off until 1080 ms of 1480 ms, which is before the last quarter (1110 ms); then off once more within
        // it.
        let mut shifts: Vec<Option<Shift>> =
            (0..37).map(|index| shift(if index <= 27 { 0.1 } else { 0.0 })).collect();
        let found = judge(&shifts, &starts, Moment::default(), Duration::from_millis(40));
        assert!(found.at_rest && found.settle == Duration::from_millis(1120), "{found:?}");
        shifts[28] = shift(0.1);
        assert!(!judge(&shifts, &starts, Moment::default(), Duration::from_millis(40)).at_rest);
    }

    #[test]
    fn noise_widens_the_tolerance() {
        let shift = |x_px: f64| Some(Shift { x_px, y_px: 0.0, sigma_px: 0.05, light: 1.0, residual_dn: 9.0 });
        let starts: Vec<Moment> = (1..4).map(|index| Moment::from_ns(1_000_000 * index)).collect();
        let found = judge(&[shift(0.14), shift(-0.1)], &starts, Moment::default(), Duration::ZERO);
        assert_eq!((found.settle, found.tolerance_px), (Duration::from_millis(1), SIGMAS * 0.05));
        assert_eq!(found.moving, None);
    }
}
