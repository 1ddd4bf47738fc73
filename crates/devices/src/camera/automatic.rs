//! Automatic controls of a camera, which must be off during a measurement.

use super::control::{Control, ControlKind};

/// The exposure time, in units of 100 us (`V4L2_CID_EXPOSURE_ABSOLUTE`).
pub(super) const EXPOSURE_ABSOLUTE: u32 = 0x009a_0902;
/// The exposure time in units of the driver, lines for bare sensors (`V4L2_CID_EXPOSURE`).
pub(super) const EXPOSURE: u32 = 0x0098_0911;
/// Columns of blanking after a line (`V4L2_CID_HBLANK`).
pub(super) const HORIZONTAL_BLANKING: u32 = 0x009e_0902;
/// Pixels per second (`V4L2_CID_PIXEL_RATE`).
pub(super) const PIXEL_RATE: u32 = 0x009f_0902;

/// `V4L2_CID_GAIN`, `V4L2_CID_ANALOGUE_GAIN`, `V4L2_CID_DIGITAL_GAIN`.
const GAINS: [u32; 3] = [0x0098_0913, 0x009e_0903, 0x009f_0905];

/// Automatic controls and their values for "off", the best first, as in the kernel's `v4l2-controls.h`.
const AUTOMATIC: &[(u32, &[i64])] = &[
    // EXPOSURE_AUTO: 1 is manual. 2 is shutter priority, which controls only the iris, which few cameras
    // have.
    (0x009a_0901, &[1, 2]),
    // EXPOSURE_AUTO_PRIORITY: lets the frame rate follow the exposure.
    (0x009a_0903, &[0]),
    // AUTOGAIN
    (0x0098_0912, &[0]),
    // AUTO_WHITE_BALANCE
    (0x0098_090c, &[0]),
    // AUTO_N_PRESET_WHITE_BALANCE: 0 is manual.
    (0x009a_0914, &[0]),
    // FOCUS_AUTO
    (0x009a_090c, &[0]),
    // ISO_SENSITIVITY_AUTO: 0 is manual.
    (0x009a_0918, &[0]),
    // AUTOBRIGHTNESS
    (0x0098_0920, &[0]),
    // HUE_AUTO
    (0x0098_0919, &[0]),
    // CHROMA_AGC
    (0x0098_091d, &[0]),
    // WIDE_DYNAMIC_RANGE: exposes parts of the image differently.
    (0x009a_0915, &[0]),
    // IMAGE_STABILIZATION: moves the image.
    (0x009a_0916, &[0]),
    // SCENE_MODE: 0 is none.
    (0x009a_091a, &[0]),
    // BACKLIGHT_COMPENSATION: some begin at 1.
    (0x0098_091c, &[0, 1]),
];

/// Other controls that must not change: exposure time, gain, white balance, focus, ISO sensitivity, iris, and
/// more.
const STEADY: &[u32] = &[
    EXPOSURE_ABSOLUTE,
    EXPOSURE,
    GAINS[0],
    GAINS[1],
    GAINS[2],
    // WHITE_BALANCE_TEMPERATURE, RED_BALANCE, BLUE_BALANCE
    0x0098_091a,
    0x0098_090e,
    0x0098_090f,
    // FOCUS_ABSOLUTE, ISO_SENSITIVITY, IRIS_ABSOLUTE
    0x009a_090a,
    0x009a_0917,
    0x009a_0911,
    // BRIGHTNESS, CONTRAST, SATURATION, HUE, GAMMA, SHARPNESS: often set by hand in other programs.
    0x0098_0900,
    0x0098_0901,
    0x0098_0902,
    0x0098_0903,
    0x0098_0910,
    0x0098_091b,
    // HFLIP, VFLIP, ROTATE, PAN_ABSOLUTE, TILT_ABSOLUTE, ZOOM_ABSOLUTE: they move the image.
    0x0098_0914,
    0x0098_0915,
    0x0098_0922,
    0x009a_0908,
    0x009a_0909,
    0x009a_090d,
    // VBLANK, HBLANK, TEST_PATTERN of bare sensors
    0x009e_0901,
    HORIZONTAL_BLANKING,
    0x009f_0903,
];

/// All controls listed here, by rising id.
#[cfg(target_os = "linux")]
pub(super) fn known() -> Vec<u32> {
    let mut ids: Vec<u32> = AUTOMATIC.iter().map(|(id, _)| *id).chain(STEADY.iter().copied()).collect();
    ids.push(PIXEL_RATE);
    ids.sort_unstable();
    ids
}

/// Whether the control switches something automatic on or off.
pub(super) fn is_automatic(control: &Control) -> bool {
    AUTOMATIC.iter().any(|(id, _)| *id == control.id)
}

/// The writes that switch off all automatic controls: control and value, in their order.
pub(super) fn switches(controls: &[Control]) -> Vec<(&Control, i64)> {
    let off = |(id, values): &(u32, &[i64])| {
        let control = controls.iter().find(|control| control.id == *id)?;
        let now = control.value?;
        // A control that lacks all of them gets the first, and the driver's refusal is reported.
        let offered = values.iter().find(|value| control.check("", **value).is_ok());
        let best = *offered.or(values.first())?;
        // A control that is inactive needs no switching, and drivers refuse it.
        (!control.inactive && now != best).then_some((control, best))
    };
    AUTOMATIC.iter().filter_map(off).collect()
}

/// Whether a control is watched: it is automatic or changes the picture, and it can be read.
pub(super) fn is_watched(control: &Control) -> bool {
    let known = AUTOMATIC.iter().any(|(id, _)| *id == control.id) || STEADY.contains(&control.id);
    known
        && !control.inactive
        && control.value.is_some()
        && !matches!(control.kind, ControlKind::Button | ControlKind::Other)
}

/// Whether the control is a gain: more of it makes the picture brighter.
pub fn is_gain(control: &Control) -> bool {
    GAINS.contains(&control.id)
}

/// The control of the exposure time, and its unit in us. `columns` is the width of the image.
pub fn exposure_unit(controls: &[Control], columns: usize) -> Option<(&Control, f64)> {
    let find = |id: u32| controls.iter().find(|control| control.id == id);
    if let Some(control) = find(EXPOSURE_ABSOLUTE) {
        return Some((control, 100.0));
    }
    // Bare sensors count lines; a line is its pixels and its blanking.
    let blanking = find(HORIZONTAL_BLANKING)?.value?;
    let rate = find(PIXEL_RATE)?.value.filter(|rate| *rate > 0)?;
    Some((find(EXPOSURE)?, (columns as f64 + blanking as f64) / rate as f64 * 1e6))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn control(id: u32, value: i64) -> Control {
        Control {
            id,
            name: format!("{id:x}"),
            kind: ControlKind::Integer,
            minimum: 0,
            maximum: i64::MAX,
            step: 1,
            default: 0,
            value: Some(value),
            read_only: false,
            inactive: false,
            items: Vec::new(),
        }
    }

    #[test]
    fn only_what_is_on_and_in_effect_is_switched() {
        let mut focus = control(0x009a_090c, 1);
        focus.inactive = true;
        let controls = [control(0x0098_0912, 1), control(0x009a_0901, 3), control(0x0098_090c, 0), focus];
        let written: Vec<(u32, i64)> =
            switches(&controls).into_iter().map(|(control, value)| (control.id, value)).collect();
        assert_eq!(written, [(0x009a_0901, 1), (0x0098_0912, 0)]);
    }

    #[test]
    fn exposures_are_in_units_of_100_us_or_lines() {
        let webcam = [control(EXPOSURE_ABSOLUTE, 100)];
        assert_eq!(exposure_unit(&webcam, 640).map(|(_, unit)| unit), Some(100.0));
        // A sensor of 84 MHz with lines of 3280 + 168 pixels: 41.05 us a line.
        let sensor =
            [control(EXPOSURE, 1000), control(HORIZONTAL_BLANKING, 168), control(PIXEL_RATE, 84_000_000)];
        let (chosen, unit) = exposure_unit(&sensor, 3280).unwrap();
        assert_eq!(chosen.id, EXPOSURE);
        assert!((unit - 41.0476).abs() < 1e-3, "{unit}");
        assert!(exposure_unit(&sensor[..2], 3280).is_none());
    }
}
