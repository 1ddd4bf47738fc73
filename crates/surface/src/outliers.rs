//! Heights that cannot belong to the surface: few pixels together, far beyond its levels.
//!
//! A single wrong answer of the matcher would decide Sz. But a real hollow may lie far from a flat surface,
//! too. What tells them apart is the area.

use super::Heights;
use super::connected::connected;
use super::steps::Steps;
use epirig_core::grid::Grid;
use epirig_core::statistics::{SIGMA_OF_MEDIAN, quantile};

/// A height this many standard deviations above the upper or below the lower level is far off. Heights of a
/// real surface seldom are: of a Gaussian one none, of a sine none.
const FAR: f64 = 8.0;

/// Marks the outliers of `rest_mm`, the heights without their form: connected pixels, fewer than
/// `least_area_px`, that all lie more than eight standard deviations beyond the levels, on one side.
///
/// With `steps`, the levels are the two of them, and heights between them are walls. Without, there is one
/// level, the median. The standard deviation is that of the heights about their level (from the median
/// deviation, which few wrong heights do not change), and at least the median sigma of the pixels.
pub fn find_outliers(
    rest_mm: &Grid<f32>,
    heights: &Heights,
    steps: Option<&Steps>,
    least_area_px: usize,
) -> Grid<bool> {
    let mut outliers = rest_mm.map(|_| false);
    let depth_mm = steps.map_or(0.0, |steps| steps.depth.depth_mm);
    let on_level = |index: usize| {
        let lower = steps.is_some_and(|steps| steps.lower.values()[index]);
        f64::from(rest_mm.values()[index]) + if lower { depth_mm } else { 0.0 }
    };
    let mut about: Vec<f64> =
        (0..rest_mm.values().len()).map(on_level).filter(|height| height.is_finite()).collect();
    let Some(level) = quantile(&mut about, 0.5) else { return outliers };
    about.iter_mut().for_each(|height| *height = (*height - level).abs());
    let scatter = SIGMA_OF_MEDIAN * quantile(&mut about, 0.5).unwrap_or(0.0);
    let sigmas = heights.sigma_mm.values().iter().zip(rest_mm.values());
    let mut sigmas: Vec<f64> =
        sigmas.filter(|(_, height)| height.is_finite()).map(|(&sigma, _)| f64::from(sigma)).collect();
    sigmas.retain(|sigma| sigma.is_finite());
    let reach = FAR * scatter.max(quantile(&mut sigmas, 0.5).unwrap_or(0.0));
    let side = rest_mm.map(|height| match f64::from(height) {
        height if height > level + reach => 1_i8,
        height if height < level - depth_mm - reach => -1,
        _ => 0,
    });
    for part in
        connected(&side, |side| side != 0).into_iter().filter(|part| part.pixels.len() < least_area_px)
    {
        part.pixels.into_iter().for_each(|(x, y)| outliers.row_mut(y)[x] = true);
    }
    outliers
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::{Geometry, StepsOptions, TrendKind, find_steps};

    const SCATTER_MM: f64 = 0.02;

    /// 120 x 100 px, `height_mm` and Gaussian noise.
    fn field(height_mm: impl Fn(usize, usize) -> f64) -> Heights {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
        let value = |index: usize| (height_mm(index % 120, index / 120) + SCATTER_MM * noise()) as f32;
        Heights {
            height_mm: Grid::from_values(100, 120, (0..12_000).map(value).collect()).unwrap(),
            sigma_mm: Grid::filled(100, 120, SCATTER_MM as f32),
            distance_mm: 1e6,
            geometry: Geometry::exact(2e6, 100.0, (59.5, 49.5)),
        }
    }

    fn count(outliers: &Grid<bool>) -> usize {
        outliers.values().iter().filter(|&&outlier| outlier).count()
    }

    #[test]
    fn wrong_answers_go_and_noise_stays() {
        let clean = field(|_, _| 0.0);
        assert_eq!(count(&find_outliers(&clean.height_mm, &clean, None, 100)), 0);
        // A single pixel, a patch of 5 x 4 px, and one below.
        let wrong = field(|x, y| match (x, y) {
            (7, 9) => 5.9,
            (50..55, 40..44) => 3.0,
            (100, 80) => -2.0,
            _ => 0.0,
        });
        let found = find_outliers(&wrong.height_mm, &wrong, None, 100);
        assert_eq!(count(&found), 1 + 20 + 1);
        assert!(found.at(7, 9) && found.at(54, 43) && found.at(100, 80));
    }

    #[test]
    fn what_is_large_enough_to_be_real_stays() {
        // A pit of 12 x 10 px, 50 standard deviations deep, in a field that has one level for it.
        let pit = field(|x, y| if (30..42).contains(&x) && (30..40).contains(&y) { -1.0 } else { 0.0 });
        assert_eq!(count(&find_outliers(&pit.height_mm, &pit, None, 100)), 0);
        assert_eq!(count(&find_outliers(&pit.height_mm, &pit, None, 121)), 120);
    }

    #[test]
    fn levels_and_the_walls_between_them_are_no_outliers() {
        // Columns 40 to 79 lie 1 mm lower, behind walls of three pixels; and there is one wrong answer.
        let depth = |x: usize| match x {
            40..80 => 1.0,
            37..40 => (x - 36) as f64 / 4.0,
            80..83 => (83 - x) as f64 / 4.0,
            _ => 0.0,
        };
        let heights = field(|x, y| if (x, y) == (60, 50) { -4.0 } else { -depth(x) });
        let options = StepsOptions::for_window(TrendKind::Constant, 7);
        let steps = find_steps(&heights, None, &options).unwrap();
        let rest_mm = steps.trend.removed_from(&heights);
        let found = find_outliers(&rest_mm, &heights, Some(&steps), options.least_area_px);
        assert!(found.at(60, 50));
        assert_eq!(count(&found), 1);
    }
}
