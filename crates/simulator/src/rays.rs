//! The rays of the points of an image row. Distortion is smooth, so few rays are solved for and the others
//! interpolated.

use super::optics::Optics;

/// Solved rays lie this share of the focal length apart: the angle that a section between two of them sees,
/// in rad.
const SECTION_RAD: f64 = 1.0 / 256.0;
/// Between solved rays a cubic is trusted if it is off by less than this, in px; else every ray is solved
/// for.
const TRUSTED_PX: f64 = 1e-7;
/// A cubic through four values at 0, 1, 2, 3 is off by the fourth derivative times at most max |t (t - 1)
/// (t - 2) (t - 3)| / 4! in between, and the fourth difference of five values is a mean of that derivative.
const CUBIC: f64 = 1.0 / 24.0;
/// Values that tell the fourth difference.
const KNOTS: usize = 5;
/// A section of fewer points is not worth a cubic.
const SHORTEST: usize = 4;

type Ray = (f64, f64);

/// Finds the rays of image points, (x, y) in px.
pub(super) struct Rays<F> {
    ray: F,
    smooth: bool,
    focal_length_px: f64,
}

impl<F: Fn(f64, f64) -> Ray> Rays<F> {
    /// The rays of these optics, or of a part of them: `ray` solves for one.
    pub(super) fn new(optics: &Optics, ray: F) -> Self {
        Self { ray, smooth: !optics.is_rectified(), focal_length_px: optics.focal_length_px }
    }

    /// The rays of the points (x(0), y), (x(1), y), ..., which are `density` to the pixel, to 1e-7 px of the
    /// image.
    pub(super) fn fill(&self, row: &mut [Ray], x: impl Fn(usize) -> f64, y: f64, density: f64) {
        let solve = |first: usize, part: &mut [Ray]| {
            for (index, ray) in part.iter_mut().enumerate() {
                *ray = (self.ray)(x(first + index), y);
            }
        };
        let section = (SECTION_RAD * self.focal_length_px * density) as usize;
        let knots = row.len().checked_div(section).unwrap_or(0) + 2;
        if !self.smooth || section < SHORTEST || knots < KNOTS {
            return solve(0, row);
        }
        let solved: Vec<Ray> = (0..knots).map(|knot| (self.ray)(x(knot * section), y)).collect();
        for (number, part) in row.chunks_mut(section).enumerate() {
            let first = number.saturating_sub(1).min(knots - 4);
            let near = &solved[first.min(knots - KNOTS)..][..KNOTS];
            let off = fourth_difference(near, |ray| ray.0).max(fourth_difference(near, |ray| ray.1));
            if off * CUBIC * self.focal_length_px < TRUSTED_PX {
                let (a, b) =
                    (Cubic::new(&solved[first..], |ray| ray.0), Cubic::new(&solved[first..], |ray| ray.1));
                let start = (number - first) as f64;
                for (index, ray) in part.iter_mut().enumerate() {
                    let t = start + index as f64 / section as f64;
                    *ray = (a.at(t), b.at(t));
                }
            } else {
                solve(number * section, part);
            }
        }
    }
}

/// Its size; infinite where a ray is not a number.
fn fourth_difference(rays: &[Ray], part: impl Fn(&Ray) -> f64) -> f64 {
    let sum =
        |weights: [f64; KNOTS]| rays.iter().zip(weights).map(|(ray, weight)| weight * part(ray)).sum::<f64>();
    let difference = sum([1.0, -4.0, 6.0, -4.0, 1.0]).abs();
    if difference.is_nan() { f64::INFINITY } else { difference }
}

/// The cubic through values at 0, 1, 2 and 3.
struct Cubic([f64; 4]);

impl Cubic {
    fn new(rays: &[Ray], part: impl Fn(&Ray) -> f64) -> Self {
        let [k0, k1, k2, k3] = [0, 1, 2, 3].map(|knot| part(&rays[knot]));
        // Newton's forward differences, by powers of t.
        let (first, second, third) = (k1 - k0, k2 - 2.0 * k1 + k0, k3 - 3.0 * (k2 - k1) - k0);
        Self([k0, first - second / 2.0 + third / 3.0, (second - third) / 2.0, third / 6.0])
    }

    fn at(&self, t: f64) -> f64 {
        let [c0, c1, c2, c3] = self.0;
        c0 + t * (c1 + t * (c2 + t * c3))
    }
}

#[cfg(test)]
mod tests {
    use super::super::distortion::Distortion;
    use super::*;

    #[test]
    fn rays_between_solved_ones_are_off_by_less_than_a_tenth_of_a_millionth_of_a_pixel() {
        let sound = Distortion { k1: -0.02, ..Distortion::default() };
        let strong = Distortion { k1: -0.1, k2: 0.3, p1: 0.001, p2: -0.002, k3: 0.1 };
        // The last one's cubics are not good enough, so that its rays are solved for.
        let wide = Distortion { k1: -0.3, k2: 0.1, ..Distortion::default() };
        for (distortion, focal_length_px) in [(sound, 2844.0), (strong, 1422.0), (wide, 500.0)] {
            let optics = Optics {
                roll_rad: 0.0122,
                pan_rad: 0.007,
                distortion,
                ..Optics::square(512, focal_length_px)
            };
            let sight = optics.sight();
            let rays = Rays::new(&optics, |x, y| sight.ray(x, y));
            let x = |index: usize| (index as f64 - 7.0) / 3.0;
            let mut row = vec![(0.0, 0.0); 512 * 3];
            for y in [-2.0, 100.3, 255.0, 513.0] {
                rays.fill(&mut row, x, y, 3.0);
                for (index, ray) in row.iter().enumerate() {
                    let exact = sight.ray(x(index), y);
                    let off_px = focal_length_px * (ray.0 - exact.0).hypot(ray.1 - exact.1);
                    assert!(off_px < 1e-7, "{distortion:?}, ({}, {y}): {off_px}", x(index));
                }
            }
        }
    }
}
