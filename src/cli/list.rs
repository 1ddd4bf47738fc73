//! `epirig list`.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::choice::choice;
use super::csv_table::{csv_table, refuse_both};
use super::{CliError, Talk};
use crate::number::{ascii, moment, plain, with_interval};
use crate::series::{SequenceState, Series, SeriesEntry, SortKey};
use epirig_surface::conformity::Verdict;

/// List the sequences below a folder, with depth and verdict
///
/// How far the work on each has come is told, too. Only records are read, no frames and no maps.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig list
  epirig list tiles --sort depth
  epirig list tiles --verdict fail
  epirig list tiles --csv > tiles.csv

The state is scan, calibrated, matched or measured: what was done last. A line \"problem\" below a
sequence says why something is not told.")]
pub(super) struct List {
    /// Folder to look below
    #[arg(default_value = ".")]
    folder: PathBuf,
    /// Order of the list
    #[arg(long, value_parser = choice::<SortKey>(), default_value_t = SortKey::Begun)]
    sort: SortKey,
    /// Turn the order round
    #[arg(long)]
    reverse: bool,
    /// Only sequences of this state
    #[arg(long, value_parser = choice::<SequenceState>())]
    state: Option<SequenceState>,
    /// Only sequences of this verdict
    #[arg(long, value_parser = choice::<Verdict>())]
    verdict: Option<Verdict>,
    /// Print a table of comma-separated values
    #[arg(long)]
    csv: bool,
}

#[derive(Serialize)]
struct ListOutput<'a> {
    sequences: &'a [SeriesEntry],
    /// Folders that could not be looked into, with the reason.
    closed: &'a [String],
}

impl List {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        refuse_both("list", self.csv, talk)?;
        let mut series = Series::below(&self.folder)?;
        series.sort(self.sort);
        series.keep(self.state, self.verdict);
        if self.reverse {
            series.entries.reverse();
        }
        for closed in &series.closed {
            talk.say(&format!("note: {closed}"));
        }
        if self.csv {
            return talk.print(&csv_table(&series.entries)?);
        }
        let output = ListOutput { sequences: &series.entries, closed: &series.closed };
        talk.result(&output, || match series.entries.is_empty() {
            true => format!("no sequences below {}\n", self.folder.display()),
            false => table(&series.entries),
        })
    }
}

/// A line for each sequence, which fits into 80 columns as long as names do.
fn table(entries: &[SeriesEntry]) -> String {
    let width = entries.iter().map(|entry| entry.name.chars().count()).max().unwrap_or(0).clamp(8, 24);
    let mut text =
        format!("{:<width$}  {:<16} {:<10} {:<22} verdict\n", "sequence", "begun", "state", "depth (95 %)");
    for entry in entries {
        let begun: String = moment(&entry.created).chars().take(16).collect();
        let verdict = entry.verdict.map_or(String::new(), |verdict| verdict.to_string());
        let line =
            format!("{:<width$}  {begun:<16} {:<10} {:<22} {verdict}", entry.name, entry.state, depth(entry));
        text.push_str(line.trim_end());
        text.push('\n');
        text.extend(entry.problem.iter().map(|problem| format!("    problem: {problem}\n")));
    }
    text
}

/// The depth with its interval, the unit once.
fn depth(entry: &SeriesEntry) -> String {
    match (entry.depth_mm, entry.half_width_95_mm) {
        (None, _) => String::new(),
        (Some(depth_mm), None) => plain(depth_mm, "mm"),
        (Some(depth_mm), half_width) => {
            ascii(&with_interval(depth_mm, half_width, "mm").replacen(" mm", "", 1))
        }
    }
}
