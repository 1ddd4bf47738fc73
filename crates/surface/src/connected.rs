//! Connected regions of a field.

use epirig_core::grid::Grid;

/// Neighbours of equal value, by their sides.
#[derive(Debug, Clone)]
pub(crate) struct Part<T> {
    pub(crate) value: T,
    /// Columns and rows.
    pub(crate) pixels: Vec<(usize, usize)>,
}

/// All connected parts of pixels whose value `counts`, from top to bottom by their first pixel.
pub(crate) fn connected<T: Copy + PartialEq>(field: &Grid<T>, counts: impl Fn(T) -> bool) -> Vec<Part<T>> {
    let (rows, columns) = (field.rows(), field.columns());
    let mut seen = field.map(|value| !counts(value));
    let mut found = Vec::new();
    for (first_x, first_y) in (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))) {
        if seen.at(first_x, first_y) {
            continue;
        }
        let value = field.at(first_x, first_y);
        seen.row_mut(first_y)[first_x] = true;
        let mut pixels = vec![(first_x, first_y)];
        let mut next = 0;
        while let Some(&(x, y)) = pixels.get(next) {
            next += 1;
            let beside = [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)];
            for (x, y) in beside.into_iter().filter(|&(x, y)| x < columns && y < rows) {
                if !seen.at(x, y) && field.at(x, y) == value {
                    seen.row_mut(y)[x] = true;
                    pixels.push((x, y));
                }
            }
        }
        found.push(Part { value, pixels });
    }
    found
}
