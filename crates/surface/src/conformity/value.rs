//! The values that are compared with limits, and their uncertainty.

use serde::Serialize;

use crate::roughness::Roughness;
use crate::steps::{Budget, Depth, Part};
use crate::student::student_t_95;
use crate::trend::{Trend, TrendKind};

epirig_core::choices! {
    /// What can have limits.
    pub enum Characteristic {
        /// Step height: depth of the hollows, or height of the raised parts, over all of them.
        Depth = "depth",
        /// The same of each part: every one of them must conform.
        EachDepth = "each-depth",
        /// Flatness deviation of the form: from its lowest to its highest point, without its tilt.
        Flatness = "flatness",
        /// Sa of the levels, or of the field if there are no two levels.
        Sa = "sa",
        /// Sq of the levels, or of the field if there are no two levels.
        Sq = "sq",
        /// Sz of the levels, or of the field if there are no two levels.
        Sz = "sz",
    }
}

/// A measured value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Value {
    /// The value, in mm.
    pub value_mm: f64,
    /// Its combined standard uncertainty, in mm; `None` if it is not known.
    pub sigma_mm: Option<f64>,
    /// The degrees of freedom of that.
    pub degrees_of_freedom: f64,
}

impl Value {
    /// The expanded uncertainty U, in mm: half the width of the interval of 95 % coverage.
    pub fn expanded_mm(self) -> Option<f64> {
        Some(student_t_95(self.degrees_of_freedom) * self.sigma_mm?)
    }
}

/// What was measured of a surface.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceValues<'a> {
    /// Depth over all parts, its budget, and each part; `None` if there are no two levels.
    pub levels: Option<(&'a Depth, &'a Budget, &'a [Part])>,
    /// The form.
    pub trend: &'a Trend,
    /// The roughness of the levels, or of the field.
    pub roughness: Option<&'a Roughness>,
    /// Relative standard uncertainty of the scale of all heights.
    pub scale_sigma: f64,
}

impl SurfaceValues<'_> {
    /// The values of a characteristic: one, or one for each part.
    ///
    /// # Errors
    /// Why it was not measured, in words.
    pub fn of(&self, characteristic: Characteristic) -> Result<Vec<Value>, String> {
        let one = |value: Value| Ok(vec![value]);
        match characteristic {
            Characteristic::Depth => self.levels.map_or_else(no_levels, |(depth, budget, _)| {
                one(Value {
                    value_mm: depth.depth_mm,
                    sigma_mm: budget.combined.map(|all| all.sigma_mm),
                    degrees_of_freedom: budget.combined.map_or(f64::NAN, |all| all.degrees_of_freedom),
                })
            }),
            Characteristic::EachDepth => self.levels.map_or_else(no_levels, |(depth, budget, parts)| {
                Ok(parts.iter().map(|part| of_part(&part.depth, depth, budget)).collect())
            }),
            Characteristic::Flatness => self.flatness(),
            Characteristic::Sa => self.rough(|rough| (rough.sa_mm, MEAN_OF_NORMAL)),
            Characteristic::Sq => self.rough(|rough| (rough.sq_mm, 1.0)),
            Characteristic::Sz => self.rough(|rough| (rough.sz_mm, range_of_normal(rough.pixels))),
        }
    }

    fn flatness(&self) -> Result<Vec<Value>, String> {
        if self.trend.kind.terms() <= TrendKind::Plane.terms() {
            return Err(format!("a {} form has no bow", self.trend.kind));
        }
        let value_mm = self.trend.bow_mm();
        let scale_mm = self.scale_sigma * value_mm;
        let sigma_mm = self.trend.bow_sigma_mm().map(|scatter_mm| scatter_mm.hypot(scale_mm));
        Ok(vec![Value { value_mm, sigma_mm, degrees_of_freedom: f64::INFINITY }])
    }

    /// Of a parameter of roughness, and what it is of normal noise with a standard deviation of 1. Noise adds to roughness
    /// in squares, and is not taken off: the parameter is too large by up to what noise explains. So that is the half
    /// width of a rectangular distribution (GUM, 4.3.7).
    fn rough(&self, of: impl Fn(&Roughness) -> (f64, f64)) -> Result<Vec<Value>, String> {
        let rough = self.roughness.ok_or_else(|| "no height is left for the roughness".to_owned())?;
        let (value_mm, of_noise) = of(rough);
        let by_noise = rough.sq_noise_mm.map(|noise_mm| {
            let without = (value_mm.powi(2) - (of_noise * noise_mm).powi(2)).max(0.0).sqrt();
            (value_mm - without) / 3.0_f64.sqrt()
        });
        let sigma_mm = by_noise.map(|by_noise| by_noise.hypot(self.scale_sigma * value_mm));
        Ok(vec![Value { value_mm, sigma_mm, degrees_of_freedom: f64::INFINITY }])
    }
}

fn no_levels() -> Result<Vec<Value>, String> {
    Err("there is no step height".to_owned())
}

/// Mean of the absolute value of a normal variable: the root of 2 / pi.
const MEAN_OF_NORMAL: f64 = 0.797_884_560_802_865_4;

/// From the lowest to the highest of so many independent normal variables, in standard deviations: at most twice the root
/// of 2 ln n.
fn range_of_normal(count: usize) -> f64 {
    2.0 * (2.0 * (count.max(2) as f64).ln()).sqrt()
}

/// The depth of a part: with its own scatter, and with all other contributions to the depth over all parts, which parts
/// share.
fn of_part(part: &Depth, whole: &Depth, budget: &Budget) -> Value {
    let unknown = Value { value_mm: part.depth_mm, sigma_mm: None, degrees_of_freedom: f64::NAN };
    let known = part.sigma_mm.zip(part.degrees_of_freedom).zip(budget.combined).zip(whole.sigma_mm);
    let Some((((own, degrees), combined), scatter)) = known else { return unknown };
    let shared = (combined.sigma_mm.powi(2) - scatter.powi(2)).max(0.0);
    let variance = own.powi(2) + shared;
    // Welch and Satterthwaite (GUM, G.4); only the scatter has finite degrees of freedom.
    let degrees_of_freedom = if own > 0.0 { degrees * variance.powi(2) / own.powi(4) } else { f64::INFINITY };
    Value { value_mm: part.depth_mm, sigma_mm: Some(variance.sqrt()), degrees_of_freedom }
}
