//! What a camera is asked to be, and what it then is.

use std::fmt;
use std::time::Duration;

use super::format::{ActiveFormat, Interval, Size};
use super::pixels::{BayerUse, FourCc};

/// What a camera is asked to be. What is left open is chosen for measuring: the deepest uncompressed grey that the camera
/// has, in its largest size, with everything automatic switched off and the rest as it is.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraSettings {
    /// Pixel format.
    pub four_cc: Option<FourCc>,
    /// Size of the image.
    pub size: Option<Size>,
    /// Frames per second.
    pub rate_hz: Option<f64>,
    /// Exposure time, in us.
    pub exposure_us: Option<f64>,
    /// Further controls: name in commands, and value in words or digits.
    pub controls: Vec<(String, String)>,
    /// What to make of a colour filter mosaic; without it, none is chosen and a Bayer format is refused.
    pub bayer: Option<BayerUse>,
    /// How long a grab may take, and how long the camera may take until its picture is steady.
    pub patience: Duration,
}

impl Default for CameraSettings {
    fn default() -> Self {
        Self {
            four_cc: None,
            size: None,
            rate_hz: None,
            exposure_us: None,
            controls: Vec::new(),
            bayer: None,
            patience: Duration::from_secs(10),
        }
    }
}

/// A control and its value, as it is to stay.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pinned {
    /// The driver's number for the control.
    pub id: u32,
    /// Its name in commands.
    pub name: String,
    /// Its value, read back.
    pub value: i64,
}

/// What a camera is, all of it read back from the driver.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    /// Format of the buffers.
    pub format: ActiveFormat,
    /// Rows of a frame: half of the format's for a colour filter mosaic.
    pub rows: usize,
    /// Columns of a frame.
    pub columns: usize,
    /// Bits of a frame's samples.
    pub bit_depth: u8,
    /// Time from frame to frame, if the driver knows it.
    pub interval: Option<Interval>,
    /// Exposure time, in us, if the camera says it in a known unit.
    pub exposure_us: Option<f64>,
    /// Controls that are watched: those that were set, the automatic ones, and what these would change.
    pub pinned: Vec<Pinned>,
    /// What a person should know of it, one sentence each.
    pub notes: Vec<String>,
}

impl fmt::Display for Configuration {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "{}", self.format)?;
        self.interval.map_or(Ok(()), |interval| write!(to, ", {interval}"))?;
        self.exposure_us.map_or(Ok(()), |exposure_us| write!(to, ", exposure {exposure_us:.0} us"))
    }
}
