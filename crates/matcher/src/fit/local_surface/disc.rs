//! Discs of pixels around the middle of 2 x 2 pixels, and the strips into which directions cut
//! them.

/// The four pixels that a disc is centred on, by column and row from its middle.
pub(super) const INNER: [(f32, f32); 4] = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)];

/// A pixel of a disc.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    /// Columns and rows from the upper left one of the four inner pixels.
    pub(super) column: isize,
    pub(super) row: isize,
    /// Place from the middle of the disc, in px.
    pub(super) x: f32,
    pub(super) y: f32,
}

impl Point {
    fn new(column: isize, row: isize) -> Self {
        Self { column, row, x: column as f32 - 0.5, y: row as f32 - 0.5 }
    }

    pub(super) fn distance(self) -> f32 {
        self.x.hypot(self.y)
    }
}

/// The pixels of a disc of this squared radius in px^2, row by row.
pub(super) fn points(squared_radius: usize) -> Vec<Point> {
    let radius = (squared_radius as f32).sqrt();
    let reach = radius.ceil() as isize;
    let square = (-reach..=reach).flat_map(|row| (-reach..=reach).map(move |column| Point::new(column, row)));
    square.filter(|point| point.distance() <= radius).collect()
}

/// Lines of neighbouring directions lie about this far apart at the rim of a disc, in px.
const RIM_PX: f32 = 0.7;
/// Directions that are tried first: rows, columns and both diagonals.
pub(super) const FEWEST: usize = 4;

/// A direction across parallel lines, and the strips of 1 px between these.
#[derive(Debug)]
pub(super) struct Direction {
    /// Indices of the points, strip after strip.
    pub(super) points: Vec<u16>,
    /// Where each strip ends among them.
    pub(super) ends: Vec<u16>,
    /// How far the middle of the first strip lies from that of the disc, in px.
    pub(super) first: f32,
    /// How far each inner pixel lies from the middle along the direction, in px.
    pub(super) inner: [f32; 4],
}

/// The directions of the disc of these `points`, from that of the columns on: [`FEWEST`] times a
/// power of two.
pub(super) fn directions(points: &[Point]) -> Vec<Direction> {
    let farthest = points.iter().map(|point| point.distance()).fold(0.0, f32::max);
    let wanted = std::f32::consts::PI * farthest / RIM_PX;
    let count = FEWEST << (wanted / FEWEST as f32).log2().round().max(0.0) as usize;
    (0..count).map(|index| direction(points, index as f64 * std::f64::consts::PI / count as f64)).collect()
}

fn direction(points: &[Point], angle: f64) -> Direction {
    let (sine, cosine) = angle.sin_cos();
    let along = |x: f32, y: f32| cosine * f64::from(x) + sine * f64::from(y);
    let places: Vec<f64> = points.iter().map(|point| along(point.x, point.y)).collect();
    // Strips have an edge or their middle in the middle of the disc: whichever cuts no pixel's
    // middle.
    let nearest_edge = |phase: f64| {
        places
            .iter()
            .map(|place| (place - phase - (place - phase).round()).abs())
            .fold(f64::INFINITY, f64::min)
    };
    let phase = if nearest_edge(0.0) > nearest_edge(0.5) { 0.0 } else { 0.5 };
    let strips: Vec<isize> = places.iter().map(|place| (place - phase).floor() as isize).collect();
    let first = strips.iter().copied().min().unwrap_or(0);
    let last = strips.iter().copied().max().unwrap_or(0);
    let (mut order, mut ends) = (Vec::with_capacity(points.len()), Vec::new());
    for number in first..=last {
        let inside = strips.iter().enumerate().filter(|(_, strip)| **strip == number);
        order.extend(inside.map(|(index, _)| index as u16));
        ends.push(order.len() as u16);
    }
    let first = (first as f64 + phase + 0.5) as f32;
    Direction { points: order, ends, first, inner: INNER.map(|(x, y)| along(x, y) as f32) }
}
