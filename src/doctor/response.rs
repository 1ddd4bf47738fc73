//! Whether the picture follows the controls of exposure and gain.
//!
//! Reading a control back proves little: `uvcvideo` answers reads of most controls from its cache, so that a
//! camera that takes a value and keeps the old one reads as if it had obeyed. The picture tells.

use super::{Check, Verdict};
use epirig_devices::camera::{
    Assessment, Camera, CameraError, CameraSettings, Control, exposure_unit, find_control, is_gain,
};

/// The picture follows if its mean changes by this share at least, of the larger mean. With half of the
/// exposure, a linear camera darkens by a half, one with the gamma of displays (2.2) by
/// 1 - 0.5^(1 / 2.2) = 27 %. A gain goes over half of its range at least: if the whole range doubles the
/// light, that is from 1.5 to 1 or to 2, and darkens or brightens linear cameras by 25 %, others by 12 %.
const CHANGE: f64 = 0.1;

/// Halves the exposure for a frame. `None` if there is no exposure to halve. `columns` is the width of the
/// image.
///
/// # Errors
/// [`CameraError`] if the camera does not work, or does not take the former value again.
pub(super) fn exposure_response(
    camera: &mut dyn Camera,
    columns: usize,
) -> Result<Option<Check>, CameraError> {
    if !camera.is_live() {
        return Ok(None);
    }
    let controls = camera.controls()?;
    let Some((control, unit_us)) = exposure_unit(&controls, columns) else { return Ok(None) };
    let Some(value) = settable(control).filter(|value| value / 2 > control.minimum) else { return Ok(None) };
    let half = on_grid(control, value / 2);
    let shown = |value: i64| format!("{:.0} us", value as f64 * unit_us);
    trial(camera, "exposure control", control, value, half, &shown).map(Some)
}

/// Sets each gain that `settings` set to the farther end of its range, for a frame. None for a camera that
/// does not show the present view.
///
/// # Errors
/// As [`exposure_response`].
pub(super) fn gain_responses(
    camera: &mut dyn Camera,
    settings: &CameraSettings,
) -> Result<Vec<Check>, CameraError> {
    if !camera.is_live() {
        return Ok(Vec::new());
    }
    let (name, controls) = (camera.identity().name(), camera.controls()?);
    let set = settings.controls.iter().filter_map(|(gain, _)| find_control(&name, &controls, gain).ok());
    let mut checks = Vec::new();
    for control in set.filter(|control| is_gain(control)) {
        let Some(value) = settable(control) else { continue };
        // The unit of gains is unknown: the longest way shows most.
        let ends = [control.minimum, on_grid(control, control.maximum)];
        let other = if value.abs_diff(ends[0]) > value.abs_diff(ends[1]) { ends[0] } else { ends[1] };
        if other == value {
            continue;
        }
        let shown = |value| format!("{} = {value}", control.name);
        checks.push(trial(camera, "gain control", control, value, other, &shown)?);
    }
    Ok(checks)
}

/// The value of a control that can be set at present.
fn settable(control: &Control) -> Option<i64> {
    control.value.filter(|_| !control.read_only && !control.inactive)
}

/// The greatest value of a control's grid that is not above `value`.
fn on_grid(control: &Control, value: i64) -> i64 {
    let step = i64::try_from(control.step).unwrap_or(1).max(1);
    control.minimum + (value - control.minimum) / step * step
}

/// What the picture shows of another value of a control. Whatever comes of it, the control is as it was, and
/// the camera runs. `shown` names a value.
fn trial(
    camera: &mut dyn Camera,
    name: &'static str,
    control: &Control,
    value: i64,
    other: i64,
    shown: &dyn Fn(i64) -> String,
) -> Result<Check, CameraError> {
    let (before, full_dn) = mean_dn(camera)?;
    let tried = camera.set_control(&control.name, &other.to_string()).and_then(|_| mean_dn(camera));
    camera.set_control(&control.name, &value.to_string())?;
    let after = match tried {
        Ok((after, _)) => after,
        Err(CameraError::Substituted { asked, got, .. }) => {
            return Ok(Check::new(
                name,
                Verdict::Warning,
                format!("asked for {asked}, the camera silently took {got}"),
                format!("not every {} is possible: read it back when you choose another", control.name),
            ));
        }
        Err(error) => {
            camera.start()?;
            return Ok(Check::new(
                name,
                Verdict::Unknown,
                format!("there is no picture with {}: {error}", shown(other)),
                format!("see by hand whether {} does anything: `epirig camera set`", control.name),
            ));
        }
    };
    let finding = format!(
        "with {} instead of {} the mean is {after:.1} DN instead of {before:.1} DN",
        shown(other),
        shown(value)
    );
    let (lesser, greater) = if other < value { (after, before) } else { (before, after) };
    if lesser < (1.0 - CHANGE) * greater {
        return Ok(Check::good(name, finding));
    }
    // A white picture cannot become brighter.
    if other > value && before > (1.0 - CHANGE) * full_dn {
        return Ok(Check::new(name, Verdict::Unknown, finding, "give it less light"));
    }
    Ok(Check::new(
        name,
        Verdict::Warning,
        finding,
        format!(
            "{} does nothing, although it reads back as set: frames may differ in brightness; \
                 switch off what is automatic (`epirig camera get`), or use another camera",
            control.name
        ),
    ))
}

/// Mean and full scale of a frame, in DN.
fn mean_dn(camera: &mut dyn Camera) -> Result<(f64, f64), CameraError> {
    let moment = camera.now();
    let frame = camera.grab_after(moment)?.frame;
    Ok((Assessment::of(&frame).mean_dn, frame.full_scale().into()))
}
