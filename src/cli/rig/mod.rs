//! The rig of a command: its profile, changes by options, and the devices it describes.

mod arguments;
mod assistant;
mod camera;
mod key_options;
mod plan;
mod profile;
mod stage;

pub(super) use arguments::RigArguments;
pub(super) use assistant::Hands;
pub(super) use camera::{CameraArgument, CameraArguments, tell_configuration};
pub(super) use key_options::{KeyGroup, KeyOption, KeyOptions};
pub(super) use profile::{LOCAL, RigArgument, given, given_by_set, named_profile, simulated_names};
pub(super) use stage::{Stages, WhichStage, driver, home};
