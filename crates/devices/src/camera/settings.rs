//! Wanted settings of a camera, and its configuration.

use std::fmt;
use std::time::Duration;

use super::format::{ActiveFormat, Interval, Size};
use super::pixels::{BayerUse, FourCc};

/// Wanted settings of a camera. Open settings are chosen for measuring: the deepest uncompressed grey format
/// in its largest size, automatic controls off, and all others unchanged.
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
    /// Further controls: name as in commands, value as a name or as digits.
    pub controls: Vec<(String, String)>,
    /// Use of a colour filter mosaic. `None` refuses Bayer formats.
    pub bayer: Option<BayerUse>,
    /// Time-out of a grab, and of the wait for a steady picture.
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

/// A control with its value, which must not change.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pinned {
    /// The driver's id of the control.
    pub id: u32,
    /// Its name in commands.
    pub name: String,
    /// Its value, read back.
    pub value: i64,
}

/// The configuration of a camera, read back from its driver.
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
    /// Time from frame to frame, if the driver reports it.
    pub interval: Option<Interval>,
    /// Exposure time, in us, if the camera reports it in a known unit.
    pub exposure_us: Option<f64>,
    /// Watched controls: those that were set, the automatic ones, and those that they would change.
    pub pinned: Vec<Pinned>,
    /// Notes for the user, a sentence each.
    pub notes: Vec<String>,
}

impl fmt::Display for Configuration {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "{}", self.format)?;
        self.interval.map_or(Ok(()), |interval| write!(to, ", {interval}"))?;
        self.exposure_us.map_or(Ok(()), |exposure_us| write!(to, ", exposure {exposure_us:.0} us"))
    }
}
