//! One corner to a few thousandths of a pixel: a least-squares fit of two blurred edges that cross.
//!
//! The model is I = (1 + hx x + hy y) (a + b f) with the pattern f of two edges, +1 and -1 in turn, under a
//! Gaussian blur: centre c, two directions, blur s, mean a, half the step b, and light that grows along a
//! direction. Light is a factor, because the step grows with it as the mean does. For edges at right angles f
//! is the product of erf(z1 / sqrt(2)) and erf(z2 / sqrt(2)), where z is the distance from an edge over s.
//! Otherwise it is the mean product of the signs of two normal variables with means z1, z2 and the
//! correlation of the edges' normals; its derivative by the correlation is four times their joint density
//! at 0. Truth and model both look the same after half a turn about the centre, so what is left out (the square
//! pixel, ink that has spread) hardly moves it. Nine unknowns, by the method of Levenberg and Marquardt; the
//! standard deviation is that of the fit's covariance, with the noise that the residuals show.

use std::f64::consts::{FRAC_2_SQRT_PI, PI, SQRT_2};

use nalgebra::{SMatrix, SVector};

use epirig_core::grid::Grid;

const UNKNOWNS: usize = 9;
/// The first of those that are levels: mean, half step, growth of light.
const LEVELS: usize = 5;
/// Steps, at most; five are usual.
const STEPS: usize = 30;
/// A step that moves the centre by less than this ends the fit, in px: a hundredth of the best standard
/// deviation.
const FINE_PX: f64 = 1e-5;
/// Variance by rounding to whole DN, in squared DN.
const ROUNDING_DN2: f64 = 1.0 / 12.0;
/// A fit is given up after this number of steps if its residual is this many times [`MOST_UNEXPLAINED`]: one
/// step more than corners usually take in all, while texture may take all [`STEPS`].
const GIVEN_UP: (usize, f64) = (6, 4.0);
/// Beyond this many blurs an edge is 1 to six digits.
const FAR: f64 = 5.0;
/// Blur of a start and of the sharpest edge that pixels can show, in px: that of a square pixel alone is
/// sqrt(1/12) = 0.29.
const START_BLUR_PX: f64 = 0.8;
const LEAST_BLUR_PX: f64 = 0.2;
/// Edges that meet at less than this, in rad (15 deg), are those of no board that can be read.
const LEAST_ANGLE_RAD: f64 = 0.26;
/// Largest share of the pattern's variance that the model may leave: noise of a fifth of the half step. Where
/// three squares of one colour and one of the other meet (at the border of a board) half is left; texture
/// leaves some hundredths and more.
const MOST_UNEXPLAINED: f64 = 0.04;
/// A window counts if this share of it is in the image.
const LEAST_SHARE: f64 = 0.75;

/// A corner of a chess-board in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Column of the centre, in px.
    pub x_px: f64,
    /// Row of the centre, in px.
    pub y_px: f64,
    /// Standard deviation of either coordinate, in px: root mean square of the two, from the fit's residuals.
    pub sigma_px: f64,
    /// Half the step from black to white, in DN, at the centre.
    pub contrast_dn: f64,
    /// Standard deviation of the Gaussian that blurs the edges, in px, with the pixel's own width in it.
    pub blur_px: f64,
}

/// A corner before the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeCross {
    /// Column, to about a quarter of the radius, in px.
    pub x_px: f64,
    /// Row, likewise, in px.
    pub y_px: f64,
    /// Direction of the edge after which, towards growing angles (from x to y), a bright square follows, in
    /// rad.
    pub before_bright_rad: f64,
    /// Direction of the edge after which a dark square follows, in rad; between it and the first lies the
    /// bright square.
    pub before_dark_rad: f64,
}

/// The pixels of a window, about its middle.
struct Window {
    middle: (f64, f64),
    pixels: Vec<(f64, f64, f64)>,
}

impl Window {
    fn new(image: &Grid<f32>, x: f64, y: f64, radius_px: f64) -> Option<Self> {
        let middle = (x.round(), y.round());
        let reach = radius_px.floor() as i64;
        let mut pixels = Vec::with_capacity((4 * (reach + 1) * (reach + 1)) as usize);
        let mut wanted = 0;
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                if (dx * dx + dy * dy) as f64 > radius_px * radius_px {
                    continue;
                }
                wanted += 1;
                let (column, row) = (middle.0 as i64 + dx, middle.1 as i64 + dy);
                let inside = |value: i64, size: usize| usize::try_from(value).ok().filter(|&v| v < size);
                if let (Some(column), Some(row)) =
                    (inside(column, image.columns()), inside(row, image.rows()))
                {
                    pixels.push((dx as f64, dy as f64, f64::from(image.at(column, row))));
                }
            }
        }
        let enough = pixels.len() as f64 >= LEAST_SHARE * f64::from(wanted) && pixels.len() > 2 * UNKNOWNS;
        enough.then_some(Self { middle, pixels })
    }
}

/// x, y (about the middle), two directions, blur, mean, half step, growth of light along x and y.
type Unknowns = SVector<f64, UNKNOWNS>;

/// Sum of squared residuals, the normal matrix and the right side.
struct Normal {
    squares: f64,
    matrix: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    side: Unknowns,
}

/// erf(u / (sqrt(2) s)) and its derivative by u. Abramowitz and Stegun 7.1.26, whose error is below 1.5e-7.
fn edge(u: f64, blur: f64) -> (f64, f64) {
    if u.abs() > FAR * blur {
        return (u.signum(), 0.0);
    }
    let z = u.abs() / (SQRT_2 * blur);
    let t = 1.0 / (1.0 + 0.327_591_1 * z);
    let gauss = (-z * z).exp();
    let polynomial = t
        * (0.254_829_592
            + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    ((1.0 - polynomial * gauss).copysign(u), FRAC_2_SQRT_PI * gauss / (SQRT_2 * blur))
}

/// Joint density at (z1, z2) of two standard normal variables with this correlation, times 4.
fn joint(z1: f64, z2: f64, correlation: f64) -> f64 {
    let rest = 1.0 - correlation * correlation;
    let exponent = -0.5 * (z1 * z1 - 2.0 * correlation * z1 * z2 + z2 * z2) / rest;
    2.0 * exponent.exp() / (PI * rest.sqrt())
}

/// The effect of correlation on the product of both edges: the integral of [`joint`] from no correlation on,
/// by Gauss and Legendre's rule of five points, or of three where the edges are within 17 deg of a right
/// angle.
fn beyond_product(z1: f64, z2: f64, correlation: f64) -> f64 {
    const FEW: [(f64, f64); 3] =
        [(0.112_701_665, 0.277_777_778), (0.5, 0.444_444_444), (0.887_298_335, 0.277_777_778)];
    const MANY: [(f64, f64); 5] = [
        (0.046_910_077, 0.118_463_443),
        (0.230_765_345, 0.239_314_335),
        (0.5, 0.284_444_444),
        (0.769_234_655, 0.239_314_335),
        (0.953_089_923, 0.118_463_443),
    ];
    let nodes: &[(f64, f64)] = if correlation.abs() < 0.3 { &FEW } else { &MANY };
    correlation * nodes.iter().map(|(node, weight)| weight * joint(z1, z2, node * correlation)).sum::<f64>()
}

/// Adds one pixel to the upper half of the normal matrix and to the right side; its derivatives by unknowns
/// before `FIRST` are 0.
fn add<const FIRST: usize>(
    upper: &mut [[f64; UNKNOWNS]; UNKNOWNS],
    side: &mut [f64; UNKNOWNS],
    row: &[f64; UNKNOWNS],
    residual: f64,
) {
    for i in FIRST..UNKNOWNS {
        side[i] += row[i] * residual;
        for j in i..UNKNOWNS {
            upper[i][j] += row[i] * row[j];
        }
    }
}

fn normal(window: &Window, at: &Unknowns) -> Normal {
    let [x, y, one, two, blur, mean, step, light_x, light_y] = at.data.0[0];
    let ((sin1, cos1), (sin2, cos2)) = (one.sin_cos(), two.sin_cos());
    // Of the normals: the cosine of the angle between the edges.
    let correlation = cos1 * cos2 + sin1 * sin2;
    let by_angle = sin2 * cos1 - cos2 * sin1;
    let uncorrelated = (1.0 - correlation * correlation).sqrt().max(f64::MIN_POSITIVE);
    let mut squares = 0.0;
    let mut upper = [[0.0_f64; UNKNOWNS]; UNKNOWNS];
    let mut side = [0.0_f64; UNKNOWNS];
    for &(px, py, value) in &window.pixels {
        let (qx, qy) = (px - x, py - y);
        let (u1, u2) = (qy * cos1 - qx * sin1, qy * cos2 - qx * sin2);
        let ((e1, d1), (e2, d2)) = (edge(u1, blur), edge(u2, blur));
        let light = 1.0 + light_x * px + light_y * py;
        let (z1, z2) = (u1 / blur, u2 / blur);
        let near = d1 > 0.0 && d2 > 0.0;
        let cross = e1 * e2 + if near { beyond_product(z1, z2, correlation) } else { 0.0 };
        let pattern = mean + step * cross;
        let residual = value - light * pattern;
        squares += residual * residual;
        let scale = light * step;
        let by_u1 = if d1 > 0.0 { scale * d1 * edge(z2 - correlation * z1, uncorrelated).0 } else { 0.0 };
        let by_u2 = if d2 > 0.0 { scale * d2 * edge(z1 - correlation * z2, uncorrelated).0 } else { 0.0 };
        let by_turn = if near { scale * joint(z1, z2, correlation) * by_angle } else { 0.0 };
        let row = [
            by_u1 * sin1 + by_u2 * sin2,
            -by_u1 * cos1 - by_u2 * cos2,
            by_turn - by_u1 * (qx * cos1 + qy * sin1),
            -by_turn - by_u2 * (qx * cos2 + qy * sin2),
            -(by_u1 * u1 + by_u2 * u2) / blur,
            light,
            light * cross,
            px * pattern,
            py * pattern,
        ];
        // Far from both edges only the levels depend on the parameters: ten of 45 products.
        if d1 > 0.0 || d2 > 0.0 {
            add::<0>(&mut upper, &mut side, &row, residual);
        } else {
            add::<LEVELS>(&mut upper, &mut side, &row, residual);
        }
    }
    let matrix = SMatrix::from_fn(|i, j| if i <= j { upper[i][j] } else { upper[j][i] });
    Normal { squares, matrix, side: Unknowns::from(side) }
}

fn possible(at: &Unknowns, window: &Window, radius_px: f64) -> bool {
    at.iter().all(|value| value.is_finite())
        && at[0].hypot(at[1]) < radius_px
        && (LEAST_BLUR_PX..radius_px).contains(&at[4])
        && (at[7].abs() + at[8].abs()) * radius_px < 1.0
        && !window.pixels.is_empty()
}

/// The fit in one window; the unknowns and their covariance, with rounding as the least noise.
fn fit(
    window: &Window,
    start: Unknowns,
    radius_px: f64,
) -> Option<(Unknowns, SMatrix<f64, UNKNOWNS, UNKNOWNS>, f64)> {
    let mut at = start;
    let mut here = normal(window, &at);
    let mut damping = 1e-3;
    let count = window.pixels.len() as f64;
    for taken in 0..STEPS {
        if taken >= GIVEN_UP.0 && here.squares > GIVEN_UP.1 * MOST_UNEXPLAINED * at[6] * at[6] * count {
            return None;
        }
        let mut damped = here.matrix;
        for k in 0..UNKNOWNS {
            damped[(k, k)] *= 1.0 + damping;
        }
        let step = damped.cholesky()?.solve(&here.side);
        let next = at + step;
        let there = possible(&next, window, radius_px).then(|| normal(window, &next));
        match there {
            Some(there) if there.squares <= here.squares => {
                (at, here) = (next, there);
                damping *= 0.1;
                if step[0].hypot(step[1]) < FINE_PX {
                    break;
                }
            }
            _ => {
                // A step that is not significant and improves nothing: this is the minimum.
                if step[0].hypot(step[1]) < FINE_PX {
                    break;
                }
                damping = damping.max(1e-6) * 10.0;
                if damping > 1e6 {
                    return None;
                }
            }
        }
    }
    let freedom = (window.pixels.len() - UNKNOWNS) as f64;
    let variance = (here.squares / freedom).max(ROUNDING_DN2);
    Some((at, here.matrix.cholesky()?.inverse() * variance, variance))
}

/// The corner at a cross of edges, from the pixels within `radius_px` of it (3 to 14 px are sensible, and
/// less than half of a square).
///
/// `None` if the window leaves the image by more than a quarter, or the pixels show no such cross within it.
///
/// ```
/// use epirig_core::grid::Grid;
/// use epirig_calibration::target::{EdgeCross, refine_corner};
///
/// // Four squares with soft edges that meet between the pixels, at (7.5, 7.5).
/// let side = |place: usize| (place as f32 - 7.5).tanh();
/// let squares = (0..256).map(|i| 125.0 + 75.0 * side(i % 16) * side(i / 16)).collect();
/// let image = Grid::from_values(16, 16, squares).unwrap();
/// let start = EdgeCross { x_px: 7.0, y_px: 8.0, before_bright_rad: 0.0, before_dark_rad: std::f64::consts::FRAC_PI_2 };
/// let corner = refine_corner(&image, &start, 6.0).unwrap();
/// assert!((corner.x_px - 7.5).abs() < 0.01 && (corner.y_px - 7.5).abs() < 0.01, "{corner:?}");
/// ```
pub fn refine_corner(image: &Grid<f32>, start: &EdgeCross, radius_px: f64) -> Option<Corner> {
    let mut window = Window::new(image, start.x_px, start.y_px, radius_px)?;
    let count = window.pixels.len() as f64;
    let mean = window.pixels.iter().map(|pixel| pixel.2).sum::<f64>() / count;
    let spread = (window.pixels.iter().map(|pixel| (pixel.2 - mean).powi(2)).sum::<f64>() / count).sqrt();
    let mut at = Unknowns::from([
        start.x_px - window.middle.0,
        start.y_px - window.middle.1,
        start.before_bright_rad,
        start.before_bright_rad + (start.before_dark_rad - start.before_bright_rad).rem_euclid(PI),
        START_BLUR_PX,
        mean,
        -spread,
        0.0,
        0.0,
    ]);
    let mut fitted = fit(&window, at, radius_px)?;
    // The window is to lie about the corner, not about the guess.
    if fitted.0[0].abs().max(fitted.0[1].abs()) > 0.6 {
        let (x, y) = (window.middle.0 + fitted.0[0], window.middle.1 + fitted.0[1]);
        window = Window::new(image, x, y, radius_px)?;
        at = fitted.0;
        (at[0], at[1]) = (x - window.middle.0, y - window.middle.1);
        fitted = fit(&window, at, radius_px)?;
    }
    let (at, covariance, variance) = fitted;
    let angle = (at[3] - at[2]).rem_euclid(PI);
    let step = -at[6];
    let crossing = angle.min(PI - angle) > LEAST_ANGLE_RAD;
    let seen = step > 0.0 && variance < MOST_UNEXPLAINED * step * step;
    (crossing && seen).then(|| Corner {
        x_px: window.middle.0 + at[0],
        y_px: window.middle.1 + at[1],
        sigma_px: (0.5 * (covariance[(0, 0)] + covariance[(1, 1)])).sqrt(),
        contrast_dn: step,
        blur_px: at[4],
    })
}

#[cfg(test)]
mod tests;
