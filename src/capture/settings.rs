//! The settings of the stage that decide where its positions are: a scan ends with those it began with.

use std::fmt;

use epirig_devices::stage::PositionSettings;

/// A setting of the stage that is not as it was when the scan began.
#[derive(Debug, Clone, PartialEq)]
pub struct ChangedSetting {
    /// Name in the stage's dialect.
    pub name: String,
    /// Value in the record of the scan; `None` if the stage did not have it.
    pub recorded: Option<f64>,
    /// Value now; `None` if the stage does not have it.
    pub found: Option<f64>,
}

impl fmt::Display for ChangedSetting {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = |value: Option<f64>| value.map_or("absent".to_owned(), |value| value.to_string());
        write!(to, "{} was {} and is {}", self.name, words(self.recorded), words(self.found))
    }
}

/// The changes as one clause.
pub(super) fn listed(changes: &[ChangedSetting]) -> String {
    let all: Vec<String> = changes.iter().map(ToString::to_string).collect();
    format!("the settings of the stage have changed ({})", all.join(", "))
}

/// The settings that differ.
pub(super) fn changes(recorded: &PositionSettings, found: &PositionSettings) -> Vec<ChangedSetting> {
    let is_new = |name: &&String| !recorded.contains_key(*name);
    let names = recorded.keys().chain(found.keys().filter(is_new));
    let settings = names.map(|name| ChangedSetting {
        name: name.clone(),
        recorded: recorded.get(name).copied(),
        found: found.get(name).copied(),
    });
    settings.filter(|setting| setting.recorded != setting.found).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_setting_that_differs_is_named_with_both_values() {
        let settings = |all: &[(&str, f64)]| -> PositionSettings {
            all.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect()
        };
        let recorded = settings(&[("$100", 250.0), ("$23", 0.0), ("$27", 1.0)]);
        assert_eq!(changes(&recorded, &recorded), []);
        let found = changes(&recorded, &settings(&[("$100", 250.001), ("$27", 1.0), ("$130", 60.0)]));
        let words: Vec<String> = found.iter().map(ToString::to_string).collect();
        let expected =
            ["$100 was 250 and is 250.001", "$23 was 0 and is absent", "$130 was absent and is 60"];
        assert_eq!(words, expected);
    }
}
