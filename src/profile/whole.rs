//! The whole profile, typed.

use std::ops::Deref;

use super::schema::{
    BoardProfile, CameraProfile, LimitsProfile, OpticsProfile, PlanProfile, ReportProfile, SimProfile,
    StageProfile, TargetProfile,
};
use super::settings::Settings;

/// A rig and a scan: its [`Sections`], and the settings that they were read from.
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
#[derive(Debug, Clone)]
pub struct Profile {
    pub(super) sections: Sections,
    /// Free of mistakes.
    pub(super) settings: Settings,
}

impl Deref for Profile {
    type Target = Sections;

    fn deref(&self) -> &Sections {
        &self.sections
    }
}

/// Profiles are equal if they mean the same, in whatever units they were written.
impl PartialEq for Profile {
    fn eq(&self, other: &Self) -> bool {
        self.sections == other.sections
    }
}

/// The sections of a profile.
#[derive(Debug, Clone, PartialEq)]
pub struct Sections {
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
    /// The hand-held chess-board.
    pub board: BoardProfile,
    /// The limits of a scan.
    pub limits: LimitsProfile,
    /// What a report says beside the results.
    pub report: ReportProfile,
    /// The simulated rig.
    pub sim: SimProfile,
}

impl Sections {
    /// The limits of a scan: it accepts the tolerance that the stage accepts.
    pub fn scan_limits(&self) -> LimitsProfile {
        let position_mm = self.limits.position_mm.max(self.stage.tolerance_mm);
        LimitsProfile { position_mm, ..self.limits.clone() }
    }
}
