//! The projective mapping between a board and its image.

use epirig_core::statistics::upper_median;
use nalgebra::{Matrix3, SMatrix, SVector, SymmetricEigen, Vector3};

/// A point of a plane and its image.
pub(super) struct Pair {
    pub(super) from: [f64; 2],
    pub(super) to: [f64; 2],
}

/// Median of the norm of a pair of Gaussian numbers, in units of their standard deviation: the square root of
/// 2 ln 2.
pub(super) const MEDIAN_NORM: f64 = 1.177_410_022_515_474_7;

/// Rounds of weighing. Each reduces the weight of wrong points by a factor; the least squares that follow
/// reject the rest.
const ROUNDS: usize = 10;

/// The homography from `from` to `to` by the direct linear transformation, with Hartley's (1997)
/// normalisation. Pairs are weighed by Cauchy's function of their residuals, so that single wrong ones do not
/// spoil it. `None` if the points leave it open.
pub(super) fn homography(pairs: &[Pair]) -> Option<Matrix3<f64>> {
    let from = normalisation(pairs.iter().map(|pair| pair.from))?;
    let to = normalisation(pairs.iter().map(|pair| pair.to))?;
    let pairs: Vec<Pair> =
        pairs.iter().map(|pair| Pair { from: mapped(&from, pair.from), to: mapped(&to, pair.to) }).collect();
    let mut weights = vec![1.0; pairs.len()];
    let mut found = direct(&pairs, &weights)?;
    for _ in 0..ROUNDS {
        let mut norms: Vec<f64> = pairs
            .iter()
            .map(|pair| {
                let [x, y] = mapped(&found, pair.from);
                (x - pair.to[0]).hypot(y - pair.to[1])
            })
            .collect();
        if norms.iter().any(|norm| !norm.is_finite()) {
            return None;
        }
        let sigma = upper_median(&mut norms.clone()).unwrap_or(f64::NAN) / MEDIAN_NORM;
        // Normalised coordinates are about 1: less is rounding.
        let scale = 2.0 * sigma.max(1e-12);
        weights
            .iter_mut()
            .zip(&mut norms)
            .for_each(|(weight, norm)| *weight = 1.0 / (1.0 + (*norm / scale).powi(2)));
        found = direct(&pairs, &weights)?;
    }
    Some(to.try_inverse()? * found * from)
}

/// A point mapped by a homography.
fn mapped(homography: &Matrix3<f64>, [x, y]: [f64; 2]) -> [f64; 2] {
    let point = homography * Vector3::new(x, y, 1.0);
    [point.x / point.z, point.y / point.z]
}

/// Moves the mean of the points to the origin and scales their mean squared distance from it to 2. `None` if
/// they lie on a line.
fn normalisation(points: impl Iterator<Item = [f64; 2]> + Clone) -> Option<Matrix3<f64>> {
    let count = points.clone().count() as f64;
    let (sx, sy) = points.clone().fold((0.0, 0.0), |(sx, sy), [x, y]| (sx + x, sy + y));
    let (mx, my) = (sx / count, sy / count);
    let (xx, xy, yy) = points.fold((0.0, 0.0, 0.0), |(xx, xy, yy), [x, y]| {
        let (dx, dy) = (x - mx, y - my);
        (xx + dx * dx, xy + dx * dy, yy + dy * dy)
    });
    let (along, twist) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
    // A strip a thousandth as wide as long is a line.
    if (along - twist) <= 1e-6 * (along + twist) || !along.is_finite() {
        return None;
    }
    let scale = (2.0 * count / (xx + yy)).sqrt();
    Some(Matrix3::new(scale, 0.0, -scale * mx, 0.0, scale, -scale * my, 0.0, 0.0, 1.0))
}

fn direct(pairs: &[Pair], weights: &[f64]) -> Option<Matrix3<f64>> {
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    for (Pair { from: [u, v], to: [x, y] }, &weight) in pairs.iter().zip(weights) {
        let first = SVector::<f64, 9>::from([*u, *v, 1.0, 0.0, 0.0, 0.0, -x * u, -x * v, -x]);
        let second = SVector::<f64, 9>::from([0.0, 0.0, 0.0, *u, *v, 1.0, -y * u, -y * v, -y]);
        normal += weight * (first * first.transpose() + second * second.transpose());
    }
    let eigen = SymmetricEigen::try_new(normal, f64::EPSILON, 1000)?;
    let smallest = eigen.eigenvalues.imin();
    Some(Matrix3::from_row_slice(eigen.eigenvectors.column(smallest).as_slice()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_homography_is_found_and_wrong_points_do_not_spoil_it() {
        let truth = Matrix3::new(12.0, -3.0, 300.0, 2.0, 11.0, 200.0, 0.002, -0.001, 1.0);
        let mut pairs: Vec<Pair> = (0..40)
            .map(|index| [f64::from(index % 8) * 5.0, f64::from(index / 8) * 5.0])
            .map(|from| Pair { from, to: mapped(&truth, from) })
            .collect();
        for wrong in [3, 17] {
            pairs[wrong].to[0] += 40.0;
        }
        let found = homography(&pairs).unwrap();
        let found = found / found[(2, 2)];
        assert!((found - truth).abs().max() < 1e-6, "{found}");
    }

    #[test]
    fn points_on_a_line_are_refused() {
        let pairs: Vec<Pair> =
            (0..10).map(f64::from).map(|x| Pair { from: [x, 2.0 * x], to: [3.0 * x, x * x] }).collect();
        assert!(homography(&pairs).is_none());
    }
}
