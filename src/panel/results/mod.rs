//! The view of a sequence and its results.

mod compare;
mod course;
mod epis;
mod facts;
mod files;
mod frames;
mod line;
mod maps;
mod mesh;
mod pixel;
mod pyramid;
mod row_cost;
mod statistics;
mod surface;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::Value;

use super::PanelError;
use crate::pipeline::{OpenedResults, open_results};
use epirig_data::sequence::Sequence;
use epirig_data::storage::is_there;
use epirig_server::{Query, Refusal, Reply, Site};

use epis::Epis;
use frames::Frames;
use maps::Maps;

/// Name of the usual folder of results.
const RESULTS: &str = "results";

/// A sequence with its results, ready to be looked at.
pub struct ResultsView {
    sequence: Sequence,
    /// Folder of the results.
    folder: PathBuf,
    /// `None` if the sequence has not been matched.
    results: Option<OpenedResults>,
    maps: Maps,
    frames: Frames,
    epis: Arc<Epis>,
}

impl ResultsView {
    /// Opens the sequence in `folder` with its results in `results`; by default those in its folder
    /// `results`, if there are any.
    ///
    /// # Errors
    /// [`PanelError`] if the sequence or the results cannot be read, or do not belong together.
    pub fn open(folder: &Path, results: Option<&Path>) -> Result<Self, PanelError> {
        let sequence = Sequence::open(folder)?;
        sequence.check_records()?;
        let usual = folder.join(RESULTS);
        let there = is_there(&usual.join("match.json")).unwrap_or(false);
        let wanted = results.map(Path::to_owned).or(there.then_some(usual.clone()));
        let opened = wanted.as_deref().map(|folder| open_results(&sequence, folder)).transpose()?;
        let folder = wanted.unwrap_or(usual);
        let maps = opened.as_ref().map_or_else(|| Ok(Maps::default()), |opened| Maps::of(opened, &folder))?;
        let calibration = opened.as_ref().and_then(|opened| opened.calibration.clone());
        let epis = Arc::new(Epis::new(sequence.clone(), calibration.clone()));
        let frames = Frames::new(sequence.clone(), calibration);
        Ok(Self { sequence, folder, results: opened, maps, frames, epis })
    }

    /// Reads the frames in the background, so that EPIs are there at once when they are asked for.
    pub fn read_ahead(&self) {
        let epis = Arc::clone(&self.epis);
        std::thread::spawn(move || epis.read());
    }

    fn results(&self) -> Result<&OpenedResults, PanelError> {
        self.results.as_ref().ok_or_else(|| {
            let folder = self.sequence.folder().display();
            PanelError::NotThere(format!("{folder} has no results; run `epirig match {folder}`"))
        })
    }
}

/// The questions that are answered: a line for each.
impl Site for ResultsView {
    fn get(&self, path: &[&str], query: &Query) -> Result<Reply, Refusal> {
        match path {
            ["about"] => Reply::json(&facts::about(self)),
            ["results"] => Reply::json(&facts::results(self)),
            ["maps", id, level, row, column] => {
                Ok(Reply::numbers(&self.maps.tile(id, pyramid::Place::parse([level, row, column])?)?))
            }
            ["frames", t, level, row, column] => {
                let place = pyramid::Place::parse([level, row, column])?;
                Ok(Reply::numbers(&self.frames.tile(t, query.text("kind"), place)?))
            }
            ["pixel"] => pixel::explain(self, query.value("x")?, query.value("y")?),
            ["row-cost"] => row_cost::row_cost(self, query.value("y")?),
            ["line"] => Reply::json(&line::line(self, query)?),
            ["line.csv"] => Ok(Reply::file("text/csv; charset=utf-8", line::csv(self, query)?)),
            ["trends"] => Reply::json(&surface::trends()),
            ["mesh"] => mesh::mesh(self, query),
            ["compare"] => compare::compare(self, query),
            ["stage"] => Reply::json(&course::course(self)),
            ["calibration"] => Reply::json(&files::calibration(self)),
            ["calibration", name] => files::calibration_picture(self, name),
            ["downloads"] => Reply::json(&files::downloads(self)),
            ["download", name @ ..] => files::download(self, &name.join("/")),
            _ => Err(Refusal::unknown(path)),
        }
    }

    fn post(&self, path: &[&str], asked: &Value) -> Result<Reply, Refusal> {
        match path {
            ["surface"] => Reply::json(&surface::surface(self, asked)?),
            _ => Err(Refusal::unknown(path)),
        }
    }
}
