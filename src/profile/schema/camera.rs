//! The keys of section `camera`. Controls are named by the camera itself.

use epirig_core::choice::names;
use epirig_core::settings::quantity::{HZ, S, US};
use epirig_devices::camera::pixels::{BayerUse, FourCc};
use epirig_devices::camera::{CameraChoice, Size};

use super::key::{Allowed, Key, Kind, key, keys, measure};

const CAMERA: &str = "a path such as /dev/video0, a name in /dev/v4l/by-id, usb:SERIAL, replay:FOLDER or sim";
const FORMAT_CODE: &str = "a code of one to four characters, such as GREY or Y12";
const SIZE_FORM: &str = "COLUMNSxROWS, such as 1280x720";

keys!(
    "camera",
    DEVICE = key(
        "device",
        Kind::Form { allowed: CAMERA, is_valid: |text| text.parse::<CameraChoice>().is_ok() },
        "/dev/video0",
        "The camera; by default the only one. sim shows the simulated object, replay:FOLDER shows the frames of a sequence",
    ),
    FORMAT = key(
        "format",
        Kind::Form { allowed: FORMAT_CODE, is_valid: |text| text.parse::<FourCc>().is_ok() },
        "GREY",
        "Pixel format; by default the deepest uncompressed grey"
    ),
    SIZE = key(
        "size",
        Kind::Form { allowed: SIZE_FORM, is_valid: |text| text.parse::<Size>().is_ok() },
        "1024x768",
        "Columns and rows; by default the largest size"
    ),
    RATE = key("rate", measure(HZ, Allowed::Positive), "25 Hz", "Frames per second; by default not changed"),
    EXPOSURE = key(
        "exposure",
        measure(US, Allowed::Positive),
        "10 ms",
        "Exposure time; under lamps on mains, whole half periods of the mains (10 ms at 50 Hz)",
    ),
    BAYER = key(
        "bayer",
        Kind::Choice(names::<BayerUse>),
        "green",
        "Use of a colour mosaic: the sum of the two green pixels of each cell, or of all four",
    ),
    PATIENCE = key(
        "patience",
        measure(S, Allowed::Positive),
        "20 s",
        "Longest wait for a good frame, and for a steady picture",
    )
    .or("10 s"),
    MAINS =
        key("mains", measure(HZ, Allowed::Among(&[50.0, 60.0])), "50 Hz", "Mains frequency of the lamps",),
);
