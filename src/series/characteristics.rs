//! What repeated scans of one object tell of a rig.

use std::path::Path;

use serde::Serialize;

use super::{Measure, SequenceState, Series, Standard, Trend, Trends};
use crate::pipeline::{PipelineError, open_results};
use crate::results::ResultMap;
use epirig_core::grid::Grid;
use epirig_core::progress::Progress;
use epirig_core::statistics::root_mean_square;
use epirig_data::sequence::Sequence;
use epirig_surface::{MeasurementNoise, NoiseOfPair, Repeatability, Response};

/// What repeated scans of one object tell of a rig.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Characteristics {
    /// Names of the sequences whose heights were compared, in the order in which they were begun.
    pub sequences: Vec<String>,
    /// Noise of the heights; `None` if no two successive maps have enough common pixels.
    pub noise: Option<MeasurementNoise>,
    /// How every quantity repeats that records have.
    pub quantities: Vec<RepeatedQuantity>,
    /// How the depths follow the known ones of standards; `None` if none is known, or none of them was measured.
    pub response: Option<Response>,
    /// What could not be read of these sequences.
    pub problems: Vec<String>,
}

/// How a quantity repeats.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RepeatedQuantity {
    /// The quantity.
    pub measure: Measure,
    /// Its unit; empty for a share.
    pub unit: &'static str,
    /// Its values.
    pub repeatability: Repeatability,
    /// The scatter that the scans claim themselves, each for its own value: root mean square of the standard uncertainties
    /// of all scans; `None` if one does not know it.
    pub claimed: Option<f64>,
}

/// A quantity in two series of scans.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ChangedQuantity {
    /// The quantity.
    pub measure: Measure,
    /// Its unit; empty for a share.
    pub unit: &'static str,
    /// The earlier mean.
    pub earlier_mean: f64,
    /// The mean now.
    pub mean: f64,
    /// How often means of the same process differ as much as that; 0 to 1.
    pub mean_by_chance: f64,
    /// The earlier repeatability standard deviation.
    pub earlier_deviation: f64,
    /// The repeatability standard deviation now.
    pub deviation: f64,
    /// How often deviations of the same process differ by that factor; 0 to 1.
    pub deviation_by_chance: f64,
}

/// Heights of a scan, and their standard uncertainties.
struct Measured {
    height_mm: Grid<f32>,
    sigma_mm: Grid<f32>,
}

impl Characteristics {
    /// Of the sequences of the series below `folder` whose surface was measured; some of them, or all, are scans of
    /// `standards`. Results of two of them are in memory at once.
    ///
    /// # Errors
    /// [`PipelineError`] if results cannot be read, do not belong to their sequence, or are damaged; or if the work was
    /// cancelled.
    pub fn of(
        folder: &Path,
        series: &Series,
        standards: &[Standard],
        progress: &dyn Progress,
    ) -> Result<Self, PipelineError> {
        let mut series = series.clone();
        series.keep(Some(SequenceState::Measured), None);
        progress.begin("comparing heights", series.entries.len() as u64);
        let mut pairs = Vec::new();
        // Scans of one object after those of another.
        let object = |name: &str| Standard::of_sequence(standards, name);
        let mut by_object = series.entries.clone();
        by_object.sort_by_key(|entry| object(&entry.name));
        let mut before: Option<(Option<usize>, Measured)> = None;
        for entry in &by_object {
            progress.unless_cancelled()?;
            let own = object(&entry.name);
            let measured = Measured::of(&folder.join(&entry.name))?;
            let same = before.as_ref().filter(|(other, _)| *other == own).map(|(_, before)| before);
            pairs.extend(
                same.zip(measured.as_ref()).and_then(|(before, measured)| before.noise_with(measured)),
            );
            before = measured.map(|measured| (own, measured));
            progress.advance(1);
        }
        progress.end();
        let sequences = series.entries.iter().map(|entry| entry.name.clone()).collect();
        let found = Trends::of(folder, &series, None);
        let quantities = RepeatedQuantity::all(&found, standards);
        let steps = Standard::steps(standards, &series.entries);
        let mut problems = found.problems;
        let unmeasured = standards.iter().zip(&steps).filter(|(_, step)| step.measured_mm.is_empty());
        problems.extend(
            unmeasured.map(|(standard, _)| format!("no depth was measured of the standard {standard}")),
        );
        let (noise, response) = (MeasurementNoise::of(&pairs), Response::of(&steps));
        Ok(Self { sequences, noise, quantities, response, problems })
    }
}

impl Measured {
    /// Of the usual results of a sequence; `None` without heights.
    fn of(folder: &Path) -> Result<Option<Self>, PipelineError> {
        let opened = open_results(&Sequence::open(folder)?, &folder.join("results"))?;
        let surface = opened.files.surface()?;
        let height_mm = opened.map(ResultMap::HeightWithoutForm, surface.as_ref())?;
        let sigma_mm = opened.map(ResultMap::HeightSigma, None)?;
        Ok(height_mm.zip(sigma_mm).map(|(height_mm, sigma_mm)| Self { height_mm, sigma_mm }))
    }

    fn noise_with(&self, next: &Self) -> Option<NoiseOfPair> {
        NoiseOfPair::of([&self.height_mm, &next.height_mm], [&self.sigma_mm, &next.sigma_mm])
    }
}

impl RepeatedQuantity {
    /// Of the measured sequences of a series of one object, from their records alone; and what could not be read of them.
    pub fn of_series(folder: &Path, series: &Series) -> (Vec<Self>, Vec<String>) {
        let mut series = series.clone();
        series.keep(Some(SequenceState::Measured), None);
        let found = Trends::of(folder, &series, None);
        (Self::all(&found, &[]), found.problems)
    }

    fn all(found: &Trends, standards: &[Standard]) -> Vec<Self> {
        found.trends.iter().filter_map(|trend| Self::of(trend, standards)).collect()
    }

    /// Each standard, and what is none, scatters about its own mean.
    fn of(trend: &Trend, standards: &[Standard]) -> Option<Self> {
        let mut objects = vec![Vec::new(); standards.len() + 1];
        for value in &trend.values {
            let object = Standard::of_sequence(standards, &value.sequence).unwrap_or(standards.len());
            objects[object].push(value.value);
        }
        let sigmas: Option<Vec<f64>> = trend.values.iter().map(|value| value.scatter).collect();
        Some(Self {
            measure: trend.measure,
            unit: trend.unit,
            repeatability: Repeatability::of_objects(&objects)?,
            claimed: sigmas.map(|sigmas| root_mean_square(&sigmas)),
        })
    }

    /// What differs from the same quantity in `earlier` scans; `None` if both have no scatter to compare with.
    pub fn compared_with(&self, earlier: &Self) -> Option<ChangedQuantity> {
        let (now, before) = (&self.repeatability, &earlier.repeatability);
        Some(ChangedQuantity {
            measure: self.measure,
            unit: self.unit,
            earlier_mean: before.mean?,
            mean: now.mean?,
            mean_by_chance: now.probability_of_mean(before)?,
            earlier_deviation: before.deviation,
            deviation: now.deviation,
            deviation_by_chance: now.probability_of_scatter(before)?,
        })
    }

    /// How often values that scatter as claimed scatter as much as these, or more.
    pub fn probability(&self) -> Option<f64> {
        self.claimed
            .filter(|claimed| *claimed > 0.0)
            .map(|claimed| self.repeatability.probability_beyond(claimed))
    }
}
