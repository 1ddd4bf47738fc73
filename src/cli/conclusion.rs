//! The last sentence of a measurement: what was measured, and whether it is as planned.

use crate::profile::Profile;
use crate::results::{LevelsSummary, SurfaceSummary};
use epirig_data::sequence::Sequence;

/// The depth that the rig's profile plans (`target.relief`), in mm, if it is recorded with the sequence.
pub(super) fn planned_mm(sequence: &Sequence) -> Option<f64> {
    // Records of another version may be unreadable; then nothing is compared.
    Profile::of_sequence(sequence).ok().flatten().and_then(|rig| rig.target.relief_mm)
}

/// The sentence about `surface`, whose depth was planned to be `planned_mm`.
pub(super) fn conclusion(surface: &SurfaceSummary, planned_mm: Option<f64>) -> String {
    match &surface.levels {
        Some(levels) => depth(levels, planned_mm),
        None => {
            let reason = surface.no_levels.as_deref().unwrap_or("the reason is not known");
            let planned = planned_mm.map_or(String::new(), |mm| format!(" (planned: {mm} mm)"));
            format!("no hollows were found{planned}: {reason}")
        }
    }
}

fn depth(levels: &LevelsSummary, planned_mm: Option<f64>) -> String {
    let depth_mm = levels.depth.depth_mm;
    let (what, how) = if levels.raised { ("raised parts", "high") } else { ("hollows", "deep") };
    let Some(combined) = levels.budget.combined else {
        return format!(
            "{what} {depth_mm:.4} mm {how}; how well that is known cannot be said, as too few parts of the field are \
             independent"
        );
    };
    let half_width_mm = combined.half_width_95_mm;
    let measured = format!("{what} {depth_mm:.4} mm +- {half_width_mm:.4} mm {how} (95 % coverage)");
    match planned_mm.map(|planned_mm| (planned_mm, depth_mm - planned_mm)) {
        None => measured,
        Some((planned_mm, more_mm)) if more_mm.abs() <= half_width_mm => {
            format!("{measured}, as planned: {planned_mm} mm lies within the interval")
        }
        Some((planned_mm, more_mm)) => format!(
            "{measured}, not as planned: {:.4} mm {} than {planned_mm} mm",
            more_mm.abs(),
            if more_mm > 0.0 { "more" } else { "less" },
        ),
    }
}
