//! Checks of stops and moves: settling, repeatability, motion of the picture, sampling, and predicted
//! heights.

use std::time::Duration;

use super::motion::ImageMotion;
use super::prediction::{Prediction, Resolution};
use super::repeatability::Repeatability;
use super::sampling::{better_step_mm, repeated_phases};
use super::settling::Settling;
use super::{Check, Verdict};

/// Relative tolerance between measured and expected motion of the picture.
const SAME_SCALE: f64 = 0.05;
/// Below this share of the expected motion, the stage has stalled, something else moves the picture, or a
/// length is wrong by a factor of two. All heights would be wrong.
const LEAST_SCALE: f64 = 0.5;
/// Angle between motion and rows from which on epipolar lines are not rows, in deg: over a shift of 8 px a
/// point then leaves its row by 0.07 px.
const TILT_DEG: f64 = 0.5;
/// Largest scatter, as a share of the relief's disparity.
const SHARE_OF_RELIEF: f64 = 1.0 / 3.0;
/// Scatter above this multiple of the noise comes from the stage.
const OVER_NOISE: f64 = 3.0;
const UM_PER_MM: f64 = 1e3;

/// Whether the planned settling time is long enough.
pub(super) fn settling(found: &Settling, given: Duration) -> Check {
    const NAME: &str = "settling";
    let ms = |time: Duration| time.as_secs_f64() * 1e3;
    if !found.at_rest {
        let finding = format!(
            "the picture does not come to rest within {:.3} px in the {:.0} ms observed after a move",
            found.tolerance_px,
            ms(found.watched)
        );
        let advice = "look for vibration, fans and loose mounts, and observe the picture for longer";
        return Check::new(NAME, Verdict::Warning, finding, advice);
    }
    let (rests, settle, planned) = (
        format!("the picture rests within {:.3} px", found.tolerance_px),
        ms(found.settle),
        format!("{:.0} ms are planned", ms(given)),
    );
    let Some(moving) = found.moving else {
        let finding = format!(
            "{rests} in every frame, from the first that the camera gives, {settle:.0} ms after a move; {planned}"
        );
        return Check::good(NAME, finding);
    };
    let finding =
        format!("{rests} {settle:.0} ms after a move, and not yet at {:.0} ms; {planned}", ms(moving));
    let verdict = if found.settle > given { Verdict::Warning } else { Verdict::Good };
    let wait = format!("plan {:.0} ms to settle", (ms(found.settle) / 10.0).ceil() * 10.0);
    Check::new(NAME, verdict, finding, wait)
}

/// Whether the repeatability is good enough for a relief of `relief_px` of disparity.
pub(super) fn repeatability(found: &Repeatability, relief_px: Option<f64>) -> Check {
    const NAME: &str = "repeatability";
    let finding = format!(
        "over {} returns the position scatters by {:.1} um ({:.4} px, of which picture noise explains {:.4} px) and drifts by {:.1} um; the reversal error is {:.1} um",
        found.returns_px.len(),
        found.sigma_um,
        found.sigma_px,
        found.noise_px,
        found.drift_um,
        found.reversal_um
    );
    let is_noise = found.sigma_px <= OVER_NOISE * found.noise_px;
    match relief_px {
        Some(relief_px) if found.sigma_px > SHARE_OF_RELIEF * relief_px => {
            let finding = format!("{finding}; the relief makes {relief_px:.4} px");
            let advice = "look for play and loose screws, set stage.approach, or take more frames";
            Check::new(NAME, Verdict::Warning, finding, advice)
        }
        None if !is_noise => {
            let advice = "set target.relief and optics.distance to learn whether that is good enough";
            Check::new(NAME, Verdict::Unknown, finding, advice)
        }
        _ => Check::good(NAME, finding),
    }
}

/// Whether the picture moves along the rows, as far as expected.
pub(super) fn motion(found: &ImageMotion, expected_px_per_mm: Option<f64>) -> Check {
    const NAME: &str = "motion";
    if !found.is_significant() {
        return Check::new(
            NAME,
            Verdict::Bad,
            format!("the picture does not move when the stage moves by {:.3} mm", found.move_mm),
            "check that the camera looks at what the stage carries, and that the motor has power",
        );
    }
    let angle_deg = found.angle_rad().to_degrees();
    let mut finding = format!(
        "the picture moves along {}x by {:.3} px/mm, {:.2} deg off the rows",
        if found.x_px_per_mm > 0.0 { "+" } else { "-" },
        found.px_per_mm(),
        angle_deg.abs()
    );
    let mut advice = Vec::new();
    let mut verdict = Verdict::Good;
    if angle_deg.abs() > TILT_DEG {
        verdict = Verdict::Warning;
        advice.push("turn the camera about its optical axis until the motion is along the rows");
    }
    if let Some(expected) = expected_px_per_mm {
        finding += &format!("; lens and distance give {expected:.3} px/mm");
        if found.px_per_mm() < LEAST_SCALE * expected {
            verdict = Verdict::Bad;
            advice.push(
                "check that the motor does not stall and that the stage's axis is the one that carries the object",
            );
        }
        if (found.px_per_mm() / expected - 1.0).abs() > SAME_SCALE {
            verdict = verdict.max(Verdict::Warning);
            advice.push("check focal length, distance and the stage's steps per mm");
        }
    }
    Check::new(NAME, verdict, finding, advice.join("; "))
}

/// Whether frames sample the pixel at many phases.
pub(super) fn sampling(step_mm: f64, px_per_mm: f64, frames: usize) -> Check {
    const NAME: &str = "sampling";
    let shift_px = step_mm * px_per_mm;
    let Some(near) = repeated_phases(shift_px, frames) else {
        let finding = format!("{shift_px:.4} px from frame to frame repeats no sub-pixel positions");
        return Check::good(NAME, finding);
    };
    let finding = format!(
        "{shift_px:.4} px from frame to frame is near {}/{}: over {frames} frames the sub-pixel positions drift by {:.2} px instead of {:.2} px, so that \
         errors of interpolation do not average out",
        near.numerator,
        near.denominator,
        near.drift_px,
        1.0 / f64::from(near.denominator)
    );
    let advice = match better_step_mm(step_mm, px_per_mm, frames) {
        Some(better_mm) => format!("step by {better_mm:.3} mm"),
        None => "take more frames".to_owned(),
    };
    Check::new(NAME, Verdict::Warning, finding, advice)
}

/// Whether the relief is resolved.
pub(super) fn prospect(found: &Prediction, relief_mm: Option<f64>) -> Check {
    const NAME: &str = "height";
    let mut finding = format!(
        "the predicted uncertainty of heights is {:.1} um from noise (one sigma of a pixel; {:.4} px of {:.1} px of disparity)",
        found.sigma_height_mm * UM_PER_MM,
        found.sigma_disparity_px,
        found.disparity_px
    );
    if let Some(common_mm) = found.common_height_mm {
        finding += &format!(", and {:.1} um common to all pixels from the stage", common_mm * UM_PER_MM);
    }
    let (Some(relief_mm), Some(sigmas), Some(resolution)) =
        (relief_mm, found.relief_sigmas, found.resolution)
    else {
        return Check::good(NAME, finding);
    };
    finding += &format!("; a relief of {:.0} um is {sigmas:.1} sigma", relief_mm * UM_PER_MM);
    let (verdict, but) = match resolution {
        Resolution::Resolved => (Verdict::Good, ""),
        Resolution::Marginal => (Verdict::Warning, ": it shows only in averages over neighbours"),
        Resolution::Hidden => (Verdict::Bad, ": noise hides it"),
    };
    let advice = "average more frames, take more of them, lengthen the baseline, move closer, or add light";
    Check::new(NAME, verdict, finding + but, advice)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motion_is_judged_by_its_direction_and_length() {
        let moving = |x_px_per_mm, y_px_per_mm| ImageMotion {
            x_px_per_mm,
            y_px_per_mm,
            sigma_px_per_mm: 0.001,
            move_mm: 2.0,
        };
        let verdict = |found, expected| motion(&found, expected).verdict;
        assert_eq!(verdict(moving(-2.0, 0.01), Some(2.09)), Verdict::Good);
        assert_eq!(verdict(moving(2.0, 0.01), Some(2.2)), Verdict::Warning);
        // 0.5 deg are 0.00873.
        assert_eq!(verdict(moving(2.0, 0.017), None), Verdict::Good);
        assert_eq!(verdict(moving(-2.0, 0.018), None), Verdict::Warning);
        assert_eq!(verdict(moving(0.003, 0.003), Some(2.0)), Verdict::Bad);
        // 0.096 px in all, and 48 sigma: drift or vibration. 0.104 px are motion.
        assert_eq!(verdict(moving(0.048, 0.0), None), Verdict::Bad);
        assert_eq!(verdict(moving(0.052, 0.0), None), Verdict::Good);
        assert_eq!(verdict(moving(0.99, 0.0), Some(2.0)), Verdict::Bad);
        assert_eq!(verdict(moving(1.01, 0.0), Some(2.0)), Verdict::Warning);
        let finding = motion(&moving(-2.0, 0.0), None).finding;
        assert_eq!(finding, "the picture moves along -x by 2.000 px/mm, 0.00 deg off the rows");
    }

    #[test]
    fn a_stage_that_settles_later_than_planned_is_told() {
        let found = Settling {
            settle: Duration::from_millis(312),
            moving: Some(Duration::from_millis(272)),
            resolution: Duration::from_millis(40),
            tolerance_px: 0.02,
            farthest_px: 3.0,
            frames: 30,
            watched: Duration::from_millis(1500),
            at_rest: true,
        };
        assert_eq!(settling(&found, Duration::from_millis(312)).verdict, Verdict::Good);
        assert_eq!(settling(&found, Duration::from_millis(300)).verdict, Verdict::Warning);
        // Nothing was seen to move, so the first frame says nothing about a shorter time.
        let first = settling(&Settling { moving: None, ..found }, Duration::from_millis(300));
        assert_eq!(first.verdict, Verdict::Good);
        assert!(first.finding.contains("the first that the camera gives, 312 ms"), "{}", first.finding);
        let late = settling(&found, Duration::from_millis(200));
        assert_eq!(late.advice.as_deref(), Some("plan 320 ms to settle"));
        let never = settling(&Settling { at_rest: false, ..found }, Duration::from_millis(2000));
        assert_eq!(never.verdict, Verdict::Warning);
        assert!(!never.advice.unwrap().contains("plan"), "no time to settle helps");
    }

    #[test]
    fn scatter_is_judged_by_the_relief_that_is_to_be_seen() {
        let found = Repeatability {
            returns_px: vec![0.0; 5],
            sigma_px: 0.04,
            sigma_um: 20.0,
            drift_um: 0.0,
            reversal_um: 0.0,
            noise_px: 0.005,
        };
        let verdict = |found: &Repeatability, relief_px| repeatability(found, relief_px).verdict;
        assert_eq!(verdict(&found, Some(0.13)), Verdict::Good);
        assert_eq!(verdict(&found, Some(0.11)), Verdict::Warning);
        assert_eq!(verdict(&found, None), Verdict::Unknown);
        assert_eq!(verdict(&Repeatability { noise_px: 0.02, ..found }, None), Verdict::Good);
    }
}
