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

use fearless_simd::{Level, dispatch};

use super::discs::Discs;
use super::model::{EdgePrior, EdgePriors, Model};
use super::observed::Observed;

/// Deviations that are tried: of heights in px, and half as much of changes of slant in px/px.
const DEVIATIONS: [f64; 5] = [0.0125, 0.025, 0.05, 0.1, 0.2];
/// Each family is expected at this share of the discs before anything is observed, as sure as if so
/// many discs had shown it: others cannot exclude an edge in one.
const SHARE_BEFORE: f32 = 0.1;
const DISCS_BEFORE: f32 = 100.0;
/// Steps of expectation maximisation: shares are known to their own chance then.
const STEPS: usize = 200;

/// Edges whose heights have this deviation, all families as likely as none.
fn of_deviation(deviation: f64) -> EdgePriors {
    let prior = |deviation: f64| EdgePrior { share: 0.25, variance: deviation * deviation };
    [prior(deviation), prior(0.5 * deviation), prior(deviation)]
}

/// What a disc's observations are multiplied in likelihood by for each family and deviation, and by
/// no edge: 1.
const KINDS: usize = 3 * DEVIATIONS.len() + 1;

/// What discs of this squared radius tell of edges.
pub(super) fn learned(level: Level, observed: &Observed, squared_radius: usize, model: &Model) -> EdgePriors {
    let tried = DEVIATIONS.map(of_deviation);
    let of_deviation = |edges| Discs::likelihoods(level, observed, squared_radius, model, edges);
    let found = tried.map(of_deviation);
    let of_disc = |disc: usize| {
        let kind = |kind: usize| found.get(kind / 3).map_or(1.0, |likelihoods| likelihoods[disc][kind % 3]);
        std::array::from_fn(kind)
    };
    let likelihoods: Vec<[f32; KINDS]> = (0..found[0].len()).map(of_disc).collect();
    let shares = dispatch!(level, _simd => shares(&likelihoods));
    std::array::from_fn(|family| {
        let of_family = || (0..DEVIATIONS.len()).map(|index| (f64::from(shares[3 * index + family]), index));
        let share: f64 = of_family().map(|(share, _)| share).sum();
        let variances = of_family().map(|(share, index)| share * tried[index][family].variance);
        EdgePrior { share, variance: variances.sum::<f64>() / share }
    })
}

/// The shares of the discs that are of each kind.
#[inline(always)]
fn shares(likelihoods: &[[f32; KINDS]]) -> [f32; KINDS] {
    let none = KINDS - 1;
    let mut before = [SHARE_BEFORE / DEVIATIONS.len() as f32; KINDS];
    before[none] = 1.0 - before[..none].iter().sum::<f32>();
    let mut shares = before;
    for _ in 0..STEPS {
        let mut sums = before.map(|share| DISCS_BEFORE * share);
        for likelihoods in likelihoods {
            let weights: [f32; KINDS] = std::array::from_fn(|kind| shares[kind] * likelihoods[kind]);
            let over = 1.0 / weights.iter().sum::<f32>();
            sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight * over);
        }
        shares = sums.map(|sum| sum / (likelihoods.len() as f32 + DISCS_BEFORE));
    }
    shares
}
