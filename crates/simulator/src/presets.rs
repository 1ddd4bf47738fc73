//! Simulators of the paper's experiments, and a small one for examples.

use super::{
    Bands, Carried, HandBoard, Optics, Scene, Sensor, SimulatedScan, SimulatorConfig, StepError, Texture,
};

/// Grains are this many pixels wide in the image: the finest texture that survives lens and pixel without
/// aliasing.
const GRAIN_PX: f64 = 2.0;

impl SimulatorConfig {
    /// The paper's real experiment (section 5.2) in an ideal world: a 15 cm tile with 0.2 mm deep hollows, 25
    /// mm lens, 9 mm chip, 900 mm away, moved 150 mm. `side_px` is the width of the square image (the
    /// paper's: 1024); the optics scale with it, so that the tile always fills the same part of the image.
    pub fn tile(side_px: usize, frames: usize) -> Self {
        let distance_mm = 900.0;
        let optics = Optics::square(side_px, 25.0 / 9.0 * side_px as f64);
        let scene = Scene::Tile {
            distance_mm,
            side_mm: 150.0,
            hollow_depth_mm: 0.2,
            hollow_width_mm: 4.0,
            pitch_mm: 8.0,
            wall_mm: 0.4,
            bow_mm: 0.0,
            bands: None,
        };
        ideal(scene, optics, distance_mm, (150.0, frames))
    }

    /// The tile with the faults of a real rig: camera 0.7 degrees rolled and 0.4 degrees panned, lens with a
    /// barrel distortion and 18 % vignetting, tile bowed by 0.3 mm, positions astray by 5 um, lamp that
    /// flickers by 0.3 %, sensor of 8 bit with noise at 45 dB below full scale, a black level, 0.5 %
    /// difference between pixels and five hot ones. The tile has chess-boards along its edges, and there is a
    /// board for the hand that fills about half of the image's width. Each fault is gone when its field is
    /// zero, as in [`tile`](Self::tile).
    pub fn real_tile(side_px: usize, frames: usize) -> Self {
        let mut config = Self::tile(side_px, frames);
        config.optics.roll_rad = 0.7_f64.to_radians();
        config.optics.pan_rad = 0.4_f64.to_radians();
        config.optics.distortion.k1 = -0.02;
        config.optics.vignetting = 0.18;
        if let Scene::Tile { bow_mm, bands, .. } = &mut config.scene {
            *bow_mm = 0.3;
            *bands = Some(Bands { square_mm: 7.5, columns: 19, rows: 3 });
        }
        config.sensor.read_noise_dn = 255.0 / 10_f64.powf(45.0 / 20.0);
        config.sensor.black_level_dn = 3.0;
        config.sensor.pixel_gain_sigma = 0.005;
        config.sensor.hot_pixels = 5;
        // 900 mm away the image is 324 mm wide.
        config.board = Some(HandBoard { square_mm: 16.0, columns: 10, rows: 7 });
        config.flicker = 0.003;
        config.step_error = StepError { sigma_um: 5.0, seed: 1 };
        config
    }

    /// The paper's synthetic experiment (section 5.1): the edge of a cube, both faces at 45 degrees to the
    /// optical axis, with granite-like texture.
    pub fn cube_edge(side_px: usize, frames: usize) -> Self {
        let distance_mm = 500.0;
        let optics = Optics::square(side_px, 1.6 * side_px as f64);
        // At the image's border the faces are this far away, and at 45 degrees grains look narrower by sqrt
        // 2.
        let farthest_mm = distance_mm / (1.0 - 0.5 / 1.6);
        let scene = Scene::CubeEdge { distance_mm, slope: 1.0 };
        ideal(scene, optics, std::f64::consts::SQRT_2 * farthest_mm, (40.0, frames))
    }

    /// A textured plane, 8 px of disparity, for small examples and tests.
    pub fn textured_plane(columns: usize, rows: usize, frames: usize) -> Self {
        let distance_mm = 500.0;
        let focal_length_px = 2.0 * columns as f64;
        let optics = Optics {
            rows,
            principal_point_y_px: 0.5 * (rows as f64 - 1.0),
            ..Optics::square(columns, focal_length_px)
        };
        let scene = Scene::Plane { distance_mm, slope_x: 0.0, slope_y: 0.0 };
        ideal(scene, optics, distance_mm, (8.0 * distance_mm / focal_length_px, frames))
    }
}

/// A rig without faults, for a scene whose grains have their width in the image at `grains_mm`.
fn ideal(scene: Scene, optics: Optics, grains_mm: f64, (travel_mm, frames): (f64, usize)) -> SimulatorConfig {
    let grain_mm = GRAIN_PX * grains_mm / optics.focal_length_px;
    SimulatorConfig {
        scene,
        texture: Texture { grain_mm, coarse_share: 0.35, seed: 1 },
        optics,
        sensor: Sensor::ideal(8),
        carried: Carried::Scene,
        scan: SimulatedScan { start_mm: 10.0, step_mm: travel_mm / (frames.max(2) - 1) as f64, frames },
        board: None,
        flicker: 0.0,
        drift: 0.0,
        highlight: 0.0,
        step_error: StepError::default(),
        first_exposure: 0,
    }
}
