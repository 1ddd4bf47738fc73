//! The camera of a profile.

use super::{RigError, simulator, simulator_config};
use crate::profile::Profile;
use epirig_devices::camera::pixels::FourCc;
use epirig_devices::camera::{CameraSettings, OpenCamera, Surroundings, camera_driver};
use epirig_devices::stage::StagePosition;

/// Opens the camera of a profile; a simulated one sees the stage at the position of `stage`.
///
/// # Errors
/// [`RigError`] if there is no such camera, it cannot be opened, or its scene cannot be simulated.
pub fn open_camera(profile: &Profile, stage: &StagePosition) -> Result<OpenCamera, RigError> {
    let device = profile.camera.device.as_deref();
    let driver = camera_driver(device);
    let simulator = if driver.is_simulated() { Some(simulator(simulator_config(profile)?)?) } else { None };
    let faults = profile.sim.faults.camera.iter().map(|(_, fault)| *fault).collect();
    let around =
        Surroundings { simulator, stage: stage.clone(), in_real_time: profile.sim.real_time, faults };
    Ok(driver.open(device, &around)?)
}

/// The settings of the camera in a profile.
///
/// # Errors
/// [`RigError::Value`] for an invalid format code.
pub fn camera_settings(profile: &Profile) -> Result<CameraSettings, RigError> {
    let camera = &profile.camera;
    let four_cc = camera.format.as_deref().map(str::parse::<FourCc>).transpose();
    Ok(CameraSettings {
        four_cc: four_cc
            .map_err(|reason| RigError::Value { key: "camera.format", reason: reason.to_string() })?,
        size: camera.size,
        rate_hz: camera.rate_hz,
        exposure_us: camera.exposure_us,
        controls: camera.controls.clone(),
        bayer: camera.bayer,
        patience: camera.patience,
    })
}
