//! The answer of a measurement in one sentence, which terminal, page and report share.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::read::{parsed, record_bytes};
use super::verdict::verdict_sentence;
use super::{ResultsError, ResultsKind};
use crate::number::{ascii, percent, plain, sigma, with_interval};
use epirig_surface::conformity::{Characteristic, Conformity, Verdict};
use epirig_surface::{Combined, ScaleSigma};

/// What was measured, how well that is known, and whether it is as planned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Conclusion {
    /// All of it in words, in ASCII.
    pub sentence: String,
    /// The depth alone with its 95 % interval, in ASCII; `None` if that is not known.
    pub depth: Option<String>,
    /// The depth that the rig's profile plans (`target.relief`), in mm, if one is recorded.
    pub planned_mm: Option<f64>,
    /// Whether the 95 % interval of the depth holds it; `None` if nothing is planned or measured.
    pub as_planned: Option<bool>,
    /// The verdict about all limits; `None` without limits.
    #[cfg_attr(test, ts(as = "Option<crate::panel::page_type_tests::Names<Verdict>>"))]
    pub verdict: Option<Verdict>,
    /// The same in words, with the values that decide and their limits, in ASCII.
    pub verdict_sentence: Option<String>,
}

impl Conclusion {
    /// Of a step, or of the reason why there is none: whether parts are raised, the depth in mm, and its uncertainty if
    /// it is known. The `scale` is that of the heights.
    pub fn of(
        step: Result<(bool, f64, Option<Combined>), &str>,
        scale: ScaleSigma,
        planned_mm: Option<f64>,
    ) -> Self {
        let of = |sentence, depth, as_planned| Self {
            sentence,
            depth,
            planned_mm,
            as_planned,
            verdict: None,
            verdict_sentence: None,
        };
        let without_depth = |sentence| of(sentence, None, None);
        let (raised, depth_mm, combined) = match step {
            Ok(step) => step,
            Err(reason) => {
                let planned = planned_mm.map_or(String::new(), |mm| format!(" (planned: {mm} mm)"));
                return without_depth(format!("no step height{planned}: {reason}"));
            }
        };
        let (what, how) = if raised { ("raised parts", "high") } else { ("hollows", "deep") };
        let Some(Combined { half_width_95_mm, .. }) = combined else {
            return without_depth(format!(
                "{what} {} {how}; how well that is known cannot be said, as too few parts of the field are independent",
                ascii(&plain(depth_mm, "mm"))
            ));
        };
        let exact =
            scale.taken_as_exact().map_or(String::new(), |factors| format!(", {factors} taken as exact"));
        let value = ascii(&with_interval(depth_mm, Some(half_width_95_mm), "mm"));
        let mut sentence = format!("{what} {value} {how} (95 % coverage{exact})");
        let more_mm = planned_mm.map(|planned_mm| depth_mm - planned_mm);
        let as_planned = more_mm.map(|more_mm| more_mm.abs() <= half_width_95_mm);
        if let (Some(planned_mm), Some(more_mm)) = (planned_mm, more_mm) {
            sentence += &match as_planned {
                Some(true) => format!(", as planned: {planned_mm} mm lies within the interval"),
                _ => format!(
                    ", not as planned: {} {} than {planned_mm} mm",
                    sigma(more_mm.abs(), "mm"),
                    if more_mm > 0.0 { "more" } else { "less" },
                ),
            };
        }
        of(sentence, Some(value), as_planned)
    }

    /// The same with the verdict of a conformity.
    #[must_use]
    pub fn with_verdict(self, conformity: Option<&Conformity>) -> Self {
        let verdict = conformity.map(|conformity| conformity.verdict);
        Self { verdict, verdict_sentence: conformity.map(verdict_sentence), ..self }
    }
}

/// How well the scale of heights is known, in words.
pub fn scale_in_words(scale: ScaleSigma) -> String {
    let together = scale.together();
    let known = (together > 0.0).then(|| format!("known to {} (standard uncertainty)", percent(together)));
    let exact = scale.taken_as_exact().map(|factors| format!("{factors} taken as exact"));
    known.into_iter().chain(exact).collect::<Vec<_>>().join(", ")
}

/// What a list tells of a surface, from its record alone.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct SurfaceFacts {
    /// Uid of the sequence.
    pub sequence_uid: String,
    /// Hash of the `match.json` of the results whose surface it is.
    pub matched_blake3: String,
    /// The answer.
    pub conclusion: Conclusion,
    /// Bow of the form over the field, in mm.
    pub bow_mm: f64,
    levels: Option<LevelsFacts>,
    conformity: Option<ConformityFacts>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct ConformityFacts {
    judgements: Vec<JudgementFacts>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct JudgementFacts {
    characteristic: Characteristic,
    limits: LimitsFacts,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
struct LimitsFacts {
    lower_mm: Option<f64>,
    upper_mm: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct LevelsFacts {
    depth: DepthFacts,
    budget: BudgetFacts,
    wall_width_mm: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct DepthFacts {
    depth_mm: f64,
    sigma_mm: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct BudgetFacts {
    combined: Option<CombinedFacts>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct CombinedFacts {
    sigma_mm: f64,
    half_width_95_mm: f64,
}

impl SurfaceFacts {
    /// The depth, in mm; `None` without two levels.
    pub fn depth_mm(&self) -> Option<f64> {
        self.levels.as_ref().map(|levels| levels.depth.depth_mm)
    }

    /// Half the width of the depth's interval of 95 % coverage, in mm; `None` if that is not known.
    pub fn half_width_95_mm(&self) -> Option<f64> {
        Some(self.levels.as_ref()?.budget.combined.as_ref()?.half_width_95_mm)
    }

    /// Standard uncertainty of the depth, in mm; `None` if that is not known.
    pub fn depth_sigma_mm(&self) -> Option<f64> {
        Some(self.levels.as_ref()?.budget.combined.as_ref()?.sigma_mm)
    }

    /// Standard uncertainty of the depth by the scatter within the scan alone, in mm; `None` if that is not known.
    pub fn depth_scatter_mm(&self) -> Option<f64> {
        self.levels.as_ref()?.depth.sigma_mm
    }

    /// How wide the walls look, from 10 % to 90 % of the depth, in mm; `None` if that is not known.
    pub fn wall_width_mm(&self) -> Option<f64> {
        self.levels.as_ref()?.wall_width_mm
    }

    /// Lower and upper limit of the depth, in mm; `None` if it was not judged.
    pub fn depth_limits_mm(&self) -> Option<(Option<f64>, Option<f64>)> {
        let mut judgements = self.conformity.as_ref()?.judgements.iter();
        let of_depth = judgements.find(|one| one.characteristic == Characteristic::Depth)?;
        Some((of_depth.limits.lower_mm, of_depth.limits.upper_mm))
    }
}

/// The facts in `surface.json` of a folder.
///
/// # Errors
/// [`ResultsError`] if the record is missing, has another version or is invalid.
pub fn read_surface_facts(folder: &Path) -> Result<SurfaceFacts, ResultsError> {
    let kind = ResultsKind::Surface;
    parsed(folder, kind, record_bytes(folder, kind)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: ScaleSigma = ScaleSigma { focal_length: Some(0.001), baseline: Some(0.0001) };

    fn with(half_width_95_mm: f64) -> Option<Combined> {
        let sigma_mm = half_width_95_mm / 1.96;
        Some(Combined { sigma_mm, degrees_of_freedom: 1e6, coverage_factor: 1.96, half_width_95_mm })
    }

    #[test]
    fn a_depth_is_compared_with_its_interval() {
        let of = |half_width, planned_mm| Conclusion::of(Ok((false, 0.2003, half_width)), KNOWN, planned_mm);
        let found = of(with(0.0012), Some(0.2));
        assert_eq!(
            found.sentence,
            "hollows 0.2003 mm +- 0.0012 mm deep (95 % coverage), as planned: 0.2 mm lies within the interval"
        );
        assert_eq!((found.planned_mm, found.as_planned), (Some(0.2), Some(true)));
        assert_eq!(found.depth.as_deref(), Some("0.2003 mm +- 0.0012 mm"));
        let found = of(with(0.0012), Some(0.25));
        assert_eq!(
            found.sentence,
            "hollows 0.2003 mm +- 0.0012 mm deep (95 % coverage), not as planned: 0.050 mm less than 0.25 mm"
        );
        assert_eq!(found.as_planned, Some(false));
        assert!(of(with(0.0001), Some(0.2)).sentence.ends_with("0.00030 mm more than 0.2 mm"));
        let unknown = of(None, Some(0.2));
        assert!(
            unknown.sentence.contains("cannot be said")
                && unknown.as_planned.is_none()
                && unknown.depth.is_none()
        );
        let raised = Conclusion::of(Ok((true, 0.2, with(0.01))), KNOWN, None);
        assert_eq!(raised.sentence, "raised parts 0.200 mm +- 0.010 mm high (95 % coverage)");
        assert_eq!((raised.planned_mm, raised.as_planned), (None, None));
    }

    #[test]
    fn what_counts_as_exact_is_named() {
        let of = |focal_length, baseline| {
            let scale = ScaleSigma { focal_length, baseline };
            Conclusion::of(Ok((false, 0.2, with(0.001))), scale, None).sentence
        };
        let exact = |factors: &str| format!("hollows 0.2000 mm +- 0.0010 mm deep (95 % coverage{factors})");
        assert_eq!(of(Some(0.02), Some(1e-4)), exact(""));
        assert_eq!(of(Some(0.02), None), exact(", baseline taken as exact"));
        assert_eq!(of(None, Some(1e-4)), exact(", focal length taken as exact"));
        assert_eq!(of(Some(0.0), None), exact(", focal length and baseline taken as exact"));
        let words = |focal_length, baseline| scale_in_words(ScaleSigma { focal_length, baseline });
        // 0.03 and 0.04 make 0.05.
        assert_eq!(words(Some(0.03), Some(0.04)), "known to 5.0 % (standard uncertainty)");
        let partly = "known to 2.0 % (standard uncertainty), baseline taken as exact";
        assert_eq!(words(Some(0.02), None), partly);
        assert_eq!(words(None, None), "focal length and baseline taken as exact");
    }
}
