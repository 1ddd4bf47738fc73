//! A two-dimensional array of values, one for each pixel.

/// Most pixels of an image: 16384 x 16384, more than any sensor has, and few enough that no size of a few of
/// them overflows.
pub const MOST_PIXELS: usize = 1 << 28;

/// Pixels of an image of `rows` x `columns`; `None` for no pixels, or more than [`MOST_PIXELS`]. Sizes from
/// files are checked by this first.
///
/// ```
/// use epirig_core::grid::area;
///
/// assert_eq!(area(480, 640), Some(307_200));
/// assert_eq!(area(0, 640), None);
/// assert_eq!(area(1 << 62, 4), None);
/// ```
pub fn area(rows: usize, columns: usize) -> Option<usize> {
    rows.checked_mul(columns).filter(|pixels| (1..=MOST_PIXELS).contains(pixels))
}

/// Values on a pixel grid, rows x columns, row by row.
///
/// Pixel centres are at integer coordinates, the first at (0, 0); x runs to the right, y down.
///
/// ```
/// use epirig_core::grid::Grid;
///
/// let mut grid = Grid::filled(2, 3, 0.0_f32);
/// grid.row_mut(1)[2] = 5.0;
/// assert_eq!(grid.at(2, 1), 5.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Grid<T> {
    rows: usize,
    columns: usize,
    values: Vec<T>,
}

impl<T: Copy> Grid<T> {
    /// A grid of `rows` x `columns` equal values.
    pub fn filled(rows: usize, columns: usize, value: T) -> Self {
        Self { rows, columns, values: vec![value; rows * columns] }
    }

    /// A grid over existing values, row by row; `None` if their number is not `rows * columns`.
    pub fn from_values(rows: usize, columns: usize, values: Vec<T>) -> Option<Self> {
        (rows.checked_mul(columns) == Some(values.len())).then_some(Self { rows, columns, values })
    }

    /// The value at column `x` of row `y`.
    ///
    /// # Panics
    /// If `x` or `y` lies outside the grid.
    pub fn at(&self, x: usize, y: usize) -> T {
        self.row(y)[x]
    }

    /// The part of the grid in these columns and rows.
    ///
    /// # Panics
    /// If they reach outside the grid.
    pub fn cropped(&self, columns: std::ops::Range<usize>, rows: std::ops::Range<usize>) -> Self {
        let (height, width) = (rows.len(), columns.len());
        let values = rows.flat_map(|y| self.row(y)[columns.clone()].iter().copied()).collect();
        Self { rows: height, columns: width, values }
    }

    /// Puts the rows of `part` in, the first at row `y`.
    ///
    /// # Panics
    /// If they reach outside the grid, or `part` has another number of columns.
    pub fn put_rows(&mut self, y: usize, part: &Self) {
        assert_eq!(self.columns, part.columns);
        let first = y * self.columns;
        self.values[first..first + part.values.len()].copy_from_slice(&part.values);
    }

    /// A grid of the same size whose values are `convert(value)`.
    pub fn map<U: Copy>(&self, convert: impl FnMut(T) -> U) -> Grid<U> {
        Grid {
            rows: self.rows,
            columns: self.columns,
            values: self.values.iter().copied().map(convert).collect(),
        }
    }

    /// A grid of the same size whose values are `combine(value, other value)`.
    ///
    /// # Panics
    /// If `other` has another size.
    pub fn zip_map<U: Copy, V>(&self, other: &Grid<U>, mut combine: impl FnMut(T, U) -> V) -> Grid<V> {
        assert_eq!((self.rows, self.columns), (other.rows, other.columns), "grids differ in size");
        let pairs = self.values.iter().zip(&other.values);
        let values = pairs.map(|(&value, &other)| combine(value, other)).collect();
        Grid { rows: self.rows, columns: self.columns, values }
    }
}

impl<T> Grid<T> {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// All values, row by row.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// All values, row by row.
    pub fn into_values(self) -> Vec<T> {
        self.values
    }

    /// The values as an array of rows x columns.
    ///
    /// # Panics
    /// Never: a grid has as many values as pixels.
    #[cfg(feature = "ndarray")]
    pub fn into_ndarray(self) -> ndarray::Array2<T> {
        let size = (self.rows, self.columns);
        ndarray::Array2::from_shape_vec(size, self.values).expect("a grid has as many values as pixels")
    }

    /// All values, row by row, to be changed in place.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// Row `y`.
    ///
    /// # Panics
    /// If `y` lies outside the grid.
    pub fn row(&self, y: usize) -> &[T] {
        &self.values[y * self.columns..(y + 1) * self.columns]
    }

    /// Row `y`, to be changed in place.
    ///
    /// # Panics
    /// If `y` lies outside the grid.
    pub fn row_mut(&mut self, y: usize) -> &mut [T] {
        &mut self.values[y * self.columns..(y + 1) * self.columns]
    }
}
