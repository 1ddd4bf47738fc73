//! Planes carried to a pixel: from another map, or from a neighbour.

use rayon::prelude::*;

use super::planes::SurfacePlanes;

/// One pixel's plane, or another one's carried to it: disparity in px, slants in px/px, and the variances of
/// both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CarriedPlane {
    pub(super) disparity: f32,
    pub(super) slant_x: f32,
    pub(super) slant_y: f32,
    pub(super) variance: f32,
    pub(super) slant_variance: f32,
}

impl CarriedPlane {
    /// The plane `u` columns and `v` rows away. Its variance grows by this share of the variance that the
    /// slants make over the distance.
    pub(super) fn carried(self, (u, v): (f32, f32), share: f32) -> Self {
        Self {
            disparity: self.slant_x.mul_add(u, self.slant_y.mul_add(v, self.disparity)),
            variance: (share * (u * u + v * v)).mul_add(self.slant_variance, self.variance),
            ..self
        }
    }
}

/// One row of planes.
struct CarriedRow<'a> {
    disparity: &'a mut [f32],
    slant_x: &'a mut [f32],
    slant_y: &'a mut [f32],
    variance: &'a mut [f32],
    slant_variance: &'a mut [f32],
}

impl CarriedRow<'_> {
    fn put(&mut self, place: usize, plane: CarriedPlane) {
        self.disparity[place] = plane.disparity;
        self.slant_x[place] = plane.slant_x;
        self.slant_y[place] = plane.slant_y;
        self.variance[place] = plane.variance;
        self.slant_variance[place] = plane.slant_variance;
    }
}

impl SurfacePlanes {
    /// Takes the plane and the variances of `other` at the places, of padded rows, and in the rows for which
    /// `takes` says so of the variances of both.
    pub(super) fn take_where(&mut self, other: &Self, takes: impl Fn(usize, usize, [f32; 2]) -> bool + Sync) {
        self.par_planes().enumerate().for_each(|(y, mut row)| {
            for place in 0..row.variance.len() {
                let offered = other.plane(place, y);
                if takes(place, y, [row.variance[place], offered.variance]) {
                    row.put(place, offered);
                }
            }
        });
    }

    /// Takes the planes that `found` has for each row, by their places in it.
    pub(super) fn take(&mut self, found: &[Vec<(usize, CarriedPlane)>]) {
        self.par_planes().zip(found).for_each(|(mut row, found)| {
            found.iter().for_each(|&(place, plane)| row.put(place, plane));
        });
    }

    /// The plane at a place of a padded row.
    pub(super) fn plane(&self, place: usize, y: usize) -> CarriedPlane {
        CarriedPlane {
            disparity: self.disparity.row(y)[place],
            slant_x: self.slant_x.row(y)[place],
            slant_y: self.slant_y.row(y)[place],
            variance: self.variance.row(y)[place],
            slant_variance: self.slant_variance.row(y)[place],
        }
    }

    /// The rows of the maps that remain when the fit's own quality is dropped.
    fn par_planes(&mut self) -> impl IndexedParallelIterator<Item = CarriedRow<'_>> {
        let first = self.disparity.par_rows().zip(self.slant_x.par_rows()).zip(self.slant_y.par_rows());
        let all = first.zip(self.variance.par_rows()).zip(self.slant_variance.par_rows());
        all.map(|((((disparity, slant_x), slant_y), variance), slant_variance)| CarriedRow {
            disparity,
            slant_x,
            slant_y,
            variance,
            slant_variance,
        })
    }
}
