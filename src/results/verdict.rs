//! The verdict about a surface in words, which terminal, page and report share.

use crate::number::{ascii, plain, share, with_interval};
use epirig_core::choice::Choice as _;
use epirig_surface::conformity::{Conformity, Judgement};

/// The verdict, and the values that decide it with their limits: in one sentence, in ASCII.
pub(super) fn verdict_sentence(conformity: &Conformity) -> String {
    let word = conformity.verdict.name().to_ascii_uppercase();
    let risk = conformity.risk.map_or(String::new(), |risk| format!(", risk {}", share(risk)));
    let found: Vec<String> = telling(conformity).into_iter().map(judged).collect();
    format!("{word} by {}{risk}; {}", conformity.rule, found.join("; "))
}

/// The judgements that decide: one of each characteristic, the worst if it has several.
fn telling(conformity: &Conformity) -> Vec<&Judgement> {
    let mut told: Vec<&Judgement> = Vec::new();
    for one in conformity.judgements.iter().filter(|one| one.verdict == conformity.verdict) {
        match told.iter_mut().find(|other| other.characteristic == one.characteristic) {
            Some(other) if conforms(one) < conforms(other) => *other = one,
            Some(_) => {}
            None => told.push(one),
        }
    }
    told
}

fn conforms(one: &Judgement) -> f64 {
    one.conformance_probability.unwrap_or(0.0)
}

/// What a judgement is about.
pub(crate) fn judged_name(one: &Judgement) -> String {
    match one.part {
        None => one.characteristic.to_string(),
        Some(part) => format!("{}, part {part}", one.characteristic),
    }
}

/// Its value with the interval.
pub(crate) fn judged_value(one: &Judgement) -> String {
    match (one.value, one.half_width_95_mm) {
        (None, _) => "not measured".to_owned(),
        (Some(value), None) => plain(value.value_mm, "mm"),
        (Some(value), half_width) => with_interval(value.value_mm, half_width, "mm"),
    }
}

fn judged(one: &Judgement) -> String {
    let (name, value) = (judged_name(one), judged_value(one));
    let probability = one
        .conformance_probability
        .map_or(String::new(), |found| format!(", conformance probability {}", share(found)));
    let why = one.undecided.as_ref().map_or(String::new(), |why| format!(" ({why})"));
    ascii(&format!("{name}: {value}, limits {}{probability}{why}", one.limits))
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_surface::conformity::{Characteristic, DecisionRule, Value, Verdict};

    fn judgement(part: Option<usize>, value_mm: f64, probability: f64, verdict: Verdict) -> Judgement {
        Judgement {
            characteristic: if part.is_some() { Characteristic::EachDepth } else { Characteristic::Depth },
            part,
            limits: "0.19..0.21 mm".parse().unwrap(),
            value: Some(Value { value_mm, sigma_mm: Some(0.0006), degrees_of_freedom: 1e6 }),
            half_width_95_mm: Some(0.0012),
            conformance_probability: Some(probability),
            verdict,
            undecided: None,
        }
    }

    fn conformity(verdict: Verdict, judgements: Vec<Judgement>) -> Conformity {
        Conformity { rule: DecisionRule::GuardedRisk, risk: Some(0.05), verdict, judgements }
    }

    #[test]
    fn a_verdict_has_the_value_its_limits_and_the_probability() {
        let found = conformity(Verdict::Pass, vec![judgement(None, 0.20034, 0.99998, Verdict::Pass)]);
        assert_eq!(
            verdict_sentence(&found),
            "PASS by guarded-risk, risk 5.0 %; depth: 0.2003 mm +- 0.0012 mm, limits 0.19 mm to 0.21 mm, conformance \
             probability above 99.9 %"
        );
    }

    #[test]
    fn of_parts_the_worst_is_named() {
        let parts = [
            (1, 0.2001, 0.9999, Verdict::Pass),
            (2, 0.2122, 0.001, Verdict::Fail),
            (3, 0.2109, 0.07, Verdict::Undecided),
        ];
        let parts =
            parts.map(|(part, mm, probability, verdict)| judgement(Some(part), mm, probability, verdict));
        let sentence = verdict_sentence(&conformity(Verdict::Fail, parts.to_vec()));
        assert!(sentence.starts_with("FAIL by guarded-risk"), "{sentence}");
        assert!(
            sentence.contains("each-depth, part 2: 0.2122 mm") && !sentence.contains("part 3"),
            "{sentence}"
        );
    }

    #[test]
    fn what_was_not_measured_says_why() {
        let undecided = Judgement {
            value: None,
            half_width_95_mm: None,
            conformance_probability: None,
            undecided: Some("there is no step height".to_owned()),
            ..judgement(None, 0.2, 0.5, Verdict::Undecided)
        };
        let found = Conformity {
            rule: DecisionRule::Simple,
            risk: None,
            ..conformity(Verdict::Undecided, vec![undecided])
        };
        assert_eq!(
            verdict_sentence(&found),
            "UNDECIDED by simple; depth: not measured, limits 0.19 mm to 0.21 mm (there is no step height)"
        );
    }
}
