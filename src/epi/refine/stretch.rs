//! What slant does to the blur.
//!
//! Lens and pixel blur a picture by a fixed variance kappa on the sensor, but a slanted surface is stretched from frame to frame: by
//! 1 + p tau' along x, and sheared by q tau', for a disparity that grows by p px per px of x and q of y. Seen from the surface the blur shrinks where the picture
//! is stretched, so that the intensity along the true line is not constant: by the heat equation it drifts by
//! -kappa (p I_xx + q I_xy) per unit of tau. A vote would take that for disparity. kappa is one number for all pixels; it is
//! found from the votes themselves, which scatter about their planes by it, and its effect is taken off.

use rayon::prelude::*;

use super::planes::{PAD, SurfacePlanes, VotePlanes};

/// The largest variance of a blur that is believed, in px^2: a point spread of sigma 2 px.
const LARGEST_BLUR: f64 = 4.0;

/// Finds the variance of the blur, in px^2, from the votes and the planes through them, and takes its effect off the votes' moments. Without slants nothing is
/// found and nothing changes.
pub(super) fn take_off_drift(votes: &mut VotePlanes, map: &SurfacePlanes) {
    let rows = votes.rows();
    // Numerator and denominator of the regression, and the sum of squares about it, row by row: the order of sums is fixed.
    let sums: Vec<(f64, f64)> = (0..rows)
        .into_par_iter()
        .map(|y| {
            let drift = drift_row(votes, map, y);
            let (moment, weight, inverse) = (votes.moment.row(y), votes.weight.row(y), votes.inverse.row(y));
            let disparity = map.disparity.row(y);
            let noise = map.variance.row(y);
            let (mut numerator, mut denominator) = (0.0, 0.0);
            for (place, &drift) in drift.iter().enumerate() {
                if drift != 0.0 && noise[place].is_finite() {
                    let deviation = moment[place] - weight[place] * disparity[place];
                    numerator += f64::from(deviation * drift * inverse[place]);
                    denominator += f64::from(drift * drift * inverse[place]);
                }
            }
            (numerator, denominator)
        })
        .collect();
    let (numerator, denominator) =
        sums.into_iter().fold((0.0, 0.0), |sum, row| (sum.0 + row.0, sum.1 + row.1));
    if denominator <= 0.0 {
        return;
    }
    let blur = (numerator / denominator).clamp(0.0, LARGEST_BLUR);
    let drifts: Vec<Vec<f32>> = (0..rows).into_par_iter().map(|y| drift_row(votes, map, y)).collect();
    votes.moment.par_rows().zip(drifts).for_each(|(moment, drift)| {
        for (moment, drift) in moment.iter_mut().zip(drift) {
            *moment -= blur as f32 * drift;
        }
    });
}

/// What a blur of variance 1 adds to the moments of row `y`: S g (p I_xx + q I_xy).
fn drift_row(votes: &VotePlanes, map: &SurfacePlanes, y: usize) -> Vec<f32> {
    let (weight, gradient, bend) = (votes.weight.row(y), votes.gradient.row(y), votes.bend.row(y));
    let above = votes.gradient.row(y.saturating_sub(1));
    let below = votes.gradient.row((y + 1).min(votes.rows() - 1));
    let (p, q) = (map.slant_x.row(y), map.slant_y.row(y));
    let mut drift = vec![0.0; weight.len()];
    for place in PAD..weight.len() - PAD {
        if gradient[place] != 0.0 && above[place] != 0.0 && below[place] != 0.0 {
            let crossed = 0.5 * (below[place] - above[place]);
            drift[place] = weight[place] / gradient[place] * (p[place] * bend[place] + q[place] * crossed);
        }
    }
    drift
}
