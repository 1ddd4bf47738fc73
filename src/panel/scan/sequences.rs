//! The sequences in the folder of the panel.

use std::path::PathBuf;

use serde::Serialize;

use crate::panel::error::PanelError;
use crate::panel::shared::SharedState;
use crate::results::{read_surface_facts, results_beside};
use epirig_data::sequence::{ExitStatus, Origin, Sequence, sequences_in};
use epirig_surface::conformity::Verdict;

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct SequenceEntry {
    name: String,
    created: String,
    frames: usize,
    planned: usize,
    ended: &'static str,
    can_be_resumed: bool,
    measured: bool,
    /// The depth that `epirig surface` found, with its 95 % interval, in ASCII.
    depth: Option<String>,
    /// The verdict about the surface; `None` without limits.
    #[cfg_attr(test, ts(as = "Option<crate::panel::page_type_tests::Names<Verdict>>"))]
    verdict: Option<Verdict>,
}

/// The sequences, the newest first. One whose records cannot be read is left out.
pub(in crate::panel) fn sequences(shared: &SharedState) -> Vec<SequenceEntry> {
    let opened = sequences_in(&shared.folder)
        .into_iter()
        .filter_map(|name| Some((Sequence::open(&shared.folder.join(&name)).ok()?, name)));
    let mut entries: Vec<SequenceEntry> = opened.map(|(sequence, name)| entry(&sequence, name)).collect();
    entries.sort_by(|one, other| other.created.cmp(&one.created));
    entries
}

fn entry(sequence: &Sequence, name: String) -> SequenceEntry {
    let record = sequence.record();
    let ended = sequence.stop().map(|stop| stop.exit_status);
    let surface = read_surface_facts(&sequence.folder().join("results/surface")).ok();
    let conclusion = surface.map(|facts| facts.conclusion);
    let was_captured = matches!(record.origin, Origin::Captured { .. });
    SequenceEntry {
        created: record.created.clone(),
        frames: sequence.frames().len(),
        planned: record.frames,
        ended: sequence.ended(),
        can_be_resumed: was_captured && !matches!(ended, Some(ExitStatus::Complete | ExitStatus::NotClosed)),
        verdict: conclusion.as_ref().and_then(|conclusion| conclusion.verdict),
        depth: conclusion.and_then(|conclusion| conclusion.depth),
        measured: results_beside(sequence.folder()).iter().any(|results| results == "results"),
        name,
    }
}

/// The folder of the sequence `name`; only a folder directly in that of the panel is one.
pub(in crate::panel) fn folder_of(shared: &SharedState, name: &str) -> Result<PathBuf, PanelError> {
    if sequences_in(&shared.folder).iter().any(|known| known == name) {
        return Ok(shared.folder.join(name));
    }
    Err(PanelError::NotThere(format!("{} has no sequence \"{name}\"", shared.folder.display())))
}
