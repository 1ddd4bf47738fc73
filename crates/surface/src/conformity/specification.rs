//! A specification, and whether a surface conforms to it.

use serde::Serialize;

use super::{Characteristic, DecisionRule, Limits, Rule, SurfaceValues, Tolerance, Value, Verdict};

/// What is asked of a surface: limits, and the rule by which it is decided.
#[derive(Debug, Clone, PartialEq)]
pub struct Specification {
    /// The limits.
    pub tolerance: Tolerance,
    /// The rule.
    pub rule: Rule,
}

/// Whether a surface conforms to its specification.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Conformity {
    /// The rule.
    pub rule: DecisionRule,
    /// Largest probability of a wrong decision, 0 to 1; `None` for a rule without one.
    pub risk: Option<f64>,
    /// Of all together: fail if one fails, else undecided if one is undecided.
    pub verdict: Verdict,
    /// Each value with its limits, in the order of the specification.
    pub judgements: Vec<Judgement>,
}

/// What is decided about one value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judgement {
    /// What has the limits.
    pub characteristic: Characteristic,
    /// The part, counted from 1 as in `hollows.csv`; `None` for what is no part.
    pub part: Option<usize>,
    /// The limits, in mm.
    pub limits: Limits,
    /// The value; `None` if it was not measured.
    pub value: Option<Value>,
    /// Its expanded uncertainty, in mm: half the width of the interval of 95 % coverage; `None` if that is not known.
    pub half_width_95_mm: Option<f64>,
    /// Probability that the quantity lies within its limits, 0 to 1; `None` if that is not known.
    pub conformance_probability: Option<f64>,
    /// The verdict.
    pub verdict: Verdict,
    /// Why nothing is decided, in words.
    pub undecided: Option<String>,
}

impl Specification {
    /// Whether a surface conforms; `None` without limits.
    pub fn judge(&self, values: &SurfaceValues<'_>) -> Option<Conformity> {
        let limits = self.tolerance.limits().iter();
        let judgements: Vec<Judgement> = limits
            .flat_map(|&(characteristic, limits)| self.judge_one(characteristic, limits, values))
            .collect();
        let has = |verdict| judgements.iter().any(|one| one.verdict == verdict);
        let verdict = match () {
            () if judgements.is_empty() => return None,
            () if has(Verdict::Fail) => Verdict::Fail,
            () if has(Verdict::Undecided) => Verdict::Undecided,
            () => Verdict::Pass,
        };
        let Rule { decision, risk } = self.rule;
        let risk = (decision == DecisionRule::GuardedRisk).then_some(risk);
        Some(Conformity { rule: decision, risk, verdict, judgements })
    }

    /// The judgements of a characteristic: one, or one for each part.
    fn judge_one(
        &self,
        characteristic: Characteristic,
        limits: Limits,
        values: &SurfaceValues<'_>,
    ) -> Vec<Judgement> {
        let empty = Judgement {
            characteristic,
            part: None,
            limits,
            value: None,
            half_width_95_mm: None,
            conformance_probability: None,
            verdict: Verdict::Undecided,
            undecided: None,
        };
        let values = match values.of(characteristic) {
            Ok(values) => values,
            Err(why) => return vec![Judgement { undecided: Some(why), ..empty }],
        };
        let of_parts = characteristic == Characteristic::EachDepth;
        let judged = |(index, value): (usize, Value)| {
            let (verdict, why) = self.rule.decide(value, limits);
            Judgement {
                part: of_parts.then_some(index + 1),
                value: Some(value),
                half_width_95_mm: value.expanded_mm(),
                conformance_probability: value.conformance_probability(limits),
                verdict,
                undecided: why.map(str::to_owned),
                ..empty.clone()
            }
        };
        values.into_iter().enumerate().map(judged).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::ScaleSigma;
    use crate::roughness::Roughness;
    use crate::steps::{Budget, Combined, Depth, Part};
    use crate::trend::{Trend, TrendKind};

    const SCALE: ScaleSigma = ScaleSigma { focal_length: Some(0.003), baseline: Some(0.004) };

    fn depth(depth_mm: f64, sigma_mm: f64) -> Depth {
        Depth {
            depth_mm,
            sigma_mm: Some(sigma_mm),
            degrees_of_freedom: Some(10.0),
            half_width_95_mm: None,
            scale_sigma_mm: SCALE.together() * depth_mm,
        }
    }

    fn part(depth: Depth) -> Part {
        Part { centre_x_px: 0.0, centre_y_px: 0.0, area_px: 900, area_mm2: 9.0, used_px: 400, depth }
    }

    fn trend() -> Trend {
        Trend {
            kind: TrendKind::Quadric,
            centre_mm: (0.0, 0.0),
            coefficients: vec![0.0, 0.1, 0.1, 0.001, 0.0, 0.0],
            sigmas: [0.1, 0.1, 0.1, 3e-5, 0.0, 0.0].map(Some).to_vec(),
            pixels: 1000,
            outliers: 0,
            half_extent_mm: (10.0, 10.0),
        }
    }

    fn roughness() -> Roughness {
        Roughness {
            sa_mm: 0.004,
            sq_mm: 0.005,
            sz_mm: 0.03,
            ssk: 0.0,
            sku: 3.0,
            sq_noise_mm: Some(0.003),
            sq_without_noise_mm: Some(0.004),
            pixels: 1000,
        }
    }

    fn judged(tolerance: &str, measured: bool) -> Conformity {
        // Scatter 0.3 um; all together 0.5 um.
        let whole = depth(0.2, 0.0003);
        let combined = Combined {
            sigma_mm: 0.0005,
            degrees_of_freedom: 77.2,
            coverage_factor: 1.99,
            half_width_95_mm: 0.001,
        };
        let budget = Budget { contributions: Vec::new(), combined: Some(combined) };
        let parts = [part(depth(0.201, 0.0003)), part(depth(0.2055, 0.0003))];
        let (trend, roughness) = (trend(), roughness());
        let values = SurfaceValues {
            levels: measured.then_some((&whole, &budget, &parts[..])),
            trend: &trend,
            roughness: Some(&roughness),
            scale_sigma: SCALE.together(),
        };
        let rule = Rule { decision: DecisionRule::GuardedRisk, risk: 0.05 };
        let specification = Specification { tolerance: tolerance.parse().unwrap(), rule };
        specification.judge(&values).unwrap()
    }

    fn sigma_mm(tolerance: &str) -> f64 {
        judged(tolerance, true).judgements[0].value.unwrap().sigma_mm.unwrap()
    }

    #[test]
    fn one_failure_fails_all_and_one_doubt_leaves_all_undecided() {
        let of = |tolerance| judged(tolerance, true).verdict;
        assert_eq!(of("0.19..0.21 mm"), Verdict::Pass);
        assert_eq!(of("0.19..0.21 mm, sa ..1 um"), Verdict::Fail);
        // The value is the limit.
        assert_eq!(of("depth 0.2 mm.."), Verdict::Undecided);
        assert_eq!(of("0.2 mm.., flatness ..0.2 mm"), Verdict::Undecided);
        assert_eq!(of("0.2 mm.., flatness ..0.01 mm"), Verdict::Fail);
    }

    #[test]
    fn each_part_is_judged_with_what_parts_share() {
        let found = judged("each-depth 0.195..0.205 mm", true);
        let verdicts: Vec<_> = found.judgements.iter().map(|one| (one.part, one.verdict)).collect();
        assert_eq!(verdicts, [(Some(1), Verdict::Pass), (Some(2), Verdict::Undecided)]);
        // Shared: 0.5^2 - 0.3^2 = 0.4^2; with 0.3 of its own that is 0.5 again, and 10 (0.5 / 0.3)^4 degrees of freedom.
        let value = found.judgements[0].value.unwrap();
        assert!((value.sigma_mm.unwrap() - 0.0005).abs() < 1e-12);
        assert!((value.degrees_of_freedom - 10.0 * (5.0_f64 / 3.0).powi(4)).abs() < 1e-9);
    }

    #[test]
    fn what_was_not_measured_is_undecided_and_says_why() {
        let found = judged("each-depth 0.19..0.21 mm, sq ..1 mm", false);
        assert_eq!((found.verdict, found.judgements[1].verdict), (Verdict::Undecided, Verdict::Pass));
        assert_eq!(found.judgements[0].undecided.as_deref(), Some("there is no step height"));
        assert_eq!(found.judgements[0].value, None);
    }

    #[test]
    fn roughness_is_too_large_by_what_noise_explains() {
        // Sq: 0.005 with noise, 0.004 without; the scale, 0.003 and 0.004, is known to 0.005.
        let by_noise = 0.001 / 3.0_f64.sqrt();
        assert!((sigma_mm("sq ..1 mm") - by_noise.hypot(0.005 * 0.005)).abs() < 1e-12);
        // Of Sa 0.004 noise of 0.003 explains 0.003 sqrt(2 / pi).
        let without = (0.004_f64.powi(2) - 0.003_f64.powi(2) * 2.0 / std::f64::consts::PI).sqrt();
        let sa = ((0.004 - without) / 3.0_f64.sqrt()).hypot(0.005 * 0.004);
        assert!((sigma_mm("sa ..1 mm") - sa).abs() < 1e-12);
        // The range of noise alone is as large: 2 (0.003) sqrt(2 ln 1000) = 0.0223 of 0.03.
        assert!(sigma_mm("sz ..1 mm") > 0.005);
    }

    #[test]
    fn flatness_is_that_of_the_form_without_its_tilt() {
        let found = judged("flatness ..0.2 mm", true);
        let value = found.judgements[0].value.unwrap();
        // 0.001 (10)^2; by scatter 3e-5 (10)^2, by the scale 0.005 of it.
        assert!((value.value_mm - 0.1).abs() < 1e-12);
        assert!((value.sigma_mm.unwrap() - 0.003_f64.hypot(0.0005)).abs() < 1e-12);
    }

    #[test]
    fn without_limits_there_is_no_verdict() {
        let rule = Rule { decision: DecisionRule::Simple, risk: 0.05 };
        let trend = trend();
        let values = SurfaceValues { levels: None, trend: &trend, roughness: None, scale_sigma: 0.0 };
        let nothing = Specification { tolerance: Tolerance::default(), rule };
        assert_eq!(nothing.judge(&values), None);
    }
}
