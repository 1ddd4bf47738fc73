//! A profile as it is written, to be changed key by key.

use std::collections::BTreeMap;

use serde::Serialize;

use super::commented::{Findings, template};
use super::error::Place;
use super::given::Given;
use super::overrides::Override;
use super::read::{is_of_no_simulator, read, sections, settled};
use super::schema::{SECTIONS, stage};
use super::settings::{Settings, control_path};
use super::{Profile, ProfileError, value};
use epirig_core::settings::{Key, Kind};

/// A profile as a person writes it: values with their units, as text.
///
/// ```
/// use std::collections::BTreeMap;
/// use epirig::profile::{Draft, Profile, SIM};
///
/// let draft = Draft::read(SIM, "sim.toml", &[])?;
/// let change = BTreeMap::from([("plan.step".to_owned(), "2 mm".to_owned())]);
/// let changed = draft.changed(&change);
/// assert_eq!(changed.profile()?.plan.step_mm, Some(2.0));
/// // What is saved reads as the same profile.
/// let saved = changed.commented(&Default::default());
/// assert_eq!(Profile::read(&saved, "rig.toml", &[])?, changed.profile()?);
/// # Ok::<(), epirig::profile::ProfileError>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Draft(Settings);

/// A section of a draft.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS), ts(rename = "ProfileSection"))]
pub struct DraftSection {
    /// Its name in the file.
    pub name: &'static str,
    /// Its purpose.
    pub meaning: &'static str,
    /// All of its keys.
    pub keys: Vec<DraftKey>,
}

/// A key of a draft.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS), ts(rename = "ProfileKey"))]
pub struct DraftKey {
    /// With its section, such as `plan.step`.
    pub path: String,
    /// Without its section.
    pub name: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// What a value must be, in words.
    pub allowed: String,
    /// The value without the key, if there is one.
    pub default: Option<&'static str>,
    /// An allowed value.
    pub example: &'static str,
    /// The allowed values, if they can be listed.
    pub choices: Option<Vec<&'static str>>,
    /// The value as it is written; `None` if the key is not set.
    pub value: Option<String>,
    /// Whether the key has an effect with the chosen stage and camera.
    pub applies: bool,
}

impl Draft {
    /// The draft of a file's text with overrides, as [`Profile::read`].
    ///
    /// # Errors
    /// [`ProfileError`] with all mistakes.
    pub fn read(text: &str, source: &str, overrides: &[Override]) -> Result<Self, ProfileError> {
        Ok(Self::of(&Profile::read(text, source, overrides)?))
    }

    /// The draft of a profile.
    pub fn of(profile: &Profile) -> Self {
        Self(profile.settings.clone()).at_rest()
    }

    /// This draft with other values: of keys, and of controls as `camera.controls.NAME`. An empty value removes
    /// a key. If another driver, camera or scene is chosen, keys of the former one are dropped.
    #[must_use]
    pub fn changed(&self, changes: &BTreeMap<String, String>) -> Self {
        let mut settings = self.0.clone();
        for (path, value) in changes {
            if value.trim().is_empty() {
                settings.forget(path);
                settings.controls.retain(|control| control_path(&control.name) != *path);
            } else {
                let (key, value) = (path.clone(), value.clone());
                settings.replace(&Override { key, value, from: path.clone() });
            }
        }
        Self(settings).at_rest()
    }

    /// What is set here counts as written in a file.
    fn at_rest(self) -> Self {
        let mut settings = settled(self.0);
        for setting in &mut settings.settings {
            setting.place = Place::Draft { key: setting.key.path() };
        }
        for control in &mut settings.controls {
            control.place = Place::Draft { key: control_path(&control.name) };
        }
        Self(settings)
    }

    /// The profile.
    ///
    /// # Errors
    /// [`ProfileError`] with all mistakes; each has the place [`Place::Draft`] with its key, or
    /// [`Place::Override`] with the path that is no key.
    pub fn profile(&self) -> Result<Profile, ProfileError> {
        read(self.0.clone())
    }

    /// All sections with all keys.
    pub fn sections(&self) -> Vec<DraftSection> {
        let read = sections(self.0.clone());
        let section = |section: &super::schema::Section| DraftSection {
            name: section.name,
            meaning: section.meaning,
            keys: section
                .keys()
                .into_iter()
                .map(|key| DraftKey {
                    path: key.path(),
                    name: key.name,
                    meaning: key.meaning,
                    allowed: key.kind.allowed(),
                    default: key.default,
                    example: key.example,
                    choices: match key.kind {
                        Kind::Choice(names) => Some(names()),
                        Kind::Flag => Some(vec!["true", "false"]),
                        _ => None,
                    },
                    value: self.value(key),
                    applies: stage::belongs_to(key, read.stage.driver) && !is_of_no_simulator(key, &read),
                })
                .collect(),
        };
        SECTIONS.iter().map(section).collect()
    }

    /// The value of the key at `path` as it is written; `None` if it is not set.
    pub fn value_of(&self, path: &str) -> Option<String> {
        super::key(path).and_then(|key| self.value(key))
    }

    /// The controls of the camera that are set: names and values.
    pub fn controls(&self) -> Vec<(String, String)> {
        let value = |control: &super::settings::ControlSetting| {
            let path = control_path(&control.name);
            (control.name.clone(), value::control(&path, &control.given).unwrap_or_default())
        };
        self.0.controls.iter().map(value).collect()
    }

    /// The text of a profile file with these values, and with every other key commented out.
    pub fn commented(&self, findings: &Findings) -> String {
        template(findings, &|key| self.value(key), &self.controls())
    }

    /// The value of a key as it is written, with its unit.
    fn value(&self, key: &Key) -> Option<String> {
        let setting = self.0.setting(&key.path())?;
        let text = match &setting.given {
            Given::Text(text) => text.clone(),
            given => given.to_string(),
        };
        Some(match setting.unit {
            Some(unit) => format!("{text} {}", unit.name),
            None => text,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{REAL, SIM};
    use super::*;

    fn changes(values: &[(&str, &str)]) -> BTreeMap<String, String> {
        values.iter().map(|(path, value)| ((*path).to_owned(), (*value).to_owned())).collect()
    }

    #[test]
    fn what_is_saved_reads_as_the_same_profile() {
        let in_key =
            "[plan]\nstep_um = 1500\nframes = 11\n[camera.controls]\ngain = 10\nmode = \"a \\\"b\\\"\"\n";
        for text in [SIM, REAL, in_key, ""] {
            let draft = Draft::read(text, "rig.toml", &[]).unwrap();
            let wanted = Profile::read(text, "rig.toml", &[]).unwrap();
            assert_eq!(draft.profile().unwrap(), wanted);
            let saved = draft.commented(&Findings::default());
            assert_eq!(Profile::read(&saved, "rig.toml", &[]).unwrap(), wanted, "{saved}");
        }
    }

    #[test]
    fn a_value_is_shown_as_it_is_written_and_an_empty_one_is_none() {
        let draft = Draft::read("[plan]\nstep_um = 1500\n", "rig.toml", &[]).unwrap();
        let step = |draft: &Draft| {
            let sections = draft.sections();
            let plan = sections.iter().find(|section| section.name == "plan").unwrap().clone();
            plan.keys.into_iter().find(|key| key.name == "step").unwrap().value
        };
        assert_eq!(step(&draft).as_deref(), Some("1500 um"));
        let changed = draft.changed(&changes(&[("plan.step", "2 mm"), ("camera.controls.gain", "3")]));
        assert_eq!(step(&changed).as_deref(), Some("2 mm"));
        assert_eq!(changed.controls(), [("gain".to_owned(), "3".to_owned())]);
        let cleared = changed.changed(&changes(&[("plan.step", " "), ("camera.controls.gain", "")]));
        assert_eq!((step(&cleared), cleared.controls().len()), (None, 0));
    }

    #[test]
    fn mistakes_name_their_key() {
        let draft = Draft::read(SIM, "sim.toml", &[]).unwrap();
        let wrong =
            draft.changed(&changes(&[("plan.step", "2"), ("plan.frames", "1"), ("plan.nothing", "1")]));
        let places: Vec<String> =
            wrong.profile().unwrap_err().mistakes.iter().map(|mistake| mistake.place.to_string()).collect();
        assert_eq!(places, ["plan.nothing", "plan.step", "plan.frames"]);
    }

    #[test]
    fn keys_of_a_replaced_driver_are_dropped() {
        let draft = Draft::read(SIM, "sim.toml", &[]).unwrap();
        let real = draft.changed(&changes(&[("stage.driver", "grbl"), ("camera.device", "/dev/video0")]));
        let profile = real.profile().unwrap();
        assert_eq!(profile.stage.driver.name(), "grbl");
        let shown = real.sections();
        let travel = shown.iter().flat_map(|section| &section.keys).find(|key| key.path == "stage.travel");
        assert!(travel.is_some_and(|key| key.value.is_none()));
        assert!(
            shown.iter().flat_map(|section| &section.keys).any(|key| key.path == "sim.scene" && !key.applies)
        );
    }
}
