//! Student's distribution.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// From here on it is the normal distribution to five digits.
const NORMAL: f64 = 1e5;

/// What `of` says of the distribution with this number of degrees of freedom; at least 1, and not always whole.
fn students(degrees_of_freedom: f64, of: impl Fn(&dyn ContinuousCDF<f64, f64>) -> f64) -> f64 {
    if degrees_of_freedom > NORMAL {
        return of(&Normal::standard());
    }
    StudentsT::new(0.0, 1.0, degrees_of_freedom.max(1.0)).map_or(f64::NAN, |students| of(&students))
}

/// The half width, in standard deviations, of the interval that holds 95 % of Student's distribution with
/// this number of degrees of freedom, at least 1; it need not be whole.
pub fn student_t_95(degrees_of_freedom: f64) -> f64 {
    students(degrees_of_freedom, |students| students.inverse_cdf(0.975))
}

/// The share of Student's distribution below `t` standard deviations, 0 to 1; degrees of freedom as for
/// [`student_t_95`].
pub(crate) fn share_below(t: f64, degrees_of_freedom: f64) -> f64 {
    students(degrees_of_freedom, |students| students.cdf(t))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_student_s_distribution_are_those_of_the_tables() {
        for (degrees, table) in
            [(1.0, 12.706), (2.0, 4.303), (4.0, 2.776), (10.0, 2.228), (30.0, 2.042), (120.0, 1.980)]
        {
            let found = student_t_95(degrees);
            assert!((found - table).abs() < 1e-3 * table, "{degrees}: {found}");
        }
        // Of many: z + (z^3 + z) / 4 n (Abramowitz and Stegun, 26.7.5), with z = 1.959964 of the normal distribution.
        let z: f64 = 1.959_964;
        for degrees in [1e3, 1e4, 9.9e4, 1e5, 1.1e5, 1e9, f64::INFINITY] {
            let series = z + (z.powi(3) + z) / (4.0 * degrees);
            assert!((student_t_95(degrees) - series).abs() < 3e-5, "{degrees}: {}", student_t_95(degrees));
        }
    }

    #[test]
    fn more_degrees_of_freedom_make_it_narrower() {
        let widths: Vec<f64> =
            (0..=1400).map(|step| student_t_95(10_f64.powf(0.005 * f64::from(step)))).collect();
        assert!(widths.windows(2).all(|pair| pair[1] < pair[0] + 1e-5), "{widths:?}");
    }

    #[test]
    fn shares_below_are_those_of_the_tables() {
        // Of one degree it is Cauchy's distribution: 1/2 + atan(t) / pi.
        for t in [-3.0_f64, -0.5, 0.0, 1.0, 12.706] {
            let truth = 0.5 + t.atan() / std::f64::consts::PI;
            assert!((share_below(t, 1.0) - truth).abs() < 1e-9, "{t}");
        }
        for (t, degrees, table) in
            [(1.812, 10.0, 0.95), (1.645, 1e9, 0.95), (-1.645, f64::INFINITY, 0.05), (2.764, 10.0, 0.99)]
        {
            assert!((share_below(t, degrees) - table).abs() < 1e-4, "{t}, {degrees}");
        }
        assert_eq!((share_below(f64::INFINITY, 3.0), share_below(f64::NEG_INFINITY, 3.0)), (1.0, 0.0));
    }
}
