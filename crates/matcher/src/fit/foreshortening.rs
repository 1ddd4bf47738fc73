//! Foreshortening of blur: the effect of slant on the intensity along a line.
//!
//! Lens and pixel blur the image by a fixed variance kappa on the sensor. The image of a slanted surface is
//! stretched from frame to frame: by 1 + p tau' along x, and sheared by q tau', for a disparity that grows by
//! p px per px of x and q of y. On the surface the blur therefore shrinks where the image is stretched, so
//! the intensity along the true line is not constant. By the heat equation it drifts by -kappa (p I_xx + q
//! I_xy) per unit of tau, and an observation takes that for disparity. kappa is one number for all pixels. It
//! is found by regression from the observations, which scatter about their planes because of it, and its
//! effect is subtracted.

use rayon::prelude::*;

use super::padded::PAD;
use super::planes::{ObservationMaps, SurfacePlanes, Template};

/// The largest variance of a blur that is believed, in px^2: a point spread of sigma 2 px.
const LARGEST_BLUR: f64 = 4.0;

/// The variance of a blur in px^2, and one over the variance with which it is known.
#[derive(Debug, Clone, Copy)]
pub(super) struct Blur {
    pub(super) variance: f64,
    pub(super) information: f64,
}

/// Finds the variance of the blur, in px^2, from the observations and the planes through them, and takes its
/// effect off the observations' moments. Without slants nothing is found and nothing changes.
pub(super) fn take_off_drift(
    observations: &mut ObservationMaps,
    template: &Template,
    map: &SurfacePlanes,
) -> Blur {
    let rows = observations.rows();
    // Numerator and denominator of the regression, row by row: the order of sums is fixed.
    let sums: Vec<[f64; 3]> = (0..rows)
        .into_par_iter()
        .map(|y| {
            let drift = drift_row(observations, template, map, y);
            let (moment, weight, inverse) =
                (observations.moment.row(y), observations.weight.row(y), observations.inverse.row(y));
            let disparity = map.disparity.row(y);
            let variance = observations.noise.row(y);
            let [mut numerator, mut denominator, mut information] = [0.0; 3];
            for (place, &drift) in drift.iter().enumerate() {
                if drift != 0.0 {
                    let deviation = moment[place] - weight[place] * disparity[place];
                    numerator += f64::from(deviation * drift * inverse[place]);
                    denominator += f64::from(drift * drift * inverse[place]);
                    information += f64::from(drift * drift * inverse[place] / variance[place]);
                }
            }
            [numerator, denominator, information]
        })
        .collect();
    let add = |sum: [f64; 3], row: [f64; 3]| std::array::from_fn(|index| sum[index] + row[index]);
    let [numerator, denominator, information] = sums.into_iter().fold([0.0; 3], add);
    if denominator <= 0.0 {
        return Blur { variance: 0.0, information: 0.0 };
    }
    let blur = (numerator / denominator).clamp(0.0, LARGEST_BLUR);
    let drifts: Vec<Vec<f32>> =
        (0..rows).into_par_iter().map(|y| drift_row(observations, template, map, y)).collect();
    observations.moment.par_rows().zip(drifts).for_each(|(moment, drift)| {
        for (moment, drift) in moment.iter_mut().zip(drift) {
            *moment -= blur as f32 * drift;
        }
    });
    Blur { variance: blur, information }
}

/// Moments that a blur of variance 1 adds to row `y`: S g (p I_xx + q I_xy).
pub(super) fn drift_row(
    observations: &ObservationMaps,
    template: &Template,
    map: &SurfacePlanes,
    y: usize,
) -> Vec<f32> {
    let (weight, gradient, curvature) =
        (observations.weight.row(y), template.gradient.row(y), template.curvature.row(y));
    let (first, last) = (y.saturating_sub(1), (y + 1).min(observations.rows() - 1));
    let (above, below) = (template.gradient.row(first), template.gradient.row(last));
    let per_row = 1.0 / (last - first).max(1) as f32;
    let (p, q) = (map.slant_x.row(y), map.slant_y.row(y));
    let mut drift = vec![0.0; weight.len()];
    for place in PAD..weight.len() - PAD {
        if gradient[place] != 0.0 && above[place] != 0.0 && below[place] != 0.0 {
            let crossed = per_row * (below[place] - above[place]);
            drift[place] =
                weight[place] / gradient[place] * (p[place] * curvature[place] + q[place] * crossed);
        }
    }
    drift
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::fit::padded::Padded;

    const ROWS: usize = 40;
    const COLUMNS: usize = 48;
    /// S of the formula.
    const SPREAD: f64 = 8.0;

    /// p and q of a curved surface: slants vary.
    fn slants(x: f64, y: f64) -> (f64, f64) {
        (0.02 + 0.001 * x, -0.03 + 0.0008 * y)
    }

    /// The antiderivative of [`slants`].
    fn disparity(x: f64, y: f64) -> f64 {
        0.02 * x + 0.0005 * x * x - 0.03 * y + 0.0004 * y * y
    }

    /// I_x, I_xx and I_xy; I_x is linear in y, so that differences of rows are derivatives.
    fn derivatives(x: f64, y: f64) -> (f64, f64, f64) {
        let crossed = 0.3 * (0.4 * x).cos();
        let turned = 0.7 * x + 0.5;
        (14.0 * turned.sin() + y * crossed, 9.8 * turned.cos() - 0.12 * y * (0.4 * x).sin(), crossed)
    }

    /// Observations on a surface whose slants are `scale` times the formula's, seen through a blur
    /// of variance `blur`, with noise of `sigma` DN; and the true surface, flat in the first and
    /// last row, which have no neighbour on one side.
    fn observations_through(blur: f64, scale: f64, sigma: f64) -> (ObservationMaps, Template, SurfacePlanes) {
        let zeros = || Padded::filled(ROWS, COLUMNS, 0.0);
        let noise = Padded::filled(ROWS, COLUMNS, 1.0);
        let [weight, moment, inverse] = [(); 3].map(|()| zeros());
        let mut observations = ObservationMaps { weight, moment, inverse, noise_gain: 1.0, noise };
        let mut template = Template { gradient: zeros(), curvature: zeros(), intensity: zeros() };
        let [disparity_map, slant_x, slant_y] = [(); 3].map(|()| zeros());
        let mut map = SurfacePlanes { disparity: disparity_map, slant_x, slant_y };
        let mut random = ChaCha8Rng::seed_from_u64(11);
        for y in 0..ROWS {
            for x in 0..COLUMNS {
                let (place, column, row) = (PAD + x, x as f64, y as f64);
                let (gradient, curvature, crossed) = derivatives(column, row);
                let (p, q) = slants(column, row);
                let weight = SPREAD * gradient * gradient;
                let drift = SPREAD * gradient * scale * (p * curvature + q * crossed);
                let noise: f64 = StandardNormal.sample(&mut random);
                let moment =
                    weight * scale * disparity(column, row) + blur * drift + sigma * weight.sqrt() * noise;
                observations.weight.row_mut(y)[place] = weight as f32;
                observations.inverse.row_mut(y)[place] = (1.0 / weight) as f32;
                observations.moment.row_mut(y)[place] = moment as f32;
                template.gradient.row_mut(y)[place] = gradient as f32;
                template.curvature.row_mut(y)[place] = curvature as f32;
                map.disparity.row_mut(y)[place] = (scale * disparity(column, row)) as f32;
                if y > 0 && y + 1 < ROWS {
                    map.slant_x.row_mut(y)[place] = (scale * p) as f32;
                    map.slant_y.row_mut(y)[place] = (scale * q) as f32;
                }
            }
        }
        (observations, template, map)
    }

    /// The blur that was taken off, by its effect on the moments of all inner pixels: least and greatest.
    fn taken_off(blur: f64, sigma: f64) -> (f64, f64) {
        let (mut observations, template, map) = observations_through(blur, 1.0, sigma);
        let before = observations.clone();
        take_off_drift(&mut observations, &template, &map);
        let mut range = (f64::INFINITY, f64::NEG_INFINITY);
        for y in 1..ROWS - 1 {
            for x in 0..COLUMNS {
                let (gradient, curvature, crossed) = derivatives(x as f64, y as f64);
                let (p, q) = slants(x as f64, y as f64);
                let drift = SPREAD * gradient * (p * curvature + q * crossed);
                // Small differences of moments of some 1000 tell nothing.
                if drift.abs() > 10.0 {
                    let change = before.moment.row(y)[PAD + x] - observations.moment.row(y)[PAD + x];
                    range = (range.0.min(f64::from(change) / drift), range.1.max(f64::from(change) / drift));
                }
            }
        }
        range
    }

    #[test]
    fn the_drift_of_a_blur_is_found_and_taken_off() {
        // Moments up to 5000 in single precision are known to 0.0003, of drifts above 10: 3e-5, and twice
        // that for the difference.
        let (least, greatest) = taken_off(0.7, 0.0);
        assert!(least > 0.7 - 1e-4 && greatest < 0.7 + 1e-4, "{least} to {greatest}");
        let (mut observations, template, map) = observations_through(0.7, 1.0, 0.0);
        take_off_drift(&mut observations, &template, &map);
        for y in 1..ROWS - 1 {
            for x in 0..COLUMNS {
                let place = PAD + x;
                let left = observations.moment.row(y)[place]
                    - observations.weight.row(y)[place] * map.disparity.row(y)[place];
                assert!(left.abs() < 0.005, "({x}, {y}): {left}");
            }
        }
    }

    #[test]
    fn noise_moves_the_blur_by_its_share() {
        // Standard error of the regression: s over the root of the sum of drift^2 / weight.
        let mut information = 0.0;
        for y in 1..ROWS - 1 {
            for x in 0..COLUMNS {
                let (_, curvature, crossed) = derivatives(x as f64, y as f64);
                let (p, q) = slants(x as f64, y as f64);
                information += SPREAD * (p * curvature + q * crossed).powi(2);
            }
        }
        let sigma = 1.0;
        let (least, greatest) = taken_off(1.5, sigma);
        let bound = 4.0 * sigma / information.sqrt();
        assert!(bound < 0.5 && least > 1.5 - bound && greatest < 1.5 + bound, "{least} to {greatest}");
    }

    #[test]
    fn a_blur_is_no_less_than_none_and_no_more_than_believed() {
        let (least, greatest) = taken_off(-0.5, 0.0);
        assert_eq!((least, greatest), (0.0, 0.0));
        let (least, greatest) = taken_off(6.0, 0.0);
        assert!((least - LARGEST_BLUR).abs() < 1e-3 && (greatest - LARGEST_BLUR).abs() < 1e-3);
    }

    #[test]
    fn without_slants_nothing_changes() {
        let (mut observations, template, map) = observations_through(0.7, 0.0, 1.0);
        let before = observations.clone();
        take_off_drift(&mut observations, &template, &map);
        for y in 0..ROWS {
            assert_eq!(observations.moment.row(y), before.moment.row(y));
        }
    }
}
