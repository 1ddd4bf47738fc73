//! What repeated scans of one object tell of a rig.

use std::path::Path;

use serde::Serialize;

use super::{Measure, SequenceState, Series, Trend, Trends};
use crate::pipeline::{PipelineError, open_results};
use crate::results::ResultMap;
use epirig_core::grid::Grid;
use epirig_core::progress::Progress;
use epirig_core::statistics::root_mean_square;
use epirig_data::sequence::Sequence;
use epirig_surface::{MeasurementNoise, NoiseOfPair, Repeatability};

/// What repeated scans of one object tell of a rig.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Characteristics {
    /// Names of the sequences whose heights were compared, in the order in which they were begun.
    pub sequences: Vec<String>,
    /// Noise of the heights; `None` if no two successive maps have enough common pixels.
    pub noise: Option<MeasurementNoise>,
    /// How every quantity repeats that records have.
    pub quantities: Vec<RepeatedQuantity>,
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

/// Heights of a scan, and their standard uncertainties.
struct Measured {
    height_mm: Grid<f32>,
    sigma_mm: Grid<f32>,
}

impl Characteristics {
    /// Of the sequences of the series below `folder` whose surface was measured. Results of two of them are in memory at
    /// once.
    ///
    /// # Errors
    /// [`PipelineError`] if results cannot be read, do not belong to their sequence, or are damaged; or if the work was
    /// cancelled.
    pub fn of(folder: &Path, series: &Series, progress: &dyn Progress) -> Result<Self, PipelineError> {
        let mut series = series.clone();
        series.keep(Some(SequenceState::Measured), None);
        progress.begin("comparing heights", series.entries.len() as u64);
        let mut pairs = Vec::new();
        let mut before: Option<Measured> = None;
        for entry in &series.entries {
            progress.unless_cancelled()?;
            let measured = Measured::of(&folder.join(&entry.name))?;
            let both = before.as_ref().zip(measured.as_ref());
            pairs.extend(both.and_then(|(before, measured)| before.noise_with(measured)));
            before = measured;
            progress.advance(1);
        }
        progress.end();
        let sequences = series.entries.iter().map(|entry| entry.name.clone()).collect();
        let found = Trends::of(folder, &series, None);
        let quantities = found.trends.iter().filter_map(RepeatedQuantity::of).collect();
        Ok(Self { sequences, noise: MeasurementNoise::of(&pairs), quantities, problems: found.problems })
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
    fn of(trend: &Trend) -> Option<Self> {
        let values: Vec<f64> = trend.values.iter().map(|value| value.value).collect();
        let sigmas: Option<Vec<f64>> = trend.values.iter().map(|value| value.scatter).collect();
        Some(Self {
            measure: trend.measure,
            unit: trend.unit,
            repeatability: Repeatability::of(&values)?,
            claimed: sigmas.map(|sigmas| root_mean_square(&sigmas)),
        })
    }

    /// How often values that scatter as claimed scatter as much as these, or more.
    pub fn probability(&self) -> Option<f64> {
        self.claimed
            .filter(|claimed| *claimed > 0.0)
            .map(|claimed| self.repeatability.probability_beyond(claimed))
    }
}
