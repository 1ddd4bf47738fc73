//! The maps that are shown, in the order of the menu.

use std::sync::OnceLock;

use rayon::prelude::*;
use serde::Serialize;

use super::pyramid::{Place, Pyramid, Reduction, levels};
use super::statistics::Statistics;
use crate::panel::PanelError;
use crate::pipeline::OpenedResults;
use crate::results::{Class, Look, MapRow, ResultFiles, ResultMap};
use epirig_core::choice::Choice as _;
use epirig_core::grid::Grid;
use epirig_data::formats::Quantity;

/// A map that can be looked at.
#[derive(Debug)]
pub(super) struct Shown {
    pub(super) id: &'static str,
    pub(super) row: MapRow,
    classes: Vec<MapClass>,
    pyramid: Pyramid,
    statistics: OnceLock<Statistics>,
}

/// All maps.
#[derive(Debug, Default)]
pub(super) struct Maps(Vec<Shown>);

/// A map as the page is told of it.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct MapInfo<'a> {
    id: &'static str,
    title: &'static str,
    unit: &'static str,
    rows: usize,
    columns: usize,
    levels: usize,
    #[cfg_attr(test, ts(type = "'viridis' | 'magma' | 'vik' | 'mask'"))]
    colours: &'static str,
    #[cfg_attr(test, ts(type = "'linear' | 'log'"))]
    scale: &'static str,
    /// What the values 0, 1, ... stand for; empty for quantities.
    classes: &'a [MapClass],
    #[serde(flatten)]
    statistics: &'a Statistics,
}

/// A class of pixels as the page is told of it.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct MapClass {
    name: &'static str,
    /// Its share of all pixels.
    share: f64,
}

impl Maps {
    /// The maps of `opened`, and those of their surface.
    pub(super) fn of(opened: &OpenedResults, surface: Option<&ResultFiles>) -> Result<Self, PanelError> {
        let mut maps: Vec<ResultMap> = ResultMap::ALL.to_vec();
        // It has no value that the measured heights do not have.
        maps.retain(|map| *map != ResultMap::HeightUsed);
        // Heights without the form come first, then the other heights.
        maps.sort_by_key(|map| {
            (*map != ResultMap::HeightWithoutForm, map.row().quantity != Quantity::LengthMm)
        });
        // Unpacking takes longest; maps of 20 million pixels are unpacked side by side.
        let found = maps.par_iter().map(|&map| Ok((map, opened.map(map, surface)?)));
        let found: Vec<_> = found.collect::<Result<_, PanelError>>()?;
        let found: Vec<_> = found.into_iter().filter_map(|(map, values)| Some((map, values?))).collect();
        let has_form_removed = found.iter().any(|(map, _)| *map == ResultMap::HeightWithoutForm);
        let mut maps = Self::default();
        for (map, values) in found {
            // The heights that count are "height", whether or not a form was removed from them.
            let id = match map {
                ResultMap::HeightWithoutForm => ResultMap::Height.row().id,
                ResultMap::Height if has_form_removed => "height-measured",
                _ => map.row().id,
            };
            maps.add(id, map.row(), values);
        }
        Ok(maps)
    }

    fn add(&mut self, id: &'static str, row: MapRow, map: Grid<f32>) {
        let share = |class: &Class| {
            let pixels = map.values().iter().filter(|&&value| value == f32::from(class.value));
            MapClass { name: class.name, share: pixels.count() as f64 / map.values().len().max(1) as f64 }
        };
        let classes: Vec<_> = row.classes().iter().map(share).collect();
        let pyramid = match row.classes() {
            [] => Pyramid::new(map, Reduction::Mean),
            known => Pyramid::new(map.map(|value| place_in(known, value)), Reduction::Nearest),
        };
        self.0.push(Shown { id, row, classes, pyramid, statistics: OnceLock::new() });
    }

    /// All of them, for the menu.
    pub(super) fn facts(&self) -> Vec<MapInfo<'_>> {
        self.0.par_iter().map(Shown::facts).collect()
    }

    /// What is known of the map.
    pub(super) fn shown(&self, id: &str) -> Option<&Shown> {
        self.0.iter().find(|map| map.id == id)
    }

    /// The map itself.
    pub(super) fn map(&self, id: &str) -> Option<&Grid<f32>> {
        self.shown(id).map(|map| map.pyramid.map())
    }

    /// All maps that have numbers, not classes.
    pub(super) fn numbers(&self) -> impl Iterator<Item = &Shown> {
        self.0.iter().filter(|map| map.row.classes().is_empty())
    }

    /// The values of a tile.
    pub(super) fn tile(&self, id: &str, place: Place) -> Result<Vec<f32>, PanelError> {
        let map = self.shown(id).ok_or_else(|| PanelError::NotThere(format!("there is no map \"{id}\"")))?;
        map.pyramid.tile(place)
    }
}

impl Shown {
    fn facts(&self) -> MapInfo<'_> {
        let map = self.pyramid.map();
        let (colours, scale) = match self.row.look {
            Look::Plain | Look::Relief => ("viridis", "linear"),
            Look::Decades => ("magma", "log"),
            Look::Difference => ("vik", "linear"),
            Look::Classes(_) => ("mask", "linear"),
        };
        MapInfo {
            id: self.id,
            title: self.row.title,
            unit: self.row.unit(),
            rows: map.rows(),
            columns: map.columns(),
            levels: levels(map.rows(), map.columns()),
            colours,
            scale,
            classes: &self.classes,
            statistics: self.statistics.get_or_init(|| Statistics::of(map)),
        }
    }

    /// The value at a pixel; `None` where it is unknown.
    pub(super) fn value(&self, x: usize, y: usize) -> Option<f64> {
        Some(f64::from(self.pyramid.map().at(x, y))).filter(|value| value.is_finite())
    }
}

/// The place of a grey value among the classes; NaN for one that none has.
fn place_in(classes: &[Class], value: f32) -> f32 {
    let found = classes.iter().position(|class| f32::from(class.value) == value);
    found.map_or(f32::NAN, |place| place as f32)
}
