//! The simulator behind a simulated camera.

use std::sync::Arc;

use super::RigError;
use crate::profile::{Profile, SceneName, SimProfile};
use epirig_calibration::target::{ChessBoard, Target};
use epirig_devices::camera::Size;
use epirig_simulator::{Bands, HandBoard, Scene, SimulatedScan, Simulator, SimulatorConfig, StepError};

/// Default size of the simulated camera's frames.
const SIZE: Size = Size { columns: 640, rows: 480 };
/// Most pixels of a frame: more than any sensor has, but small enough for memory.
const MOST_PIXELS: usize = 100_000_000;
/// More exposures than a scan has. So many have numbers of their own in each of the 4000 scans of `sim.scan`.
const MOST_EXPOSURES: u32 = 1 << 20;

/// The simulation for the camera of a profile. Lens, distance and chess-boards are those of the profile, if
/// it describes them.
///
/// # Errors
/// [`RigError::OtherBands`] for chess-boards that the simulated tile cannot have.
pub fn simulator_config(profile: &Profile) -> Result<SimulatorConfig, RigError> {
    let size = profile.camera.size.unwrap_or(SIZE);
    let frames = profile.plan.frames.unwrap_or(2);
    let mut config = match profile.sim.scene {
        SceneName::Tile => SimulatorConfig::tile(size.columns, frames),
        SceneName::CubeEdge => SimulatorConfig::cube_edge(size.columns, frames),
        SceneName::Plane => SimulatorConfig::textured_plane(size.columns, size.rows, frames),
    };
    let optics = &mut config.optics;
    optics.rows = size.rows;
    optics.principal_point_y_px = 0.5 * (size.rows as f64 - 1.0);
    if let Some((x_px, y_px)) = profile.optics.principal_point_px() {
        (optics.principal_point_x_px, optics.principal_point_y_px) = (x_px, y_px);
    }
    if let Some(focal_length_px) = profile.optics.focal_length_px(size.columns) {
        optics.focal_length_px = focal_length_px;
    }
    if let (
        Some(stated_mm),
        Scene::Tile { distance_mm, .. }
        | Scene::CubeEdge { distance_mm, .. }
        | Scene::Plane { distance_mm, .. },
    ) = (profile.optics.distance_mm, &mut config.scene)
    {
        *distance_mm = stated_mm;
    }
    if let Some(step_mm) = profile.plan.step_mm {
        config.scan = SimulatedScan { start_mm: profile.plan.start_mm, step_mm, frames };
    }
    add_faults(&mut config, &profile.sim);
    if let (Scene::Tile { side_mm, bands, .. }, Some(print)) = (&mut config.scene, profile.target.print()) {
        *bands = Some(tile_bands(&print, *side_mm)?);
    }
    config.board = profile.board.chess_board().map(|board| {
        let ChessBoard { square_mm, columns, rows } = board;
        HandBoard { square_mm, columns: columns + 1, rows: rows + 1 }
    });
    Ok(config)
}

fn add_faults(config: &mut SimulatorConfig, faults: &SimProfile) {
    let SimulatorConfig { scene, optics, sensor, step_error, .. } = config;
    sensor.read_noise_dn = faults.noise_dn;
    sensor.seed = sensor.seed.wrapping_add(faults.seed);
    config.texture.seed = faults.texture_seed;
    (optics.roll_rad, optics.pan_rad) = (faults.roll_rad, faults.pan_rad);
    optics.distortion.k1 = faults.k1;
    optics.vignetting = faults.vignetting;
    sensor.black_level_dn = faults.black_level_dn;
    sensor.pixel_gain_sigma = faults.pixel_gains;
    sensor.hot_pixels = faults.hot_pixels;
    if faults.step_error_um > 0.0 {
        *step_error = StepError { sigma_um: faults.step_error_um, seed: faults.seed.wrapping_add(1) };
    }
    if let Scene::Tile { bow_mm, .. } = scene {
        *bow_mm = faults.bow_mm;
    }
    config.first_exposure = (faults.scan as u32).wrapping_mul(MOST_EXPOSURES);
    config.flicker = faults.flicker;
    config.drift = faults.drift;
    config.highlight = faults.highlight_dn / 255.0;
}

/// The chess-boards of a simulated tile, along its upper and its lower edge.
fn tile_bands(print: &Target, side_mm: f64) -> Result<Bands, RigError> {
    /// Far below the resolution of a ruler.
    const SAME_MM: f64 = 1e-6;
    let ChessBoard { square_mm, columns, rows } = print.board;
    let distance_mm = side_mm - (rows + 1) as f64 * square_mm;
    if print.bands != 2 || (print.band_distance_mm - distance_mm).abs() > SAME_MM {
        return Err(RigError::OtherBands { band_distance_mm: distance_mm });
    }
    Ok(Bands { square_mm, columns: columns + 1, rows: rows + 1 })
}

/// A simulator with this configuration.
///
/// # Errors
/// [`RigError`] if it is too large, or impossible.
pub fn simulator(config: SimulatorConfig) -> Result<Arc<Simulator>, RigError> {
    let (columns, rows) = (config.optics.columns, config.optics.rows);
    if columns.saturating_mul(rows) > MOST_PIXELS {
        return Err(RigError::TooLarge { columns, rows });
    }
    Ok(Arc::new(Simulator::new(config)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::{Override, REAL, SIM};

    fn simulator_of(profile: &str, settings: &[&str]) -> Result<SimulatorConfig, RigError> {
        let settings: Vec<Override> =
            settings.iter().map(|text| Override::parse(text, "--set").unwrap()).collect();
        simulator_config(&Profile::read(profile, "rig.toml", &settings).unwrap())
    }

    #[test]
    fn the_simulated_rigs_are_the_simulators_own() {
        assert_eq!(simulator_of(SIM, &[]).unwrap(), SimulatorConfig::tile(1024, 101));
        let mut real = SimulatorConfig::real_tile(1024, 101);
        let found = simulator_of(REAL, &[]).unwrap();
        // The profile rounds 255 / 10^(45 / 20) = 1.43397.
        assert!((found.sensor.read_noise_dn / real.sensor.read_noise_dn - 1.0).abs() < 1e-4);
        real.sensor.read_noise_dn = found.sensor.read_noise_dn;
        assert_eq!(found, real);
        Simulator::new(found).unwrap();
    }

    #[test]
    fn the_texture_has_a_seed_of_its_own() {
        let config = |setting: &str| simulator_of(REAL, &[setting]).unwrap();
        let (first, again, other) =
            (config("sim.seed=0"), config("sim.seed=5"), config("sim.texture_seed=5"));
        assert_eq!(first.texture, again.texture);
        assert_eq!((other.texture.seed, other.sensor, other.step_error), (5, first.sensor, first.step_error));
    }

    #[test]
    fn another_scan_changes_nothing_of_the_rig() {
        let config = |setting: &str| simulator_of(REAL, &[setting]).unwrap();
        let (first, other) = (config("sim.scan=0"), config("sim.scan=3"));
        assert!(other.first_exposure > 0);
        assert_eq!(SimulatorConfig { first_exposure: 0, ..other.clone() }, first);
        let [first, other] = [first, other].map(|config| Simulator::new(config).unwrap());
        assert_ne!(first.expose(10.0, 1), other.expose(10.0, 1));
    }

    #[test]
    fn a_tile_that_is_described_otherwise_than_it_is_made_is_refused() {
        let plain = ["target.square=7.5 mm", "target.columns=18", "target.rows=2"];
        let refused = |settings: &[&str]| simulator_of(SIM, settings).unwrap_err().to_string();
        assert!(refused(&plain).contains("target.band_distance = \"127.5 mm\""), "{}", refused(&plain));
        let near = [&plain[..], &["target.bands=2", "target.band_distance=127 mm"]].concat();
        assert!(refused(&near).contains("127.5 mm"));
        let right = [&plain[..], &["target.bands=2", "target.band_distance=127.5 mm"]].concat();
        let Scene::Tile { bands, .. } = simulator_of(SIM, &right).unwrap().scene else { panic!() };
        assert_eq!(bands, Some(Bands { square_mm: 7.5, columns: 19, rows: 3 }));
        // Chess-boards that no tile shows are not checked.
        let plane = [&plain[..], &["sim.scene=plane"]].concat();
        assert!(matches!(simulator_of(SIM, &plane).unwrap().scene, Scene::Plane { .. }));
    }
}
