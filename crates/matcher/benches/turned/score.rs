//! How far a match is from the truth.

use super::scenes::Scene;
use epirig_matcher::DisparityMaps;

/// Pixels at the border that do not count: there points leave the image in most frames.
const BORDER_PX: usize = 14;
/// An answer farther off is wrong, not inaccurate, in px.
const WRONG_PX: f64 = 0.5;
/// A pixel lies beside an edge if the surface this far from it in two opposite directions, in px,
/// deviates from a plane by more than this, in px.
const BESIDE_PX: f64 = 4.0;
const EDGE_PX: f64 = 0.01;
/// Pixels beside edges, and all others.
const PLACES: usize = 2;

pub(super) struct Score {
    mean: f64,
    of_all: [f64; 2],
    wrong: f64,
    answered: f64,
    /// Shares of the errors within one sigma and two: beside edges, and elsewhere.
    within: [[f64; 2]; PLACES],
    within_2_sigma: f64,
    /// Depth that was read over the true one.
    depth: Option<f64>,
}

impl Score {
    pub(super) const HEAD: &'static str = "| scene | mean error, mpx | 99 % below | largest | wrong | answered | within 1/2 sigma beside edges, % | elsewhere | depth read | s |\n\
         | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |";

    pub(super) fn of(scene: &Scene, maps: &DisparityMaps) -> Self {
        let (rows, columns) = (maps.disparity.rows(), maps.disparity.columns());
        let (right, down) = (0.5 * (columns - 1) as f64, 0.5 * (rows - 1) as f64);
        let (mut errors, mut wrong, mut all) = (Vec::new(), 0, 0);
        let mut within = [[0; 2]; PLACES];
        let mut counts = [0; PLACES];
        // Regression of what was found on the truth.
        let mut pairs: Vec<(f64, f64)> = Vec::new();
        for (x, y) in
            (BORDER_PX..rows - BORDER_PX).flat_map(|y| (BORDER_PX..columns - BORDER_PX).map(move |x| (x, y)))
        {
            all += 1;
            let place = (x as f64 - right, y as f64 - down);
            let truth = (scene.disparity)(place.0, place.1);
            let (found, sigma) = (f64::from(maps.disparity.at(x, y)), f64::from(maps.sigma.at(x, y)));
            if !found.is_finite() {
                continue;
            }
            let error = (found - truth).abs();
            if error > WRONG_PX {
                wrong += 1;
                continue;
            }
            let elsewhere = usize::from(!is_beside_an_edge(scene, place, truth));
            counts[elsewhere] += 1;
            for (count, sigmas) in within[elsewhere].iter_mut().zip([1.0, 2.0]) {
                *count += usize::from(error <= sigmas * sigma);
            }
            errors.push(error);
            pairs.push((truth, found));
        }
        errors.sort_by(f64::total_cmp);
        let count = errors.len() as f64;
        let at = |share: f64| errors.get(((count - 1.0) * share) as usize).copied().unwrap_or(f64::NAN);
        let mean_of = |part: fn(&(f64, f64)) -> f64| pairs.iter().map(part).sum::<f64>() / count;
        let (mean_truth, mean_found) = (mean_of(|pair| pair.0), mean_of(|pair| pair.1));
        let covariance: f64 =
            pairs.iter().map(|(truth, found)| (truth - mean_truth) * (found - mean_found)).sum();
        let variance: f64 = pairs.iter().map(|(truth, _)| (truth - mean_truth).powi(2)).sum();
        Self {
            mean: errors.iter().sum::<f64>() / count,
            of_all: [at(0.99), at(1.0)],
            wrong: f64::from(wrong) / (count + f64::from(wrong)),
            answered: (count + f64::from(wrong)) / f64::from(all),
            within: std::array::from_fn(|place| {
                within[place].map(|within| within as f64 / counts[place] as f64)
            }),
            within_2_sigma: (within[0][1] + within[1][1]) as f64 / count,
            depth: scene.depth_px.map(|_| covariance / variance),
        }
    }

    /// Mean error, in px.
    pub(super) fn mean_px(&self) -> f64 {
        self.mean
    }

    /// Share of the errors within two sigma.
    pub(super) fn within_2_sigma(&self) -> f64 {
        self.within_2_sigma
    }

    /// Depth that was read over the true one; NaN without two levels.
    pub(super) fn depth(&self) -> f64 {
        self.depth.unwrap_or(f64::NAN)
    }

    /// A row of the table.
    pub(super) fn line(&self, name: &str, seconds: f64) -> String {
        let mpx = |px: f64| format!("{:.1}", 1e3 * px);
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        let depth = self.depth.map_or(String::new(), percent);
        let [most, largest] = self.of_all;
        let within = |[one, two]: [f64; 2]| {
            if one.is_nan() { String::new() } else { format!("{:.0} / {:.0}", 100.0 * one, 100.0 * two) }
        };
        format!(
            "| {name} | {} | {} | {} | {} | {} | {} | {} | {depth} | {seconds:.2} |",
            mpx(self.mean),
            mpx(most),
            mpx(largest),
            percent(self.wrong),
            percent(self.answered),
            within(self.within[0]),
            within(self.within[1]),
        )
    }
}

/// Whether a pixel, whose disparity is `truth`, lies beside an edge.
fn is_beside_an_edge(scene: &Scene, (x, y): (f64, f64), truth: f64) -> bool {
    [0.0_f64, 45.0, 90.0, 135.0].into_iter().any(|degrees| {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let (across, down) = (BESIDE_PX * cosine, BESIDE_PX * sine);
        let around = (scene.disparity)(x + across, y + down) + (scene.disparity)(x - across, y - down);
        (0.5 * around - truth).abs() > EDGE_PX
    })
}
