//! Values that replace those of the file: from the command line and the environment.

use std::ffi::OsString;

use super::error::{Mistake, Place, Problem, ProfileError};
use super::schema::{CONTROLS, SECTIONS, Section, find_key};

/// A value that replaces the file's.
///
/// ```
/// use epirig::profile::Override;
///
/// let step = Override::parse("plan.step=1.5 mm", "--set")?;
/// assert_eq!((step.key.as_str(), step.value.as_str()), ("plan.step", "1.5 mm"));
/// # Ok::<(), epirig::profile::ProfileError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Override {
    /// The key with its section: `plan.step`, `plan.step_mm`, `camera.controls.gain`.
    pub key: String,
    /// The value as in a file, but without quotes: `1.5 mm`.
    pub value: String,
    /// Its source, for messages: `--set`, or the name of an environment variable.
    pub from: String,
}

impl Override {
    /// Parses `SECTION.KEY=VALUE`; blanks around key and value are removed.
    /// [`Profile::read`](super::Profile::read) checks key and value.
    ///
    /// # Errors
    /// [`Problem::NoSetting`] for another form.
    pub fn parse(text: &str, from: &str) -> Result<Self, ProfileError> {
        let parts = text.split_once('=').map(|(key, value)| (key.trim(), value.trim()));
        let (key, value) = parts
            .filter(|(key, value)| key.contains('.') && !value.is_empty())
            .ok_or_else(|| ProfileError::one(place(from), Problem::NoSetting(text.to_owned())))?;
        Ok(Self { key: key.to_owned(), value: value.to_owned(), from: from.to_owned() })
    }
}

fn place(from: &str) -> Place {
    Place::Override { from: from.to_owned() }
}

/// The overrides of environment variables named `EPIRIG_SECTION_KEY`, such as `EPIRIG_PLAN_STEP` or
/// `EPIRIG_CAMERA_CONTROLS_GAIN`, in the order of their names. Other variables, such as `EPIRIG_PORT`, are
/// ignored.
///
/// # Errors
/// [`Problem::UnknownKey`] for a variable that names a section but no key of it, [`Problem::Twice`] for two
/// variables of one key, [`Problem::NotUnicode`].
pub fn overrides_from_environment<N: Into<OsString>, V: Into<OsString>>(
    variables: impl IntoIterator<Item = (N, V)>,
) -> Result<Vec<Override>, ProfileError> {
    let mut ours: Vec<(String, &Section, String, OsString)> = Vec::new();
    for (name, value) in variables {
        let Ok(name) = name.into().into_string() else { continue };
        let Some(words) = name.strip_prefix("EPIRIG_").map(str::to_ascii_lowercase) else { continue };
        let section = SECTIONS.iter().find_map(|section| {
            Some((section, words.strip_prefix(section.name)?.strip_prefix('_')?.to_owned()))
        });
        if let Some((section, key)) = section {
            ours.push((name, section, key, value.into()));
        }
    }
    ours.sort_by(|(one, ..), (other, ..)| one.cmp(other));
    let mut mistakes = Vec::new();
    let mut overrides: Vec<(String, Override)> = Vec::new();
    for (from, section, key, value) in ours {
        match checked(section, &key, value, &from) {
            Err(problem) => mistakes.push(Mistake { place: place(&from), problem }),
            Ok((path, value)) => match overrides.iter().find(|(known, _)| *known == path) {
                Some((_, first)) => mistakes.push(Mistake {
                    place: place(&from),
                    problem: Problem::Twice { key: path, first: place(&first.from) },
                }),
                None => overrides.push((path, value)),
            },
        }
    }
    if mistakes.is_empty() {
        Ok(overrides.into_iter().map(|(_, value)| value).collect())
    } else {
        Err(ProfileError { mistakes })
    }
}

/// The path of a variable's key without its unit, and the override.
fn checked(section: &Section, key: &str, value: OsString, from: &str) -> Result<(String, Override), Problem> {
    let control = key.strip_prefix(CONTROLS).and_then(|rest| rest.strip_prefix('_'));
    let (path, key) = match control.filter(|control| section.name == "camera" && !control.is_empty()) {
        Some(control) => {
            let path = format!("{}.{CONTROLS}.{control}", section.name);
            (path.clone(), path)
        }
        None => (find_key(section, key)?.0.path(), format!("{}.{key}", section.name)),
    };
    let value = value.into_string().map_err(|_| Problem::NotUnicode)?;
    Ok((path, Override { key, value, from: from.to_owned() }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn environment(variables: &[(&str, &str)]) -> Result<Vec<Override>, ProfileError> {
        overrides_from_environment(variables.iter().copied())
    }

    #[test]
    fn settings_are_split_at_the_first_equals_sign() {
        let value = Override::parse(" camera.controls.mode = a=b ", "--set").unwrap();
        assert_eq!((value.key.as_str(), value.value.as_str()), ("camera.controls.mode", "a=b"));
        for text in ["", "plan.step", "plan.step=", "step=1 mm", "=1"] {
            let error = Override::parse(text, "--set").unwrap_err().to_string();
            let expected = format!(
                "--set: {text:?} is not a setting; write SECTION.KEY=VALUE, such as plan.step=1.5 mm"
            );
            assert_eq!(error, expected);
        }
    }

    #[test]
    fn variables_of_the_sections_are_taken_in_the_order_of_their_names() {
        let found = environment(&[
            ("EPIRIG_PLAN_STEP", "1.5 mm"),
            ("EPIRIG_CAMERA_CONTROLS_EXPOSURE_AUTO", "1"),
            ("EPIRIG_LIMITS_POSITION_UM", "30"),
            ("EPIRIG_CAMERA", "sim"),
            ("EPIRIG_PORT", "/dev/ttyUSB0"),
            ("EPIRIG_RIG", "bench"),
            ("EPIRIG_REQUIRE_PYTHON", "1"),
            ("PLAN_STEP", "nothing"),
        ]);
        let found: Vec<(String, String, String)> =
            found.unwrap().into_iter().map(|value| (value.key, value.value, value.from)).collect();
        let expected = [
            ("camera.controls.exposure_auto", "1", "EPIRIG_CAMERA_CONTROLS_EXPOSURE_AUTO"),
            ("limits.position_um", "30", "EPIRIG_LIMITS_POSITION_UM"),
            ("plan.step", "1.5 mm", "EPIRIG_PLAN_STEP"),
        ];
        assert_eq!(
            found,
            expected.map(|(key, value, from)| (key.to_owned(), value.to_owned(), from.to_owned()))
        );
    }

    #[test]
    fn a_variable_of_a_section_that_is_no_key_is_refused() {
        let message = |variables: &[(&str, &str)]| environment(variables).unwrap_err().to_string();
        assert_eq!(
            message(&[("EPIRIG_PLAN_STPE", "1 mm")]),
            "EPIRIG_PLAN_STPE: there is no key plan.stpe; did you mean step?"
        );
        assert_eq!(
            message(&[("EPIRIG_PLAN_STEP_MM", "1"), ("EPIRIG_PLAN_STEP", "1 mm")]),
            "EPIRIG_PLAN_STEP_MM: plan.step is given twice, first at EPIRIG_PLAN_STEP; remove one"
        );
    }

    #[cfg(unix)]
    #[test]
    fn what_is_not_unicode_is_refused_in_our_variables_only() {
        use std::os::unix::ffi::OsStringExt;

        let broken = || OsString::from_vec(vec![0xff]);
        assert_eq!(overrides_from_environment([(OsString::from("OTHER"), broken())]), Ok(Vec::new()));
        assert_eq!(overrides_from_environment([(broken(), broken())]), Ok(Vec::new()));
        let error = overrides_from_environment([("EPIRIG_PLAN_STEP", broken())]).unwrap_err();
        assert_eq!(error.to_string(), "EPIRIG_PLAN_STEP: the value is not Unicode; set it again or unset it");
    }
}
