//! Where the object is: the outline around the answers.

use super::Validity;
use crate::maps::DisparityMaps;
use epirig_core::grid::Grid;

/// As many answers as this to each of the four sides make a pixel part of the object: a few wrong answers on the
/// background are no object.
const LEAST: usize = 8;

impl DisparityMaps {
    /// The pixels of the object: they are not outside the mask, and answers lie to the left and right of each
    /// in its row, and above and below it in its column. So holes and speckles in the object belong to it, and
    /// the background does not; rows x columns.
    pub fn object(&self) -> Grid<bool> {
        let found = self.validity.map(|validity| validity == Validity::Found);
        let (rows, columns) = (found.rows(), found.columns());
        let mut object = Grid::filled(rows, columns, false);
        let above_and_below: Vec<Option<(usize, usize)>> =
            (0..columns).map(|x| inner((0..rows).map(|y| found.at(x, y)))).collect();
        for y in 0..rows {
            let Some((left, right)) = inner(found.row(y).iter().copied()) else { continue };
            for (x, inside) in object.row_mut(y).iter_mut().enumerate().take(right + 1).skip(left) {
                *inside = self.validity.at(x, y) != Validity::Outside
                    && above_and_below[x].is_some_and(|(top, bottom)| (top..=bottom).contains(&y));
            }
        }
        object
    }
}

/// From the [`LEAST`]th answer to the [`LEAST`]th last; the rim that this takes off is given back.
fn inner(line: impl DoubleEndedIterator<Item = bool> + ExactSizeIterator + Clone) -> Option<(usize, usize)> {
    let last = line.len().checked_sub(1)?;
    let edge = |indices: &mut dyn Iterator<Item = (usize, bool)>| {
        let mut answers = indices.filter(|(_, found)| *found).map(|(index, _)| index);
        let (first, inner) = (answers.next()?, answers.nth(LEAST - 2)?);
        // Where answers are dense, the first ones belong to the object, too.
        Some(if inner - first < 2 * LEAST { first } else { inner })
    };
    let first = edge(&mut line.clone().enumerate())?;
    let from_behind = edge(&mut line.rev().enumerate())?;
    let end = last - from_behind;
    (first <= end).then_some((first, end))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DisparityRange;
    use crate::maps::OrderingUsed;

    fn maps(rows: usize, columns: usize, found: impl Fn(usize, usize) -> bool) -> DisparityMaps {
        let empty = Grid::filled(rows, columns, f32::NAN);
        let mut validity = Grid::filled(rows, columns, Validity::BeyondRange);
        for y in 0..rows {
            for x in (0..columns).filter(|&x| found(x, y)) {
                validity.row_mut(y)[x] = Validity::Found;
            }
        }
        DisparityMaps {
            disparity: empty.clone(),
            sigma: empty.clone(),
            cost: empty.clone(),
            confidence: empty,
            validity,
            reference: 0,
            range: DisparityRange { minimum_px: 0.0, maximum_px: 1.0 },
            range_found: true,
            ordering: OrderingUsed::On,
            locking: None,
            light: None,
        }
    }

    fn pixels(object: &Grid<bool>) -> Vec<(usize, usize)> {
        let inside = |index: &usize| object.values()[*index];
        let place = |index| (index % object.columns(), index / object.columns());
        (0..object.values().len()).filter(inside).map(place).collect()
    }

    /// A square of 40 x 30 px in a frame of 100 x 80.
    fn in_square(x: usize, y: usize) -> bool {
        (30..70).contains(&x) && (20..50).contains(&y)
    }

    #[test]
    fn holes_belong_to_the_object_and_the_background_does_not() {
        let holed =
            maps(80, 100, |x, y| in_square(x, y) && !((40..50).contains(&x) && (30..40).contains(&y)));
        let square: Vec<(usize, usize)> = (20..50).flat_map(|y| (30..70).map(move |x| (x, y))).collect();
        assert_eq!(pixels(&holed.object()), square);
        // Half of its pixels have no answer.
        let speckled = maps(80, 100, |x, y| in_square(x, y) && (x + y) % 2 == 0);
        let found = pixels(&speckled.object());
        assert!(found.len() > 1100 && found.len() <= 1200, "{}", found.len());
    }

    #[test]
    fn a_few_wrong_answers_are_no_object() {
        let wrong = |x: usize, y: usize| x % 25 == 3 && y % 20 == 7;
        let beside = maps(80, 100, |x, y| in_square(x, y) || wrong(x, y));
        assert!(pixels(&beside.object()).iter().all(|&(x, y)| in_square(x, y)));
        assert_eq!(pixels(&maps(80, 100, wrong).object()), []);
        assert_eq!(pixels(&maps(80, 100, |_, _| false).object()), []);
    }

    #[test]
    fn what_is_outside_the_mask_is_no_hole_of_the_object() {
        let mut ring = maps(80, 100, |x, y| in_square(x, y) && !(x == 50 && y == 35));
        ring.validity.row_mut(35)[50] = Validity::Outside;
        assert_eq!(pixels(&ring.object()).len(), 1199);
    }

    #[test]
    fn a_frame_full_of_answers_is_all_object() {
        assert_eq!(pixels(&maps(10, 12, |_, _| true).object()).len(), 120);
    }
}
