//! Decision rules, and what they decide about one value.

use super::{Limits, Value};
use crate::student::share_below;

epirig_core::choices! {
    /// How it is decided whether a value conforms to its limits.
    #[derive(Default)]
    pub enum DecisionRule {
        /// ISO 14253-1: what is proven with at most the stated risk passes or fails; else it is undecided.
        ///
        /// Conformity is proven if the conformance probability is at least 1 - risk; non-conformity, if the value lies
        /// beyond one of the limits with such a probability. Limits that are closer than the uncertainty prove neither.
        #[default]
        GuardedRisk = "guarded-risk",
        /// The same with a guard band as wide as the expanded uncertainty U (95 % coverage), JCGM 106, 8.3.2.
        GuardedCoverage = "guarded-coverage",
        /// Simple acceptance: a value within its limits passes, whatever its uncertainty (JCGM 106, 8.2).
        Simple = "simple",
    }
}

epirig_core::choices! {
    /// The verdict about a value, or about all of them.
    pub enum Verdict {
        /// Conformity is proven, or accepted.
        Pass = "pass",
        /// Non-conformity is proven, or a value is rejected.
        Fail = "fail",
        /// Neither is proven, or the value is not known.
        Undecided = "undecided",
    }
}

/// A decision rule with its risk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rule {
    /// The rule.
    pub decision: DecisionRule,
    /// Largest probability of a wrong decision, 0 to 1; only [`DecisionRule::GuardedRisk`] has it.
    pub risk: f64,
}

impl Value {
    /// Probability that the quantity lies within limits, 0 to 1 (JCGM 106, 7): its distribution is Student's about
    /// the value, as wide as its standard uncertainty. `None` if that is not known.
    pub fn conformance_probability(self, limits: Limits) -> Option<f64> {
        let (below, above) = self.beyond(limits)?;
        Some((1.0 - below - above).clamp(0.0, 1.0))
    }

    /// Probabilities that the quantity lies below the lower limit and above the upper one; 0 without that limit.
    fn beyond(self, limits: Limits) -> Option<(f64, f64)> {
        let sigma_mm = self.sigma_mm.filter(|_| self.value_mm.is_finite())?;
        let below = |limit_mm: f64, from_mm: f64| match sigma_mm > 0.0 {
            true => share_below((limit_mm - from_mm) / sigma_mm, self.degrees_of_freedom),
            false => f64::from(u8::from(from_mm < limit_mm)),
        };
        let beyond_lower = limits.lower_mm().map_or(0.0, |lower| below(lower, self.value_mm));
        // The distribution is symmetric.
        let beyond_upper = limits.upper_mm().map_or(0.0, |upper| below(-upper, -self.value_mm));
        Some((beyond_lower, beyond_upper))
    }
}

impl Rule {
    /// What it decides about a value, and why if that is nothing.
    pub fn decide(self, value: Value, limits: Limits) -> (Verdict, Option<&'static str>) {
        const NOT_KNOWN: &str = "its uncertainty is not known";
        const NEITHER: &str = "neither conformity nor non-conformity is proven";
        let proven = |pass: bool, fail: bool| match (pass, fail) {
            (true, _) => (Verdict::Pass, None),
            (_, true) => (Verdict::Fail, None),
            _ => (Verdict::Undecided, Some(NEITHER)),
        };
        match self.decision {
            DecisionRule::Simple => {
                let holds = limits.hold(value.value_mm);
                proven(holds, !holds)
            }
            DecisionRule::GuardedRisk => match value.beyond(limits) {
                Some((below, above)) => {
                    proven(below + above <= self.risk, below.max(above) >= 1.0 - self.risk)
                }
                None => (Verdict::Undecided, Some(NOT_KNOWN)),
            },
            DecisionRule::GuardedCoverage => match value.expanded_mm() {
                Some(band_mm) => {
                    let hold =
                        |limits: Option<Limits>| limits.is_some_and(|limits| limits.hold(value.value_mm));
                    proven(hold(limits.widened_by(-band_mm)), !hold(limits.widened_by(band_mm)))
                }
                None => (Verdict::Undecided, Some(NOT_KNOWN)),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution as _, StudentT, Uniform};

    use super::*;

    const SIGMA_MM: f64 = 0.002;

    fn value(value_mm: f64, degrees_of_freedom: f64) -> Value {
        Value { value_mm, sigma_mm: Some(SIGMA_MM), degrees_of_freedom }
    }

    fn limits() -> Limits {
        Limits::new(Some(0.19), Some(0.21)).unwrap()
    }

    #[test]
    fn each_rule_decides_at_its_own_places() {
        let decided = |decision, value_mm| {
            let rule = Rule { decision, risk: 0.05 };
            rule.decide(value(value_mm, f64::INFINITY), limits()).0
        };
        // In standard uncertainties from the upper limit. One-sided, 5 % lie beyond 1.645, and U is 1.96.
        let cases = [
            (-1.97, [Verdict::Pass, Verdict::Pass, Verdict::Pass]),
            (-1.95, [Verdict::Pass, Verdict::Undecided, Verdict::Pass]),
            (-1.66, [Verdict::Pass, Verdict::Undecided, Verdict::Pass]),
            (-1.63, [Verdict::Undecided, Verdict::Undecided, Verdict::Pass]),
            (0.01, [Verdict::Undecided, Verdict::Undecided, Verdict::Fail]),
            (1.63, [Verdict::Undecided, Verdict::Undecided, Verdict::Fail]),
            (1.66, [Verdict::Fail, Verdict::Undecided, Verdict::Fail]),
            (1.97, [Verdict::Fail, Verdict::Fail, Verdict::Fail]),
        ];
        for (sigmas, verdicts) in cases {
            let value_mm = 0.21 + sigmas * SIGMA_MM;
            let all = [DecisionRule::GuardedRisk, DecisionRule::GuardedCoverage, DecisionRule::Simple];
            assert_eq!(all.map(|rule| decided(rule, value_mm)), verdicts, "{sigmas}");
            // The lower limit is the mirror image.
            assert_eq!(all.map(|rule| decided(rule, 0.4 - value_mm)), verdicts, "{sigmas} from the lower");
        }
    }

    #[test]
    fn limits_that_are_too_close_for_the_uncertainty_prove_nothing() {
        let narrow = Limits::new(Some(0.1999), Some(0.2001)).unwrap();
        for decision in [DecisionRule::GuardedRisk, DecisionRule::GuardedCoverage] {
            let rule = Rule { decision, risk: 0.05 };
            assert_eq!(rule.decide(value(0.2, 10.0), narrow).0, Verdict::Undecided, "{decision}");
            assert_eq!(rule.decide(value(0.22, 10.0), narrow).0, Verdict::Fail, "{decision}");
            let unknown = Value { sigma_mm: None, ..value(0.2, 10.0) };
            let (verdict, why) = rule.decide(unknown, narrow);
            assert!(verdict == Verdict::Undecided && why.unwrap().contains("not known"), "{decision}");
        }
        let not_measured = Value { value_mm: f64::NAN, ..value(0.2, 10.0) };
        assert_eq!(not_measured.conformance_probability(narrow), None);
        let exact = Value { sigma_mm: Some(0.0), ..value(0.2, 10.0) };
        assert_eq!(exact.conformance_probability(narrow), Some(1.0));
        assert_eq!(Value { value_mm: 0.21, ..exact }.conformance_probability(narrow), Some(0.0));
    }

    /// 2,000 depths about the upper limit, measured with an error of the stated distribution. What is proven is wrong as
    /// often as the rule allows: at the limit itself, where the risk is largest, and over all depths.
    #[test]
    fn the_rule_is_wrong_as_often_as_it_promises() {
        const COUNT: usize = 2000;
        let mut random = ChaCha8Rng::seed_from_u64(44);
        for (degrees, risk) in [(6.0, 0.05), (50.0, 0.05), (12.0, 0.2)] {
            let errors = StudentT::new(degrees).unwrap();
            let rule = Rule { decision: DecisionRule::GuardedRisk, risk };
            let mut decide = |true_mm: f64| {
                let found = value(true_mm + SIGMA_MM * errors.sample(&mut random), degrees);
                (rule.decide(found, limits()).0, found.conformance_probability(limits()).unwrap())
            };
            // A true value at the limit passes with the probability of the risk, and fails with the same.
            let at_limit: Vec<Verdict> = (0..COUNT).map(|_| decide(0.21).0).collect();
            let bound = 4.0 * (risk * (1.0 - risk) / COUNT as f64).sqrt();
            for verdict in [Verdict::Pass, Verdict::Fail] {
                let share = at_limit.iter().filter(|found| **found == verdict).count() as f64 / COUNT as f64;
                assert!((share - risk).abs() < bound, "{verdict} at the limit: {share}, promised {risk}");
            }
            // True values spread evenly and widely about the limit: of those with a conformance probability, that share
            // conforms.
            let spread = Uniform::new(0.21 - 10.0 * SIGMA_MM, 0.21 + 10.0 * SIGMA_MM).unwrap();
            let (mut wrong, mut proven, mut promised, mut conform) = (0, 0, 0.0, 0);
            let mut truths = ChaCha8Rng::seed_from_u64(7);
            for _ in 0..COUNT {
                let true_mm = spread.sample(&mut truths);
                let (verdict, probability) = decide(true_mm);
                let holds = limits().hold(true_mm);
                promised += probability;
                conform += usize::from(holds);
                proven += usize::from(verdict != Verdict::Undecided);
                wrong +=
                    usize::from((verdict == Verdict::Pass && !holds) || (verdict == Verdict::Fail && holds));
            }
            // The variance of a count of independent trials is at most COUNT / 4.
            let bound = 4.0 * (COUNT as f64 / 4.0).sqrt();
            assert!((promised - conform as f64).abs() < bound, "{promised} promised, {conform} conform");
            assert!((wrong as f64) <= risk * proven as f64, "{wrong} of {proven} are wrong");
            assert!(proven > COUNT / 2, "{proven} were proven");
        }
    }
}
