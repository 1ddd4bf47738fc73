//! Connected regions of a level, and the pixels of them that lie clear of the walls.

use super::super::connected::{Part, connected};
use super::super::smooth::count_around;
use epirig_core::grid::Grid;

/// On which level a pixel lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Level {
    Unknown,
    Upper,
    Lower,
}

impl Level {
    pub(super) fn other(self) -> Self {
        match self {
            Self::Unknown => Self::Unknown,
            Self::Upper => Self::Lower,
            Self::Lower => Self::Upper,
        }
    }
}

/// Number of pixels on a level.
pub(super) fn count(levels: &Grid<Level>, wanted: Level) -> usize {
    levels.values().iter().filter(|&&level| level == wanted).count()
}

/// Connected pixels of one level.
pub(super) type Region = Part<Level>;

/// All connected parts, from top to bottom by their first pixel.
pub(super) fn regions(levels: &Grid<Level>) -> Vec<Region> {
    connected(levels, |level| level != Level::Unknown)
}

/// Gives parts of fewer than `least_area_px` pixels to the other level: they are noise, not hollows.
pub(super) fn without_small_parts(levels: &mut Grid<Level>, least_area_px: usize) {
    for region in regions(levels).into_iter().filter(|region| region.pixels.len() < least_area_px) {
        for (x, y) in region.pixels {
            levels.row_mut(y)[x] = region.value.other();
        }
    }
}

/// The levels without the pixels that have one of the other level in the square that reaches `margin_px` to
/// each side.
pub(super) fn clear_of_walls(levels: &Grid<Level>, margin_px: usize) -> Grid<Level> {
    let around = |level: Level| count_around(&levels.map(|here| here == level), margin_px);
    let (upper, lower) = (around(Level::Upper), around(Level::Lower));
    let mut clear = levels.clone();
    for ((level, &upper), &lower) in clear.values_mut().iter_mut().zip(upper.values()).zip(lower.values()) {
        let others = if *level == Level::Upper { lower } else { upper };
        if others > 0 {
            *level = Level::Unknown;
        }
    }
    clear
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(lines: &[&str]) -> Grid<Level> {
        let level = |letter| match letter {
            '#' => Level::Lower,
            '.' => Level::Upper,
            _ => Level::Unknown,
        };
        let values = lines.iter().flat_map(|line| line.chars().map(level)).collect();
        Grid::from_values(lines.len(), lines[0].len(), values).unwrap()
    }

    #[test]
    fn parts_hang_together_by_their_sides() {
        let levels = picture(&["##.#", "#..#", "? #."]);
        let found: Vec<(Level, usize)> =
            regions(&levels).iter().map(|region| (region.value, region.pixels.len())).collect();
        let (lower, upper) = (Level::Lower, Level::Upper);
        assert_eq!(found, [(lower, 3), (upper, 3), (lower, 2), (lower, 1), (upper, 1)]);
    }

    #[test]
    fn small_parts_go_and_walls_are_left_out() {
        let mut levels = picture(&["......", ".#....", "....##", "....##", "....##"]);
        without_small_parts(&mut levels, 2);
        assert_eq!(levels, picture(&["......", "......", "....##", "....##", "....##"]));
        assert_eq!(clear_of_walls(&levels, 1), picture(&["......", "...   ", "...   ", "...  #", "...  #"]));
    }
}
