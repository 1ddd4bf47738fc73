//! Everything that the command line says of a rig and a scan.

use std::path::PathBuf;

use clap::Args;

use super::camera::CameraArguments;
use super::plan::PlanArguments;
use super::profile::RigArgument;
use super::stage::StageArguments;
use crate::cli::CliError;
use crate::profile::{Draft, Override, Profile};

/// Options that describe a rig and a scan.
#[derive(Debug, Args)]
pub(in crate::cli) struct RigArguments {
    #[command(flatten)]
    rig: RigArgument,
    #[command(flatten)]
    plan: PlanArguments,
    #[command(flatten)]
    pub(in crate::cli) stage: StageArguments,
    #[command(flatten)]
    camera: CameraArguments,
}

impl RigArguments {
    /// The profile as a draft; what a person calls it; and the file that it is saved to.
    pub(in crate::cli) fn draft(&self) -> Result<(Draft, String, PathBuf), CliError> {
        self.rig.draft(self.changes())
    }

    fn changes(&self) -> Vec<Override> {
        [self.plan.changes(), self.stage.changes(), self.camera.changes()].concat()
    }

    /// The profile with the changes that options make.
    pub(in crate::cli) fn profile(&self) -> Result<Profile, CliError> {
        self.profile_with(Vec::new())
    }

    /// The same, with more changes.
    pub(in crate::cli) fn profile_with(&self, more: Vec<Override>) -> Result<Profile, CliError> {
        self.rig.profile([self.changes(), more].concat())
    }
}
