//! The examination: all checks in order.

use tracing::{info, info_span, warn};

use super::error::MotionError;
use super::motion::measure_motion;
use super::prediction::{Prediction, Prospect};
use super::repeatability::{RETURNS, measure_repeatability};
use super::response::{exposure_response, gain_responses};
use super::settling::measure_settling;
use super::view::View;
use super::{Check, DoctorError, DoctorPlan, Report, Verdict, picture, rules, stops};
use epirig_core::fault::{Blame, Fault};
use epirig_core::progress::Progress;
use epirig_devices::camera::{Assessment, Camera, CameraError, Configuration};
use epirig_devices::stage::Stage;

/// Frames of the first view: far fewer give the noise to 1 %, but bands of a lamp beat against the frames
/// over several of them.
const FRAMES: usize = 16;
/// Pixels in the smallest window of the matcher: 5 x 5.
const WINDOW_PX: f64 = 25.0;
/// Steps of the progress bar: setup, picture, motion, settling, repeatability.
const PARTS: u64 = 5;

/// Sets up the camera, homes the stage, moves to the plan's first position and makes all checks. At the end
/// the camera is stopped; the stage stays at the last position.
///
/// A failed measurement becomes a check of its own, and the examination continues.
///
/// # Errors
/// [`DoctorError`] if the plan is empty, or stage or camera do not work at all.
pub fn examine(
    stage: &mut dyn Stage,
    camera: &mut dyn Camera,
    plan: &DoctorPlan,
    progress: &dyn Progress,
) -> Result<Report, DoctorError> {
    if plan.scan.positions_mm.len() < 2 {
        return Err(DoctorError::EmptyPlan(plan.scan.positions_mm.len()));
    }
    let _span = info_span!("examination").entered();
    progress.begin("examining", PARTS);
    let found = examine_parts(stage, camera, plan, progress);
    progress.end();
    let report = found?;
    for Check { name, verdict, finding, advice } in &report.checks {
        match verdict {
            Verdict::Good | Verdict::Unknown => info!(check = name, ?verdict, finding, "checked"),
            Verdict::Warning | Verdict::Bad => warn!(check = name, ?verdict, finding, advice, "checked"),
        }
    }
    camera.stop()?;
    Ok(report)
}

fn examine_parts(
    stage: &mut dyn Stage,
    camera: &mut dyn Camera,
    plan: &DoctorPlan,
    progress: &dyn Progress,
) -> Result<Report, DoctorError> {
    let configuration = camera.configure(&plan.scan.camera)?;
    let mut report = Report {
        configuration: configuration.to_string(),
        checks: vec![
            rules::travel(&plan.scan.positions_mm, stage.travel_mm()),
            rules::holding(stage.holds_at_rest()),
            rules::disk(&plan.scan, 0, plan.free_bytes, &configuration),
            rules::automatic_controls(&configuration),
            rules::exposure(configuration.exposure_us, plan.mains_hz),
        ],
        motion: None,
        settling: None,
        repeatability: None,
        predicted: None,
    };
    let movable = go_to_start(stage, plan, &mut report.checks)?;
    match camera.start() {
        Ok(()) => {}
        // A finding that ends the checks of the picture.
        Err(error @ CameraError::Unsteady { .. }) => {
            let advice = "make the picture steady first; the other checks of the picture were skipped";
            report.checks.push(Check::new("steadiness", Verdict::Bad, error.to_string(), advice));
            return Ok(report);
        }
        Err(error) => return Err(error.into()),
    }
    progress.advance(1);
    let view = look_at_picture(camera, plan, &mut report.checks)?;
    report.checks.extend(exposure_response(camera, configuration.format.size.columns)?);
    report.checks.extend(gain_responses(camera, &plan.scan.camera)?);
    progress.advance(1);
    if movable {
        measure_moves(stage, camera, plan, &configuration, progress, &mut report)?;
    }
    foresee(plan, &configuration, &view, &mut report);
    Ok(report)
}

/// Homes the stage and moves to the first position. Returns whether that position can be approached.
fn go_to_start(
    stage: &mut dyn Stage,
    plan: &DoctorPlan,
    checks: &mut Vec<Check>,
) -> Result<bool, DoctorError> {
    stage.home()?;
    let lowest_mm = plan.scan.positions_mm.iter().copied().fold(f64::INFINITY, f64::min);
    let reached = stage.move_to(lowest_mm).and_then(|()| stage.move_to(plan.scan.positions_mm[0]));
    let (verdict, finding) = match reached {
        Ok(()) => (Verdict::Good, format!("the lowest position, {lowest_mm:.3} mm, can be approached")),
        Err(error) if error.blame() == Blame::Request => (Verdict::Bad, error.to_string()),
        Err(error) => return Err(error.into()),
    };
    let advice = "choose another start; checks that need moves were skipped";
    checks.push(Check::new("approach", verdict, finding, advice));
    Ok(verdict == Verdict::Good)
}

fn look_at_picture(
    camera: &mut dyn Camera,
    plan: &DoctorPlan,
    checks: &mut Vec<Check>,
) -> Result<View, DoctorError> {
    let at_rest = camera.now().after(plan.scan.section.settle);
    let frame = camera.grab_after(at_rest)?.frame;
    let seen = Assessment::of(&frame);
    let view = View::take(camera, FRAMES)?;
    checks.extend([
        picture::saturation(&frame, &seen, plan.scan.limits.saturated),
        picture::brightness(&frame, &seen),
        picture::texture(&view, &seen),
        picture::noise(&view, plan.scan.section.average),
        picture::flicker(&view),
    ]);
    Ok(view)
}

/// Motion, settling and repeatability.
fn measure_moves(
    stage: &mut dyn Stage,
    camera: &mut dyn Camera,
    plan: &DoctorPlan,
    configuration: &Configuration,
    progress: &dyn Progress,
    report: &mut Report,
) -> Result<(), DoctorError> {
    let (first_mm, step_mm) = (plan.scan.positions_mm[0], step_mm(plan));
    let last_mm = plan.scan.positions_mm.iter().copied().fold(first_mm, f64::max).min(stage.travel_mm());
    let moved = measure_motion(stage, camera, plan.scan.section.settle, [first_mm, last_mm], step_mm);
    let expected = expected_px_per_mm(plan, configuration);
    if let Some(motion) = or_check("motion", moved, camera, &mut report.checks)? {
        report.checks.push(stops::motion(&motion, expected));
        report.motion = Some(motion).filter(|motion| motion.is_significant());
    }
    progress.advance(1);
    let Some(motion) = report.motion.filter(|_| !plan.short) else { return Ok(()) };
    // One step, as in the scan.
    stage.move_to(first_mm)?;
    let next_mm = (first_mm + step_mm).min(stage.travel_mm());
    let settled = measure_settling(stage, camera, next_mm);
    if let Some(settling) = or_check("settling", settled, camera, &mut report.checks)? {
        report.checks.push(stops::settling(&settling, plan.scan.section.settle));
        report.settling = Some(settling);
    }
    progress.advance(1);
    let axis = [motion.x_px_per_mm, motion.y_px_per_mm];
    let returned =
        measure_repeatability(stage, camera, plan.scan.section.settle, [next_mm, step_mm], axis, RETURNS);
    if let Some(found) = or_check("repeatability", returned, camera, &mut report.checks)? {
        let distance_mm = distance_mm(plan, configuration, motion.px_per_mm());
        let relief = plan.relief_mm.zip(distance_mm);
        let relief_px =
            relief.map(|(relief, distance)| relief / distance * motion.px_per_mm() * baseline_mm(plan));
        report.checks.push(stops::repeatability(&found, relief_px));
        report.repeatability = Some(found);
    }
    progress.advance(1);
    Ok(())
}

/// The measurement; or a check with the reason of its failure, with the camera running again.
fn or_check<T>(
    name: &'static str,
    measured: Result<T, MotionError>,
    camera: &mut dyn Camera,
    checks: &mut Vec<Check>,
) -> Result<Option<T>, DoctorError> {
    let (verdict, why) = match measured {
        Ok(found) => return Ok(Some(found)),
        Err(MotionError::Stage(error)) => return Err(error.into()),
        Err(MotionError::Camera(error)) => {
            camera.start()?;
            (Verdict::Bad, error.to_string())
        }
        Err(error) => (Verdict::Unknown, error.to_string()),
    };
    checks.push(Check { name, verdict, finding: format!("the measurement failed: {why}"), advice: None });
    Ok(None)
}

/// Sampling, and the predicted uncertainty of heights.
fn foresee(plan: &DoctorPlan, configuration: &Configuration, view: &View, report: &mut Report) {
    let frames = plan.scan.positions_mm.len();
    let measured = report.motion.map(|motion| motion.px_per_mm());
    let px_per_mm = measured.or_else(|| expected_px_per_mm(plan, configuration));
    if let Some(px_per_mm) = px_per_mm {
        report.checks.push(stops::sampling(step_mm(plan), px_per_mm, frames));
    }
    let distance_mm = px_per_mm.and_then(|px_per_mm| distance_mm(plan, configuration, px_per_mm));
    let Some((px_per_mm, distance_mm)) = px_per_mm.zip(distance_mm) else {
        report.checks.push(Check::new(
            "height",
            Verdict::Unknown,
            "the uncertainty of heights depends on lens and distance, which are unknown".to_owned(),
            "give the focal length, the distance of the object, or both",
        ));
        return;
    };
    let predicted = Prediction::of(&Prospect {
        px_per_mm,
        distance_mm,
        baseline_mm: baseline_mm(plan),
        frames,
        noise_dn: view.noise_dn() / (plan.scan.section.average.max(1) as f64).sqrt(),
        gradient_dn_per_px: view.gradient_dn_per_px(),
        window_px: WINDOW_PX,
        step_error_mm: report.repeatability.as_ref().map(|found| found.sigma_um * 1e-3),
        relief_mm: plan.relief_mm,
    });
    report.checks.push(stops::prospect(&predicted, plan.relief_mm));
    report.predicted = Some(predicted);
}

/// Distance from the first to the last position, in mm.
fn baseline_mm(plan: &DoctorPlan) -> f64 {
    (plan.scan.positions_mm[plan.scan.positions_mm.len() - 1] - plan.scan.positions_mm[0]).abs()
}

/// Mean distance between frames, in mm.
fn step_mm(plan: &DoctorPlan) -> f64 {
    baseline_mm(plan) / (plan.scan.positions_mm.len() - 1) as f64
}

/// Motion of the picture as expected from lens and distance, in px per mm.
fn expected_px_per_mm(plan: &DoctorPlan, configuration: &Configuration) -> Option<f64> {
    Some(plan.scan.lens?.focal_length.px(configuration.columns) / plan.distance_mm?)
}

/// Distance of the object as given, or from lens and measured motion, in mm.
fn distance_mm(plan: &DoctorPlan, configuration: &Configuration, px_per_mm: f64) -> Option<f64> {
    let by_motion = || Some(plan.scan.lens?.focal_length.px(configuration.columns) / px_per_mm);
    plan.distance_mm.or_else(by_motion)
}
