//! The section `sim`: the simulator and its imperfections.

use super::section::{Allowed, Kind, Setting, from_value, measure, section};
use epirig_core::choice::{Choice as _, names};
use epirig_core::settings::quantity::{DEG, DN, MM, PERCENT, UM};
use epirig_devices::faults::RigFaults;

epirig_core::choices! {
    /// The scene of the simulator.
    #[derive(Default)]
    pub enum SceneName {
        /// A plane with stripe-like hollows.
        Tile = "tile",
        /// Two planes that meet in an edge.
        CubeEdge = "cube-edge",
        /// A plane.
        #[default]
        Plane = "plane",
    }
}

from_value! { SceneName: Setting::Text(name) => Self::from_name(&name); }

section! {
    /// The simulated rig; only with a simulated stage or camera.
    pub struct SimProfile in "sim" {
        /// The scene that the simulated camera sees.
        "scene" => scene: SceneName = Kind::Choice(names::<SceneName>), like "tile" or "plane";
        /// Standard deviation of the noise of a pixel, in grey levels of 255.
        "noise" => noise_dn: f64 = measure(DN, Allowed::ZeroOrMore), like "1 DN" or "0 DN";
        /// Seed of all random numbers but those of the texture: the same seed gives the same frames.
        "seed" => seed: u64 = Kind::Whole(0, i64::MAX), like "7" or "0";
        /// Number of the scan: with another one, the same rig has other noise, and another flicker.
        "scan" => scan: u64 = Kind::Whole(0, 4000), like "2" or "0";
        /// Seed of the texture: another one is another object of the same shape.
        "texture_seed" => texture_seed: u64 = Kind::Whole(0, i64::MAX), like "2" or "1";
        /// Whether moves and frames take real time.
        "real_time" => real_time: bool = Kind::Flag, like "true" or "false";
        /// Roll of the camera about its optical axis, relative to the travel.
        "roll" => roll_rad: f64 = measure(DEG, Allowed::Within(180.0)), like "0.7 deg" or "0 deg";
        /// Pan of the camera towards the travel.
        // The simulator refuses 0.5 rad and more.
        "pan" => pan_rad: f64 = measure(DEG, Allowed::Within(28.0)), like "0.4 deg" or "0 deg";
        /// Radial distortion of the simulated lens, coefficient of r^2; negative for barrel distortion.
        "k1" => k1: f64 = Kind::Number, like "-0.02" or "0";
        /// Vignetting: relative loss of light in the farthest corner.
        "vignetting" => vignetting: f64 = measure(PERCENT, Allowed::UpTo(90.0)), like "18 %" or "0 %";
        /// Relative standard deviation of the lamp from frame to frame.
        "flicker" => flicker: f64 = measure(PERCENT, Allowed::UpTo(10.0)), like "0.3 %" or "0 %";
        /// How much lighter the lamp becomes from the first to the last stop.
        "drift" => drift: f64 = measure(PERCENT, Allowed::Within(90.0)), like "3 %" or "0 %";
        /// Brightness of a highlight that stands still in the image while the object moves, in grey levels of
        /// 255.
        "highlight" => highlight_dn: f64 = measure(DN, Allowed::UpTo(127.0)), like "2 DN" or "0 DN";
        /// Standard deviation of the true minus the reported position.
        "step_error" => step_error_um: f64 = measure(UM, Allowed::ZeroOrMore), like "5 um" or "0 um";
        /// Bow: depth of the middle of an edge of the tile below its centre; only with scene = "tile".
        "bow" => bow_mm: f64 = measure(MM, Allowed::Any), like "0.3 mm" or "0 mm";
        /// Pixel value without light, in grey levels of 255.
        "black_level" => black_level_dn: f64 = measure(DN, Allowed::UpTo(127.0)), like "3 DN" or "0 DN";
        /// Relative standard deviation of the pixels' gains.
        "pixel_gains" => pixel_gains: f64 = measure(PERCENT, Allowed::UpTo(10.0)), like "0.5 %" or "0 %";
        /// Number of hot pixels: nearly white in any light.
        "hot_pixels" => hot_pixels: usize = Kind::Whole(0, 1_000_000), like "5" or "0";
        /// Faults of stage and camera, separated by commas, each at a frame, counted from 0; a scan that is
        /// resumed has none.
        "faults" => faults: RigFaults = FAULTS, like "lost-steps@40/0.1mm";
    }
}

const FAULTS: Kind =
    Kind::Form { allowed: RigFaults::ALLOWED, is_valid: |text| text.parse::<RigFaults>().is_ok() };

from_value! { RigFaults: Setting::Text(text) => text.parse().ok(); }
