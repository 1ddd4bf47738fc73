//! Two images of one size, the second one interpolated: the shift between them, and how well they agree at
//! it.

use rayon::prelude::*;

use super::spline::{combine_along, combine_rows, gradient_weights, weights};
use epirig_core::grid::Grid;
use epirig_core::spline::cubic::{TAPS, filter_image};

/// Pixels left out at the borders: where a spline is mirrored it depends on where the border is, by
/// 0.27^distance.
pub(super) const BORDER: usize = 4;
/// Width and height of the blocks within which agreement is judged.
const BLOCK: usize = 32;

/// Fewer pixels than in the smallest frame tell nothing.
const LEAST_COUNT: f64 = 64.0;

/// A pair, as the coefficients of splines.
#[derive(Debug)]
pub(super) struct Pair {
    first: Grid<f32>,
    second: Grid<f32>,
    /// 1 for usable pixels, 0 for others; `None` if all are usable.
    weights: Option<[Grid<f32>; 2]>,
}

/// Sums over the pixels that both images show. `a`: first image, `b`: second, looked up at the shift; `g`:
/// gradient of the first along x and y.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    count: f64,
    a: f64,
    b: f64,
    aa: f64,
    ab: f64,
    bb: f64,
    g: [f64; 2],
    ga: [f64; 2],
    gb: [f64; 2],
    gg: [f64; 3],
}

/// How well a pair agrees at a shift.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Agreement {
    /// Correlation within blocks: slower variations, as those of light and lens, do not count.
    pub correlation: f64,
    /// Mean squared difference, once light is fitted.
    pub residual2: f64,
    /// Squared gradients of the first image: xx, xy, yy.
    pub squares: [f64; 3],
    /// Gradients of the first times those of the second: xx, xy, yx, yy. Noise has no part in them.
    pub products: [f64; 4],
}

/// The pixels of the first image that both show, and where they are in the second.
#[derive(Debug, Clone, Copy)]
struct Overlap {
    left: usize,
    width: usize,
    top: usize,
    bottom: usize,
    /// Whole pixels of the shift.
    whole: [isize; 2],
    /// The rest of it, in [0, 1).
    fraction: [f64; 2],
}

impl Pair {
    /// A pair of images (not coefficients) of one shape.
    pub(super) fn new(first: &Grid<f32>, second: &Grid<f32>, weights: Option<[Grid<f32>; 2]>) -> Self {
        let [mut first, mut second] = [first.clone(), second.clone()];
        rayon::join(|| filter_image(&mut first), || filter_image(&mut second));
        Self { first, second, weights }
    }

    /// Columns and rows.
    pub(super) fn size(&self) -> [usize; 2] {
        [self.first.columns(), self.first.rows()]
    }

    /// The overlap, if it is at least half as wide and half as high as the images.
    fn overlap(&self, shift: [f64; 2]) -> Option<Overlap> {
        let whole = shift.map(|pixels| pixels.floor() as isize);
        let range = |size: usize, whole: isize| {
            let start = BORDER as isize - whole.min(0);
            let end = size as isize - BORDER as isize - whole.max(0);
            (end - start >= size as isize / 2).then_some((start as usize, end as usize))
        };
        let [columns, rows] = self.size();
        let ((left, right), (top, bottom)) = (range(columns, whole[0])?, range(rows, whole[1])?);
        let fraction = [shift[0] - whole[0] as f64, shift[1] - whole[1] as f64];
        Some(Overlap { left, width: right - left, top, bottom, whole, fraction })
    }

    /// The sums of the pair at `shift`; `None` if too few pixels are seen by both.
    pub(super) fn sums(&self, shift: [f64; 2]) -> Option<Sums> {
        let overlap = self.overlap(shift)?;
        let of_row = |lines: &mut Lines, y: usize| {
            self.look_up(&overlap, y, lines);
            lines.sums()
        };
        // Added in the order of the rows, so that the result does not depend on how threads share the work.
        let rows: Vec<Sums> = (overlap.top..overlap.bottom)
            .into_par_iter()
            .map_init(|| Lines::new(overlap.width), of_row)
            .collect();
        let mut sums = Sums::default();
        rows.iter().for_each(|row| sums.add(row));
        (sums.count >= LEAST_COUNT).then_some(sums)
    }

    /// How well the pair agrees at `shift`, where it has `sums`.
    pub(super) fn agreement(&self, shift: [f64; 2], sums: &Sums) -> Option<Agreement> {
        let overlap = self.overlap(shift)?;
        let (light, offset) = (sums.light(), (sums.b - sums.light() * sums.a) / sums.count);
        let of_band = |top: usize| {
            let mut band = Band::default();
            let mut lines = Lines::new(overlap.width);
            let mut blocks = vec![Sums::default(); overlap.width.div_ceil(BLOCK)];
            for y in top..(top + BLOCK).min(overlap.bottom) {
                self.look_up(&overlap, y, &mut lines);
                for (block, first) in blocks.iter_mut().zip((0..overlap.width).step_by(BLOCK)) {
                    block.add_values(&lines, first..(first + BLOCK).min(overlap.width));
                }
                self.look_up_gradient(&overlap, y, &mut lines);
                band.add(&lines, light as f32, offset as f32);
            }
            for block in blocks.iter().filter(|block| block.count > 1.0) {
                band.covariances[0] += block.centred(block.a, block.a, block.aa);
                band.covariances[1] += block.centred(block.a, block.b, block.ab);
                band.covariances[2] += block.centred(block.b, block.b, block.bb);
            }
            band
        };
        let tops: Vec<usize> = (overlap.top..overlap.bottom).step_by(BLOCK).collect();
        let bands: Vec<Band> = tops.into_par_iter().map(of_band).collect();
        let mut all = Band::default();
        bands.iter().for_each(|band| all.merge(band));
        let [aa, ab, bb] = all.covariances;
        let spread = (aa * bb).sqrt();
        Some(Agreement {
            correlation: if spread > 0.0 { ab / spread } else { 0.0 },
            residual2: all.squares / sums.count.max(1.0),
            squares: all.gg,
            products: all.products,
        })
    }

    /// Fills in values and the first image's gradients for row `y` of the overlap.
    fn look_up(&self, overlap: &Overlap, y: usize, lines: &mut Lines) {
        let Overlap { left, fraction, width, .. } = *overlap;
        let Lines { wide, a, gradient, b, weight, .. } = lines;
        combine_rows(&self.first, y, left - 1, weights(0.0), wide);
        combine_along(wide, weights(0.0), a);
        combine_along(wide, gradient_weights(0.0), &mut gradient[0]);
        combine_rows(&self.first, y, left - 1, gradient_weights(0.0), wide);
        combine_along(wide, weights(0.0), &mut gradient[1]);
        let (start, row) = overlap.in_second(y);
        combine_rows(&self.second, row, start - 1, weights(fraction[1]), wide);
        combine_along(wide, weights(fraction[0]), b);
        if let Some([of_first, of_second]) = &self.weights {
            // The pixel that is nearest, if the shift lies between two.
            let nearest = fraction.map(|fraction| usize::from(fraction > 0.5));
            let second = &of_second.row(row + nearest[1])[start + nearest[0]..][..width];
            let both = of_first.row(y)[left..][..width].iter().zip(second);
            weight.iter_mut().zip(both).for_each(|(weight, (first, second))| *weight = first * second);
        }
    }

    /// Fills in the second image's gradients for row `y` of the overlap.
    fn look_up_gradient(&self, overlap: &Overlap, y: usize, lines: &mut Lines) {
        let [across, down] = overlap.fraction;
        let (start, row) = overlap.in_second(y);
        let Lines { wide, second_gradient, .. } = lines;
        combine_rows(&self.second, row, start - 1, weights(down), wide);
        combine_along(wide, gradient_weights(across), &mut second_gradient[0]);
        combine_rows(&self.second, row, start - 1, gradient_weights(down), wide);
        combine_along(wide, weights(across), &mut second_gradient[1]);
    }
}

impl Overlap {
    /// Column and row in the second image of the first pixel of row `y`.
    fn in_second(&self, y: usize) -> (usize, usize) {
        (self.left.saturating_add_signed(self.whole[0]), y.saturating_add_signed(self.whole[1]))
    }
}

/// A row of the overlap.
struct Lines {
    wide: Vec<f32>,
    a: Vec<f32>,
    b: Vec<f32>,
    gradient: [Vec<f32>; 2],
    second_gradient: [Vec<f32>; 2],
    weight: Vec<f32>,
}

impl Lines {
    fn new(width: usize) -> Self {
        let line = || vec![0.0; width];
        Self {
            wide: vec![0.0; width + TAPS - 1],
            a: line(),
            b: line(),
            gradient: [line(), line()],
            second_gradient: [line(), line()],
            weight: vec![1.0; width],
        }
    }

    fn sums(&self) -> Sums {
        let mut sums = Sums::default();
        sums.add_values(self, 0..self.a.len());
        let [x, y] = [0, 1].map(|axis| products(&self.gradient[axis], &self.weight));
        sums.g = [dot(&x, &self.weight), dot(&y, &self.weight)];
        sums.ga = [dot(&x, &self.a), dot(&y, &self.a)];
        sums.gb = [dot(&x, &self.b), dot(&y, &self.b)];
        sums.gg = [dot(&x, &self.gradient[0]), dot(&x, &self.gradient[1]), dot(&y, &self.gradient[1])];
        sums
    }
}

fn products(values: &[f32], weights: &[f32]) -> Vec<f32> {
    values.iter().zip(weights).map(|(value, weight)| value * weight).collect()
}

/// Sum of products, in eight parts that a processor adds at once.
fn dot(one: &[f32], other: &[f32]) -> f64 {
    let mut parts = [0.0_f32; 8];
    let (one, other) = (one.chunks_exact(8), other.chunks_exact(8));
    let rest: f32 = one.remainder().iter().zip(other.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in one.zip(other) {
        parts.iter_mut().zip(a).zip(b).for_each(|((part, a), b)| *part += a * b);
    }
    parts.iter().map(|&part| f64::from(part)).sum::<f64>() + f64::from(rest)
}

impl Sums {
    fn add_values(&mut self, lines: &Lines, range: std::ops::Range<usize>) {
        let (a, b, weight) = (&lines.a[range.clone()], &lines.b[range.clone()], &lines.weight[range]);
        let (wa, wb) = (products(a, weight), products(b, weight));
        self.count += dot(weight, weight);
        self.a += dot(&wa, weight);
        self.b += dot(&wb, weight);
        self.aa += dot(&wa, a);
        self.ab += dot(&wa, b);
        self.bb += dot(&wb, b);
    }

    fn add(&mut self, other: &Self) {
        self.count += other.count;
        self.a += other.a;
        self.b += other.b;
        self.aa += other.aa;
        self.ab += other.ab;
        self.bb += other.bb;
        let pairs = self.g.iter_mut().chain(&mut self.ga).chain(&mut self.gb).chain(&mut self.gg);
        let others = other.g.iter().chain(&other.ga).chain(&other.gb).chain(&other.gg);
        pairs.zip(others).for_each(|(sum, more)| *sum += more);
    }

    /// Sum of products about the means.
    fn centred(&self, one: f64, other: f64, product: f64) -> f64 {
        product - one * other / self.count
    }

    /// Correlation of the two images, 0 if one of them shows nothing.
    pub(super) fn correlation(&self) -> f64 {
        let spread = (self.centred(self.a, self.a, self.aa) * self.centred(self.b, self.b, self.bb)).sqrt();
        if spread > 0.0 { self.centred(self.a, self.b, self.ab) / spread } else { 0.0 }
    }

    /// Ratio of the contrasts, second over first. A regression of one on the other would take noise for
    /// weaker light.
    pub(super) fn light(&self) -> f64 {
        let ratio = self.centred(self.b, self.b, self.bb) / self.centred(self.a, self.a, self.aa);
        if ratio.is_finite() && ratio > 0.0 { ratio.sqrt() } else { 1.0 }
    }

    /// The Gauss-Newton step towards the shift at which the images agree, light and offset eliminated; `None`
    /// if they leave a direction open.
    pub(super) fn step(&self) -> Option<[f64; 2]> {
        let aa = self.centred(self.a, self.a, self.aa);
        let regression = self.centred(self.a, self.b, self.ab) / aa;
        let ga = [0, 1].map(|axis| self.centred(self.g[axis], self.a, self.ga[axis]));
        let gb = [0, 1].map(|axis| self.centred(self.g[axis], self.b, self.gb[axis]));
        let gg = |one: usize, other: usize| {
            self.centred(self.g[one], self.g[other], self.gg[one + other]) - ga[one] * ga[other] / aa
        };
        // For equal images the regression is exactly 1, hence the step exactly 0.
        let force = [gb[0] - ga[0] * regression, gb[1] - ga[1] * regression];
        let [xx, xy, yy] = [gg(0, 0), gg(0, 1), gg(1, 1)];
        let determinant = xx * yy - xy * xy;
        if determinant <= f64::EPSILON * (xx + yy).powi(2) || determinant.is_nan() {
            return None;
        }
        let scale = -1.0 / (determinant * self.light());
        Some([scale * (yy * force[0] - xy * force[1]), scale * (xx * force[1] - xy * force[0])])
    }
}

/// The part of the agreement from a band of rows.
#[derive(Debug, Clone, Copy, Default)]
struct Band {
    squares: f64,
    gg: [f64; 3],
    products: [f64; 4],
    covariances: [f64; 3],
}

impl Band {
    fn add(&mut self, lines: &Lines, light: f32, offset: f32) {
        let values = lines.a.iter().zip(&lines.b).zip(&lines.weight);
        let residuals: Vec<f32> = values.map(|((a, b), weight)| (b - light * a - offset) * weight).collect();
        self.squares += dot(&residuals, &residuals);
        let [x, y] = [0, 1].map(|axis| products(&lines.gradient[axis], &lines.weight));
        let [second_x, second_y] = &lines.second_gradient;
        let gg = [dot(&x, &x), dot(&x, &y), dot(&y, &y)];
        let products = [dot(&x, second_x), dot(&x, second_y), dot(&y, second_x), dot(&y, second_y)];
        self.merge(&Self { gg, products, ..Self::default() });
    }

    fn merge(&mut self, other: &Self) {
        self.squares += other.squares;
        let pairs = self.gg.iter_mut().chain(&mut self.products).chain(&mut self.covariances);
        let others = other.gg.iter().chain(&other.products).chain(&other.covariances);
        pairs.zip(others).for_each(|(sum, more)| *sum += more);
    }
}
