//! Defective pixels: single pixels unlike their neighbours, and the values that replace them.

use epirig_core::statistics::{SIGMA_OF_MEDIAN_4, upper_median};
use serde::{Deserialize, Serialize};

use epirig_core::grid::Grid;

/// Beyond this many robust standard deviations a pixel is an outlier: of ten million pixels with Gaussian
/// noise there is one in fifty images.
const SIGMAS: f64 = 6.0;

/// The kind of a pixel's defect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OutlierKind {
    /// Too bright in the dark.
    Hot,
    /// Too dark in the dark: it does not even have the black level.
    Cold,
    /// Its gain is too high, as flat frames show.
    Sensitive,
    /// Its gain is too low, as flat frames show; down to none.
    Dead,
}

/// A pixel that cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outlier {
    /// Column.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// The kind of defect.
    pub kind: OutlierKind,
}

/// Pixels whose value departs from the median of its up to eight neighbours by more than six robust standard
/// deviations of that departure, and by more than `least`: those that are too high are of the first of the
/// kinds. With `relative`, departures are shares of the median.
pub(super) fn departing(
    image: &Grid<f32>,
    least: f64,
    relative: bool,
    [high, low]: [OutlierKind; 2],
) -> Vec<Outlier> {
    let (rows, columns) = (image.rows(), image.columns());
    let mut departures = Grid::filled(rows, columns, 0.0_f32);
    let mut neighbours = Vec::with_capacity(8);
    for y in 0..rows {
        for x in 0..columns {
            neighbours.clear();
            neighbours.extend(around(x, y, 1, rows, columns).map(|(x, y)| image.at(x, y)));
            let Some(median) = upper_median(&mut neighbours) else { continue };
            let departure = image.at(x, y) - median;
            let unit = if relative { median.max(f32::MIN_POSITIVE) } else { 1.0 };
            departures.row_mut(y)[x] = departure / unit;
        }
    }
    let mut sizes: Vec<f32> = departures.values().iter().map(|departure| departure.abs()).collect();
    let typical = upper_median(&mut sizes).map_or(0.0, f64::from);
    let limit = (SIGMAS * SIGMA_OF_MEDIAN_4 * typical).max(least);
    let all = departures.values().iter().enumerate();
    let far = all.filter(|&(_, &departure)| f64::from(departure.abs()) > limit);
    far.map(|(index, &departure)| {
        let kind = if departure > 0.0 { high } else { low };
        Outlier { x: index % columns, y: index / columns, kind }
    })
    .collect()
}

/// Pixels at a distance of exactly `ring` rows or columns that are in the image.
fn around(
    x: usize,
    y: usize,
    ring: usize,
    rows: usize,
    columns: usize,
) -> impl Iterator<Item = (usize, usize)> {
    let reach = ring as isize;
    let offsets = (-reach..=reach).flat_map(move |down| (-reach..=reach).map(move |right| (right, down)));
    let on_ring = offsets.filter(move |(right, down)| right.abs().max(down.abs()) == reach);
    on_ring.filter_map(move |(right, down)| {
        let (x, y) = (x.checked_add_signed(right)?, y.checked_add_signed(down)?);
        (x < columns && y < rows).then_some((x, y))
    })
}

/// The nearest good neighbours of a pixel: the good ones of the first ring around it that has any, up to
/// `farthest` px away.
pub(crate) fn nearest_good(
    (x, y): (usize, usize),
    (rows, columns): (usize, usize),
    farthest: usize,
    is_good: impl Fn(&(usize, usize)) -> bool,
) -> Option<Vec<(usize, usize)>> {
    let good_on = |ring| around(x, y, ring, rows, columns).filter(&is_good).collect::<Vec<_>>();
    (1..=farthest).map(good_on).find(|good| !good.is_empty())
}

/// Puts the mean of the nearest good neighbours in the place of every pixel in `bad` (column, row; sorted):
/// of the eight around it, or of the next ring, if all of those are bad. An image without a good pixel is
/// left as it is.
pub(super) fn replace(image: &mut Grid<f32>, bad: &[(usize, usize)]) {
    let (rows, columns) = (image.rows(), image.columns());
    let is_good = |place: &(usize, usize)| bad.binary_search(place).is_err();
    let replacement = |&place: &(usize, usize)| {
        let good = nearest_good(place, (rows, columns), rows.max(columns), is_good)?;
        let sum = good.iter().fold(0.0, |sum, &(x, y)| sum + f64::from(image.at(x, y)));
        Some((sum / good.len() as f64) as f32)
    };
    let replaced: Vec<_> = bad.iter().map(replacement).collect();
    for (&(x, y), value) in bad.iter().zip(replaced) {
        if let Some(value) = value {
            image.row_mut(y)[x] = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_pixels_depart_and_ramps_and_edges_do_not() {
        let mut image = Grid::filled(20, 30, 0.0);
        for y in 0..20 {
            for x in 0..30 {
                image.row_mut(y)[x] = 100.0 + 3.0 * x as f32 + if y < 10 { 0.0 } else { 50.0 };
            }
        }
        let kinds = [OutlierKind::Hot, OutlierKind::Cold];
        assert_eq!(departing(&image, 4.0, false, kinds), []);
        image.row_mut(4)[7] += 30.0;
        image.row_mut(0)[0] -= 30.0;
        let cold = Outlier { x: 0, y: 0, kind: OutlierKind::Cold };
        let hot = Outlier { x: 7, y: 4, kind: OutlierKind::Hot };
        assert_eq!(departing(&image, 10.0, false, kinds), [cold, hot]);
        assert_eq!(departing(&image, 0.2, true, kinds).len(), 2);
    }

    #[test]
    fn bad_pixels_get_the_mean_of_good_neighbours() {
        let mut image = Grid::from_values(3, 3, vec![1.0, 2.0, 3.0, 4.0, 99.0, 6.0, 7.0, 8.0, 99.0]).unwrap();
        replace(&mut image, &[(1, 1), (2, 2)]);
        assert!((image.at(1, 1) - 31.0 / 7.0).abs() < 1e-6);
        assert_eq!(image.at(2, 2), 7.0, "the mean of 6 and 8");
        // A cluster: its middle takes the next ring.
        let mut image = Grid::filled(5, 5, 2.0);
        let mut cluster: Vec<(usize, usize)> = (1..4).flat_map(|x| (1..4).map(move |y| (x, y))).collect();
        cluster.sort_unstable();
        cluster.iter().for_each(|&(x, y)| image.row_mut(y)[x] = 99.0);
        replace(&mut image, &cluster);
        assert!(image.values().iter().all(|&value| value == 2.0));
        let mut all_bad = Grid::filled(1, 1, 5.0);
        replace(&mut all_bad, &[(0, 0)]);
        assert_eq!(all_bad.values(), [5.0]);
    }
}
