//! The log of a scan, beside its journal.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::file::LogFile;
use crate::cli::progress::tell;
use epirig_data::sequence::{JOURNAL, refuse_busy, refuse_existing};
use epirig_data::storage::{is_there, open_lines};

/// Name of the log in the folder of the sequence.
const NAME: &str = "log.jsonl";

/// Most bytes that wait for the folder; later lines are lost.
const MOST_WAITING: usize = 1 << 20;

/// Where the lines go.
enum Place {
    Nowhere,
    /// A new scan has no folder until the rig has been started. `None`: its path is unknown too.
    Waiting(Option<PathBuf>, Vec<u8>),
    File(LogFile),
}

static PLACE: Mutex<Place> = Mutex::new(Place::Nowhere);

fn place() -> MutexGuard<'static, Place> {
    PLACE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From now on lines wait until the folder of the scan is known.
pub(super) fn wait_for_folder() {
    *place() = Place::Waiting(None, Vec::new());
}

/// Logs into `folder`: one that does not exist yet, or for a resumed scan, a sequence that no other program
/// writes. Nothing is logged into any other folder.
pub(in crate::cli) fn beside(folder: &Path, resumed: bool) {
    let usable = if resumed { refuse_busy(folder).is_ok() } else { refuse_existing(folder).is_ok() };
    let mut place = place();
    match &mut *place {
        Place::Waiting(known, _) if usable => *known = Some(folder.to_owned()),
        // A program that takes one scan after another has a log for each.
        Place::File(_) if usable => *place = Place::Waiting(Some(folder.to_owned()), Vec::new()),
        place => *place = Place::Nowhere,
    }
}

/// Appends a line to the log.
pub(super) fn put(line: &[u8]) {
    place().take(line);
}

impl Place {
    fn take(&mut self, line: &[u8]) {
        match self {
            Self::Nowhere => {}
            Self::File(file) => file.put(line),
            Self::Waiting(folder, lines) => {
                if lines.len() + line.len() <= MOST_WAITING {
                    lines.extend_from_slice(line);
                }
                let made = |folder: &mut PathBuf| is_there(&folder.join(JOURNAL)).unwrap_or(false);
                if let Some(folder) = folder.take_if(made) {
                    *self = Self::opened(&folder.join(NAME), lines);
                }
            }
        }
    }

    fn opened(path: &Path, lines: &[u8]) -> Self {
        match open_lines(path) {
            Ok(file) => {
                let mut file = LogFile::new(file, path.to_owned());
                file.put(lines);
                Self::File(file)
            }
            Err(error) => {
                tell(&format!("note: {}: the scan continues without a log: {error}", path.display()));
                Self::Nowhere
            }
        }
    }
}
