//! Names of new sequences: each is the name of a folder.

use serde::Serialize;

/// Most letters of a name.
const LONGEST: usize = 80;

/// What a name may be: for the form of the page, which checks it while somebody types.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct NameRule {
    /// As a regular expression for the whole name.
    pattern: &'static str,
    /// In words.
    words: &'static str,
}

/// The rule that [`is_plain`] checks.
pub(super) const NAME_RULE: NameRule = NameRule {
    pattern: "[A-Za-z0-9](?:[A-Za-z0-9_.\\-]{0,78}[A-Za-z0-9_\\-])?",
    words: "a name has at most 80 characters: a to z, A to Z, 0 to 9, and inside of it also - _ and .",
};

/// What the rule says of a name that does not keep it; `None` for one that does.
pub(in crate::panel) fn why_no_name(name: &str) -> Option<&'static str> {
    (!is_plain(name)).then_some(NAME_RULE.words)
}

/// Whether a name can be that of a new folder, on any system.
fn is_plain(name: &str) -> bool {
    let is_inside = |letter: char| letter.is_ascii_alphanumeric() || matches!(letter, '-' | '_' | '.');
    (1..=LONGEST).contains(&name.len())
        && name.chars().all(is_inside)
        && name.starts_with(|first: char| first.is_ascii_alphanumeric())
        && !name.ends_with('.')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_that_of_a_folder_everywhere() {
        let longest = "x".repeat(LONGEST);
        for name in ["a", "scan-001", "tile_0042", "2026.11.26", "a-", longest.as_str()] {
            assert_eq!(why_no_name(name), None, "{name}");
        }
        let longer = "x".repeat(LONGEST + 1);
        for name in ["", "-a", "_a", ".a", "a.", "a b", "a/b", "..", "con:", "\u{fc}", longer.as_str()] {
            assert!(why_no_name(name).is_some(), "{name}");
        }
    }
}
