//! Roughness of a field by the parameters of ISO 25178-2.

use serde::Serialize;

use epirig_core::grid::Grid;

/// Height parameters of a field after its form was removed. Pixels without a height do not count.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Roughness {
    /// Sa: mean distance from the mean height, in mm.
    pub sa_mm: f64,
    /// Sq: root mean square distance from the mean height, in mm.
    pub sq_mm: f64,
    /// Sz: from the lowest to the highest pixel, in mm. Outliers must be left out before.
    pub sz_mm: f64,
    /// Ssk: skewness; negative where hollows prevail.
    pub ssk: f64,
    /// Sku: kurtosis; 3 for Gaussian heights, 1 for two levels of equal share.
    pub sku: f64,
    /// Sq that a flat surface would show by the noise that the pixels' sigmas state: their root mean square,
    /// in mm; `None` behind an S-filter, which changes the noise.
    pub sq_noise_mm: Option<f64>,
    /// Sq without that: the root of Sq^2 - noise^2, in mm; 0 if there is no more than noise.
    pub sq_without_noise_mm: Option<f64>,
    /// Pixels that it was found from.
    pub pixels: usize,
}

/// Roughness of the pixels of `rest_mm` (heights without their form) that `counts` chooses; `None` if it
/// chooses no known one.
///
/// ```
/// use epirig_core::grid::Grid;
/// use epirig_surface::roughness;
///
/// let rest = Grid::from_values(1, 4, vec![3.0, -1.0, -3.0, 1.0]).unwrap();
/// let found = roughness(&rest, &Grid::filled(1, 4, 1.0), |_, _| true).unwrap();
/// assert_eq!((found.sa_mm, found.sz_mm), (2.0, 6.0));
/// assert_eq!((found.sq_mm, found.sq_without_noise_mm), (5_f64.sqrt(), Some(2.0)));
/// ```
pub fn roughness(
    rest_mm: &Grid<f32>,
    sigma_mm: &Grid<f32>,
    counts: impl Fn(usize, usize) -> bool,
) -> Option<Roughness> {
    let chosen = || {
        let places = (0..rest_mm.rows()).flat_map(|y| (0..rest_mm.columns()).map(move |x| (x, y)));
        let known = places
            .filter(|&(x, y)| rest_mm.at(x, y).is_finite() && sigma_mm.at(x, y).is_finite() && counts(x, y));
        known.map(|(x, y)| (f64::from(rest_mm.at(x, y)), f64::from(sigma_mm.at(x, y))))
    };
    let pixels = chosen().count();
    if pixels == 0 {
        return None;
    }
    let mean_of = |of: &dyn Fn(f64, f64) -> f64| {
        chosen().map(|(height, sigma)| of(height, sigma)).sum::<f64>() / pixels as f64
    };
    let mean = mean_of(&|height, _| height);
    let power = |exponent: i32| mean_of(&|height, _| (height - mean).powi(exponent));
    let sq_mm = power(2).sqrt();
    let sq_noise_mm = mean_of(&|_, sigma| sigma * sigma).sqrt();
    let (low, high) = chosen().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (height, _)| {
        (low.min(height), high.max(height))
    });
    // Of a field that is perfectly flat the shape has no meaning; it is that of a single level.
    let shape = |exponent: i32| if sq_mm > 0.0 { power(exponent) / sq_mm.powi(exponent) } else { 0.0 };
    Some(Roughness {
        sa_mm: mean_of(&|height, _| (height - mean).abs()),
        sq_mm,
        sz_mm: high - low,
        ssk: shape(3),
        sku: shape(4),
        sq_noise_mm: Some(sq_noise_mm),
        sq_without_noise_mm: Some((sq_mm * sq_mm - sq_noise_mm * sq_noise_mm).max(0.0).sqrt()),
        pixels,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_has_the_roughness_of_the_textbook() {
        // Amplitude A: Sa = 2 A / pi, Sq = A / sqrt 2, Sz = 2 A, Ssk = 0, Sku = 3/2.
        let values =
            (0..1000).map(|x| 0.5 * (x as f32 * std::f32::consts::TAU / 1000.0).sin() + 4.0).collect();
        let field = Grid::from_values(1, 1000, values).unwrap();
        let found = roughness(&field, &Grid::filled(1, 1000, 0.01), |_, _| true).unwrap();
        // Heights are stored to 4e-7.
        for (name, value, truth) in [
            ("Sa", found.sa_mm, 1.0 / std::f64::consts::PI),
            ("Sq", found.sq_mm, 0.5 / 2_f64.sqrt()),
            ("Sz", found.sz_mm, 1.0),
            ("Ssk", found.ssk, 0.0),
            ("Sku", found.sku, 1.5),
            ("noise", found.sq_noise_mm.unwrap(), 0.01),
        ] {
            assert!((value - truth).abs() < 1e-5, "{name}: {value}, not {truth}");
        }
    }

    #[test]
    fn two_levels_by_hand_with_a_hole() {
        // Heights 0, 0, 0, -0.2: mean -0.05; Sa = (3 * 0.05 + 0.15) / 4; Sq^2 = (3 * 0.0025 + 0.0225) / 4 =
        // 0.0075; third moment (3 * 0.000125 - 0.003375) / 4 = -0.00075; fourth (3 * 6.25e-6 + 5.0625e-4) /
        // 4 = 1.3125e-4.
        let field = Grid::from_values(1, 5, vec![0.0, 0.0, f32::NAN, 0.0, -0.2]).unwrap();
        let found = roughness(&field, &Grid::filled(1, 5, 0.2), |_, _| true).unwrap();
        assert_eq!(found.pixels, 4);
        assert!((found.sa_mm - 0.075).abs() < 1e-8);
        assert!((found.sq_mm - 0.0075_f64.sqrt()).abs() < 1e-8);
        assert!((found.ssk + 0.00075 / 0.0075_f64.powf(1.5)).abs() < 1e-6);
        assert!((found.sku - 1.3125e-4 / 0.0075_f64.powi(2)).abs() < 1e-6);
        assert_eq!(found.sq_without_noise_mm, Some(0.0), "more noise than relief");
        assert_eq!(roughness(&field, &field, |x, _| x == 2), None);
    }
}
