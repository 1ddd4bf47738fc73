//! Small pictures of sequences, asked for one by one.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{PoisonError, RwLock};

use crate::panel::error::PanelError;
use crate::panel::requests::requests;
use crate::results::encoded_picture;
use crate::series::{SeriesEntry, thumbnail};
use epirig_server::Reply;

requests! {
    /// A picture, as the list of the sequences names it.
    PictureName { picture: String }
}

/// The sequences whose pictures the last list has named, by these names.
///
/// A name is a hash of what the picture is made of. So the browser can keep a picture for good, and no name leads
/// out of the folder.
#[derive(Default)]
pub(in crate::panel) struct Pictures(RwLock<HashMap<String, PathBuf>>);

impl Pictures {
    /// Gives each of the `entries` below `folder` the name of its picture; `None` to one without frames.
    pub(super) fn name_all(&self, folder: &Path, entries: &[SeriesEntry]) -> Vec<Option<String>> {
        let names: Vec<_> = entries.iter().map(name_of).collect();
        let named = names.iter().zip(entries);
        let known = named.filter_map(|(name, entry)| Some((name.clone()?, folder.join(&entry.name))));
        *self.0.write().unwrap_or_else(PoisonError::into_inner) = known.collect();
        names
    }

    /// The picture of this name, as PNG.
    ///
    /// # Errors
    /// [`PanelError::NotThere`] if no sequence has it any more; [`PanelError`] if its files cannot be read.
    pub(in crate::panel) fn picture(&self, name: &str) -> Result<Reply, PanelError> {
        let known = self.0.read().unwrap_or_else(PoisonError::into_inner).get(name).cloned();
        let gone =
            || PanelError::NotThere("this picture is of a former list; look at the list again".to_owned());
        let folder = known.ok_or_else(gone)?;
        let picture = thumbnail(&folder)?.ok_or_else(gone)?;
        Ok(Reply::of("image/png", encoded_picture(&folder, &picture)?).lasting())
    }
}

/// A hash of what tells this picture from others.
fn name_of(entry: &SeriesEntry) -> Option<String> {
    if entry.frames == 0 {
        return None;
    }
    let SeriesEntry { name, created, frames, matched_blake3, depth_mm, .. } = entry;
    // Another surface of the same match has another depth.
    let made_of = format!("{name}\n{created}\n{frames}\n{matched_blake3:?}\n{depth_mm:?}");
    Some(blake3::hash(made_of.as_bytes()).to_hex()[..32].to_owned())
}
