//! A printed chess-board with soft edges, whose corners have exactly known places.
//!
//! Sharp edges would alias, because a picture is made of three samples per pixel. So an edge is the integral
//! of a Gaussian, which is odd about the edge: the saddle of reflectance lies where two lines of the board
//! cross.

/// Reflectance of white paper.
pub(super) const WHITE: f64 = 0.9;
/// Reflectance of black squares.
pub(super) const BLACK: f64 = 0.1;
/// Standard deviation of an edge, in px of the image. At 2.5 cycles per pixel, which three samples per pixel
/// fold onto the finest that a picture holds, exp(-2 (pi 0.45 2.5)^2) = 1e-11 of it is left.
pub(super) const SOFTNESS_PX: f64 = 0.45;
/// An edge may be at most this share of a square wide, so that at the middle of a square, where one edge ends
/// and the next one begins, 7e-6 of it is left.
const SOFTEST: f64 = 1.0 / 9.0;

/// A chess-board; its middle is the origin, the square at least u and v is black.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chess {
    square_mm: f64,
    columns: usize,
    rows: usize,
    softness_mm: f64,
}

impl Chess {
    /// A board of `columns` x `rows` squares whose edges have standard deviation `softness_mm`, less if
    /// squares are small.
    pub(super) fn new(square_mm: f64, columns: usize, rows: usize, softness_mm: f64) -> Self {
        Self { square_mm, columns, rows, softness_mm: softness_mm.min(SOFTEST * square_mm) }
    }

    /// Standard deviation of an edge, in mm.
    pub(super) fn softness_mm(&self) -> f64 {
        self.softness_mm
    }

    /// Reflectance at a place of the board or of the white paper around it.
    pub(super) fn reflectance(&self, u: f64, v: f64) -> f64 {
        let on_board = self.within(u, self.columns) * self.within(v, self.rows);
        let black = 0.5 * (1.0 + self.wave(u, self.columns) * self.wave(v, self.rows));
        WHITE - (WHITE - BLACK) * black * on_board
    }

    /// The inner corners with the squares that end there: (column, row, u, v), row by row.
    pub(super) fn corners(self) -> impl Iterator<Item = (usize, usize, f64, f64)> {
        (0..self.rows - 1).flat_map(move |row| {
            (0..self.columns - 1).map(move |column| {
                (column, row, self.edge(column + 1, self.columns), self.edge(row + 1, self.rows))
            })
        })
    }

    /// Place of edge `index` of `squares` squares, whose outer edges are 0 and `squares`.
    fn edge(&self, index: usize, squares: usize) -> f64 {
        (index as f64 - 0.5 * squares as f64) * self.square_mm
    }

    /// 1 in the first, third, ... square, -1 in the others; the outermost squares never end.
    fn wave(&self, place: f64, squares: usize) -> f64 {
        let nearest = (place / self.square_mm + 0.5 * squares as f64 + 0.5).floor();
        let index = nearest.clamp(1.0, squares as f64 - 1.0) as usize;
        let beyond = 2.0 * step(place - self.edge(index, squares), self.softness_mm) - 1.0;
        if index % 2 == 1 { -beyond } else { beyond }
    }

    /// 1 between the outer edges, 0 beyond.
    fn within(&self, place: f64, squares: usize) -> f64 {
        step(self.edge(squares, squares) - place.abs(), self.softness_mm)
    }
}

/// At this many standard deviations from an edge 1e-18 of it is left, which rounding loses beside 1.
const FAR: f64 = 8.7;

/// A soft step from 0 to 1: the integral of a Gaussian, to 1e-7 (Abramowitz and Stegun, Handbook of
/// Mathematical Functions, 7.1.26).
pub(super) fn step(beyond: f64, sigma: f64) -> f64 {
    if beyond.abs() > FAR * sigma {
        return f64::from(u8::from(beyond > 0.0));
    }
    let z = beyond.abs() / (std::f64::consts::SQRT_2 * sigma);
    let t = 1.0 / (1.0 + 0.327_591_1 * z);
    let series = t
        * (0.254_829_592
            + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    let tail = 0.5 * series * (-z * z).exp();
    if beyond < 0.0 { tail } else { 1.0 - tail }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_is_the_integral_of_a_gaussian() {
        // From tables of the normal distribution.
        for (z, expected) in
            [(0.0, 0.5), (1.0, 0.841_344_7), (-2.0, 0.022_750_1), (4.0, 0.999_968_3), (40.0, 1.0)]
        {
            assert!((step(3.0 * z, 3.0) - expected).abs() < 2e-7, "{z}");
        }
    }

    #[test]
    fn squares_alternate_from_black_and_paper_is_white() {
        let chess = Chess::new(10.0, 4, 3, 0.5);
        for column in 0..4 {
            for row in 0..3 {
                let (u, v) = (f64::from(column) * 10.0 - 15.0, f64::from(row) * 10.0 - 10.0);
                let expected = if (column + row) % 2 == 0 { 0.1 } else { 0.9 };
                assert!((chess.reflectance(u, v) - expected).abs() < 1e-6, "{column} {row}");
            }
        }
        for (u, v) in [(-25.0, -10.0), (25.0, 10.0), (-15.0, -20.0), (100.0, 0.0), (0.0, 1e6)] {
            assert!((chess.reflectance(u, v) - 0.9).abs() < 1e-6, "({u}, {v})");
        }
        // Half-way up an outer edge of a black square.
        assert!((chess.reflectance(-20.0, -10.0) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn corners_are_where_the_board_is_odd() {
        let chess = Chess::new(10.0, 4, 3, 0.5);
        let corners: Vec<_> = chess.corners().collect();
        assert_eq!(corners.len(), 6);
        assert_eq!(corners[0], (0, 0, -10.0, -5.0));
        assert_eq!(corners[5], (2, 1, 10.0, 5.0));
        for (_, _, u, v) in corners {
            for (du, dv) in [(0.3, 0.2), (0.7, -0.1), (-2.0, 1.0)] {
                let (here, across) = (chess.reflectance(u + du, v + dv), chess.reflectance(u - du, v + dv));
                assert!((here + across - 1.0).abs() < 1e-6, "{here} {across}");
            }
        }
    }
}
