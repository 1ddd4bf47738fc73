//! One frame as the rectified camera looks into it: where its pixels lie, and which of them it shows.

use std::ops::Range;

use super::pose::dot;
use super::{FramePose, Mapping};
use crate::lens::{Distortion, Lens};

/// Largest distance, in px, by which rounding may put a place on the border of the raw image outside of it.
pub(super) const ROUNDING_PX: f64 = 1e-6;
/// Largest slope |(a, b)| of rays that are looked at: nobody photographs 89.9 deg off the optical axis.
const STEEPEST: f64 = 1e3;

/// The map from rectified pixels to one raw frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// (x, y, 1) of a rectified pixel becomes a multiple of its ray in the frame's camera.
    pub(super) to_ray: [[f64; 3]; 3],
    /// Its product with (x, y, 1) is positive if the pixel is in front of the common raw camera.
    common_depth: [f64; 3],
    /// The lens.
    pub(super) lens: Lens,
    /// Square of the slope of the rays at which the lens folds the image back on itself, at most
    /// [`STEEPEST`].
    pub(super) fold: f64,
    /// Column and row of the last raw pixel.
    pub(super) last: [f64; 2],
}

impl View {
    pub(super) fn new(mapping: &Mapping, pose: &FramePose) -> Self {
        let camera = mapping.camera;
        let rotation = mapping.rotation();
        // Ray of the rectified pixel, then back by the transpose of the rotation.
        let scale = 1.0 / camera.focal_length_px;
        let (x, y) = (-scale * camera.principal_point_x_px, -scale * camera.principal_point_y_px);
        let common: [[f64; 3]; 3] = std::array::from_fn(|axis| {
            let [a, b, c] = rotation.map(|row| row[axis]);
            [a * scale, b * scale, a * x + b * y + c]
        });
        let columns = [0, 1, 2].map(|column| common.map(|row| row[column]));
        let to_ray = pose.matrix().map(|row| columns.map(|column| dot(row, column)));
        Self {
            to_ray,
            common_depth: common[2],
            lens: mapping.lens,
            fold: fold(&mapping.lens.distortion),
            last: [mapping.raw_columns as f64 - 1.0, mapping.raw_rows as f64 - 1.0],
        }
    }

    /// The ray of the rectified pixel in the frame's camera; `None` from behind it or the common one.
    pub(super) fn ray(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let pixel = [x, y, 1.0];
        let [a, b, c] = self.to_ray.map(|row| dot(row, pixel));
        (c > 0.0 && dot(self.common_depth, pixel) > 0.0).then(|| (a / c, b / c))
    }

    /// Whether all rays of the first `columns` pixels of a row come from the front and lie within the fold of
    /// the lens: depth is linear along the row and the slope of the ray convex, so that the ends decide.
    pub(super) fn is_unfolded(&self, y: usize, columns: usize) -> bool {
        let ends = [0, columns.saturating_sub(1)].map(|x| self.ray(x as f64, y as f64));
        ends.iter().all(|end| end.is_some_and(|(a, b)| a * a + b * b < self.fold))
    }

    /// Whether the frame shows the rectified pixel, at least `inset_px` inside its border.
    pub(super) fn shows(&self, x: f64, y: f64, inset_px: f64) -> bool {
        let Some((a, b)) = self.ray(x, y).filter(|(a, b)| a * a + b * b < self.fold) else { return false };
        let (x, y) = self.lens.pixel(a, b);
        let inside = |place: f64, last: f64| place >= inset_px && place <= last - inset_px;
        inside(x, self.last[0]) && inside(y, self.last[1])
    }

    /// Whether the frame shows all pixels of a rectangle or none of them; `None` if that has to be seen one
    /// by one. Bounds of intervals: never wrong.
    pub(super) fn shows_all(&self, columns: Range<i64>, rows: Range<i64>, inset_px: f64) -> Option<bool> {
        let (left, right) = (columns.start as f64, (columns.end - 1) as f64);
        let (top, bottom) = (rows.start as f64, (rows.end - 1) as f64);
        let corners = [(left, top), (right, top), (left, bottom), (right, bottom)];
        let rays = corners.map(|(x, y)| self.ray(x, y));
        // Depths are linear, so that corners decide; rays then have their extremes there.
        let [Some(first), Some(second), Some(third), Some(fourth)] = rays else {
            let behind = |of: [f64; 3]| {
                let depths = corners.map(|(x, y)| dot(of, [x, y, 1.0]));
                depths.iter().all(|depth| depth.is_nan() || *depth <= 0.0)
            };
            return (behind(self.to_ray[2]) || behind(self.common_depth)).then_some(false);
        };
        let rays = [first, second, third, fourth];
        let (a, b) = (Interval::around(rays.map(|ray| ray.0)), Interval::around(rays.map(|ray| ray.1)));
        let r2 = a.square().plus(b.square());
        if r2.low >= self.fold {
            return Some(false);
        }
        let Distortion { k1, k2, p1, p2, k3 } = self.lens.distortion;
        let radial = r2.times(r2.times(r2.scaled(k3).moved(k2)).moved(k1)).moved(1.0);
        let mixed = a.times(b).scaled(2.0);
        let x = a.times(radial).plus(mixed.scaled(p1)).plus(r2.plus(a.square().scaled(2.0)).scaled(p2));
        let y = b.times(radial).plus(r2.plus(b.square().scaled(2.0)).scaled(p1)).plus(mixed.scaled(p2));
        let x = x.scaled(self.lens.focal_length_x_px).moved(self.lens.principal_point_x_px);
        let y = y.scaled(self.lens.focal_length_y_px).moved(self.lens.principal_point_y_px);
        let most = self.last.map(|last| last - inset_px);
        // What rounding could change is looked at pixel by pixel.
        let inside = |place: Interval, most: f64| {
            place.low >= inset_px + ROUNDING_PX && place.high <= most - ROUNDING_PX
        };
        let outside = |place: Interval, most: f64| {
            place.high < inset_px - ROUNDING_PX || place.low > most + ROUNDING_PX
        };
        if outside(x, most[0]) || outside(y, most[1]) {
            Some(false)
        } else {
            (r2.high < self.fold && inside(x, most[0]) && inside(y, most[1])).then_some(true)
        }
    }
}

/// Square of the slope of the rays at which the radial distortion r (1 + k1 r^2 + k2 r^4 + k3 r^6) stops
/// growing, at most that of [`STEEPEST`]. Tangential terms are too small to matter.
fn fold(distortion: &Distortion) -> f64 {
    let Distortion { k1, k2, k3, .. } = *distortion;
    // The derivative, as a polynomial of s = r^2: it begins with 1.
    let growth = |s: f64| 1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * 7.0 * k3));
    let most = STEEPEST * STEEPEST;
    // Where the derivative itself turns; between these places it has one root at most.
    let (c, b, a) = (3.0 * k1, 10.0 * k2, 21.0 * k3);
    let root = (b * b - 4.0 * a * c).sqrt();
    let half = -0.5 * (b + root.copysign(b));
    let mut turns = [half / a, c / half, most];
    turns.sort_by(f64::total_cmp);
    let mut from = 0.0;
    for to in turns.into_iter().filter(|&turn| turn > 0.0 && turn <= most) {
        if growth(to) <= 0.0 {
            let (mut low, mut high) = (from, to);
            // Halved as often as an f64 has digits.
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if growth(middle) > 0.0 { low = middle } else { high = middle }
            }
            return low;
        }
        from = to;
    }
    most
}

/// Bounds of a number.
#[derive(Debug, Clone, Copy)]
struct Interval {
    low: f64,
    high: f64,
}

impl Interval {
    fn around(values: [f64; 4]) -> Self {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        Self { low, high: values.iter().copied().fold(f64::NEG_INFINITY, f64::max) }
    }

    fn plus(self, other: Self) -> Self {
        Self { low: self.low + other.low, high: self.high + other.high }
    }

    fn moved(self, by: f64) -> Self {
        Self { low: self.low + by, high: self.high + by }
    }

    fn scaled(self, by: f64) -> Self {
        let (one, other) = (by * self.low, by * self.high);
        Self { low: one.min(other), high: one.max(other) }
    }

    fn times(self, other: Self) -> Self {
        let (a, b) = (self, other);
        Self::around([a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high])
    }

    fn square(self) -> Self {
        let (low, high) = (self.low.abs().min(self.high.abs()), self.low.abs().max(self.high.abs()));
        Self { low: if self.low <= 0.0 && self.high >= 0.0 { 0.0 } else { low * low }, high: high * high }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn before_the_fold_places_move_outwards(k1 in -2.0..2.0, k2 in -2.0..2.0, k3 in -2.0..2.0) {
            let distortion = Distortion { k1, k2, k3, ..Distortion::default() };
            let most = fold(&distortion).sqrt();
            let place = |r: f64| distortion.apply(r, 0.0).0;
            for step in 0..1000 {
                let r = most * f64::from(step) / 1000.0;
                prop_assert!(place(r + 1e-3 * most) > place(r), "{r} of {most}");
            }
            prop_assert!(most == STEEPEST || place(1.001 * most) < place(most), "{most}");
        }
    }

    #[test]
    fn a_fold_is_where_the_formula_has_it() {
        let fold = |k1, k2| fold(&Distortion { k1, k2, ..Distortion::default() });
        assert_eq!(fold(0.0, 0.0), STEEPEST * STEEPEST);
        assert!((fold(-1.0, 0.0) - 1.0 / 3.0).abs() < 1e-12);
        // 1 - 1.5 s + 0.5 s^2 = (1 - s) (1 - s / 2): later it grows again.
        assert!((fold(-0.5, 0.1) - 1.0).abs() < 1e-12);
    }
}
