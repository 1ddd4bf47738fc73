//! The typed sections of a profile.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::record;
use epirig_calibration::lens::{Distortion, Lens};
use epirig_core::settings::Settings;
use epirig_devices::camera::pixels::BayerUse;
use epirig_devices::camera::{Size, camera_driver};
use epirig_devices::stage::Driver;

epirig_core::choices! {
    /// The scene of the simulator.
    pub enum SceneName {
        /// A plane with stripe-like hollows.
        Tile = "tile",
        /// Two planes that meet in an edge.
        CubeEdge = "cube-edge",
        /// A plane.
        Plane = "plane",
    }
}

/// The stage and its connection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageProfile {
    /// The driver.
    pub driver: Driver,
    /// The port, as [`PortChoice`](epirig_devices::link::PortChoice) parses it; `None`: the only USB serial
    /// port.
    pub port: Option<String>,
    /// Unidirectional approach: distance below each position from which it is approached, in mm, 0 or more.
    pub approach_mm: f64,
    /// Allowed error of the reported position beyond half a step, in mm, 0 or more.
    pub tolerance_mm: f64,
    /// The driver's own settings.
    pub settings: Settings,
}

impl StageProfile {
    /// Whether the stage is simulated in memory.
    pub fn is_simulated(&self) -> bool {
        !self.driver.has_line()
    }
}

/// The camera and its settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraProfile {
    /// The camera, as [`CameraChoice`](epirig_devices::camera::CameraChoice) parses it; `None`: the only
    /// camera.
    pub device: Option<String>,
    /// Pixel format, as [`FourCc`](epirig_devices::camera::pixels::FourCc) parses it; `None`: the deepest
    /// uncompressed grey.
    pub format: Option<String>,
    /// Columns and rows; `None`: the largest size.
    #[serde(with = "record::size")]
    pub size: Option<Size>,
    /// Frames per second, positive; `None`: not changed.
    pub rate_hz: Option<f64>,
    /// Exposure time, in us, positive; `None`: not changed.
    pub exposure_us: Option<f64>,
    /// Use of a colour mosaic.
    pub bayer: Option<BayerUse>,
    /// Longest wait for a good frame, and for a steady picture. In a record: `patience_s`, in s.
    #[serde(rename = "patience_s", with = "record::seconds")]
    pub patience: Duration,
    /// Mains frequency of the lamps, in Hz: 50 or 60.
    pub mains_hz: Option<f64>,
    /// Controls in the order in which they are set: name as in commands, value as a name or as digits.
    pub controls: Vec<(String, String)>,
}

impl CameraProfile {
    /// Whether the camera is simulated.
    pub fn is_simulated(&self) -> bool {
        camera_driver(self.device.as_deref()).is_simulated()
    }
}

/// The scan: positions and frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanProfile {
    /// Position of the first frame, from home, in mm, 0 or more.
    pub start_mm: f64,
    /// Distance between stops, in mm, positive.
    pub step_mm: Option<f64>,
    /// Number of frames, 2 to 100000.
    pub frames: Option<usize>,
    /// Time for which the stage vibrates after a move. In a record: `settle_s`, in s.
    #[serde(rename = "settle_s", with = "record::seconds")]
    pub settle: Duration,
    /// Number of frames averaged at each stop, 1 to 65536.
    pub average: usize,
    /// Number of dark frames, 0 to 1000.
    pub dark: usize,
    /// Number of frames of a uniform target, 0 to 1000.
    pub flat: usize,
    /// Number of frames of the hand-held chess-board, each in a different pose, 0 to 1000.
    #[serde(default)]
    pub board: usize,
}

impl PlanProfile {
    /// Positions of all frames, from home, in mm: start + index x step. `None` without step or number of
    /// frames.
    pub fn positions_mm(&self) -> Option<Vec<f64>> {
        let (step_mm, frames) = (self.step_mm?, self.frames?);
        Some((0..frames).map(|index| self.start_mm + index as f64 * step_mm).collect())
    }
}

/// Focal length of the lens.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FocalLength {
    /// In px.
    Px(f64),
    /// In mm.
    Mm(f64),
}

/// The lens and the sensor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OpticsProfile {
    /// Focal length of the lens, positive.
    pub focal_length: Option<FocalLength>,
    /// Relative standard uncertainty of the focal length, 0 to 1.
    #[serde(default = "record::data_sheet_sigma")]
    pub focal_length_sigma: f64,
    /// Width of the part of the sensor that the image covers, in mm, positive.
    pub sensor_width_mm: Option<f64>,
    /// Column and row of the principal point, in px; `None`: the centre of the image.
    pub principal_point_px: Option<(f64, f64)>,
    /// Distance from the lens to the object, in mm, positive.
    pub distance_mm: Option<f64>,
    /// Distortion of the lens; zero by default.
    #[serde(default)]
    pub distortion: Distortion,
}

impl OpticsProfile {
    /// The lens for images of `columns` x `rows`. The principal point defaults to their centre. `None` if the
    /// focal length in px is unknown.
    pub fn lens(&self, columns: usize, rows: usize) -> Option<Lens> {
        let middle = |size: usize| 0.5 * (size as f64 - 1.0);
        let (x_px, y_px) = self.principal_point_px.unwrap_or((middle(columns), middle(rows)));
        let lens = Lens::pinhole(self.focal_length_px(columns)?, x_px, y_px);
        Some(Lens { distortion: self.distortion, ..lens })
    }

    /// Focal length in px for images with this number of columns. A length is divided by the width of a
    /// pixel: `sensor_width_mm` / `columns`. `None` if it is unknown.
    pub fn focal_length_px(&self, columns: usize) -> Option<f64> {
        Some(match self.focal_length? {
            FocalLength::Px(length_px) => length_px,
            FocalLength::Mm(length_mm) => length_mm / self.sensor_width_mm? * columns as f64,
        })
    }
}

/// The measured object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TargetProfile {
    /// Height difference that the measurement must resolve, in mm, positive.
    pub relief_mm: Option<f64>,
    /// The chess-boards printed on the object; `None`: unknown or absent.
    #[serde(default)]
    pub print: Option<PrintProfile>,
}

/// The chess-boards printed on the object: one, or two with the relief between them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrintProfile {
    /// One board; its columns lie along the travel.
    pub board: BoardProfile,
    /// For two boards: distance from the first row of inner corners of the upper board to that of the lower,
    /// in mm, positive. `None` for one board.
    pub band_distance_mm: Option<f64>,
}

/// A chess-board.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardProfile {
    /// Side of a square, in mm, positive.
    pub square_mm: f64,
    /// Inner corners per row, 2 to 1000: one less than squares.
    pub columns: usize,
    /// Rows of inner corners, 2 to 1000.
    pub rows: usize,
}

/// The limits of a scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitsProfile {
    /// Retakes of a frame before the scan stops, 0 to 100.
    pub retakes: usize,
    /// Share of a frame's pixels that may be saturated, 0 to 1.
    pub saturated: f64,
    /// Largest distance of the reported from the commanded position, in mm, positive.
    pub position_mm: f64,
    /// Longest wait for a device that has disconnected. In a record: `wait_s`, in s.
    #[serde(rename = "wait_s", with = "record::seconds")]
    pub wait: Duration,
    /// Largest shift of the picture when a stop is taken again, in px, positive.
    pub shift_px: f64,
}

/// Seed of the texture unless another one is asked for.
pub(super) const FIRST_TEXTURE: u64 = 1;

/// The simulated rig.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimProfile {
    /// The scene that the simulated camera sees.
    pub scene: SceneName,
    /// Standard deviation of the noise of a pixel, in grey levels of 255, 0 or more.
    pub noise_dn: f64,
    /// Seed of all random numbers but those of the texture.
    pub seed: u64,
    /// Seed of the texture: another one is another object of the same shape.
    #[serde(default = "first_texture")]
    pub texture_seed: u64,
    /// Whether moves and frames take real time.
    pub real_time: bool,
    /// Imperfections of the simulated rig.
    #[serde(default)]
    pub faults: SimFaults,
}

/// That of records from before there were others.
fn first_texture() -> u64 {
    FIRST_TEXTURE
}

/// Imperfections of the simulated rig; zero by default.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SimFaults {
    /// Roll of the camera about its optical axis, in rad.
    pub roll_rad: f64,
    /// Pan of the camera towards the travel, in rad.
    pub pan_rad: f64,
    /// Radial distortion of the lens, coefficient of r^2.
    pub k1: f64,
    /// Relative loss of light in the farthest corner, 0 to 0.9.
    pub vignetting: f64,
    /// Relative standard deviation of the lamp from frame to frame, 0 to 0.1.
    pub flicker: f64,
    /// How much lighter the lamp becomes from the first to the last stop, as a share of its light,
    /// -0.9 to 0.9.
    pub drift: f64,
    /// Brightness of a highlight that stands still in the image, in grey levels of 255, 0 to 127.
    pub highlight_dn: f64,
    /// Standard deviation of the true minus the reported position, in um, 0 or more.
    pub step_error_um: f64,
    /// Depth of the middle of an edge of the tile below the tile's centre, in mm.
    pub bow_mm: f64,
    /// Pixel value without light, in grey levels of 255, 0 to 127.
    pub black_level_dn: f64,
    /// Relative standard deviation of the pixels' gains, 0 to 0.1.
    pub pixel_gains: f64,
    /// Number of hot pixels: nearly white in any light.
    pub hot_pixels: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_those_of_the_plan() {
        let plan = PlanProfile {
            start_mm: 10.0,
            step_mm: Some(1.5),
            frames: Some(4),
            settle: Duration::ZERO,
            average: 1,
            dark: 0,
            flat: 0,
            board: 0,
        };
        assert_eq!(plan.positions_mm(), Some(vec![10.0, 11.5, 13.0, 14.5]));
        assert_eq!(PlanProfile { frames: None, ..plan.clone() }.positions_mm(), None);
        assert_eq!(PlanProfile { step_mm: None, ..plan }.positions_mm(), None);
    }

    #[test]
    fn a_focal_length_in_mm_is_counted_in_pixels_of_the_sensor() {
        let optics = OpticsProfile {
            focal_length: Some(FocalLength::Mm(25.0)),
            sensor_width_mm: Some(10.0),
            focal_length_sigma: 0.02,
            principal_point_px: None,
            distance_mm: None,
            distortion: Distortion { k1: -0.1, ..Distortion::default() },
        };
        // Pixels of 10 mm / 1000 = 10 um: 25 mm are 2500 px.
        assert_eq!(optics.focal_length_px(1000), Some(2500.0));
        assert_eq!(optics.focal_length_px(500), Some(1250.0));
        let lens = optics.lens(1000, 500).unwrap();
        assert_eq!(lens.to_array(), [2500.0, 2500.0, 499.5, 249.5, -0.1, 0.0, 0.0, 0.0, 0.0]);
        let stated = OpticsProfile { principal_point_px: Some((7.0, 9.0)), ..optics.clone() };
        assert_eq!(stated.lens(1000, 500).unwrap().to_array()[2..4], [7.0, 9.0]);
        let without_width = OpticsProfile { sensor_width_mm: None, ..optics.clone() };
        assert_eq!(without_width.focal_length_px(1000), None);
        let in_px = OpticsProfile { focal_length: Some(FocalLength::Px(2844.0)), ..optics };
        assert_eq!(in_px.focal_length_px(1000), Some(2844.0));
    }
}
