//! The whole profile, typed.

use serde::{Deserialize, Serialize};

use super::parts::{
    BoardProfile, CameraProfile, LimitsProfile, OpticsProfile, PlanProfile, SimProfile, StageProfile,
    TargetProfile,
};

/// A rig and a scan.
///
/// The round trip through a record is exact. A record has one object per section and one field per key, with
/// its unit in the name; times are in s. Unknown fields are refused. Ranges are checked by
/// [`read`](Self::read) only, because the program itself writes the records.
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
    /// The stage and its connection.
    pub stage: StageProfile,
    /// The camera and its settings.
    pub camera: CameraProfile,
    /// The scan.
    pub plan: PlanProfile,
    /// The lens and the sensor.
    pub optics: OpticsProfile,
    /// The measured object.
    pub target: TargetProfile,
    /// The hand-held chess-board; `None` if unknown.
    #[serde(default)]
    pub board: Option<BoardProfile>,
    /// The limits of a scan.
    pub limits: LimitsProfile,
    /// The simulated rig.
    pub sim: SimProfile,
}
