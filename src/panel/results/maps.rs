//! The maps that are shown, in the order of the menu.

use std::sync::OnceLock;

use rayon::prelude::*;
use serde::Serialize;

use super::pyramid::{Place, Pyramid, Reduction, levels};
use super::statistics::Statistics;
use crate::panel::PanelError;
use crate::pipeline::OpenedResults;
use crate::results::{ResultFiles, mask_value};
use epirig_core::grid::Grid;
use epirig_matcher::Answer;

/// Answers in the order of their codes in the map `mask`.
pub(super) const ANSWERS: [Answer; 7] = [
    Answer::Found,
    Answer::LeavesImage,
    Answer::BeyondRange,
    Answer::NoTexture,
    Answer::Occluded,
    Answer::Ambiguous,
    Answer::Outside,
];

/// A map that can be looked at.
#[derive(Debug)]
pub(super) struct Shown {
    pub(super) id: &'static str,
    pub(super) title: &'static str,
    pub(super) unit: &'static str,
    colours: &'static str,
    scale: &'static str,
    pyramid: Pyramid,
    statistics: OnceLock<Statistics>,
}

/// All maps.
#[derive(Debug, Default)]
pub(super) struct Maps(Vec<Shown>);

/// A map as the page is told of it.
#[derive(Debug, Serialize)]
pub(super) struct MapFacts<'a> {
    id: &'static str,
    title: &'static str,
    unit: &'static str,
    rows: usize,
    columns: usize,
    levels: usize,
    colours: &'static str,
    scale: &'static str,
    #[serde(flatten)]
    statistics: &'a Statistics,
}

impl Maps {
    /// The maps of `opened`, and those of their surface.
    pub(super) fn of(opened: &OpenedResults, surface: Option<&ResultFiles>) -> Result<Self, PanelError> {
        let OpenedResults { files, disparity, sigma, heights, .. } = opened;
        let size = (disparity.rows(), disparity.columns());
        let mut maps = Self::default();
        // Unpacking takes longest; maps of 20 million pixels are unpacked side by side.
        let (form_removed, (confidence, cost)) = rayon::join(
            || surface.map(|surface| surface.map("height_mm.tiff")).transpose(),
            || rayon::join(|| files.map("confidence.tiff"), || files.map("cost.tiff")),
        );
        if let Some(heights) = heights {
            match form_removed?.flatten() {
                Some(form_removed) => {
                    maps.add("height", "Height after the form", "mm", form_removed, size);
                    maps.add("height-measured", "Height as measured", "mm", heights.height_mm.clone(), size);
                }
                None => maps.add("height", "Height", "mm", heights.height_mm.clone(), size),
            }
            maps.add("height-sigma", "Sigma of the height", "mm", heights.sigma_mm.clone(), size);
        }
        maps.add("disparity", "Disparity", "px", disparity.clone(), size);
        maps.add("sigma", "Sigma of the disparity", "px", sigma.clone(), size);
        let others = [("confidence", "Confidence", confidence?), ("cost", "Cost of the answer", cost?)];
        for (id, title, found) in others {
            found.into_iter().for_each(|found| maps.add(id, title, "", found, size));
        }
        if let Some(mask) = files.grey("mask.png")? {
            maps.add("mask", "Whether there is an answer", "", mask.map(code), size);
        }
        if let Some(used) = surface.map(|surface| surface.grey("used.png")).transpose()?.flatten() {
            let codes = used.map(|value| f32::from(value / 80));
            maps.add("used", "Heights that the step height is made of", "", codes, size);
        }
        Ok(maps)
    }

    /// Adds a map, unless it is of another size: then it belongs to other results.
    fn add(
        &mut self,
        id: &'static str,
        title: &'static str,
        unit: &'static str,
        map: Grid<f32>,
        size: (usize, usize),
    ) {
        if (map.rows(), map.columns()) != size {
            tracing::warn!(map = id, "it has another size than the disparity, and is not shown");
            return;
        }
        let (colours, scale, reduction) = match id {
            "mask" | "used" => ("mask", "linear", Reduction::Nearest),
            "sigma" | "height-sigma" => ("magma", "log", Reduction::Mean),
            "cost" => ("magma", "log", Reduction::Mean),
            _ => ("viridis", "linear", Reduction::Mean),
        };
        let pyramid = Pyramid::new(map, reduction);
        self.0.push(Shown { id, title, unit, colours, scale, pyramid, statistics: OnceLock::new() });
    }

    /// All of them, for the menu.
    pub(super) fn facts(&self) -> Vec<MapFacts<'_>> {
        self.0.par_iter().map(Shown::facts).collect()
    }

    /// The map itself.
    pub(super) fn map(&self, id: &str) -> Option<&Grid<f32>> {
        self.0.iter().find(|map| map.id == id).map(|map| map.pyramid.map())
    }

    /// All maps that have numbers, not codes.
    pub(super) fn numbers(&self) -> impl Iterator<Item = &Shown> {
        self.0.iter().filter(|map| map.colours != "mask")
    }

    /// The values of a tile.
    ///
    /// # Errors
    /// [`PanelError::NotThere`] if there is no such map or tile.
    pub(super) fn tile(&self, id: &str, place: Place) -> Result<Vec<f32>, PanelError> {
        let map = self.0.iter().find(|map| map.id == id);
        let map = map.ok_or_else(|| PanelError::NotThere(format!("there is no map \"{id}\"")))?;
        map.pyramid.tile(place)
    }
}

impl Shown {
    fn facts(&self) -> MapFacts<'_> {
        let map = self.pyramid.map();
        MapFacts {
            id: self.id,
            title: self.title,
            unit: self.unit,
            rows: map.rows(),
            columns: map.columns(),
            levels: levels(map.rows(), map.columns()),
            colours: self.colours,
            scale: self.scale,
            statistics: self.statistics.get_or_init(|| Statistics::of(map)),
        }
    }

    /// The value at a pixel; `None` where it is unknown.
    pub(super) fn value(&self, x: usize, y: usize) -> Option<f64> {
        Some(f64::from(self.pyramid.map().at(x, y))).filter(|value| value.is_finite())
    }
}

/// The code of a grey value of `mask.png`; NaN for one that it never has.
fn code(value: u8) -> f32 {
    let found = ANSWERS.iter().position(|answer| mask_value(*answer) == value);
    found.map_or(f32::NAN, |code| code as f32)
}
