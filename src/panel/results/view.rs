//! A sequence with its results, opened once.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use tracing::{debug, warn};

use super::epis::Epis;
use super::frames::Frames;
use super::levelled_maps::LevelledMaps;
use super::maps::Maps;
use crate::calibrate::CALIBRATION;
use crate::memory::available;
use crate::panel::PanelError;
use crate::pipeline::{
    Held, OpenedResults, PipelineError, half_frames, half_heights, halves_need, open_results,
    where_frames_are,
};
use crate::results::{ResultFiles, ResultsKind};
use epirig_core::progress::Silent;
use epirig_core::shell::quoted;
use epirig_data::sequence::Sequence;
use epirig_data::storage::{is_there, read_file};
use epirig_surface::HalfHeights;

/// Name of the usual folder of results.
pub(super) const RESULTS: &str = "results";
/// The answers of `epirig surface` in a folder of results.
pub(super) const SURFACE: &str = "surface/surface.json";

/// A sequence with its results, ready to be looked at.
pub(super) struct ResultsView {
    pub(super) sequence: Sequence,
    /// Folder of the results.
    pub(super) folder: PathBuf,
    /// What tells these results from others.
    pub(super) id: String,
    /// `None` if the sequence has not been matched, or its results are not those of its frames.
    pub(super) results: Option<OpenedResults>,
    /// Their surface; `None` if it has not been measured, or cannot be shown.
    pub(super) surface: Option<ResultFiles>,
    /// What exists and is not shown, and why: results that do not fit the sequence, or their surface.
    pub(super) unfit: Option<String>,
    pub(super) maps: Maps,
    pub(super) levelled: LevelledMaps,
    pub(super) frames: Frames,
    pub(super) epis: Arc<Epis>,
    /// Heights by halves of the frames, from the first question about a step height on.
    halves: OnceLock<Option<[HalfHeights; 2]>>,
}

impl ResultsView {
    /// Opens the sequence in `folder` with its results in `results`; by default those in its folder
    /// `results`, if there are any. If those do not fit the sequence any more, its frames are shown all the same; and
    /// a match is shown whatever is wrong with its surface.
    pub(super) fn open(folder: &Path, results: Option<&Path>) -> Result<Self, PanelError> {
        // Of files that change meanwhile the new ones are read, and found to be others with the next question.
        let id = Self::id_of(folder, results);
        let sequence = Sequence::open(folder)?;
        sequence.check_records()?;
        let usual = folder.join(RESULTS);
        let there = is_there(&usual.join(ResultsKind::Match.summary())).unwrap_or(false);
        let wanted = results.map(Path::to_owned).or(there.then_some(usual.clone()));
        let opened = wanted.as_deref().map(|folder| open_results(&sequence, folder)).transpose();
        let (opened, unfit) = match opened {
            Err(PipelineError::Mismatch(mismatch)) if results.is_none() => {
                (None, Some(format!("only the frames are shown: {mismatch}")))
            }
            opened => (opened?, None),
        };
        let folder = wanted.unwrap_or(usual);
        let shown = opened.as_ref().map(maps_and_surface).transpose()?;
        let (maps, surface, without_surface) = shown.unwrap_or_default();
        let unfit = unfit.or(without_surface);
        if let Some(unfit) = &unfit {
            warn!(sequence = %quoted(sequence.folder()), "{unfit}");
        }
        let calibration = opened.as_ref().and_then(|opened| opened.calibration.clone());
        let epis = Arc::new(Epis::new(sequence.clone(), calibration.clone()));
        let frames = Frames::new(sequence.clone(), calibration);
        Ok(Self {
            sequence,
            folder,
            id,
            results: opened,
            unfit,
            surface,
            maps,
            levelled: LevelledMaps::default(),
            frames,
            epis,
            halves: OnceLock::new(),
        })
    }

    /// What tells the results on disk from others: a hash of their place and of the records that are written with
    /// them.
    pub(super) fn id_of(folder: &Path, results: Option<&Path>) -> String {
        /// Of a record; a larger one cannot be opened.
        const LARGEST: u64 = 64 << 20;
        let usual = folder.join(RESULTS);
        let results = results.unwrap_or(&usual);
        let mut hash = blake3::Hasher::new();
        hash.update(folder.as_os_str().as_encoded_bytes());
        for path in
            [results.join(ResultsKind::Match.summary()), results.join(SURFACE), folder.join(CALIBRATION)]
        {
            let bytes = read_file(&path, LARGEST).unwrap_or_default();
            hash.update(blake3::hash(&bytes).as_bytes());
        }
        hash.finalize().to_hex()[..16].to_owned()
    }

    /// Reads the frames in the background.
    pub(super) fn read_ahead(&self) {
        let epis = Arc::clone(&self.epis);
        if let Err(error) = std::thread::Builder::new().spawn(move || epis.read()) {
            debug!(%error, "EPIs are read when they are asked for");
        }
    }

    /// Heights by halves of the frames; `None` if the frames cannot be read or divided, or there is too little
    /// memory to match them.
    pub(super) fn halves(&self) -> Option<&[HalfHeights; 2]> {
        let found = || {
            let results = self.results.as_ref()?;
            let options = results.matched.options();
            let held = where_frames_are(&self.sequence, results.calibration.as_ref(), &options, &Silent);
            let need =
                halves_need(half_frames(&self.sequence, results), &options, held.unwrap_or(Held::InMemory));
            if available().is_some_and(|available| need > available.bytes) {
                warn!(need, "depths are measured without halves of the frames: too little memory");
                return None;
            }
            half_heights(&self.sequence, results, &Silent).unwrap_or_else(|error| {
                warn!(%error, "depths are measured without halves of the frames");
                None
            })
        };
        self.halves.get_or_init(found).as_ref()
    }

    /// The results.
    ///
    /// # Errors
    /// [`PanelError::NotThere`] if there are none.
    pub(super) fn results(&self) -> Result<&OpenedResults, PanelError> {
        self.results.as_ref().ok_or_else(|| {
            if let Some(reason) = &self.unfit {
                return PanelError::NotThere(reason.clone());
            }
            let folder = quoted(self.sequence.folder());
            PanelError::NotThere(format!("{folder} has no results; run `epirig match {folder}`"))
        })
    }
}

/// The maps of a match with those of its surface, and the surface; without it if it cannot be shown, and why not.
type MapsAndSurface = (Maps, Option<ResultFiles>, Option<String>);

fn maps_and_surface(opened: &OpenedResults) -> Result<MapsAndSurface, PanelError> {
    let both = || -> Result<MapsAndSurface, PanelError> {
        let surface = opened.files.surface()?;
        Ok((Maps::of(opened, surface.as_ref())?, surface, None))
    };
    both().or_else(|error| {
        // If the match alone can be shown, the surface is at fault.
        Ok((Maps::of(opened, None)?, None, Some(format!("the surface is not shown: {error}"))))
    })
}
