//! The sections and keys of a profile, for the reader and for the commented template.

mod camera;
mod optics;
mod plan;
mod report;
mod section;
mod sim;
pub(super) mod stage;
mod target;

use super::error::{Problem, did_you_mean};

use epirig_core::settings::quantity::Unit;
use epirig_core::settings::{Key, Kind};

pub use camera::CameraProfile;
pub use optics::{FocalLength, OpticsProfile};
pub use plan::{LimitsProfile, PlanProfile};
pub use report::ReportProfile;
pub(super) use section::{Section, default_of};
pub use sim::{SceneName, SimProfile};
pub use stage::StageProfile;
pub use target::{BoardProfile, TargetProfile};

impl Section {
    /// All keys; for the stage, those of all drivers too.
    pub(super) fn keys(&self) -> Vec<&'static Key> {
        let more = if self.name == "stage" { stage::of_drivers() } else { Vec::new() };
        self.keys.iter().copied().chain(more).collect()
    }
}

/// The table in [`camera`] whose keys are the controls of the camera.
pub(super) const CONTROLS: &str = "controls";

/// All sections.
pub(super) static SECTIONS: &[Section] = &[
    StageProfile::SECTION,
    CameraProfile::SECTION,
    PlanProfile::SECTION,
    OpticsProfile::SECTION,
    TargetProfile::SECTION,
    BoardProfile::SECTION,
    LimitsProfile::SECTION,
    ReportProfile::SECTION,
    SimProfile::SECTION,
];

/// The section called `name`.
///
/// # Errors
/// [`Problem::UnknownSection`].
pub(super) fn find_section(name: &str) -> Result<&'static Section, Problem> {
    SECTIONS.iter().find(|section| section.name == name).ok_or_else(|| Problem::UnknownSection {
        name: name.to_owned(),
        hint: did_you_mean(name, SECTIONS.iter().map(|section| section.name.to_owned())),
    })
}

/// The key at `path`, such as `plan.step`, without a unit; `None` if there is no such key.
pub fn key_at(path: &str) -> Option<&'static Key> {
    let (section, name) = path.split_once('.')?;
    let section = SECTIONS.iter().find(|known| known.name == section)?;
    section.keys().into_iter().find(|key| key.name == name)
}

/// The key of a name in a section, and the unit in the name.
///
/// # Errors
/// [`Problem::UnknownKey`], [`Problem::UnknownUnitInKey`].
pub(super) fn find_key(section: &Section, name: &str) -> Result<(&'static Key, Option<Unit>), Problem> {
    let suffix = |key: &Key| name.strip_prefix(key.name).and_then(|rest| rest.strip_prefix('_'));
    let keys = section.keys();
    for key in &keys {
        if key.name == name {
            return Ok((key, None));
        }
        let unit = suffix(key).and_then(|suffix| key.kind.units().find(|unit| unit.suffix == suffix));
        if unit.is_some() {
            return Ok((key, unit));
        }
    }
    // If several keys match the beginning, the longest is used.
    let likely = keys.iter().filter(|key| suffix(key).is_some()).max_by_key(|key| key.name.len());
    if let Some(key) = likely
        && let (Kind::Measure { unit, .. }, Some(suffix)) = (key.kind, suffix(key))
    {
        return Err(Problem::UnknownUnitInKey {
            key: format!("{}.{name}", section.name),
            suffix: suffix.to_owned(),
            proposal: format!("{}_{}", key.name, unit.suffix),
            units: key.kind.units().map(|unit| unit.name).collect::<Vec<_>>().join(", "),
        });
    }
    // A key of another section is suggested before a similar one of this section.
    let elsewhere =
        SECTIONS.iter().flat_map(Section::keys).find(|key| key.spellings().any(|spelling| spelling == name));
    let spellings = || keys.iter().flat_map(|key| key.spellings());
    Err(Problem::UnknownKey {
        key: format!("{}.{name}", section.name),
        hint: elsewhere.map_or_else(
            || did_you_mean(name, spellings()),
            |key| format!("did you mean {}.{name}?", key.section),
        ),
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn no_two_spellings_are_the_same() {
        for section in SECTIONS {
            let spellings: Vec<String> = section.keys().iter().flat_map(|key| key.spellings()).collect();
            let different: BTreeSet<&String> = spellings.iter().collect();
            assert_eq!(different.len(), spellings.len(), "{}", section.name);
            assert!(section.keys().iter().all(|key| key.section == section.name), "{}", section.name);
        }
    }

    #[test]
    fn keys_are_found_in_all_spellings() {
        let plan = find_section("plan").unwrap();
        let (key, unit) = find_key(plan, "step_um").unwrap();
        assert_eq!((key.name, unit.map(|unit| unit.name)), ("step", Some("um")));
        let stage = find_section("stage").unwrap();
        let (key, unit) = find_key(stage, "velocity_mm_s").unwrap();
        assert_eq!((key.name, unit.map(|unit| unit.name)), ("velocity", Some("mm/s")));
        assert!(find_key(plan, "frames_mm").is_err(), "a count has no unit");
    }
}
