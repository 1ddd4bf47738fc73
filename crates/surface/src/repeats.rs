//! What repeated measurements of one object tell of the instrument.

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::student::{share_below, student_t_95};
use epirig_core::grid::Grid;
use epirig_core::statistics::mean;

/// Fewest common pixels of two maps.
const LEAST_PIXELS: usize = 100;
/// The repeatability limit in repeatability standard deviations: 1.96 times the root of 2 (ISO 5725-6, 4.1.4).
const LIMIT: f64 = 2.8;

/// How repeated values scatter (ISO 5725-2).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Repeatability {
    /// Number of values.
    pub count: usize,
    /// Degrees of freedom of the standard deviation: one less than the values of each object.
    pub degrees_of_freedom: usize,
    /// Their mean; `None` for values of several objects.
    pub mean: Option<f64>,
    /// Repeatability standard deviation s_r.
    pub deviation: f64,
    /// Lower end of its interval of 95 % coverage, for normal values.
    pub lower: f64,
    /// Upper end of that interval.
    pub upper: f64,
    /// Repeatability limit r: two values differ by less than that with a probability of 95 %.
    pub limit: f64,
}

impl Repeatability {
    /// Of finite values of one object; `None` for fewer than two.
    pub fn of(values: &[f64]) -> Option<Self> {
        Self::of_objects(&[values])
    }

    /// Of finite values of each of several objects; `None` if no object has two. Each object scatters about its own mean, and
    /// all of them are taken to scatter alike: their variances are pooled by their degrees of freedom.
    pub fn of_objects(values: &[impl AsRef<[f64]>]) -> Option<Self> {
        let objects = || values.iter().map(AsRef::as_ref).filter(|values| !values.is_empty());
        let count: usize = objects().map(<[f64]>::len).sum();
        let degrees_of_freedom = count - objects().count();
        if degrees_of_freedom == 0 || !objects().flatten().all(|value| value.is_finite()) {
            return None;
        }
        let degrees = degrees_of_freedom as f64;
        let deviation = (objects().map(|values| Sums::of(values).squares).sum::<f64>() / degrees).sqrt();
        let mut each = objects().map(|values| Sums::of(values).mean);
        let mean = each.next().filter(|_| each.next().is_none());
        let squares = ChiSquared::new(degrees).ok()?;
        let end = |share: f64| deviation * (degrees / squares.inverse_cdf(share)).sqrt();
        let (lower, upper) = (end(0.975), end(0.025));
        Some(Self { count, degrees_of_freedom, mean, deviation, lower, upper, limit: LIMIT * deviation })
    }

    /// How often values that scatter by the standard deviation `claimed` scatter as much as these, or more; 0 to 1.
    pub fn probability_beyond(&self, claimed: f64) -> f64 {
        let degrees = self.degrees_of_freedom as f64;
        let squares = degrees * (self.deviation / claimed).powi(2);
        ChiSquared::new(degrees).map_or(f64::NAN, |chi_squared| chi_squared.sf(squares))
    }

    /// How often the means of two series of the same normal process differ as far as these, or farther; 0 to 1. The two
    /// need not scatter alike (Welch 1947). `None` for series of several objects, and for those that do not scatter.
    pub fn probability_of_mean(&self, other: &Self) -> Option<f64> {
        let difference = (self.mean? - other.mean?).abs();
        let [one, two] = [self, other].map(|series| series.deviation.powi(2) / series.count as f64);
        if one <= 0.0 || two <= 0.0 {
            return None;
        }
        let part = |variance: f64, series: &Self| variance.powi(2) / series.degrees_of_freedom as f64;
        let degrees = (one + two).powi(2) / (part(one, self) + part(two, other));
        Some(2.0 * share_below(-difference / (one + two).sqrt(), degrees))
    }

    /// How often the standard deviations of two series of the same normal process differ by as large a factor as these,
    /// or a larger one; 0 to 1 (Fisher's F, two-sided). `None` for series that do not scatter.
    pub fn probability_of_scatter(&self, other: &Self) -> Option<f64> {
        let [one, two] = [self, other].map(|series| series.degrees_of_freedom as f64);
        if self.deviation <= 0.0 || other.deviation <= 0.0 {
            return None;
        }
        let ratio = (self.deviation / other.deviation).powi(2);
        let below = FisherSnedecor::new(one, two).ok()?.cdf(ratio);
        Some(2.0 * below.min(1.0 - below))
    }
}

/// Mean of values, and the sum of their squared distances from it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sums {
    pub(crate) mean: f64,
    pub(crate) squares: f64,
}

impl Sums {
    /// Of one value at least. Values that are all equal do not scatter, whatever rounding makes of their mean.
    pub(crate) fn of(values: &[f64]) -> Self {
        match values {
            [first, rest @ ..] if rest.iter().all(|value| value == first) => {
                Self { mean: *first, squares: 0.0 }
            }
            _ => {
                let mean = mean(values);
                Self { mean, squares: values.iter().map(|value| (value - mean).powi(2)).sum() }
            }
        }
    }
}

/// The noise of two maps of one object, by their difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseOfPair {
    /// Root mean square of the difference without its plane, over the root of 2, in mm.
    pub noise_mm: f64,
    /// Root mean square of each pixel's difference over its standard uncertainty: about 1 if noise is what the sigmas
    /// claim.
    pub over_claimed: f64,
    /// Pixels that both maps have.
    pub pixels: usize,
}

impl NoiseOfPair {
    /// Of two maps of heights with their standard uncertainties, all rows x columns, in mm, NaN for unknown. A plane is
    /// removed, because the zero of heights and the tilt of the object differ from scan to scan. `None` for maps of
    /// different size, or with fewer than a hundred common pixels.
    pub fn of(heights: [&Grid<f32>; 2], sigmas: [&Grid<f32>; 2]) -> Option<Self> {
        let [first, second] = heights;
        let size = |map: &Grid<f32>| (map.rows(), map.columns());
        if [second, sigmas[0], sigmas[1]].into_iter().any(|map| size(map) != size(first)) {
            return None;
        }
        let mut differences = Vec::new();
        for y in 0..first.rows() {
            for x in 0..first.columns() {
                let difference = f64::from(second.at(x, y)) - f64::from(first.at(x, y));
                let variance = sigmas.iter().map(|map| f64::from(map.at(x, y)).powi(2)).sum::<f64>();
                if difference.is_finite() && variance.is_finite() && variance > 0.0 {
                    let place = Vector3::new(1.0, x as f64, y as f64);
                    differences.push((place, difference, variance.recip()));
                }
            }
        }
        let pixels = differences.len();
        if pixels < LEAST_PIXELS {
            return None;
        }
        let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (place, difference, weight) in &differences {
            matrix += place * place.transpose() * *weight;
            right += place * (difference * weight);
        }
        let plane = matrix.cholesky()?.solve(&right);
        let degrees = (pixels - 3) as f64;
        let (mut squares, mut over_variances) = (0.0, 0.0);
        for (place, difference, weight) in &differences {
            let square = (difference - place.dot(&plane)).powi(2);
            squares += square;
            over_variances += square * weight;
        }
        Some(Self {
            noise_mm: (squares / degrees / 2.0).sqrt(),
            over_claimed: (over_variances / degrees).sqrt(),
            pixels,
        })
    }
}

/// Measurement noise N_M (ISO 25178-700): the noise of a map of heights by repeated measurements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MeasurementNoise {
    /// N_M, in mm.
    pub noise_mm: f64,
    /// Half the width of its interval of 95 % coverage, in mm, by the scatter of the pairs; `None` for one pair.
    pub half_width_95_mm: Option<f64>,
    /// Root mean square of the differences over their standard uncertainties: about 1 if noise is what the sigmas of the
    /// pixels claim. It is less if they hold errors that repeat, or are too large.
    pub over_claimed: f64,
    /// Number of pairs of maps.
    pub pairs: usize,
    /// Pixels of a typical pair: their mean.
    pub pixels: usize,
}

impl MeasurementNoise {
    /// Of pairs of successive maps; `None` without any.
    pub fn of(pairs: &[NoiseOfPair]) -> Option<Self> {
        if pairs.is_empty() {
            return None;
        }
        let mean_of =
            |value: &dyn Fn(&NoiseOfPair) -> f64| pairs.iter().map(value).sum::<f64>() / pairs.len() as f64;
        let noise_mm = mean_of(&|pair| pair.noise_mm.powi(2)).sqrt();
        let scatter = Repeatability::of(&pairs.iter().map(|pair| pair.noise_mm).collect::<Vec<_>>());
        let half_width_95_mm = scatter.map(|scatter| {
            let count = scatter.count as f64;
            student_t_95(count - 1.0) * scatter.deviation / count.sqrt()
        });
        Some(Self {
            noise_mm,
            half_width_95_mm,
            over_claimed: mean_of(&|pair| pair.over_claimed.powi(2)).sqrt(),
            pairs: pairs.len(),
            pixels: mean_of(&|pair| pair.pixels as f64).round() as usize,
        })
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;

    fn normal(random: &mut ChaCha8Rng) -> f64 {
        StandardNormal.sample(random)
    }

    #[test]
    fn a_standard_deviation_has_the_interval_of_the_tables() {
        // Of ten values, the interval of 95 % coverage is 0.688 s to 1.826 s (chi squared 19.023 and 2.700).
        let values: Vec<f64> = (0..10).map(f64::from).collect();
        let found = Repeatability::of(&values).unwrap();
        assert_eq!((found.count, found.mean), (10, Some(4.5)));
        assert!((found.deviation - 3.02765).abs() < 1e-5);
        assert!((found.lower / found.deviation - 0.688).abs() < 1e-3, "{found:?}");
        assert!((found.upper / found.deviation - 1.826).abs() < 1e-3, "{found:?}");
        // 16.919 is the 95 % quantile for nine degrees of freedom.
        let claimed = found.deviation * (9.0_f64 / 16.919).sqrt();
        assert!((found.probability_beyond(claimed) - 0.05).abs() < 1e-4);
        assert_eq!(Repeatability::of(&[1.0]), None);
    }

    #[test]
    fn the_interval_holds_the_truth_as_often_as_stated() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let runs = 2000;
        let inside = |_: &i32| {
            let values: Vec<f64> = (0..6).map(|_| 0.2 + 0.003 * normal(&mut random)).collect();
            let found = Repeatability::of(&values).unwrap();
            (found.lower..=found.upper).contains(&0.003)
        };
        let held = (0..runs).filter(inside).count() as f64;
        // Four standard deviations of a count with 95 % inside.
        assert!((held - 0.95 * 2000.0).abs() < 4.0 * (2000.0_f64 * 0.95 * 0.05).sqrt(), "{held}");
    }

    #[test]
    fn objects_scatter_each_about_its_own_mean() {
        let found = Repeatability::of_objects(&[&[1.0, 3.0][..], &[], &[11.0, 12.0, 13.0], &[7.0]]).unwrap();
        // Squares 2 and 2, of one and two degrees of freedom.
        assert_eq!((found.count, found.degrees_of_freedom), (6, 3));
        assert!((found.deviation - (4.0_f64 / 3.0).sqrt()).abs() < 1e-12, "{found:?}");
        assert_eq!(found.mean, None);
        assert_eq!(Repeatability::of_objects(&[[1.0], [2.0]]), None);
    }

    #[test]
    fn two_series_differ_by_the_tests_of_welch_and_fisher() {
        let series = |values: &[f64]| Repeatability::of(values).unwrap();
        // By scipy.stats.ttest_ind(equal_var=False) and by 2 min(F, 1 - F) of scipy.stats.f.
        let (one, two) = (series(&[1.0, 2.0, 4.0, 5.0]), series(&[6.0, 6.5, 7.5]));
        let [of_mean, of_scatter] = [one.probability_of_mean(&two), one.probability_of_scatter(&two)];
        assert!((of_mean.unwrap() - 0.020_467_78).abs() < 1e-6, "{of_mean:?}");
        assert!((of_scatter.unwrap() - 0.305_097_71).abs() < 1e-6, "{of_scatter:?}");
        assert_eq!(one.probability_of_mean(&one), Some(1.0));
    }

    #[test]
    fn equal_values_do_not_scatter_and_are_not_tested() {
        // The mean of three times 0.1 is not 0.1.
        for count in 2..9 {
            let same = Repeatability::of(&vec![0.1; count]).unwrap();
            assert_eq!((same.mean, same.deviation), (Some(0.1), 0.0));
            let other = Repeatability::of(&[0.1, 0.2]).unwrap();
            assert_eq!((same.probability_of_mean(&other), same.probability_of_scatter(&other)), (None, None));
        }
    }

    /// A surface with hollows, measured again and again with noise, and each time with another tilt.
    #[test]
    fn noise_is_told_apart_from_form_and_tilt() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let (rows, columns, sigma) = (60, 80, 0.004);
        let mut measured = |tilt: f64| {
            let mut map = Grid::filled(rows, columns, 0.0_f32);
            for y in 0..rows {
                for x in 0..columns {
                    let hollow = if (x / 20 + y / 20) % 2 == 0 { 0.2 } else { 0.0 };
                    let height = hollow + tilt * (x as f64 - 2.0 * y as f64) + sigma * normal(&mut random);
                    // Each map lacks other pixels.
                    map.row_mut(y)[x] = if normal(&mut random) > 2.0 { f32::NAN } else { height as f32 };
                }
            }
            map
        };
        let maps: Vec<Grid<f32>> = (0..6).map(|number| measured(1e-4 * f64::from(number * number))).collect();
        let sigmas = Grid::filled(rows, columns, sigma as f32);
        let pair = |pair: &[Grid<f32>]| NoiseOfPair::of([&pair[0], &pair[1]], [&sigmas, &sigmas]).unwrap();
        let pairs: Vec<NoiseOfPair> = maps.windows(2).map(pair).collect();
        let noise = MeasurementNoise::of(&pairs).unwrap();
        assert_eq!(noise.pairs, 5);
        assert!((4300..4800).contains(&noise.pixels), "{noise:?}");
        // 4,600 pixels give a standard deviation to 1 % (standard deviation of it), five pairs to half of that.
        assert!((noise.noise_mm / sigma - 1.0).abs() < 0.02, "{noise:?}");
        assert!(
            (noise.over_claimed - 1.0).abs() < 0.02 && noise.half_width_95_mm.unwrap() < 0.03 * sigma,
            "{noise:?}"
        );
        let other = Grid::filled(rows, columns + 1, 0.0);
        assert_eq!(NoiseOfPair::of([&maps[0], &other], [&sigmas, &sigmas]), None);
        assert_eq!(MeasurementNoise::of(&[]), None);
    }
}
