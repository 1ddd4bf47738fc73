//! The section `camera`. Controls are named by the camera itself.

use std::time::Duration;

use super::section::{Allowed, Kind, Setting, from_value, measure, section};
use epirig_core::choice::{Choice as _, names};
use epirig_core::settings::quantity::{HZ, S, US};
use epirig_devices::camera::pixels::{BayerUse, FourCc};
use epirig_devices::camera::{CameraChoice, Size, camera_driver};

const CAMERA: Kind = Kind::Form {
    allowed: "a path such as /dev/video0, a name in /dev/v4l/by-id, usb:SERIAL, replay:FOLDER or sim",
    is_valid: |text| text.parse::<CameraChoice>().is_ok(),
};
const FORMAT: Kind = Kind::Form {
    allowed: "a code of one to four characters, such as GREY or Y12",
    is_valid: |text| text.parse::<FourCc>().is_ok(),
};
const SIZE: Kind =
    Kind::Form { allowed: "COLUMNSxROWS, such as 1280x720", is_valid: |text| text.parse::<Size>().is_ok() };

section! {
    /// The camera and its settings.
    pub struct CameraProfile in "camera" {
        /// The camera; by default the only one. sim shows the simulated object, replay:FOLDER shows the frames
        /// of a sequence.
        "device" => device: Option<String> = CAMERA, like "/dev/video0";
        /// Pixel format; by default the deepest uncompressed grey.
        "format" => format: Option<String> = FORMAT, like "GREY";
        /// Columns and rows; by default the largest size.
        "size" => size: Option<Size> = SIZE, like "1024x768";
        /// Frames per second; by default not changed.
        "rate" => rate_hz: Option<f64> = measure(HZ, Allowed::Positive), like "25 Hz";
        /// Exposure time; under lamps on mains, whole half periods of the mains (10 ms at 50 Hz).
        "exposure" => exposure_us: Option<f64> = measure(US, Allowed::Positive), like "10 ms";
        /// Use of a colour mosaic: the sum of the two green pixels of each cell, or of all four.
        "bayer" => bayer: Option<BayerUse> = Kind::Choice(names::<BayerUse>), like "green";
        /// Longest wait for a good frame, and for a steady picture.
        "patience" => patience: Duration = measure(S, Allowed::Positive), like "20 s" or "10 s";
        /// Mains frequency of the lamps.
        "mains" => mains_hz: Option<f64> = measure(HZ, Allowed::Among(&[50.0, 60.0])), like "50 Hz";
    } and {
        /// Controls in the order in which they are set: name as in commands, value as a name or as digits.
        controls: Vec<(String, String)>,
    }
}

impl CameraProfile {
    /// Whether the camera is simulated.
    pub fn is_simulated(&self) -> bool {
        camera_driver(self.device.as_deref()).is_simulated()
    }
}

from_value! {
    Size: Setting::Text(text) => text.parse().ok();
    BayerUse: Setting::Text(name) => Self::from_name(&name);
}
