//! Scans that did not end as complete.

use std::path::Path;

use clap::Args;

use super::verify::refuse_another_rig;
use super::{CliError, Talk};
use crate::profile::Profile;
use crate::results::MatchSummary;
use epirig_core::choice::Choice as _;
use epirig_data::sequence::{ExitStatus, Sequence, SequenceError};

/// Whether wrong positions are accepted.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct AnywayArgument {
    /// Continue although the scan is not closed and the positions of its frames are wrong
    #[arg(long, hide_short_help = true)]
    anyway: bool,
}

/// Reports how the scan of some results ended, if it was not complete.
pub(super) fn tell_results(summary: &MatchSummary, talk: &Talk) {
    if summary.scan_ended != ExitStatus::Complete.name() {
        talk.say(&format!("note: the scan of these results is recorded as {}", summary.scan_ended));
    }
}

impl AnywayArgument {
    /// As it was given before.
    pub(super) fn of(anyway: bool) -> Self {
        Self { anyway }
    }

    pub(super) fn is_given(self) -> bool {
        self.anyway
    }

    /// Opens a sequence. Refuses a scan whose positions are wrong, unless the option accepts them, and one
    /// whose records contradict its rig. Reports the end of a scan that is not complete.
    pub(super) fn open(self, folder: &Path, talk: &Talk) -> Result<Sequence, CliError> {
        let sequence = Sequence::open(folder)?;
        if !self.anyway {
            sequence.check_closed()?;
        }
        sequence.check_records()?;
        // A wrong size in the record shows in a frame, and would look like a wrong lens.
        if let Some(Err(error @ SequenceError::RecordAtFault { .. })) =
            sequence.frames().first().map(|first| sequence.read(first))
        {
            return Err(error.into());
        }
        // A rig recorded by another version may be unreadable, and is not needed here.
        if let Ok(Some(rig)) = Profile::of_sequence(&sequence) {
            refuse_another_rig(&sequence, &rig)?;
        }
        if let Some(words) = sequence.end_in_words() {
            talk.say(&format!("note: {words}"));
        }
        Ok(sequence)
    }
}
