//! Rig profiles: the description of a rig and a scan in TOML.
//!
//! A quantity is written with its unit, in the value (`step = "1.5 mm"`) or in the key (`step_mm = 1.5`).
//! Other forms, duplicates and unknown keys are refused, with line number and correction. Overrides of the
//! command line and the environment replace values of the file. [`commented`] writes a text with all sections
//! and keys.

mod commented;
mod draft;
mod error;
mod given;
mod overrides;
mod read;
mod recorded;
mod schema;
mod settings;
mod value;
mod whole;

pub use commented::{Findings, FoundCamera, commented};
pub use draft::{Draft, DraftKey, DraftSection};
pub use error::{Mistake, Place, Problem, ProfileError};
pub use overrides::{Override, overrides_from_environment};
pub use recorded::RecordedRigError;
pub use schema::{
    BoardProfile, CameraProfile, FocalLength, LimitsProfile, OpticsProfile, PlanProfile, ReportProfile,
    SceneName, SimProfile, StageProfile, TargetProfile, key_at as key,
};
pub use whole::{Profile, Sections};

use settings::Settings;

/// The profile of the simulated rig, that of the paper, as text for [`Profile::read`].
pub const SIM: &str = include_str!("../../calib/sim.toml");

/// The profile of the same rig with all the imperfections that calibration has to find.
pub const REAL: &str = include_str!("../../calib/real.toml");

impl Profile {
    /// Parses the text of a file; `source` is its name in messages. The last of several overrides of a key is
    /// used.
    ///
    /// A key without effect for the stage's driver or the camera is refused. Exception: if an override
    /// selects another driver or camera, keys of lower rank for the replaced one are dropped.
    ///
    /// # Errors
    /// [`ProfileError`] with all mistakes in the file and the overrides.
    pub fn read(text: &str, source: &str, overrides: &[Override]) -> Result<Self, ProfileError> {
        let mut settings = Settings::of_file(text, source);
        overrides.iter().for_each(|value| settings.replace(value));
        read::read(settings)
    }

    /// A profile from overrides alone.
    ///
    /// # Errors
    /// [`ProfileError`] with all mistakes.
    pub fn of(overrides: &[Override]) -> Result<Self, ProfileError> {
        Self::read("", "", overrides)
    }
}

#[cfg(test)]
mod tests;
