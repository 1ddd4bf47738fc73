//! A map in tiles at several resolutions.

use std::sync::OnceLock;

use super::super::PanelError;
use super::statistics::every;
use epirig_core::grid::Grid;
use epirig_core::image::reduced_known;

/// Side of a tile, in px.
pub(super) const TILE: usize = 256;

/// How pixels of a coarser level are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reduction {
    /// Mean of the known ones of 2 x 2.
    Mean,
    /// The first of 2 x 2: for codes, which have no mean.
    Nearest,
}

/// A tile: its level (0 is the whole resolution), and its row and column in tiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) level: usize,
    pub(super) row: usize,
    pub(super) column: usize,
}

/// Number of levels of an image of `rows` x `columns`: the coarsest fits into one tile.
pub(super) fn levels(rows: usize, columns: usize) -> usize {
    let mut side = rows.max(columns);
    let mut levels = 1;
    while side > TILE {
        side = side.div_ceil(2);
        levels += 1;
    }
    levels
}

/// A map whose coarser levels are made when they are asked for.
#[derive(Debug)]
pub(super) struct Pyramid {
    levels: Vec<OnceLock<Grid<f32>>>,
    reduction: Reduction,
}

impl Pyramid {
    pub(super) fn new(map: Grid<f32>, reduction: Reduction) -> Self {
        let levels: Vec<OnceLock<_>> = vec![OnceLock::new(); levels(map.rows(), map.columns())];
        // It is empty, so this cannot fail.
        let _ = levels[0].set(map);
        Self { levels, reduction }
    }

    /// The map itself.
    pub(super) fn map(&self) -> &Grid<f32> {
        self.level(0)
    }

    fn level(&self, level: usize) -> &Grid<f32> {
        self.levels[level].get_or_init(|| halved(self.level(level.saturating_sub(1)), self.reduction))
    }

    /// The values of a tile, row by row; NaN beyond the edge of the map.
    ///
    /// # Errors
    /// [`PanelError::NotThere`] if there is no such tile.
    pub(super) fn tile(&self, place: Place) -> Result<Vec<f32>, PanelError> {
        let Place { level, row, column } = place;
        let nothing = || PanelError::NotThere(format!("there is no tile {level}/{row}/{column}"));
        if level >= self.levels.len() {
            return Err(nothing());
        }
        let map = self.level(level);
        if row >= map.rows().div_ceil(TILE) || column >= map.columns().div_ceil(TILE) {
            return Err(nothing());
        }
        let (top, left) = (row * TILE, column * TILE);
        let width = TILE.min(map.columns() - left);
        let mut values = vec![f32::NAN; TILE * TILE];
        for (y, target) in (top..map.rows()).zip(values.chunks_exact_mut(TILE)) {
            target[..width].copy_from_slice(&map.row(y)[left..left + width]);
        }
        Ok(values)
    }
}

fn halved(map: &Grid<f32>, reduction: Reduction) -> Grid<f32> {
    match reduction {
        Reduction::Mean => reduced_known(map, 2, 0.0),
        Reduction::Nearest => every(map, 2),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_the_map_and_coarser_levels_are_means() {
        let (rows, columns) = (300, 700);
        let ramp: Vec<f32> = (0..rows * columns).map(|index| (index % columns) as f32).collect();
        let mut map = Grid::from_values(rows, columns, ramp).unwrap();
        map.row_mut(0)[0] = f32::NAN;
        let pyramid = Pyramid::new(map, Reduction::Mean);
        assert_eq!(pyramid.levels.len(), 3);
        let tile = pyramid.tile(Place { level: 0, row: 1, column: 2 }).unwrap();
        assert_eq!(tile[0], 512.0);
        assert_eq!(tile[187], 699.0);
        assert!(tile[188].is_nan() && tile[44 * TILE].is_nan());
        let coarse = pyramid.tile(Place { level: 1, row: 0, column: 0 }).unwrap();
        // Of the first four pixels one is unknown: the mean of 1, 0 and 1.
        assert!((coarse[0] - 2.0 / 3.0).abs() < 1e-6);
        assert_eq!(coarse[5], 10.5);
        for place in [(3, 0, 0), (0, 2, 0), (0, 0, 3), (usize::MAX, 0, 0)] {
            let (level, row, column) = place;
            assert!(pyramid.tile(Place { level, row, column }).is_err(), "{place:?}");
        }
    }

    #[test]
    fn codes_stay_codes() {
        let map = Grid::from_values(2, 600, (0..1200).map(|index| (index % 5) as f32).collect()).unwrap();
        let pyramid = Pyramid::new(map, Reduction::Nearest);
        let coarse = pyramid.tile(Place { level: 1, row: 0, column: 0 }).unwrap();
        assert!(coarse.iter().filter(|value| !value.is_nan()).all(|value| value.fract() == 0.0));
    }
}
