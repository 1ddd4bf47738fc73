//! How far a match is from the truth.

use super::scenes::Scene;
use epirig_matcher::DisparityMaps;

/// Pixels at the border that do not count: there points leave the image in most frames.
const BORDER_PX: usize = 14;
/// An answer farther off is wrong, not inaccurate, in px.
const WRONG_PX: f64 = 0.5;

pub(super) struct Score {
    mean: f64,
    of_all: [f64; 2],
    wrong: f64,
    answered: f64,
    within: [f64; 2],
    /// Depth that was read over the true one.
    depth: Option<f64>,
}

impl Score {
    pub(super) const HEAD: &'static str = "| scene | mean error, mpx | 99 % below | largest | wrong | answered | within 1 sigma | 2 sigma | depth read | s |\n\
         | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |";

    pub(super) fn of(scene: &Scene, maps: &DisparityMaps) -> Self {
        let (rows, columns) = (maps.disparity.rows(), maps.disparity.columns());
        let (right, down) = (0.5 * (columns - 1) as f64, 0.5 * (rows - 1) as f64);
        let (mut errors, mut wrong, mut all) = (Vec::new(), 0, 0);
        let mut within = [0; 2];
        // Regression of what was found on the truth.
        let mut pairs: Vec<(f64, f64)> = Vec::new();
        for (x, y) in
            (BORDER_PX..rows - BORDER_PX).flat_map(|y| (BORDER_PX..columns - BORDER_PX).map(move |x| (x, y)))
        {
            all += 1;
            let truth = (scene.disparity)(x as f64 - right, y as f64 - down);
            let (found, sigma) = (f64::from(maps.disparity.at(x, y)), f64::from(maps.sigma.at(x, y)));
            if !found.is_finite() {
                continue;
            }
            let error = (found - truth).abs();
            if error > WRONG_PX {
                wrong += 1;
                continue;
            }
            for (count, sigmas) in within.iter_mut().zip([1.0, 2.0]) {
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
            within: within.map(|within| within as f64 / count),
            depth: scene.depth_px.map(|_| covariance / variance),
        }
    }

    /// Mean error, in px.
    pub(super) fn mean_px(&self) -> f64 {
        self.mean
    }

    /// Share of the errors within two sigma.
    pub(super) fn within_2_sigma(&self) -> f64 {
        self.within[1]
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
        format!(
            "| {name} | {} | {} | {} | {} | {} | {} | {} | {depth} | {seconds:.2} |",
            mpx(self.mean),
            mpx(most),
            mpx(largest),
            percent(self.wrong),
            percent(self.answered),
            percent(self.within[0]),
            percent(self.within[1]),
        )
    }
}
