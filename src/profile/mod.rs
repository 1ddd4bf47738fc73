//! Rig profiles: a rig and a scan, described by a person in TOML.
//!
//! A quantity is written with its unit, in the value (`step = "1.5 mm"`) or in the key (`step_mm = 1.5`). What is written otherwise, twice, or
//! under a name that is no key is refused, with its line and with what to write instead. Overrides from the command line and from the environment
//! count instead of what the file says. All sections and keys are in the text that [`commented`] writes when nothing was found.

mod commented;
mod error;
mod overrides;
mod parts;
mod read;
mod record;
mod recorded;
mod schema;
mod settings;
mod value;

use serde::{Deserialize, Serialize};

pub use commented::{Findings, FoundCamera, commented};
pub use error::{Mistake, Place, Problem, ProfileError};
pub use overrides::{Override, overrides_from_environment};
pub use parts::{
    BoardProfile, CameraProfile, FocalLength, LimitsProfile, OpticsProfile, PlanProfile, PrintProfile,
    SceneName, SimFaults, SimProfile, StageProfile, TargetProfile,
};
pub use recorded::RecordedRigError;

use settings::Settings;

/// The profile of the simulated rig: the paper's, as [`Profile::read`] takes it.
pub const SIM: &str = include_str!("../../calib/sim.toml");

/// The profile of the same rig, simulated as real ones are: with everything that calibration has to find.
pub const REAL: &str = include_str!("../../calib/real.toml");

/// A rig and a scan.
///
/// Written into a record and read back, it is the same to the last bit. A record has the sections as objects, a field for each of theirs
/// with its unit in the name, times as numbers of s, and refuses fields that it does not know. It is what the program wrote itself: ranges are
/// checked by [`read`](Self::read) only.
///
/// ```
/// use epirig::profile::{Override, Profile};
///
/// let text = "[plan]\nstep = \"1.5 mm\"\nframes = 3\n";
/// let profile = Profile::read(text, "rig.toml", &[Override::parse("plan.start=1 cm", "--set")?])?;
/// assert_eq!(profile.plan.positions_mm(), Some(vec![10.0, 11.5, 13.0]));
///
/// let error = Profile::read("[plan]\nstep = 1.5\n", "rig.toml", &[]).unwrap_err();
/// assert_eq!(
///     error.to_string(),
///     "rig.toml, line 2: plan.step = 1.5 has no unit; write step = \"1.5 mm\" or step_mm = 1.5"
/// );
/// # Ok::<(), epirig::profile::ProfileError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// The stage, and how to reach it.
    pub stage: StageProfile,
    /// The camera, and how it is to be set.
    pub camera: CameraProfile,
    /// The scan.
    pub plan: PlanProfile,
    /// The lens and the sensor.
    pub optics: OpticsProfile,
    /// What is measured.
    pub target: TargetProfile,
    /// The chess-board that is held before the camera; `None`: none that is known.
    #[serde(default)]
    pub board: Option<BoardProfile>,
    /// What a scan may not exceed.
    pub limits: LimitsProfile,
    /// The simulated rig.
    pub sim: SimProfile,
}

impl Profile {
    /// From the text of a file; `source` is its name for messages. Of several overrides of a key the last counts.
    ///
    /// A key that means nothing with the driver of the stage or with the camera is refused; but if the command line or the environment has
    /// chosen another driver or camera, what places that count less say of the one in the file is left out.
    ///
    /// # Errors
    /// [`ProfileError`] with all that is wrong in file and overrides.
    pub fn read(text: &str, source: &str, overrides: &[Override]) -> Result<Self, ProfileError> {
        let mut settings = Settings::of_file(text, source);
        overrides.iter().for_each(|value| settings.replace(value));
        let (profile, mistakes) = read::read(settings);
        if mistakes.is_empty() { Ok(profile) } else { Err(ProfileError { mistakes }) }
    }

    /// From overrides alone.
    ///
    /// # Errors
    /// [`ProfileError`] with all that is wrong.
    pub fn of(overrides: &[Override]) -> Result<Self, ProfileError> {
        Self::read("", "", overrides)
    }
}

#[cfg(test)]
mod tests;
