//! Where in the picture corners of a board were seen: a lens is calibrated only there.

/// Parts of the picture from left to right.
pub(in crate::panel) const COLUMNS: usize = 6;
/// Parts of the picture from top to bottom.
pub(in crate::panel) const ROWS: usize = 4;

/// The parts of the picture in which corners were seen.
#[derive(Debug, Clone, Default)]
pub(in crate::panel) struct Coverage([bool; COLUMNS * ROWS]);

impl Coverage {
    /// Adds corners at x and y in a frame of `columns` x `rows` pixels.
    pub(in crate::panel) fn add(&mut self, corners: &[[f64; 2]], columns: usize, rows: usize) {
        let part = |at_px: f64, size: usize, parts: usize| {
            // Casts saturate; a corner on the border belongs to the part beside it.
            ((at_px.max(0.0) / size.max(1) as f64 * parts as f64) as usize).min(parts - 1)
        };
        for &[x, y] in corners {
            self.0[part(y, rows, ROWS) * COLUMNS + part(x, columns, COLUMNS)] = true;
        }
    }

    /// Forgets all.
    pub(in crate::panel) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Whether corners were seen in each part, row by row.
    pub(in crate::panel) fn seen(&self) -> &[bool] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_belong_to_the_part_that_they_lie_in() {
        let mut coverage = Coverage::default();
        coverage.add(&[[0.0, 0.0], [599.9, 399.9], [250.0, 150.0], [-3.0, 1e9]], 600, 400);
        let seen: Vec<usize> = (0..24).filter(|&part| coverage.seen()[part]).collect();
        assert_eq!(seen, [0, COLUMNS + 2, 3 * COLUMNS, 3 * COLUMNS + 5]);
        coverage.clear();
        assert!(coverage.seen().iter().all(|seen| !seen));
    }
}
