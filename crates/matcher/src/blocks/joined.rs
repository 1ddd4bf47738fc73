//! The maps of a picture from those of its blocks.

use std::ops::Range;

use crate::light_change::LightChange;
use crate::locking::PixelLocking;
use crate::maps::DisparityMaps;
use crate::validity::Validity;
use epirig_core::grid::Grid;

/// Maps of a picture, of which some blocks have been put in.
#[derive(Debug, Default)]
pub(crate) struct Joined {
    maps: Option<DisparityMaps>,
    /// Pixels that were answered, and rows that were put in.
    answered: usize,
    rows: usize,
}

impl Joined {
    /// Puts `part` in, the maps of these `rows` of a picture that has so many.
    pub(crate) fn put(&mut self, part: DisparityMaps, rows: Range<usize>, rows_of_picture: usize) {
        assert_eq!(part.disparity.rows(), rows.len(), "the part has the rows of its block");
        let answered = part.validity.values().iter().filter(|&&validity| validity == Validity::Found).count();
        let counts = [(self.answered, answered), (self.rows, rows.len())];
        (self.answered, self.rows) = (self.answered + answered, self.rows + rows.len());
        let Some(maps) = &mut self.maps else {
            self.maps =
                Some(if rows.len() == rows_of_picture { part } else { spread(&part, rows, rows_of_picture) });
            return;
        };
        maps.put_rows(rows.start, &part);
        let [answered, rows] = counts.map(|(before, more)| [before, more].map(|count| count as f64));
        maps.locking = of_both(maps.locking, part.locking, |one, other| one.joined(other, answered));
        maps.light = of_both(maps.light, part.light, |one, other| one.joined(other, rows));
    }

    /// The maps.
    ///
    /// # Panics
    /// If nothing was put in.
    pub(crate) fn maps(self) -> DisparityMaps {
        self.maps.expect("a match has a block")
    }
}

fn of_both<T>(one: Option<T>, other: Option<T>, join: impl FnOnce(T, T) -> T) -> Option<T> {
    match (one, other) {
        (Some(one), Some(other)) => Some(join(one, other)),
        (one, other) => one.or(other),
    }
}

/// Maps of the whole picture of which these rows are known.
fn spread(part: &DisparityMaps, rows: Range<usize>, rows_of_picture: usize) -> DisparityMaps {
    let columns = part.disparity.columns();
    let none = || Grid::filled(rows_of_picture, columns, f32::NAN);
    let mut whole = DisparityMaps {
        disparity: none(),
        sigma: none(),
        cost: none(),
        confidence: none(),
        validity: Grid::filled(rows_of_picture, columns, Validity::Outside),
        ..part.without_pixels()
    };
    whole.put_rows(rows.start, part);
    whole
}

impl PixelLocking {
    /// That of two parts, which have so many answered pixels.
    fn joined(self, other: Self, answered: [f64; 2]) -> Self {
        let worse = if other.worst_bias_px.abs() > self.worst_bias_px.abs() { other } else { self };
        let low = |one: (f64, f64), other: (f64, f64)| (one.0.min(other.0), one.1.max(other.1));
        Self {
            share_locked: weighted([self.share_locked, other.share_locked], answered),
            locked_px: of_both(self.locked_px, other.locked_px, low),
            ..worse
        }
    }
}

impl LightChange {
    /// That of two parts, which have so many rows.
    fn joined(self, other: Self, rows: [f64; 2]) -> Self {
        let root_mean_square = |one: f64, other: f64| weighted([one.powi(2), other.powi(2)], rows).sqrt();
        Self {
            frames: root_mean_square(self.frames, other.frames),
            drift_dn: root_mean_square(self.drift_dn, other.drift_dn),
            effect_px: root_mean_square(self.effect_px, other.effect_px),
            significance: weighted([self.significance, other.significance], rows),
        }
    }
}

fn weighted(values: [f64; 2], weights: [f64; 2]) -> f64 {
    let sum = weights[0] + weights[1];
    if sum > 0.0 { (values[0] * weights[0] + values[1] * weights[1]) / sum } else { values[0] }
}
