//! Tables of comma-separated values.

/// A table with this head; each of `rows` is a line.
pub(crate) fn table(head: &str, rows: impl Iterator<Item = String>) -> String {
    std::iter::once(head.to_owned()).chain(rows).map(|line| line + "\n").collect()
}

/// A number for a table.
pub(crate) fn number(value: f64) -> String {
    if value.is_nan() { "nan".to_owned() } else { value.to_string() }
}
