//! Means and medians over squares around each pixel; unknown values do not count.

use epirig_core::grid::Grid;
use epirig_core::statistics::upper_median;

/// Sums over rectangles in constant time: the sum of all values above and to the left, with a row and a
/// column of zeros before.
struct RunningSums {
    sums: Grid<f64>,
}

impl RunningSums {
    fn new(rows: usize, columns: usize, value: impl Fn(usize) -> f64) -> Self {
        let mut sums = Grid::filled(rows + 1, columns + 1, 0.0);
        for y in 0..rows {
            let mut row_sum = 0.0;
            for x in 0..columns {
                row_sum += value(y * columns + x);
                sums.row_mut(y + 1)[x + 1] = sums.at(x + 1, y) + row_sum;
            }
        }
        Self { sums }
    }

    /// The sum over the square that reaches `reach` px to each side of (x, y), cut at the borders.
    fn around(&self, x: usize, y: usize, reach: usize) -> f64 {
        let (left, top) = (x.saturating_sub(reach), y.saturating_sub(reach));
        let right = (x + reach + 1).min(self.sums.columns() - 1);
        let bottom = (y + reach + 1).min(self.sums.rows() - 1);
        self.sums.at(right, bottom) - self.sums.at(left, bottom) - self.sums.at(right, top)
            + self.sums.at(left, top)
    }
}

/// How many pixels of the square that reaches `reach` px to each side are `chosen`, which has the size of the
/// field.
pub(super) fn count_around(chosen: &Grid<bool>, reach: usize) -> Grid<u32> {
    let values = chosen.values();
    let sums = RunningSums::new(chosen.rows(), chosen.columns(), |index| f64::from(u8::from(values[index])));
    let mut counts = Grid::filled(chosen.rows(), chosen.columns(), 0);
    for y in 0..chosen.rows() {
        for (x, count) in counts.row_mut(y).iter_mut().enumerate() {
            *count = sums.around(x, y, reach).round() as u32;
        }
    }
    counts
}

/// The mean of the known values of the square that reaches `reach` px to each side; NaN stays NaN.
pub(super) fn mean_around(field: &Grid<f32>, reach: usize) -> Grid<f32> {
    if reach == 0 {
        return field.clone();
    }
    let (rows, columns, values) = (field.rows(), field.columns(), field.values());
    let known = |index: usize| !values[index].is_nan();
    let sums =
        RunningSums::new(rows, columns, |index| if known(index) { f64::from(values[index]) } else { 0.0 });
    let counts = RunningSums::new(rows, columns, |index| f64::from(u8::from(known(index))));
    let mut means = field.clone();
    for y in 0..rows {
        for (x, mean) in means.row_mut(y).iter_mut().enumerate().filter(|(_, value)| !value.is_nan()) {
            *mean = (sums.around(x, y, reach) / counts.around(x, y, reach)) as f32;
        }
    }
    means
}

/// The field without isolated values: a value further from the median of the 5 x 5 around it than `limit`
/// becomes NaN. A hollow has neighbours as deep as itself, a wrong answer of the matcher has none.
pub(super) fn without_spikes(field: &Grid<f32>, limit: f32) -> Grid<f32> {
    const REACH: usize = 2;
    let mut clean = field.clone();
    let mut around: Vec<f32> = Vec::with_capacity((2 * REACH + 1).pow(2));
    for y in 0..field.rows() {
        for x in 0..field.columns() {
            let value = field.at(x, y);
            around.clear();
            for row in y.saturating_sub(REACH)..(y + REACH + 1).min(field.rows()) {
                let columns = x.saturating_sub(REACH)..(x + REACH + 1).min(field.columns());
                around.extend(field.row(row)[columns].iter().filter(|value| !value.is_nan()));
            }
            let Some(median) = upper_median(&mut around) else { continue };
            if (value - median).abs() > limit {
                clean.row_mut(y)[x] = f32::NAN;
            }
        }
    }
    clean
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_are_cut_at_borders_and_holes_do_not_count() {
        let nan = f32::NAN;
        let field = Grid::from_values(2, 3, vec![1.0, 2.0, nan, 4.0, 6.0, 8.0]).unwrap();
        let means = mean_around(&field, 1);
        assert_eq!((means.at(0, 0), means.at(1, 0)), (3.25, 4.2));
        assert!(means.at(2, 0).is_nan());
        let counts = count_around(&field.map(|value| value > 3.0), 1);
        assert_eq!((counts.at(0, 0), counts.at(2, 1)), (2, 2));
    }

    #[test]
    fn what_stands_alone_is_left_out_and_a_hollow_stays() {
        let mut field = Grid::filled(20, 20, 0.0_f32);
        field.row_mut(10)[4] = 5.0;
        for y in 2..9 {
            field.row_mut(y)[11..18].fill(-5.0);
        }
        let clean = without_spikes(&field, 1.0);
        assert!(clean.at(4, 10).is_nan());
        // At a corner of the hollow 9 of 25 lie as deep, beside it 12; everywhere else more than half do.
        assert_eq!(clean.values().iter().filter(|value| value.is_nan()).count(), 1 + 4 * 3);
    }
}
