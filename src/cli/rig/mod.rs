//! The rig that a command works with: which profile, what the command line changes of it, and the devices it describes.

mod assistant;
mod calibration;
mod camera;
mod plan;
mod profile;
mod simulator;
mod stage;

pub(super) use assistant::Hands;
pub(super) use calibration::{calibration_plan, can_be_calibrated, recorded_options};
pub(super) use camera::{
    CameraArgument, CameraArguments, Opened, camera_settings, open_camera, tell_configuration,
};
pub(super) use plan::{PlanArguments, capture_plan, nominal_lens};
pub(super) use profile::{Options, RigArgument, named_profile};
pub(super) use simulator::{simulated_simulator, simulator_config};
pub(super) use stage::{StageArguments, Stages, home, sim_config};
