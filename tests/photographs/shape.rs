//! How one map differs from another by what no photograph tells.

use nalgebra::{Matrix4, Vector4};

/// Disparity and sigma of one pixel in two maps, and its place.
pub(super) struct Pair {
    pub(super) one: [f64; 2],
    pub(super) other: [f64; 2],
    /// In units of half the picture.
    pub(super) place: [f64; 2],
}

impl Pair {
    fn terms(&self) -> Vector4<f64> {
        Vector4::new(self.one[0], 1.0, self.place[0], self.place[1])
    }

    /// By how much the second differs from what the model makes of the first.
    pub(super) fn off(&self, model: &Vector4<f64>) -> f64 {
        (self.other[0] - self.terms().dot(model)).abs()
    }

    pub(super) fn sigma(&self, model: &Vector4<f64>) -> f64 {
        self.other[1].hypot(model[0] * self.one[1])
    }
}

/// How one map differs from the other by what no photograph tells: a turn of the camera and the focal length change the
/// shape by scale, offset and inclination. Least squares with the weights of a Cauchy distribution.
pub(super) fn shape(pairs: &[Pair]) -> Vector4<f64> {
    let sign = {
        let mean = |value: fn(&Pair) -> f64| pairs.iter().map(value).sum::<f64>() / pairs.len() as f64;
        (mean(|pair| pair.one[0]) * mean(|pair| pair.other[0])).signum()
    };
    let mut model = Vector4::new(sign, 0.0, 0.0, 0.0);
    for _ in 0..50 {
        let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
        for pair in pairs {
            let (terms, sigma) = (pair.terms(), pair.sigma(&model));
            let error = (pair.other[0] - terms.dot(&model)) / sigma;
            let weight = 1.0 / (sigma * sigma) / (1.0 + (error / 3.0).powi(2));
            normal += weight * terms * terms.transpose();
            right += weight * pair.other[0] * terms;
        }
        model = normal.cholesky().unwrap().solve(&right);
    }
    model
}
