//! Whether the picture follows the control of the exposure.
//!
//! Reading a control back proves little: `uvcvideo` answers reads of most controls from its cache, so that a
//! camera that takes a value and keeps the old one reads as if it had obeyed. The picture tells.

use super::{Check, Verdict};
use epirig_devices::camera::{Assessment, Camera, CameraError, exposure_unit};

/// The picture follows if half of the exposure darkens its mean by this share at least. A linear camera
/// darkens by a half, one with the gamma of displays (2.2) by 1 - 0.5^(1 / 2.2) = 27 %.
const DARKER: f64 = 0.1;

/// Halves the exposure for a frame. `None` if there is no exposure to halve. `columns` is the width of the
/// image.
///
/// # Errors
/// [`CameraError`] if the camera does not work, refuses the values, or does not take the former one again.
pub(super) fn exposure_response(
    camera: &mut dyn Camera,
    columns: usize,
) -> Result<Option<Check>, CameraError> {
    const NAME: &str = "exposure control";
    if !camera.is_live() {
        return Ok(None);
    }
    let controls = camera.controls()?;
    let Some((control, unit_us)) = exposure_unit(&controls, columns) else { return Ok(None) };
    let usable = control.value.filter(|_| !control.read_only && !control.inactive);
    let Some(value) = usable.filter(|value| value / 2 > control.minimum) else { return Ok(None) };
    let step = i64::try_from(control.step).unwrap_or(1).max(1);
    let half = control.minimum + (value / 2 - control.minimum) / step * step;
    let before = mean_dn(camera)?;
    let darker = camera.set_control(&control.name, &half.to_string()).and_then(|_| mean_dn(camera));
    // Whatever came of it, the exposure is as it was.
    camera.set_control(&control.name, &value.to_string())?;
    let after = match darker {
        Err(CameraError::Substituted { asked, got, .. }) => {
            return Ok(Some(Check::with_advice(
                NAME,
                Verdict::Warning,
                format!("asked for {asked}, the camera silently took {got}"),
                format!("not every {} is possible: read it back when you choose another", control.name),
            )));
        }
        darker => darker?,
    };
    let finding = format!(
        "with {:.0} us instead of {:.0} us the mean is {after:.1} DN instead of {before:.1} DN",
        half as f64 * unit_us,
        value as f64 * unit_us
    );
    Ok(Some(if after < (1.0 - DARKER) * before {
        Check::good(NAME, finding)
    } else {
        Check::with_advice(
            NAME,
            Verdict::Warning,
            finding,
            format!(
                "{} does nothing, although it reads back as set: frames may differ in brightness; \
                 switch off what is automatic (`epirig camera get`), or use another camera",
                control.name
            ),
        )
    }))
}

fn mean_dn(camera: &mut dyn Camera) -> Result<f64, CameraError> {
    let moment = camera.now();
    Ok(Assessment::of(&camera.grab_after(moment)?.frame).mean_dn)
}
