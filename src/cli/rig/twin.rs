//! The twin that a simulated rig has before its camera.

use std::sync::Arc;

use crate::camera::Size;
use crate::cli::CliError;
use crate::profile::{Profile, SceneName};
use crate::twin::{Scene, Twin, TwinConfig, TwinScan};

/// Size of the simulated camera's frames, unless another is asked for.
const SIZE: Size = Size { columns: 640, rows: 480 };
/// More than any sensor has, and less than would not fit into memory.
const MOST_PIXELS: usize = 100_000_000;

/// The twin of a profile. Its lens and its distance are those that the profile states, if it does.
pub(in crate::cli) fn twin_config(profile: &Profile) -> TwinConfig {
    let size = profile.camera.size.unwrap_or(SIZE);
    let frames = profile.plan.frames.unwrap_or(2);
    let mut config = match profile.sim.scene {
        SceneName::Tile => TwinConfig::tile(size.columns, frames),
        SceneName::CubeEdge => TwinConfig::cube_edge(size.columns, frames),
        SceneName::Plane => TwinConfig::textured_plane(size.columns, size.rows, frames),
    };
    let optics = &mut config.optics;
    optics.rows = size.rows;
    optics.principal_point_y_px = 0.5 * (size.rows as f64 - 1.0);
    if let Some((x_px, y_px)) = profile.optics.principal_point_px {
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
        config.scan = TwinScan { start_mm: profile.plan.start_mm, step_mm, frames };
    }
    config.sensor.read_noise_dn = profile.sim.noise_dn;
    config.sensor.seed = config.sensor.seed.wrapping_add(profile.sim.seed);
    config
}

/// A twin of this make, if it can be.
pub(in crate::cli) fn simulated_twin(config: TwinConfig) -> Result<Arc<Twin>, CliError> {
    let Size { columns, rows } = Size { columns: config.optics.columns, rows: config.optics.rows };
    if columns.saturating_mul(rows) > MOST_PIXELS {
        return Err(CliError::Usage(format!(
            "a simulated camera of {columns}x{rows} is too large; take 10000x10000 or less"
        )));
    }
    Ok(Arc::new(Twin::new(config)?))
}
