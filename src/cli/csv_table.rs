//! A table of comma-separated values on stdout.

use serde::Serialize;

use super::{CliError, Talk};

/// Refuses `--csv` together with `--json`; `what` is printed.
pub(super) fn refuse_both(what: &str, csv: bool, talk: &Talk) -> Result<(), CliError> {
    match csv && talk.wants_json() {
        true => Err(CliError::usage(format!(
            "the {what} is printed as CSV or as JSON; give one of --csv and --json"
        ))),
        false => Ok(()),
    }
}

/// The rows as a table, with the names of their fields as its head.
pub(super) fn csv_table(rows: impl IntoIterator<Item = impl Serialize>) -> Result<String, CliError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(CliError::output)?;
    }
    let bytes = writer.into_inner().map_err(CliError::output)?;
    String::from_utf8(bytes).map_err(CliError::output)
}
