//! Checks of the picture: light, focus, noise, flicker.

use super::flicker::Flicker;
use super::view::View;
use super::{Check, Verdict};
use epirig_core::frame::Frame;
use epirig_devices::camera::Assessment;

/// A frame is dim if its brightest hundredth stays below this share of full scale: two bits of eight are
/// unused ...
const DIM: f64 = 0.25;
/// ... and dark below this: 12 levels of 8 bit are left.
const DARK: f64 = 0.05;
const BRIGHTEST: f64 = 0.01;

/// Saturation.
pub(super) fn saturation(frame: &Frame, seen: &Assessment, limit: f64) -> Check {
    let share = seen.saturated as f64 / frame.samples().len().max(1) as f64;
    let finding = format!(
        "{:.3} % of the samples are at full scale, {:.3} % are allowed",
        100.0 * share,
        100.0 * limit
    );
    let verdict = if share > limit { Verdict::Bad } else { Verdict::Good };
    Check::new("saturation", verdict, finding, "expose for less time, lower the gain or close the aperture")
}

/// Brightness.
pub(super) fn brightness(frame: &Frame, seen: &Assessment) -> Check {
    let mut left = (BRIGHTEST * frame.samples().len() as f64) as u64;
    let brightest = seen.histogram.iter().enumerate().rev().find(|(_, count)| {
        let is_it = **count > left;
        left = left.saturating_sub(**count);
        is_it
    });
    let level_dn = brightest.map_or(0.0, |(bin, _)| (bin as f64 + 0.5) * f64::from(seen.bin_width_dn));
    let share = level_dn / f64::from(frame.full_scale());
    let finding = format!(
        "the mean is {:.1} DN, and all but 1 % of the samples stay below {:.0} % of full scale",
        seen.mean_dn,
        100.0 * share
    );
    let verdict = match share {
        ..DARK => Verdict::Bad,
        ..DIM => Verdict::Warning,
        _ => Verdict::Good,
    };
    Check::new("brightness", verdict, finding, "expose for longer, open the aperture or bring more light")
}

/// Texture and focus.
pub(super) fn texture(view: &View, seen: &Assessment) -> Check {
    let (gradient, noise) = (view.gradient_dn_per_px(), view.noise_dn());
    let finding = format!(
        "gradients are {gradient:.2} DN/px, noise is {noise:.2} DN, and the focus figure is {:.5} (compare it for one object with other \
         settings of the lens)",
        seen.focus
    );
    // The central difference of pure noise has this value. Many frames may compensate for weak texture; the
    // check of heights tests that.
    let is_weak = gradient < noise / std::f64::consts::SQRT_2;
    let verdict = if is_weak { Verdict::Warning } else { Verdict::Good };
    let advice =
        "put a textured object in view, focus, or bring more light: noise is stronger than the texture";
    Check::new("texture", verdict, finding, advice)
}

/// Noise.
pub(super) fn noise(view: &View, averaged: usize) -> Check {
    let noise_dn = view.noise_dn();
    let mut finding = format!("noise is {noise_dn:.2} DN in a frame");
    if averaged > 1 {
        finding += &format!(", {:.2} DN in the mean of {averaged}", noise_dn / (averaged as f64).sqrt());
    }
    Check::good("noise", finding)
}

/// Flicker, as measured.
pub(super) fn flicker(view: &View) -> Check {
    let found = Flicker::of(view);
    let mut finding = format!(
        "frames differ by {:.3} % and rows by {:.3} % in brightness (rows by {:.3} % by noise alone)",
        100.0 * found.common_share,
        100.0 * found.band_share,
        100.0 * found.noise_share
    );
    // Any change along a line of an EPI acts as noise on the matcher.
    let mut verdict = Verdict::Good;
    if found.intensity_dn() > view.noise_dn() {
        verdict = Verdict::Warning;
        finding += "; that is more than the noise of a pixel";
    }
    Check::new(
        "flicker",
        verdict,
        finding,
        "use a steady lamp, or expose for whole half periods of the mains",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_core::frame::Samples;

    #[test]
    fn weak_texture_is_a_warning_because_many_frames_may_resolve_it() {
        let verdict = |step_dn: u8| {
            let samples = (0..40 * 30).map(|index| 50 + step_dn * (index % 40) as u8).collect();
            let frame = Frame::new(30, 40, 8, Samples::U8(samples)).unwrap();
            texture(&View::new(&frame), &Assessment::of(&frame)).verdict
        };
        // Noise of a single frame is that of rounding, 0.29 DN: 0.2 DN/px are as strong.
        assert_eq!((verdict(0), verdict(1)), (Verdict::Warning, Verdict::Good));
    }
}
