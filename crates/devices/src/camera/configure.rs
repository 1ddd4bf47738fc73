//! Configures a camera, and reads back what its driver has set.

use super::CameraError;
use super::automatic::{exposure_unit, is_automatic, is_watched, switches};
use super::control::{Control, ControlKind, find_control};
use super::device::VideoDevice;
use super::format::{ActiveFormat, Interval, OfferedFormat, Size, Sizes};
use super::pixels::{BayerUse, FourCc, Layout, PixelFormat};
use super::settings::{CameraSettings, Configuration, Pinned};

/// Relative tolerance of rates: drivers round intervals to 100 ns or to fractions of a clock.
const SAME_RATE: f64 = 0.005;
/// Writing an automatic control may change the range of others; no camera has more such layers.
const ROUNDS: usize = 3;

/// Configures a device, reads everything back, and returns the configuration.
///
/// # Errors
/// [`CameraError`] if the device does not offer what is wanted, sets something else, or keeps changing by
/// itself.
pub(super) fn configure(
    device: &mut dyn VideoDevice,
    settings: &CameraSettings,
) -> Result<Configuration, CameraError> {
    let camera = device.identity().name();
    let mut notes = Vec::new();
    let (format, pixels) = set_format(device, settings, &camera)?;
    if pixels.is_lossy() {
        notes.push(format!(
            "the images of {camera} are compressed ({}), which limits accuracy: use an uncompressed format if it has one",
            format.four_cc
        ));
    }
    let interval = set_rate(device, settings, &format, &camera)?;
    let controls = device.controls()?;
    let by_name = |(name, _): &(String, String)| Ok(find_control(&camera, &controls, name)?.id);
    let by_hand: Vec<u32> = settings.controls.iter().map(by_name).collect::<Result<_, CameraError>>()?;
    switch_automatics_off(device, &by_hand, &camera, &mut notes)?;
    let mut written = Vec::new();
    // Automatic controls come first: while one is on, what it controls cannot be set.
    let (automatics, others): (Vec<_>, Vec<_>) = {
        let controls = device.controls()?;
        settings
            .controls
            .iter()
            .partition(|(name, _)| find_control(&camera, &controls, name).is_ok_and(is_automatic))
    };
    write_controls(device, &automatics, &mut written, &camera)?;
    if let Some(exposure_us) = settings.exposure_us {
        written.push(set_exposure(device, exposure_us, format.size, &camera)?);
    }
    write_controls(device, &others, &mut written, &camera)?;
    let controls = device.controls()?;
    let automatic = switches(&controls).into_iter().filter(|(control, _)| written.contains(&control.id));
    notes.extend(automatic.map(|(control, _)| {
        format!("{} is kept as you set it: what it controls may change from frame to frame", control.name)
    }));
    let exposure_us = exposure_unit(&controls, format.size.columns)
        .and_then(|(control, unit_us)| Some(control.value? as f64 * unit_us));
    let layout = layout(&format, pixels, settings);
    let (rows, columns, bit_depth) = layout.frame_shape();
    let watched = controls.iter().filter(|control| is_watched(control) || written.contains(&control.id));
    let pinned = watched
        .filter_map(|control| {
            Some(Pinned { id: control.id, name: control.name.clone(), value: control.value? })
        })
        .collect();
    Ok(Configuration { format, rows, columns, bit_depth, interval, exposure_us, pinned, notes })
}

/// Writes controls, none of them twice.
fn write_controls(
    device: &mut dyn VideoDevice,
    settings: &[&(String, String)],
    written: &mut Vec<u32>,
    camera: &str,
) -> Result<(), CameraError> {
    for (name, value) in settings {
        let controls = device.controls()?;
        let control = find_control(camera, &controls, name)?;
        let value = control.parse(camera, value)?;
        if written.contains(&control.id) {
            return Err(control.refused(camera, value, "it is given twice".to_owned()));
        }
        write_and_compare(device, camera, control, value)?;
        written.push(control.id);
    }
    Ok(())
}

/// Layout of the buffers of a configured device.
pub(super) fn layout(format: &ActiveFormat, pixels: PixelFormat, settings: &CameraSettings) -> Layout {
    Layout {
        format: pixels,
        rows: format.size.rows,
        columns: format.size.columns,
        stride: format.stride,
        bayer: settings.bayer.unwrap_or(BayerUse::Green),
    }
}

fn set_format(
    device: &mut dyn VideoDevice,
    settings: &CameraSettings,
    camera: &str,
) -> Result<(ActiveFormat, PixelFormat), CameraError> {
    let offered = device.offered()?;
    let (chosen, pixels) = choose_format(&offered, settings, camera)?;
    let active = device.active_format()?;
    let size = choose_size(chosen, settings, active.size, camera)?;
    let got = device.set_format(chosen.four_cc, size)?;
    if (got.four_cc, got.size) != (chosen.four_cc, size) {
        return Err(CameraError::substituted(camera, format!("{} {size}", chosen.four_cc), got));
    }
    if got.interlaced {
        return Err(CameraError::not_a_camera(
            camera,
            "its frames are interlaced: their rows were taken at two times; set it to a progressive mode",
        ));
    }
    Ok((got, pixels))
}

fn choose_format<'a>(
    offered: &'a [OfferedFormat],
    settings: &CameraSettings,
    camera: &str,
) -> Result<(&'a OfferedFormat, PixelFormat), CameraError> {
    let known =
        offered.iter().filter_map(|format| Some((format, PixelFormat::from_four_cc(format.four_cc)?)));
    let known: Vec<(&OfferedFormat, PixelFormat)> = known.collect();
    let names = || {
        let names: Vec<String> = known.iter().map(|(format, _)| format.four_cc.to_string()).collect();
        if names.is_empty() { "no format that epirig can decode".to_owned() } else { names.join(", ") }
    };
    let not_offered = |wanted: String| CameraError::not_offered(camera, wanted, names());
    let fits_size = |format: &OfferedFormat| settings.size.is_none_or(|size| format.sizes.holds(size));
    let chosen = match settings.four_cc {
        // Some codes differ in case only, so exact matches come first.
        Some(four_cc) => known.iter().find(|(format, _)| format.four_cc == four_cc).or_else(|| {
            let same = |code: FourCc| code.0.eq_ignore_ascii_case(&four_cc.0);
            known.iter().find(|(format, _)| same(format.four_cc))
        }),
        None => {
            // The option for mosaics selects a mosaic.
            let wanted = |pixels: &PixelFormat| settings.bayer.is_none() || pixels.is_bayer();
            let fitting = known.iter().filter(|(format, pixels)| fits_size(format) && wanted(pixels));
            fitting.min_by_key(|(_, pixels)| pixels.preference())
        }
    };
    let Some(&(format, pixels)) = chosen else {
        return Err(not_offered(match (settings.four_cc, settings.size) {
            (Some(four_cc), _) => format!("format {four_cc}"),
            (None, _) if settings.bayer.is_some() => "colour mosaic".to_owned(),
            (None, Some(size)) => format!("size of {size}"),
            (None, None) => "format suitable for measurement".to_owned(),
        }));
    };
    if settings.bayer.is_some() && !pixels.is_bayer() {
        return Err(not_offered(format!("colour mosaic in format {}, for --bayer", format.four_cc)));
    }
    if pixels.is_bayer() && settings.bayer.is_none() {
        let offered = format!(
            "{}; choose the use of its colour mosaic: --bayer green (the green pixels) or --bayer binned (all four)",
            names()
        );
        return Err(CameraError::not_offered(camera, "grey format", offered));
    }
    Ok((format, pixels))
}

fn choose_size(
    format: &OfferedFormat,
    settings: &CameraSettings,
    active: Size,
    camera: &str,
) -> Result<Size, CameraError> {
    let size = settings.size.unwrap_or_else(|| match &format.sizes {
        Sizes::Discrete(sizes) => {
            let largest = sizes.iter().map(|(size, _)| *size).max_by_key(|size| size.columns * size.rows);
            largest.unwrap_or(active)
        }
        // The driver reports the size of the sensor or the signal; another size would be scaled.
        Sizes::Range { .. } if format.sizes.holds(active) => active,
        Sizes::Range { greatest, .. } => *greatest,
    });
    if format.sizes.holds(size) {
        return Ok(size);
    }
    let offered = match &format.sizes {
        Sizes::Discrete(sizes) => {
            sizes.iter().map(|(size, _)| size.to_string()).collect::<Vec<_>>().join(", ")
        }
        Sizes::Range { least, greatest, step } => {
            format!("{least} to {greatest} in steps of {}, {}", step.columns, step.rows)
        }
    };
    Err(CameraError::not_offered(camera, format!("size of {size} in {}", format.four_cc), offered))
}

fn set_rate(
    device: &mut dyn VideoDevice,
    settings: &CameraSettings,
    format: &ActiveFormat,
    camera: &str,
) -> Result<Option<Interval>, CameraError> {
    if let Some(rate_hz) = settings.rate_hz {
        let offered = device.offered()?;
        refuse_unlisted_rate(&offered, format, rate_hz, camera)?;
        const MILLI: f64 = 1000.0;
        let asked = Interval { numerator: 1000, denominator: (rate_hz * MILLI).round().max(1.0) as u32 };
        device.set_interval(asked)?;
        let got = device.interval()?;
        if !got.is_some_and(|got| (got.rate_hz() / rate_hz - 1.0).abs() <= SAME_RATE) {
            let got = got.map_or("an unknown rate".to_owned(), |got| got.to_string());
            return Err(CameraError::substituted(camera, format!("{rate_hz} Hz"), got));
        }
    }
    device.interval()
}

/// Refuses a rate that is not in the driver's list for this size, if there is a list.
fn refuse_unlisted_rate(
    offered: &[OfferedFormat],
    format: &ActiveFormat,
    rate_hz: f64,
    camera: &str,
) -> Result<(), CameraError> {
    let sizes =
        offered.iter().filter(|offered| offered.four_cc == format.four_cc).map(|offered| &offered.sizes);
    let rates: Vec<f64> = sizes
        .filter_map(|sizes| match sizes {
            Sizes::Discrete(sizes) => sizes.iter().find(|(size, _)| *size == format.size),
            Sizes::Range { .. } => None,
        })
        .flat_map(|(_, intervals)| intervals.iter().map(|interval| interval.rate_hz()))
        .collect();
    let listed = |rate: &f64| (rate / rate_hz - 1.0).abs() <= SAME_RATE;
    if rates.is_empty() || rates.iter().any(listed) {
        return Ok(());
    }
    let names: Vec<String> = rates.iter().map(|rate| format!("{rate:.3} Hz")).collect();
    Err(CameraError::not_offered(camera, format!("rate of {rate_hz} Hz in {format}"), names.join(", ")))
}

/// Switches off automatic controls, except those that are set by name.
fn switch_automatics_off(
    device: &mut dyn VideoDevice,
    asked_for: &[u32],
    camera: &str,
    notes: &mut Vec<String>,
) -> Result<(), CameraError> {
    for round in 0..ROUNDS {
        let controls = device.controls()?;
        let mut to_write = switches(&controls);
        to_write.retain(|(control, _)| !asked_for.contains(&control.id));
        if round == 0 {
            let fixed = to_write.iter().filter(|(control, _)| control.read_only);
            notes.extend(fixed.map(|(control, _)| {
                format!(
                    "{} of {camera} cannot be switched off: frames may differ in brightness",
                    control.name
                )
            }));
        }
        to_write.retain(|(control, _)| !control.read_only);
        if to_write.is_empty() {
            return Ok(());
        }
        for (control, off) in to_write {
            write_and_compare(device, camera, control, off)?;
        }
    }
    let controls = device.controls()?;
    let still_on = |control: &Control| !asked_for.contains(&control.id) && !control.read_only;
    match switches(&controls).iter().find(|(control, _)| still_on(control)) {
        None => Ok(()),
        Some((control, off)) => Err(CameraError::ControlChanged {
            camera: camera.to_owned(),
            name: control.name.clone(),
            set: *off,
            found: control.value.unwrap_or_default(),
        }),
    }
}

/// Sets the exposure time, and returns its control.
fn set_exposure(
    device: &mut dyn VideoDevice,
    exposure_us: f64,
    size: Size,
    camera: &str,
) -> Result<u32, CameraError> {
    let controls = device.controls()?;
    let Some((control, unit_us)) = exposure_unit(&controls, size.columns) else {
        let (wanted, offered) = ("exposure time in a known unit", "other controls; see `epirig camera get`");
        return Err(CameraError::not_offered(camera, wanted, offered));
    };
    /// Largest relative difference to the wanted exposure, because of the camera's unit.
    const NEAR: f64 = 0.05;
    let value = (exposure_us / unit_us).round();
    let in_us = |value: i64| value as f64 * unit_us;
    let refused = |reason| Err(control.refused(camera, format!("{exposure_us} us"), reason));
    if (value * unit_us - exposure_us).abs() > NEAR * exposure_us {
        let nearest = value * unit_us;
        return refused(format!("it is counted in units of {unit_us:.1} us; the nearest is {nearest:.1} us"));
    }
    if !(control.minimum as f64..=control.maximum as f64).contains(&value) {
        let (least, most) = (in_us(control.minimum), in_us(control.maximum));
        return refused(format!("its range is {least} us to {most} us"));
    }
    write_and_compare(device, camera, control, value as i64)?;
    Ok(control.id)
}

/// Writes a control and reads it back, because drivers clamp silently.
///
/// # Errors
/// [`CameraError`] if the control refuses the value, or reads back another one.
pub(super) fn write_and_compare(
    device: &mut dyn VideoDevice,
    camera: &str,
    control: &Control,
    value: i64,
) -> Result<(), CameraError> {
    control.check(camera, value)?;
    device.write_control(control.id, value).map_err(|error| match error {
        CameraError::System { camera, detail, .. } => {
            let (name, kept) = (&control.name, control.value.unwrap_or(value));
            let reason = format!("its driver reports: {detail}; --control {name}={kept} keeps its value");
            control.refused(&camera, value, reason)
        }
        other => other,
    })?;
    if control.kind == ControlKind::Button || control.value.is_none() {
        return Ok(());
    }
    let found = device.read_control(control.id)?;
    // A mask may be read back with its sign extended.
    let same = found == value || control.kind == ControlKind::Bitmask && (found ^ value) & 0xffff_ffff == 0;
    if same {
        return Ok(());
    }
    Err(CameraError::substituted(camera, format!("{} = {value}", control.name), found))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offered(codes: &[&str]) -> Vec<OfferedFormat> {
        let sizes = [(640, 480), (1280, 720)].map(|(columns, rows)| (Size { columns, rows }, Vec::new()));
        let format = |code: &&str| OfferedFormat {
            four_cc: code.parse().unwrap(),
            description: String::new(),
            sizes: Sizes::Discrete(sizes.to_vec()),
        };
        codes.iter().map(format).collect()
    }

    fn chosen(codes: &[&str], settings: &CameraSettings) -> Result<String, String> {
        let offered = offered(codes);
        let chosen = choose_format(&offered, settings, "cam");
        chosen.map(|(format, _)| format.four_cc.to_string()).map_err(|error| error.to_string())
    }

    #[test]
    fn what_measures_best_is_taken_and_mosaics_only_as_decided() {
        let any = CameraSettings::default();
        assert_eq!(chosen(&["MJPG", "YUYV"], &any).unwrap(), "YUYV");
        assert_eq!(chosen(&["YUYV", "GREY", "Y12", "MJPG"], &any).unwrap(), "Y12");
        assert_eq!(chosen(&["MJPG"], &any).unwrap(), "MJPG");
        let error = chosen(&["RGGB", "MJPG", "H264"], &any).unwrap_err();
        assert!(error.contains("--bayer green") && error.contains("RGGB, MJPG"), "{error}");
        let binned = CameraSettings { bayer: Some(BayerUse::Binned), ..CameraSettings::default() };
        assert_eq!(chosen(&["YUYV", "RGGB"], &binned).unwrap(), "RGGB");
        assert!(chosen(&["YUYV", "GREY"], &binned).unwrap_err().contains("no colour mosaic"));
        let format = |code: &str| CameraSettings { four_cc: Some(code.parse().unwrap()), ..binned.clone() };
        assert!(chosen(&["YUYV", "RGGB"], &format("YUYV")).unwrap_err().contains("for --bayer"));
        let grey = CameraSettings { four_cc: Some("grey".parse().unwrap()), ..CameraSettings::default() };
        assert_eq!(chosen(&["YUYV", "GREY"], &grey).unwrap(), "GREY");
        assert!(chosen(&["H264"], &any).unwrap_err().contains("no format that epirig can decode"));
    }

    #[test]
    fn the_largest_size_is_taken_but_nothing_is_scaled() {
        let size = |columns, rows| Size { columns, rows };
        let list = &offered(&["GREY"])[0];
        let any = CameraSettings::default();
        assert_eq!(choose_size(list, &any, size(640, 480), "cam").unwrap(), size(1280, 720));
        let odd = CameraSettings { size: Some(size(800, 600)), ..CameraSettings::default() };
        let error = choose_size(list, &odd, size(640, 480), "cam").unwrap_err().to_string();
        assert!(error.contains("800 x 600") && error.contains("640 x 480, 1280 x 720"), "{error}");
        let sizes = Sizes::Range { least: size(16, 16), greatest: size(16384, 8640), step: size(2, 2) };
        let receiver = OfferedFormat { sizes, ..list.clone() };
        assert_eq!(choose_size(&receiver, &any, size(640, 480), "cam").unwrap(), size(640, 480));
    }

    #[test]
    fn rates_of_a_list_are_taken_from_it() {
        let interval = |denominator| Interval { numerator: 1001, denominator };
        let listed = size_list(vec![interval(30_000), interval(15_000)]);
        let format = ActiveFormat {
            four_cc: listed[0].four_cc,
            size: Size { columns: 640, rows: 480 },
            stride: 640,
            image_bytes: 640 * 480,
            interlaced: false,
        };
        assert!(refuse_unlisted_rate(&listed, &format, 30.0, "cam").is_ok(), "29.97 is as good");
        let error = refuse_unlisted_rate(&listed, &format, 13.0, "cam").unwrap_err().to_string();
        assert!(error.contains("13 Hz") && error.contains("29.970 Hz, 14.985 Hz"), "{error}");
        assert!(refuse_unlisted_rate(&size_list(Vec::new()), &format, 13.0, "cam").is_ok(), "no list");
    }

    fn size_list(intervals: Vec<Interval>) -> Vec<OfferedFormat> {
        let mut formats = offered(&["GREY"]);
        formats[0].sizes = Sizes::Discrete(vec![(Size { columns: 640, rows: 480 }, intervals)]);
        formats
    }
}
