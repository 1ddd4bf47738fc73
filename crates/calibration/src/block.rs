//! A square of a picture, and how well it correlates with another picture at a place.

use epirig_core::grid::Grid;

/// Least standard deviation of a block with texture, in DN of 8 bit.
const LEAST_CONTRAST_DN: f32 = 1.0;

/// A square of a picture without its mean.
#[derive(Debug)]
pub(crate) struct Block {
    top: usize,
    left: usize,
    side: usize,
    values: Vec<f32>,
    /// Root of the sum of the squares.
    norm: f32,
}

impl Block {
    /// The square of `side` pixels, a multiple of 4, whose first pixel is at (`left`, `top`); `None` if it lies not
    /// inside, or has too little texture.
    pub(crate) fn of(picture: &Grid<f32>, top: usize, left: usize, side: usize) -> Option<Self> {
        if top + side > picture.rows() || left + side > picture.columns() {
            return None;
        }
        let mut values = Vec::with_capacity(side * side);
        (0..side).for_each(|row| values.extend_from_slice(&picture.row(top + row)[left..][..side]));
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        values.iter_mut().for_each(|value| *value -= mean);
        let norm = values.iter().map(|value| value * value).sum::<f32>().sqrt();
        let contrast = norm / side as f32;
        (contrast >= LEAST_CONTRAST_DN).then_some(Self { top, left, side, values, norm })
    }

    /// Its middle: column and row, in px.
    pub(crate) fn middle(&self) -> [f64; 2] {
        [self.left, self.top].map(|first| first as f64 + 0.5 * (self.side as f64 - 1.0))
    }

    /// The correlation with the square that is (x, y) farther in `picture`; `None` beyond its border.
    pub(crate) fn correlation(&self, picture: &Grid<f32>, x: isize, y: isize) -> Option<f32> {
        let top = self.top.checked_add_signed(y)?;
        let left = self.left.checked_add_signed(x)?;
        if top + self.side > picture.rows() || left + self.side > picture.columns() {
            return None;
        }
        let (mut sum, mut squares, mut product) = (0.0_f32, 0.0_f32, 0.0_f32);
        for (row, values) in self.values.chunks_exact(self.side).enumerate() {
            // Sums of lanes, which are added several at a time.
            const LANES: usize = 4;
            let other = &picture.row(top + row)[left..][..self.side];
            let mut lanes = [[0.0_f32; LANES]; 3];
            for (ours, theirs) in values.chunks_exact(LANES).zip(other.chunks_exact(LANES)) {
                for lane in 0..LANES {
                    lanes[0][lane] += theirs[lane];
                    lanes[1][lane] += theirs[lane] * theirs[lane];
                    lanes[2][lane] += ours[lane] * theirs[lane];
                }
            }
            sum += lanes[0].iter().sum::<f32>();
            squares += lanes[1].iter().sum::<f32>();
            product += lanes[2].iter().sum::<f32>();
        }
        let variance = squares - sum * sum / self.values.len() as f32;
        (variance > 0.0).then(|| product / (self.norm * variance.sqrt()))
    }
}
