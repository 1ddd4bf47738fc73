//! Values of keys.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{Key, Kind};

/// The value of a key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Setting {
    /// True or false.
    Flag(bool),
    /// A whole number.
    Whole(i64),
    /// A number: of a quantity, in the key's unit.
    Number(f64),
    /// Text, or the name of a choice.
    Text(String),
}

/// Values of keys of one table, such as that of a driver.
///
/// In a record: an object with a field for each value; the name of a quantity ends in its unit.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Settings(BTreeMap<String, Setting>);

/// What is wrong with recorded settings.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum SettingFault {
    /// There is no key of this name.
    #[error("{name} is no key; there are {known}")]
    Unknown {
        /// As it was recorded.
        name: String,
        /// All names of the table.
        known: String,
    },
    /// A value is not what its key allows.
    #[error("{name} must be {allowed}")]
    NotAllowed {
        /// The name in the record.
        name: String,
        /// What is allowed.
        allowed: String,
    },
    /// A key that must be given is missing.
    #[error("{name} is missing")]
    Missing {
        /// The name in the record.
        name: String,
    },
}

impl Settings {
    /// Sets `key`.
    pub fn set(&mut self, key: &Key, value: Setting) {
        self.0.insert(key.record_name(), value);
    }

    /// The value of a name as records have it, such as `travel_mm`; `None` if it was not set.
    pub fn get(&self, record_name: &str) -> Option<&Setting> {
        self.0.get(record_name)
    }

    /// The number of a key, in its unit; `None` if it was not set.
    pub fn number(&self, key: &Key) -> Option<f64> {
        match self.0.get(&key.record_name())? {
            Setting::Number(number) => Some(*number),
            Setting::Whole(number) => Some(*number as f64),
            _ => None,
        }
    }

    /// The whole number of a key; `None` if it was not set.
    pub fn whole(&self, key: &Key) -> Option<i64> {
        match self.0.get(&key.record_name())? {
            Setting::Whole(number) => Some(*number),
            _ => None,
        }
    }

    /// The text, or the name of the choice, of a key; `None` if it was not set.
    pub fn text(&self, key: &Key) -> Option<&str> {
        match self.0.get(&key.record_name())? {
            Setting::Text(text) => Some(text),
            _ => None,
        }
    }

    /// Whether these are values that `keys` allow. Records come from files, which may say anything.
    ///
    /// # Errors
    /// [`SettingFault`] for the first that is not.
    pub fn check(&self, keys: &[&Key]) -> Result<(), SettingFault> {
        for (name, value) in &self.0 {
            let Some(key) = keys.iter().find(|key| key.record_name() == *name) else {
                let known: Vec<String> = keys.iter().map(|key| key.record_name()).collect();
                return Err(SettingFault::Unknown { name: name.clone(), known: known.join(", ") });
            };
            let suits = match (key.kind, value) {
                (Kind::Flag, Setting::Flag(_)) => true,
                (Kind::Whole(least, most), Setting::Whole(number)) => (least..=most).contains(number),
                (Kind::Number | Kind::Measure { .. }, Setting::Number(number)) => {
                    key.kind.allows_number(*number)
                }
                (Kind::Text, Setting::Text(text)) => !text.trim().is_empty(),
                (Kind::Form { is_valid, .. }, Setting::Text(text)) => is_valid(text),
                (Kind::Choice(names), Setting::Text(text)) => names().contains(&text.as_str()),
                _ => false,
            };
            if !suits {
                return Err(SettingFault::NotAllowed { name: name.clone(), allowed: key.kind.allowed() });
            }
        }
        match keys.iter().find(|key| key.needed.is_some() && !self.0.contains_key(&key.record_name())) {
            Some(key) => Err(SettingFault::Missing { name: key.record_name() }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Allowed;
    use super::super::quantity::{MM, S};
    use super::*;

    static STEP: Key = Key::new("a", "step", Kind::measure(MM, Allowed::Positive), "1 mm", "A step");
    static WAIT: Key = Key::new("a", "wait", Kind::measure(S, Allowed::ZeroOrMore), "1 s", "A time");
    static AXIS: Key = Key::new("a", "axis", Kind::Choice(|| vec!["x", "y"]), "x", "An axis").needed("look");
    static COUNT: Key = Key::new("a", "count", Kind::Whole(1, 9), "3", "A count");
    static KEYS: &[&Key] = &[&STEP, &WAIT, &AXIS, &COUNT];

    #[test]
    fn a_record_gives_back_what_was_set() {
        let mut settings = Settings::default();
        settings.set(&STEP, Setting::Number(2.0));
        settings.set(&AXIS, Setting::Text("y".to_owned()));
        settings.set(&COUNT, Setting::Whole(4));
        let text = serde_json::to_string(&settings).unwrap();
        assert_eq!(text, r#"{"axis":"y","count":4,"step_mm":2.0}"#);
        let back: Settings = serde_json::from_str(&text).unwrap();
        assert_eq!(back, settings);
        assert_eq!(back.check(KEYS), Ok(()));
        assert_eq!(
            (back.number(&STEP), back.whole(&COUNT), back.text(&AXIS)),
            (Some(2.0), Some(4), Some("y"))
        );
        assert_eq!(back.number(&WAIT), None);
    }

    #[test]
    fn what_no_key_allows_is_refused() {
        let refused = |text: &str| serde_json::from_str::<Settings>(text).unwrap().check(KEYS).unwrap_err();
        for (text, name) in [
            (r#"{"axis":"x","step_cm":1.0}"#, "step_cm"),
            (r#"{"axis":"z"}"#, "axis"),
            (r#"{"axis":"x","step_mm":0.0}"#, "step_mm"),
            (r#"{"axis":"x","step_mm":1e-10}"#, "step_mm"),
            (r#"{"axis":"x","step_mm":1e10}"#, "step_mm"),
            (r#"{"axis":"x","step_mm":"1 mm"}"#, "step_mm"),
            (r#"{"axis":"x","wait_s":86401.0}"#, "wait_s"),
            (r#"{"axis":"x","count":10}"#, "count"),
            (r#"{"axis":"x","count":2.5}"#, "count"),
            (r#"{"count":2}"#, "axis"),
        ] {
            assert!(refused(text).to_string().starts_with(name), "{text}: {}", refused(text));
        }
    }
}
