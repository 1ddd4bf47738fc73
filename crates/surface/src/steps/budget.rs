//! The uncertainty budget of a depth, as in the GUM (JCGM 100:2008).

use serde::Serialize;

use super::super::height::ScaleSigma;
use super::super::student::student_t_95;
use super::depth::Depth;

/// How a contribution was evaluated (GUM, 2.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Evaluation {
    /// From the scatter of this measurement.
    A,
    /// From elsewhere: from other choices in the evaluation, or from the calibration.
    B,
}

/// A contribution to the uncertainty of a depth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Contribution {
    /// What contributes.
    pub name: &'static str,
    /// How it was evaluated.
    pub evaluation: Evaluation,
    /// Standard uncertainty of the depth by it, in mm; `None` if it is not known, and taken as 0.
    pub sigma_mm: Option<f64>,
    /// Its share of the combined variance, 0 to 1; `None` if one of them is not known.
    pub share: Option<f64>,
}

/// All known contributions together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Combined {
    /// Combined standard uncertainty, in mm.
    pub sigma_mm: f64,
    /// Effective degrees of freedom, by Welch and Satterthwaite (GUM, G.4).
    pub degrees_of_freedom: f64,
    /// Coverage factor for 95 % (Student's t).
    pub coverage_factor: f64,
    /// Half the width of the interval that holds the depth with 95 % coverage, in mm.
    pub half_width_95_mm: f64,
}

/// The uncertainty budget of a depth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Budget {
    /// The contributions.
    pub contributions: Vec<Contribution>,
    /// Their sum; `None` if the scatter, with its degrees of freedom, is not known.
    pub combined: Option<Combined>,
}

/// Depths that the same heights give by other choices; `None` where there is no other choice, or it leaves too
/// few pixels.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Choices {
    /// With more pixels left out beside the walls.
    pub(super) farther_from_walls: Option<(f64, Option<f64>)>,
    /// With one pixel less left out. Where there is no room for more, this tells how much walls matter: their effect
    /// fades with each pixel, so what the last one changed is more than what is left.
    pub(super) nearer_to_walls: Option<(f64, Option<f64>)>,
    /// With a form of one more degree.
    pub(super) richer_form: Option<(f64, Option<f64>)>,
    /// On the plateaus of ISO 5436-1.
    pub(super) on_plateaus: Option<(f64, Option<f64>)>,
    /// By each half of the frames alone.
    pub(super) by_halves: Option<[(f64, Option<f64>); 2]>,
    /// Error of the depth by pixel locking, as predicted, in mm; `None` if it is not known.
    pub(super) locking_mm: Option<f64>,
}

impl Budget {
    /// Of `depth`. If it is known by halves, the levels of each were found by the heights of the other.
    pub(super) fn of(depth: &Depth, choices: Choices, scale: ScaleSigma) -> Self {
        let own = (depth.depth_mm, depth.sigma_mm);
        let by_choice = |other: Option<(f64, Option<f64>)>| other.and_then(|other| by_choice(own, other));
        let walls = match choices.farther_from_walls {
            None => choices.nearer_to_walls.and_then(|nearer| self::by_choice(nearer, own)),
            farther => by_choice(farther),
        };
        let of_scale = |relative: Option<f64>| relative.map(|relative| relative * depth.depth_mm.abs());
        let known = [
            ("scatter between independent parts of the field", Evaluation::A, depth.sigma_mm),
            ("selection of the levels by noise", Evaluation::B, choices.by_halves.map(|_| 0.0)),
            ("frames: even and odd ones apart", Evaluation::B, choices.by_halves.and_then(by_frames)),
            ("pixel locking, as predicted", Evaluation::B, choices.locking_mm.map(f64::abs)),
            ("walls: other margins", Evaluation::B, walls),
            ("plateaus: those of ISO 5436-1", Evaluation::B, by_choice(choices.on_plateaus)),
            ("trend: another form", Evaluation::B, by_choice(choices.richer_form)),
            ("scale: focal length", Evaluation::B, of_scale(scale.focal_length)),
            ("scale: length of the baseline", Evaluation::B, of_scale(scale.baseline)),
        ];
        let variance: f64 = known.iter().filter_map(|(_, _, sigma_mm)| *sigma_mm).map(|mm| mm * mm).sum();
        let combined = depth.sigma_mm.zip(depth.degrees_of_freedom).and_then(|(scatter_mm, degrees)| {
            // Only the scatter has finite degrees of freedom.
            let degrees_of_freedom = degrees * variance.powi(2) / scatter_mm.powi(4);
            let (sigma_mm, coverage_factor) = (variance.sqrt(), student_t_95(degrees_of_freedom));
            let half_width_95_mm = coverage_factor * sigma_mm;
            let combined = Combined { sigma_mm, degrees_of_freedom, coverage_factor, half_width_95_mm };
            degrees_of_freedom.is_finite().then_some(combined)
        });
        let whole = combined.map(|combined| combined.sigma_mm.powi(2));
        let contributions = known.map(|(name, evaluation, sigma_mm)| {
            let share = sigma_mm.zip(whole).map(|(mm, whole)| mm * mm / whole);
            Contribution { name, evaluation, sigma_mm, share }
        });
        Self { contributions: contributions.into(), combined }
    }
}

/// Standard uncertainty by a choice between depths with their sigmas: what they differ by beyond the noise, as half the
/// width of a rectangular distribution (GUM, 4.3.7). The `other` takes fewer pixels or has more unknowns. So noise makes
/// the two differ with the variance that it knows the depth less by (Hausman, 1978). `None` if one of the sigmas is
/// not known.
fn by_choice(
    (one_mm, one_sigma_mm): (f64, Option<f64>),
    (other_mm, other_sigma_mm): (f64, Option<f64>),
) -> Option<f64> {
    let (one, other) = (one_sigma_mm?, other_sigma_mm?);
    let noise = (other * other - one * one).max(0.0);
    Some((((other_mm - one_mm).powi(2) - noise).max(0.0) / 3.0).sqrt())
}

/// Standard uncertainty by the choice of frames: what the depths by halves of them differ by beyond their noise, as the
/// width of a rectangular distribution. Errors of positions and of interpolation differ between the halves, and are
/// alike in all parts of the field, whose scatter does not show them. `None` if one of the sigmas is not known.
fn by_frames([(one_mm, one_sigma_mm), (other_mm, other_sigma_mm)]: [(f64, Option<f64>); 2]) -> Option<f64> {
    let noise = one_sigma_mm?.powi(2) + other_sigma_mm?.powi(2);
    Some((((other_mm - one_mm).powi(2) - noise).max(0.0) / 12.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn depth(sigma_mm: Option<f64>) -> Depth {
        Depth {
            depth_mm: -2.0,
            sigma_mm,
            degrees_of_freedom: sigma_mm.map(|_| 10.0),
            half_width_95_mm: sigma_mm.map(|sigma| 2.228 * sigma),
            scale_sigma_mm: 0.005,
        }
    }

    const SCALE: ScaleSigma = ScaleSigma { focal_length: Some(0.0009), baseline: Some(0.002) };

    #[test]
    fn contributions_add_in_squares_and_share_their_degrees_of_freedom() {
        let by_halves = Some([(-2.0, Some(0.02)), (-2.01, Some(0.02))]);
        let budget = Budget::of(
            &depth(Some(0.012)),
            Choices { by_halves, locking_mm: Some(-0.0024), ..Choices::default() },
            SCALE,
        );
        let sigmas: Vec<_> = budget.contributions.iter().map(|part| part.sigma_mm).collect();
        let known = [0.012, 0.0, 0.0, 0.0024].map(Some);
        assert_eq!(sigmas, [&known[..], &[None, None, None], &[Some(0.0018), Some(0.004)]].concat());
        // 0.012, 0.0024, 0.0018 and 0.004 make 0.013; 10 (0.013 / 0.012)^4 = 13.77 degrees of freedom, whose t by
        // tables lies between 2.160 (13) and 2.145 (14).
        let combined = budget.combined.unwrap();
        assert!((combined.sigma_mm - 0.013).abs() < 1e-12);
        assert!((combined.degrees_of_freedom - 13.773).abs() < 1e-3);
        assert!((2.145..2.160).contains(&combined.coverage_factor), "{}", combined.coverage_factor);
        assert!((combined.half_width_95_mm - 0.013 * combined.coverage_factor).abs() < 1e-15);
        let shares: f64 = budget.contributions.iter().filter_map(|part| part.share).sum();
        assert!((shares - 1.0).abs() < 1e-12);
    }

    #[test]
    fn another_choice_counts_as_far_as_it_differs_beyond_the_noise() {
        let sigma_of = |other| by_choice((-2.0, Some(0.003)), other).unwrap();
        // 0.005^2 - 0.003^2 = 0.004^2 is the variance of the difference by noise.
        assert_eq!(sigma_of((-2.003, Some(0.005))), 0.0);
        assert!((sigma_of((-2.005, Some(0.005))) - 0.003 / 3.0_f64.sqrt()).abs() < 1e-9);
        // A sigma that is not larger explains nothing.
        assert!((sigma_of((-2.003, Some(0.002))) - 0.003 / 3.0_f64.sqrt()).abs() < 1e-9);
        assert_eq!(by_choice((-2.0, Some(0.003)), (-2.1, None)), None);
        let choices = Choices { farther_from_walls: Some((-2.012, Some(0.003))), ..Choices::default() };
        let budget = Budget::of(&depth(Some(0.003)), choices, ScaleSigma::default());
        // 0.003^2 + 0.012^2 / 3.
        assert!((budget.combined.unwrap().sigma_mm - 57e-6_f64.sqrt()).abs() < 1e-12);
        assert_eq!(budget.contributions[1].sigma_mm, None, "heights that were divided by themselves");
    }

    #[test]
    fn halves_that_differ_beyond_their_noise_count() {
        let of = |difference_mm: f64| by_frames([(-2.0, Some(0.003)), (-2.0 + difference_mm, Some(0.004))]);
        assert_eq!(of(0.005), Some(0.0));
        // 0.013^2 - 0.005^2 = 0.012^2, and a rectangle's variance is a twelfth of its width squared.
        assert!((of(-0.013).unwrap() - 0.012 / 12.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(by_frames([(-2.0, None), (-2.1, Some(0.004))]), None);
    }

    #[test]
    fn without_a_scale_the_scatter_is_all_and_without_scatter_there_is_no_sum() {
        let of = |sigma_mm, scale| Budget::of(&depth(sigma_mm), Choices::default(), scale).combined;
        let alone = of(Some(0.012), ScaleSigma::default()).unwrap();
        assert!((alone.sigma_mm - 0.012).abs() < 1e-15 && (alone.degrees_of_freedom - 10.0).abs() < 1e-9);
        // Tables: 2.228 for 10.
        assert!((alone.coverage_factor - 2.228).abs() < 1e-3);
        assert_eq!(of(None, SCALE), None);
        // Heights without any scatter leave no degrees of freedom to count.
        assert_eq!(of(Some(0.0), SCALE), None);
    }
}
