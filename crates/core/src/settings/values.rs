//! Values of keys.

use std::collections::BTreeMap;

use super::quantity::Measure;
use super::{Key, Kind};

/// The value of a key.
#[derive(Debug, Clone, PartialEq)]
pub enum Setting {
    /// True or false.
    Flag(bool),
    /// A whole number.
    Whole(i64),
    /// A number: of a quantity, in the key's unit.
    Number(f64),
    /// Text, or the name of a choice.
    Text(String),
    /// A quantity as it was written; [`Settings`] keep it as a number.
    Measure(Measure),
}

/// Values of keys of one table, such as that of a driver.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Settings(BTreeMap<&'static str, Setting>);

impl Settings {
    /// Sets `key`; a quantity in the key's unit.
    pub fn set(&mut self, key: &Key, value: Setting) {
        let value = match (value, key.kind) {
            (Setting::Measure(measure), Kind::Measure { unit, .. }) => Setting::Number(measure.in_unit(unit)),
            (value, _) => value,
        };
        self.0.insert(key.name, value);
    }

    /// Sets the keys that have a value in `others` and none here.
    pub fn add_missing(&mut self, others: &Self) {
        for (name, value) in &others.0 {
            self.0.entry(*name).or_insert_with(|| value.clone());
        }
    }

    /// The value of the key with a name, such as `travel`; `None` if it was not set.
    pub fn get(&self, name: &str) -> Option<&Setting> {
        self.0.get(name)
    }

    /// The number of a key, in its unit; `None` if it was not set.
    pub fn number(&self, key: &Key) -> Option<f64> {
        match self.get(key.name)? {
            Setting::Number(number) => Some(*number),
            Setting::Whole(number) => Some(*number as f64),
            _ => None,
        }
    }

    /// The whole number of a key; `None` if it was not set.
    pub fn whole(&self, key: &Key) -> Option<i64> {
        match self.get(key.name)? {
            Setting::Whole(number) => Some(*number),
            _ => None,
        }
    }

    /// The text, or the name of the choice, of a key; `None` if it was not set.
    pub fn text(&self, key: &Key) -> Option<&str> {
        match self.get(key.name)? {
            Setting::Text(text) => Some(text),
            _ => None,
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

    #[test]
    fn what_was_set_is_there() {
        let mut settings = Settings::default();
        settings.set(&STEP, Setting::Number(2.0));
        settings.set(&AXIS, Setting::Text("y".to_owned()));
        settings.set(&COUNT, Setting::Whole(4));
        assert_eq!(
            (settings.number(&STEP), settings.whole(&COUNT), settings.text(&AXIS)),
            (Some(2.0), Some(4), Some("y"))
        );
        assert_eq!((settings.number(&WAIT), settings.number(&AXIS)), (None, None));
    }
}
