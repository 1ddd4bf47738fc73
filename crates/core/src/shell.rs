//! Paths and words as a person can paste them into a shell.

use std::path::Path;

/// `path` as a POSIX shell reads it: as it is if it holds nothing that a shell understands otherwise, else in
/// single quotes.
///
/// ```
/// use epirig_core::shell::quoted;
///
/// assert_eq!(quoted("scans/tile-1".as_ref()), "scans/tile-1");
/// assert_eq!(quoted("my scans/tile's".as_ref()), r"'my scans/tile'\''s'");
/// assert_eq!(quoted("-tile".as_ref()), "./-tile");
/// ```
pub fn quoted(path: &Path) -> String {
    let name = path.display().to_string();
    // A leading minus would be an option.
    quoted_word(&if name.starts_with('-') { format!("./{name}") } else { name })
}

/// `word` as a POSIX shell reads it, which may be an option.
///
/// ```
/// use epirig_core::shell::quoted_word;
///
/// assert_eq!(quoted_word("--band"), "--band");
/// assert_eq!(quoted_word("$HOME"), "'$HOME'");
/// ```
pub fn quoted_word(word: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || "_./-+,@%:=".contains(letter);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}
