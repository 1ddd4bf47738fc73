//! The thread that looks at pictures: light, sharpness, and chess-boards.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::panel::scan::find_target;
use crate::panel::shared::SharedState;
use crate::panel::state::LightState;
use epirig_core::frame::{Frame, Samples};
use epirig_devices::camera::Assessment;

/// Time between two looks at the light, ...
const LIGHT: Duration = Duration::from_millis(150);
/// ... and for a chess-board, which takes longer.
const TARGET: Duration = Duration::from_millis(400);

/// Looks at the latest picture again and again until the panel ends.
pub(super) fn watch(shared: &Arc<SharedState>) {
    let mut number = 0;
    let mut searched: Option<Instant> = None;
    while !shared.is_ending() {
        let Some(picture) = shared.pictures.after(number, LIGHT) else { continue };
        number = picture.number;
        let began = Instant::now();
        let mut light = light(&picture.frame);
        let picture_hz = Some(shared.pictures.rate_hz());
        let searches = shared.change(|state| {
            // Who resets the peak sets it to 0 in the light before.
            let before = state.rig.light.as_ref().map_or(0.0, |light| light.focus_peak);
            light.focus_peak = light.focus_peak.max(before);
            (state.rig.camera.picture_hz, state.rig.light) = (picture_hz, Some(light));
            // A scan that waits for a board looks for it itself.
            let asked = state.rig.scan.as_ref().is_some_and(|scan| scan.asked.is_some());
            if !asked && !state.finds_target {
                state.rig.target = None;
            }
            !asked && state.finds_target
        });
        if searches && searched.is_none_or(|at| at.elapsed() >= TARGET) {
            searched = Some(Instant::now());
            let target = find_target(shared, &picture.frame, true);
            shared.change(|state| state.rig.target = target);
        }
        std::thread::sleep(LIGHT.saturating_sub(began.elapsed()));
    }
}

/// Light and sharpness of a frame; without light its sharpness is no peak.
fn light(frame: &Frame) -> LightState {
    /// Below this share of full scale the sharpness is that of noise.
    const DARK: f64 = 0.02;
    let seen = Assessment::of(frame);
    let is_lit = seen.mean_dn >= DARK * f64::from(frame.full_scale());
    LightState {
        mean_dn: seen.mean_dn,
        minimum_dn: seen.minimum_dn,
        maximum_dn: seen.maximum_dn,
        full_scale_dn: frame.full_scale(),
        pixels: frame.rows() * frame.columns(),
        saturated: seen.saturated,
        black: seen.black,
        focus: seen.focus,
        focus_peak: if is_lit { seen.focus } else { 0.0 },
        corners: corners(frame),
        bin_width_dn: seen.bin_width_dn,
        histogram: seen.histogram,
    }
}

/// Parts of a picture, each way, whose light is compared.
const PARTS: usize = 10;
/// Largest standard deviation of the samples of a part, as a share of their mean, of a uniform target. A lens that
/// lets half of the light through at the edge changes it by at most a fifth within a part, which is 6 %; noise of
/// 8 % on top makes 10 %. Texture and dark ground have several times that.
const UNIFORM: f64 = 0.1;

/// Mean light of the four corners over that of the centre: the vignetting, where the picture is that of a uniform
/// target. Of another picture it tells nothing: dark corners may be the ground behind an object.
fn corners(frame: &Frame) -> Option<f64> {
    let (rows, columns) = (frame.rows(), frame.columns());
    let (high, wide) = ((rows / PARTS).max(1), (columns / PARTS).max(1));
    // Mean of a part, and whether it is that of a uniform target.
    let part = |top: usize, left: usize| {
        let (mut sum, mut squares) = (0.0, 0.0);
        for y in top..top + high {
            let (from, to) = (y * columns + left, y * columns + left + wide);
            let mut add = |value: f64| (sum, squares) = (sum + value, squares + value * value);
            match frame.samples() {
                Samples::U8(samples) => samples[from..to].iter().for_each(|&value| add(f64::from(value))),
                Samples::U16(samples) => samples[from..to].iter().for_each(|&value| add(f64::from(value))),
            }
        }
        let count = (high * wide) as f64;
        let mean = sum / count;
        let variance = (squares / count - mean * mean).max(0.0);
        (mean, mean > 0.0 && variance.sqrt() <= UNIFORM * mean)
    };
    let (bottom, right) = (rows - high, columns - wide);
    let at = |index: usize, last: usize| index * last / (PARTS - 1);
    let all = (0..PARTS * PARTS).map(|index| part(at(index / PARTS, bottom), at(index % PARTS, right)));
    let means: Vec<f64> = all.map(|(mean, uniform)| uniform.then_some(mean)).collect::<Option<_>>()?;
    let last = PARTS - 1;
    let outside =
        [0, last, last * PARTS, last * PARTS + last].iter().map(|&corner| means[corner]).sum::<f64>();
    Some(0.25 * outside / part(bottom / 2, right / 2).0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_compared_with_the_centre() {
        // Light that falls by a fifth from the centre to the ends of a row, linearly.
        let samples = (0..20 * 41).map(|index| {
            let from_centre = (f64::from(index % 41) - 20.0).abs() / 20.0;
            (1000.0 * (1.0 - 0.2 * from_centre)).round() as u16
        });
        let frame = Frame::new(20, 41, 12, Samples::U16(samples.collect())).unwrap();
        // The outermost four of 41 columns: 1.5 of 20 columns from the end on average, so 0.8 + 0.015.
        // The middle four: 18 to 21, a mean distance of 1 of 20 columns.
        let expected = 0.815 / 0.99;
        assert!((corners(&frame).unwrap() - expected).abs() < 1e-3, "{:?}", corners(&frame));
        let black = Frame::new(2, 2, 8, Samples::U8(vec![0; 4])).unwrap();
        assert_eq!(corners(&black), None);
        // A bright object before black ground, and one that fills the picture with texture: no vignetting is seen.
        let object = |index: usize| if (10..30).contains(&(index % 41)) { 1000 } else { 3 };
        let texture = |index: usize| if index.is_multiple_of(3) { 200 } else { 1000 };
        for samples in [(0..20 * 41).map(object).collect(), (0..20 * 41).map(texture).collect()] {
            assert_eq!(corners(&Frame::new(20, 41, 12, Samples::U16(samples)).unwrap()), None);
        }
        assert!(light(&frame).focus_peak > 0.0);
        assert_eq!(light(&black).focus_peak, 0.0);
    }
}
