//! What the whole picture tells of edges, before a disc is looked at: how often there is one, and
//! how high.
//!
//! A prior that is too generous sees edges in noise and widens sigma on planes; one that is too
//! narrow smooths hidden relief away. Both are learned together. For each family of edges and each
//! of some deviations T, a sample of discs tells the ratio B of the likelihoods with such an edge
//! and without. The shares p of discs that have one maximise
//!
//! ```text
//! sum over discs of ln(p_0 + sum over families and T of p_T B_T)
//! ```
//!
//! by expectation maximisation (Dempster, Laird and Rubin 1977; mixture of known densities). A
//! family's variance is the mean of its T^2.

use fearless_simd::Level;

use super::discs::Discs;
use super::model::{EdgePrior, EdgePriors, Model};
use super::observed::Observed;

/// Deviations that are tried: of heights in px, and half as much of changes of slant in px/px.
const DEVIATIONS: [f64; 5] = [0.0125, 0.025, 0.05, 0.1, 0.2];
/// Each family is expected at this share of the discs before anything is observed, as sure as if so
/// many discs had shown it: others cannot exclude an edge in one.
const SHARE_BEFORE: f64 = 0.1;
const DISCS_BEFORE: f64 = 100.0;
/// Steps of expectation maximisation: shares are known to their own chance then.
const STEPS: usize = 200;

/// Edges whose heights have this deviation, all families as likely as none.
fn of_deviation(deviation: f64) -> EdgePriors {
    let prior = |deviation: f64| EdgePrior { share: 0.25, variance: deviation * deviation };
    [prior(deviation), prior(0.5 * deviation), prior(deviation)]
}

/// What discs of this squared radius tell of edges.
pub(super) fn learned(level: Level, observed: &Observed, squared_radius: usize, model: &Model) -> EdgePriors {
    let tried = DEVIATIONS.map(of_deviation);
    let likelihoods = tried.map(|edges| Discs::likelihoods(level, observed, squared_radius, (model, edges)));
    let mut shares = [[SHARE_BEFORE / DEVIATIONS.len() as f64; 3]; DEVIATIONS.len()];
    let count = likelihoods[0].len();
    for _ in 0..STEPS {
        let rest = 1.0 - shares.iter().flatten().sum::<f64>();
        let mut sums = [[0.0; 3]; DEVIATIONS.len()];
        for disc in 0..count {
            let mut weights = [[0.0; 3]; DEVIATIONS.len()];
            let mut whole = rest;
            for (index, of_deviation) in likelihoods.iter().enumerate() {
                for family in 0..3 {
                    let weight = shares[index][family] * f64::from(of_deviation[disc][family]);
                    weights[index][family] = weight;
                    whole += weight;
                }
            }
            for (sum, weight) in sums.iter_mut().flatten().zip(weights.iter().flatten()) {
                *sum += weight / whole;
            }
        }
        let before = DISCS_BEFORE * SHARE_BEFORE / DEVIATIONS.len() as f64;
        for (share, sum) in shares.iter_mut().flatten().zip(sums.iter().flatten()) {
            *share = (sum + before) / (count as f64 + DISCS_BEFORE);
        }
    }
    std::array::from_fn(|family| {
        let share: f64 = shares.iter().map(|shares| shares[family]).sum();
        let variances =
            shares.iter().zip(&tried).map(|(shares, edges)| shares[family] * edges[family].variance);
        EdgePrior { share, variance: variances.sum::<f64>() / share }
    })
}
