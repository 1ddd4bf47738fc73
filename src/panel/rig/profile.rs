//! The profile as a form.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::panel::error::PanelError;
use crate::panel::shared::SharedState;
use crate::profile::{Draft, DraftSection, Findings, Place};
use epirig_data::storage::{RealDisk, is_there, write_whole};

/// The profile in use, key by key.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS), ts(rename = "Profile"))]
pub(in crate::panel) struct ProfileForm {
    source: String,
    file: String,
    sections: Vec<DraftSection>,
    controls: Vec<(String, String)>,
}

pub(in crate::panel) fn profile_form(shared: &SharedState) -> ProfileForm {
    let draft = shared.draft();
    ProfileForm {
        source: shared.source.clone(),
        file: shared.file.display().to_string(),
        sections: draft.sections(),
        controls: draft.controls(),
    }
}

/// A mistake in a value.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct ProfileMistake {
    key: Option<String>,
    pub(in crate::panel) words: String,
}

/// The profile in use with other values; or their mistakes.
pub(in crate::panel) fn change_profile(
    shared: &SharedState,
    values: &BTreeMap<String, String>,
) -> Result<Draft, Vec<ProfileMistake>> {
    let draft = shared.draft().changed(values);
    match draft.profile() {
        Ok(_) => Ok(draft),
        Err(error) => Err(error
            .mistakes
            .into_iter()
            .map(|mistake| ProfileMistake {
                key: match mistake.place {
                    Place::Draft { key } | Place::Override { from: key } => Some(key),
                    Place::Line { .. } | Place::Record => None,
                },
                words: mistake.problem.to_string(),
            })
            .collect()),
    }
}

/// Writes the file of the profile.
///
/// # Errors
/// [`PanelError::Wrong`] if there is one and it is not to be replaced, [`PanelError::Save`].
pub(in crate::panel) fn save_profile(
    shared: &SharedState,
    draft: &Draft,
    overwrite: bool,
) -> Result<(), PanelError> {
    let failed = |source| PanelError::Save { path: shared.file.clone(), source };
    if !overwrite && is_there(&shared.file).map_err(failed)? {
        return Err(PanelError::Wrong(format!("{} exists already", shared.file.display())));
    }
    let text = draft.commented(&Findings::default());
    write_whole(&mut RealDisk, &shared.file, text.as_bytes()).map_err(failed)
}
