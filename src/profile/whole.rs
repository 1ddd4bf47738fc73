//! The whole profile, typed.

use serde::{Deserialize, Serialize};

use super::parts::{
    BoardProfile, CameraProfile, LimitsProfile, OpticsProfile, PlanProfile, SimProfile, StageProfile,
    TargetProfile,
};

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
