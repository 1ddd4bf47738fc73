//! The sequences below the folder of the panel.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::pictures::Pictures;
use crate::panel::error::PanelError;
use crate::series::{SequenceState, Series, SeriesEntry};
use epirig_data::sequence::sequences_below;
use epirig_surface::conformity::Verdict;

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct SequenceEntry {
    /// Its folder, as seen from that of the panel.
    name: String,
    /// When it was begun, as in RFC 3339; empty if that cannot be read.
    created: String,
    /// How far the work has come.
    #[cfg_attr(test, ts(as = "crate::panel::page_type_tests::Names<SequenceState>"))]
    state: SequenceState,
    ended: &'static str,
    frames: usize,
    planned: usize,
    can_be_resumed: bool,
    /// Depth of the hollows, or height of the raised parts; `None` if it was not measured.
    depth_mm: Option<f64>,
    /// Half the width of its interval of 95 % coverage; `None` if that is not known.
    half_width_95_mm: Option<f64>,
    /// The verdict about the surface; `None` without limits.
    #[cfg_attr(test, ts(as = "Option<crate::panel::page_type_tests::Names<Verdict>>"))]
    verdict: Option<Verdict>,
    /// Why something is not told, or must not be trusted.
    problem: Option<String>,
    /// Name of its picture: another one when the picture is another one. `None` if there is nothing to show.
    picture: Option<String>,
}

/// The sequences, the newest first. From now on `pictures` knows those in the list.
pub(in crate::panel) fn sequences(
    folder: &Path,
    pictures: &Pictures,
) -> Result<Vec<SequenceEntry>, PanelError> {
    let entries = Series::below(folder)?.entries;
    let names = pictures.name_all(folder, &entries);
    let told = entries.into_iter().zip(names).map(|(entry, picture)| told(entry, picture));
    Ok(told.rev().collect())
}

fn told(entry: SeriesEntry, picture: Option<String>) -> SequenceEntry {
    let SeriesEntry { name, created, state, ended, frames, planned, .. } = entry;
    let SeriesEntry { depth_mm, half_width_95_mm, verdict, can_be_resumed, problem, .. } = entry;
    SequenceEntry {
        name,
        created,
        state,
        ended,
        frames,
        planned,
        can_be_resumed,
        depth_mm,
        half_width_95_mm,
        verdict,
        problem,
        picture,
    }
}

/// The folder of the sequence `name` of the list below `folder`: no other name leads to one.
pub(in crate::panel) fn folder_of(folder: &Path, name: &str) -> Result<PathBuf, PanelError> {
    let found = sequences_below(folder)?.folders.into_iter().find(|known| *known == folder.join(name));
    found.ok_or_else(|| {
        PanelError::NotThere(format!(
            "{} has no sequence \"{name}\"; it may have been moved or renamed: look at the list again",
            folder.display()
        ))
    })
}

/// The name that the list below `folder` has for a sequence; `None` for one that is elsewhere.
pub(in crate::panel) fn name_of(folder: &Path, sequence: &Path) -> Option<String> {
    let inside = sequence.strip_prefix(folder).ok()?;
    Some(inside.to_string_lossy().into_owned()).filter(|name| !name.is_empty())
}
